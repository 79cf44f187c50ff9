"""The manoeuvre file (TOML, ``gainsmith.manoeuvre/1``): who drives what, where, and how. Every quantity has its unit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from estimators.arrays import FloatArray
from estimators.errors import unknown
from studies.drives import quantities
from studies.drives.quantities import Duration
from studies.truth.course import Course
from studies.truth.drivetrain import Assist
from studies.truth.fleet import TIRES
from studies.truth.profile import GRID, Angles, PathPiece, Piece, Shares, Speeds, Torques, curvature, sampled
from studies.truth.record import Truth
from studies.truth.road import Road
from studies.truth.simulate import EVERYTHING, RECORD_TIME, STEP, simulate, simulate_in_processes
from studies.truth.vehicle import TruthVehicle, load_vehicle
from synthesis.errors import SpecError
from synthesis.toml_file import StrictTable, find_toml, load_toml, shipped_files


class Car(StrictTable):
    """Which vehicle, by the name of its parameter set or as a TOML file beside the manoeuvre, and what is fitted to it."""

    parameters: str = Field(min_length=1)
    drivetrain: Literal["AWD", "RWD", "FWD"] = "AWD"
    tire: Literal["lugre", "magic-formula"] = "lugre"
    steering_ratio: float | None = Field(default=None, gt=0.0)
    traction_control: Literal["off", "poor"] = "off"
    anti_lock: Literal["off", "poor"] = "off"
    maximum_torque: quantities.Torque | None = None  # of all driven wheels; what full throttle gives at low speed
    maximum_power: quantities.Power | None = None
    maximum_brake_torque: quantities.Torque | None = None  # of all wheels


class Manoeuvre(StrictTable):
    """A manoeuvre that was read and checked.

    Steering: ``steer`` (at the road wheels) or ``hand_wheel`` (needs ``vehicle.steering_ratio``), or a ``path`` that the
    driver follows. Pedals: ``torque`` (sum at the driven wheels) and ``throttle`` (share of what there is, negative for
    reverse), ``brake_torque`` (sum) and ``brake`` (share of the greatest); or ``target_speed``, which the driver holds,
    with the pedals added, and which he lets go of after ``free_after``.

    >>> load_manoeuvre("p2-step-steer-dry").paper
    'P2'
    """

    schema_: Literal["gainsmith.manoeuvre/1"] = Field(alias="schema")
    name: str = Field(pattern=r"^[a-z0-9][a-z0-9-]*$")
    title: str = Field(min_length=1)
    paper: Literal["P1", "P2", "P3", "P4", "P5", ""] = ""
    where: str = ""
    given: list[str] = Field(default_factory=list)  # what the source says
    chosen: list[str] = Field(default_factory=list)  # what it does not say, and what is taken instead
    duration: Duration
    speed: quantities.Velocity = 0.0
    vehicle: Car
    road: Road = Road()
    steer: Angles = Field(default_factory=list)
    hand_wheel: Angles = Field(default_factory=list)
    torque: Torques = Field(default_factory=list)
    throttle: Shares = Field(default_factory=list)
    brake_torque: Torques = Field(default_factory=list)
    brake: Shares = Field(default_factory=list)
    target_speed: Speeds = Field(default_factory=list)
    free_after: Duration | None = None
    path: list[PathPiece] = Field(default_factory=list)

    @model_validator(mode="after")
    def _parts_agree(self) -> Self:
        steering = [name for name in ("steer", "hand_wheel", "path") if getattr(self, name)]
        if len(steering) > 1:
            raise ValueError(f"{' and '.join(steering)} both steer; keep one of steer, hand_wheel, path")
        if self.hand_wheel and self.vehicle.steering_ratio is None:
            raise ValueError("vehicle.steering_ratio: missing, but hand_wheel is given; add it, such as 16.7")
        if self.free_after is not None and not self.target_speed:
            raise ValueError("free_after: there is no target_speed to let go of; remove it or add target_speed")
        return self

    def with_tire(self, tire: str) -> Manoeuvre:
        """The same manoeuvre on other tires. Raises SpecError for a tire that does not exist."""
        if tire not in TIRES:
            raise SpecError(unknown("tire", tire, TIRES))
        return self.model_copy(update={"vehicle": self.vehicle.model_copy(update={"tire": tire})})

    def truth_vehicle(self, folder: Path = Path()) -> TruthVehicle:
        """The car; a file of its own lies in ``folder``. Raises SpecError when there is no such parameter set."""
        own = self.vehicle
        car = load_vehicle(own.parameters, folder)
        limits = ("maximum_torque", "maximum_power", "maximum_brake_torque")
        given: dict[str, Any] = {name: value for name in limits if (value := getattr(own, name)) is not None}
        for name in ("traction_control", "anti_lock"):
            given[name] = Assist() if getattr(own, name) == "poor" else None
        return car.changed(drivetrain=replace(car.drivetrain, layout=own.drivetrain, **given))

    def course(self) -> Course:
        """As arrays."""

        def table(pieces: Sequence[Piece], unit: str, start: float = 0.0) -> FloatArray:
            return sampled(pieces, unit, self.duration, start)

        steer = table(self.steer, "rad")
        if self.hand_wheel and self.vehicle.steering_ratio:
            steer = table(self.hand_wheel, "rad") / self.vehicle.steering_ratio
        target = None
        if self.target_speed:
            target = table(self.target_speed, "m/s", self.speed)
            if self.free_after is not None:
                target[int(np.ceil(self.free_after / GRID)) :] = np.nan
        return Course(
            name=self.name, duration=self.duration, initial_speed=self.speed, tire=self.vehicle.tire, steer=steer,
            drive_torque=table(self.torque, "N*m"), drive_share=table(self.throttle, "share"),
            brake_torque=table(self.brake_torque, "N*m"), brake_share=table(self.brake, "share"),
            grade=table(self.road.grade, "rad"), bank=table(self.road.bank, "rad"), friction=self.road.coefficient,
            zones=self.road.zones(), speed=target, curvature=curvature(self.path) if self.path else None,
        )  # fmt: skip


def shipped_manoeuvres(paper: str = "") -> dict[str, Path]:
    """The manoeuvre files that come with the package, by name; those of one paper (``"P1"``) if asked.

    >>> sorted(shipped_manoeuvres("P5"))
    ['p5-roundabout', 'p5-slalom']
    """
    found = shipped_files("studies", "manoeuvres")
    return {name: path for name, path in found.items() if name.startswith(paper.lower())}


def load_manoeuvre(name: str | Path) -> Manoeuvre:
    """A shipped manoeuvre by name, or one of your own by its path (ends with .toml).

    Raises SpecError, one line: file, key, what is wrong, what would be right.

    >>> load_manoeuvre("p1-launch-split").title
    'Launch on split friction: right wheels on ice, left wheels on dry'
    """
    return load_toml(find_toml(name, shipped_manoeuvres(), "manoeuvre"), Manoeuvre, "manoeuvre")


def simulate_manoeuvres(
    manoeuvres: Sequence[Manoeuvre],
    vehicles: Sequence[TruthVehicle] | None = None,
    *,
    step: float = STEP,
    record_time: float = RECORD_TIME,
    record: Sequence[str] = EVERYTHING,
    progress: Callable[[float], None] | None = None,
    workers: int = 1,
) -> Truth:
    """Simulate every manoeuvre of the batch, with its own vehicle or `vehicles[b]`, in ``workers`` processes; see `simulate`.

    ``progress`` is called by the only process; with several it is not called.

    >>> truth = simulate_manoeuvres([load_manoeuvre("p2-step-steer-dry").model_copy(update={"duration": 0.5})])
    >>> truth.signals["vx"].shape, truth.signals["wheel_speed"].shape  # runs, samples (of 5 ms), wheels
    ((1, 101), (1, 101, 4))
    """
    courses = {id(m): m.course() for m in manoeuvres}
    if vehicles is None:
        own = {id(m): m.truth_vehicle() for m in manoeuvres}
        vehicles = [own[id(m)] for m in manoeuvres]
    batch = [courses[id(m)] for m in manoeuvres]
    options: dict[str, Any] = {"step": step, "record_time": record_time, "record": record}
    if workers > 1:
        return simulate_in_processes(batch, vehicles, workers, **options)
    return simulate(batch, vehicles, progress=progress, **options)
