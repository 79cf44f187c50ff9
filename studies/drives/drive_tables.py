"""The tables of a drive file: a log column, a log file and its clock, the vehicle, the observers."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from estimators.vehicle import VehicleParameters
from studies.drives.quantities import (
    AngularSpeed,
    Duration,
    Inertia,
    Lag,
    Length,
    Mass,
    Offset,
    Rate,
    Stiffness,
    factor_to,
)
from synthesis.errors import unknown


def _a_time(unit: str) -> str:
    factor_to(unit, "s")
    return unit


class Table(BaseModel):
    """Strict and frozen: no unknown key, no number in quotes, no infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Column(Table):
    """One log column: value in SI = factor * sign * (column in ``unit``)."""

    column: str = Field(min_length=1, examples=["omega_fl"])
    unit: str = Field(min_length=1, examples=["rad/s"])
    log: str | None = None
    sign: Literal["positive", "negative"] = "positive"
    factor: float = Field(default=1.0, examples=[0.5])

    def scale(self, si_unit: str) -> float:
        """The number that turns the column into ``si_unit`` with the sign of this project (x forward, y left, z up)."""
        return factor_to(self.unit, si_unit) * self.factor * (-1.0 if self.sign == "negative" else 1.0)


class Align(Table):
    """Estimate a clock offset: the derivative of ``velocity`` must look like ``acceleration`` (:mod:`.align`)."""

    to: str = Field(examples=["imu"])
    velocity: str = "vx"
    acceleration: str = "ax"
    search: Duration | None = None


class LogFile(Table):
    """One log file: its clock, its rate, and the longest pause that may be bridged by interpolation."""

    name: str = Field(min_length=1, examples=["car"])
    rate: Rate = Field(examples=["200 Hz"])
    file: str | None = None
    time: str = "time"
    time_unit: Annotated[str, AfterValidator(_a_time)] = "s"
    delimiter: str = Field(default=",", min_length=1, max_length=1)
    max_gap: Duration | None = None
    duplicates: Literal["mean", "last", "refuse"] = "mean"
    sort: bool = False
    clock_offset: Offset = 0.0
    align: Align | None = None

    @property
    def allowed_gap(self) -> float:
        """The longest spacing of samples that is interpolated over, s (five nominal periods if the file names none)."""
        return self.max_gap if self.max_gap is not None else 5.0 / self.rate


WHEEL_INERTIA = 1.0
"""kg m^2 where the drive has none: without torques it has nothing to act on."""


class Vehicle(Table):
    """Rigid-body and wheel data, SI. Lengths are to the centre of gravity; tracks are wheel centre to wheel centre."""

    mass: Mass = Field(examples=["1600 kg"])
    front_axle_distance: Length = Field(examples=["1.4 m"])
    rear_axle_distance: Length = Field(examples=["1.5 m"])
    cg_height: Length = Field(examples=["0.55 m"])
    front_track: Length = Field(examples=["1.6 m"])
    rear_track: Length = Field(examples=["1.6 m"])
    effective_radius_front: Length = Field(examples=["0.34 m"])
    effective_radius_rear: Length = Field(examples=["0.34 m"])
    wheel_inertia: Inertia | None = None
    rolling_resistance: float = Field(default=0.0, ge=0.0, le=0.2, examples=[0.012])
    steering_ratio: float | None = Field(default=None, gt=0.0, examples=[15.0])
    yaw_inertia: Inertia | None = None
    cornering_stiffness_front: Stiffness | None = None  # of the axle, both wheels
    cornering_stiffness_rear: Stiffness | None = None
    relaxation_length: Length | None = None

    @cached_property
    def parameters(self) -> VehicleParameters:
        """The car as the estimators know it; yaw inertia m L_f L_r and wheel inertia 1 kg m^2 where not given."""
        return VehicleParameters(
            mass=self.mass,
            yaw_inertia=self.yaw_inertia or self.mass * self.front_axle_distance * self.rear_axle_distance,
            wheel_inertia=self.wheel_inertia or WHEEL_INERTIA,
            front_axle_distance=self.front_axle_distance,
            rear_axle_distance=self.rear_axle_distance,
            cg_height=self.cg_height,
            front_track=self.front_track,
            rear_track=self.rear_track,
            effective_radius=(self.effective_radius_front, self.effective_radius_rear),
            rolling_resistance=self.rolling_resistance,
        )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        _ = self.parameters
        return self


class Observer(Table):
    """How the observer inputs are formed: lag of the differentiators, and when a wheel counts as stopped."""

    derivative_lag: Lag = 0.01
    stopped_below: AngularSpeed = 1.0


def _one_of(*names: str) -> Callable[[str], str]:
    def check(name: str) -> str:
        if name not in names:
            raise ValueError(unknown("estimator", name, names))
        return name

    return check


class Estimators(Table):
    """Which estimators make up the pipeline, and which run at the corners beside it; the first of each is the default.

    ``corner_velocity`` is what the result calls corner observers; the same kind cross-checks the pipeline where a lateral
    schedule is given. With ``velocity = "corners"`` they are its only source of velocities, as in the papers; with
    ``"kinematic"`` they correct the kinematic model with bias states, P2 (15). ``axle_weights``: P1 weighs by slip.
    """

    longitudinal_force: Annotated[str, AfterValidator(_one_of("unknown-input", "pid", "unscented", "linear"))] = (
        "unknown-input"
    )
    vertical_load: Annotated[str, AfterValidator(_one_of("dynamic", "quasi-static"))] = "dynamic"
    lateral_force: Annotated[str, AfterValidator(_one_of("linear", "unscented"))] = "linear"
    attitude: Annotated[str, AfterValidator(_one_of("none", "gyro"))] = "none"
    velocity: Annotated[str, AfterValidator(_one_of("fusion", "corners", "kinematic"))] = "fusion"
    corner_velocity: Annotated[
        str, AfterValidator(_one_of("lpv", "gain-switched", "kalman-three-state", "kalman-two-state"))
    ] = "lpv"
    axle_weights: Annotated[str, AfterValidator(_one_of("equal", "slip"))] = "equal"
    sideslip: Annotated[
        str,
        AfterValidator(
            _one_of(
                "none",
                "four-wheel-extended",
                "four-wheel-unscented",
                "adaptive-stiffness",
                "fixed-stiffness",
                "sliding-mode",
            )
        ),
    ] = "none"


class Schedules(Table):
    """The gain schedule of each direction: a shipped name, or the path of a JSON file beside the drive file."""

    longitudinal: str = Field(min_length=1, examples=["corner-estimation-longitudinal"])
    lateral: str | None = None
