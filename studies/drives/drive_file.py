"""The drive file: which columns of which logs are what, and the vehicle they were recorded on.

A drive file (TOML, ``gainsmith.drive/1``) maps log columns with units and signs to the signals of :mod:`.quantities`, several
log files with their own clocks to one clock, and names the schedules. Every quantity carries its unit; nothing is guessed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from estimators.errors import unknown
from estimators.vehicle import VehicleParameters
from studies.drives import quantities as si
from studies.drives.columns import Column, LogFile, check_alignment, check_logs
from studies.drives.compliance import Suspension
from studies.drives.direction import Gear, check_direction
from studies.drives.mounted import Mountings, check_mountings
from studies.drives.quantities import CORNERS, REFERENCES, SIGNALS
from synthesis.toml_file import StrictTable, load_toml

WHEEL_INERTIA = 1.0  # kg m^2 where the drive has none: without torques it has nothing to act on


class Vehicle(StrictTable):
    """Rigid-body and wheel data, SI. Lengths are to the centre of gravity; tracks are wheel centre to wheel centre."""

    mass: si.Mass = Field(examples=["1600 kg"])
    front_axle_distance: si.Length = Field(examples=["1.4 m"])
    rear_axle_distance: si.Length = Field(examples=["1.5 m"])
    cg_height: si.Length = Field(examples=["0.55 m"])
    roll_center_height: si.Place = 0.0  # of the roll axis below the centre of gravity
    front_track: si.Length = Field(examples=["1.6 m"])
    rear_track: si.Length = Field(examples=["1.6 m"])
    effective_radius_front: si.Length = Field(examples=["0.34 m"])
    effective_radius_rear: si.Length = Field(examples=["0.34 m"])
    wheel_inertia: si.Inertia | None = None
    rolling_resistance: float = Field(default=0.0, ge=0.0, le=0.2, examples=[0.012])
    bearing_friction: si.Damping = 0.0  # C_b of P2 (1), drag torque of a wheel over its speed
    steering_ratio: float | None = Field(default=None, gt=0.0, examples=[15.0])
    yaw_inertia: si.Inertia | None = None
    cornering_stiffness_front: si.Stiffness | None = None  # of the axle, both wheels
    cornering_stiffness_rear: si.Stiffness | None = None
    relaxation_length: si.Length | None = None
    suspension: Suspension = Suspension()
    friction: float = Field(default=1.0, gt=0.0, le=10.0, examples=[0.9])  # of tire and road, P4 (5)

    @cached_property
    def parameters(self) -> VehicleParameters:
        """The car as the estimators know it; yaw inertia m L_f L_r and wheel inertia 1 kg m^2 where not given."""
        return VehicleParameters(
            mass=self.mass,
            yaw_inertia=self.yaw_inertia or self.mass * self.front_axle_distance * self.rear_axle_distance,
            wheel_inertia=self.wheel_inertia or WHEEL_INERTIA, front_axle_distance=self.front_axle_distance,
            rear_axle_distance=self.rear_axle_distance, cg_height=self.cg_height, front_track=self.front_track,
            rear_track=self.rear_track, effective_radius=(self.effective_radius_front, self.effective_radius_rear),
            roll_center_height=self.roll_center_height, rolling_resistance=self.rolling_resistance,
            bearing_friction=self.bearing_friction,
        )  # fmt: skip

    @model_validator(mode="after")
    def _possible(self) -> Self:
        _ = self.parameters
        return self

    def radius_for(self, signal: str) -> float | None:
        """Effective radius, m, of the wheel whose speed a signal is; None for other signals."""
        if not signal.startswith("wheel_speed_"):
            return None
        return self.effective_radius_front if signal.endswith(("_fl", "_fr")) else self.effective_radius_rear


class Observer(StrictTable):
    """How the observer inputs are formed: lag of the differentiators, and when a wheel counts as stopped."""

    derivative_lag: si.Lag = 0.01
    stopped_below: si.AngularSpeed = 1.0


CHOICES = {
    "longitudinal_force": ("unknown-input", "pid", "unscented", "linear"),
    "vertical_load": ("dynamic", "quasi-static"),
    "lateral_force": ("linear", "unscented"),
    "attitude": ("none", "gyro"),
    "velocity": ("fusion", "corners", "kinematic"),
    "corner_velocity": ("lpv", "gain-switched", "kalman-three-state", "kalman-two-state"),
    "axle_weights": ("equal", "slip"),
    "process_covariance": ("input", "identity"),
    "suspension": ("rigid", "compliant"),
    "sideslip": ("none", "four-wheel-extended", "four-wheel-unscented", "adaptive-stiffness", "fixed-stiffness", "sliding-mode"),
    "sideslip_speed": ("estimated", "rear-wheels"),
    "stiffness_noise": ("per-sample", "per-time"),
}  # fmt: skip
"""Names of the estimators."""


class Estimators(StrictTable):
    """Which estimators make up the pipeline, and which run at the corners beside it.

    ``corner_velocity`` is what the result calls corner observers; the same kind cross-checks the pipeline where a lateral
    schedule is given. With ``velocity = "corners"`` they are its only source of velocities, as in the papers; with
    ``"kinematic"`` they correct the kinematic model with bias states, P2 (15). ``axle_weights``: P1 weighs by slip.
    ``process_covariance`` of the Kalman corner observers: Q = q B B' or q I of P2 (22). ``suspension``: slips of the wheel
    centres on compliant suspensions, P3 (14)-(15). ``sideslip_speed``: V_g of the sideslip observers is the pipeline's V_x, or
    the mean of the rear wheels, P4 (9). ``stiffness_noise``: the variances of P5 hold for every sample, or for every 10 ms.
    """

    longitudinal_force: str = "unknown-input"
    vertical_load: str = "dynamic"
    lateral_force: str = "linear"
    attitude: str = "none"
    velocity: str = "fusion"
    corner_velocity: str = "lpv"
    axle_weights: str = "equal"
    process_covariance: str = "input"
    suspension: str = "rigid"
    sideslip: str = "none"
    sideslip_speed: str = "estimated"
    stiffness_noise: str = "per-sample"

    @field_validator("*")
    @classmethod
    def _is_known(cls, name: str, field: ValidationInfo) -> str:
        known = CHOICES[field.field_name or ""]
        if name not in known:
            raise ValueError(unknown("estimator", name, known))
        return name


class Schedules(StrictTable):
    """The gain schedule of each direction: a shipped name, or the path of a JSON file beside the drive file."""

    longitudinal: str = Field(min_length=1, examples=["corner-estimation-longitudinal"])
    lateral: str | None = None


WHEEL_SPEEDS = tuple(f"wheel_speed_{corner}" for corner in CORNERS)
TORQUES = tuple(f"torque_{corner}" for corner in CORNERS)


def check_columns(
    signals: Mapping[str, Column], reference: Mapping[str, Column], logs: Sequence[LogFile], vehicle: Vehicle
) -> None:
    """Every signal is a known one, has a unit that measures it, and says which log holds it."""
    names = [log.name for log in logs]
    given = [("signals", SIGNALS, *each) for each in signals.items()]
    given += [("reference", REFERENCES, *each) for each in reference.items()]
    for table, known, name, column in given:
        place = f"{table}.{name}"
        if name not in known:
            raise ValueError(f"{place}: {unknown('signal', name, known)}")
        if column.factor == 0:
            raise ValueError(f"{place}.factor: 0 is not a scale; use a finite number other than zero")
        try:
            column.scale(known[name], vehicle.radius_for(name))
        except ValueError as error:
            raise ValueError(f"{place}.unit: {error}") from error
        if column.radius is not None and vehicle.radius_for(name) is None:
            raise ValueError(f"{place}.radius: belongs to wheel speeds; leave it out")
        if column.log is None and len(names) > 1:
            raise ValueError(f"{place}.log: missing; say which log holds column '{column.column}': {', '.join(names)}")
        if column.log is not None and column.log not in names:
            raise ValueError(f"{place}.log: {unknown('log', column.log, names)}")


def check_signals(signals: Mapping[str, Column], vehicle: Vehicle) -> None:
    """What the observers cannot do without is there, and the vehicle has what the signals need."""
    for name in (*WHEEL_SPEEDS, "ax"):
        if name not in signals:
            raise ValueError(f"signals.{name}: missing; {_add_signal(name)}")
    if any(name in signals for name in TORQUES) and vehicle.wheel_inertia is None:
        raise ValueError('vehicle.wheel_inertia: missing, but wheel torques are given; add it, such as "1.6 kg*m^2"')
    if "hand_wheel" in signals and vehicle.steering_ratio is None:
        raise ValueError("vehicle.steering_ratio: missing, but hand_wheel is given; add it, such as 15.0")
    steering = [name for name in ("steering", "hand_wheel", "steer_fl", "steer_fr") if name in signals]
    if len(steering) > 1 and steering != ["steer_fl", "steer_fr"]:
        keep = "keep steering, hand_wheel, or steer_fl and steer_fr"
        raise ValueError(f"signals: {' and '.join(steering)} say the same thing; {keep}")
    for pair in (("steer_fl", "steer_fr"), ("steer_rl", "steer_rr")):
        given = [name for name in pair if name in signals]
        if len(given) == 1:
            (missing,) = set(pair) - set(given)
            raise ValueError(
                f"signals.{missing}: missing, but {given[0]} is given; {_add_signal(missing)}"
                + (", or give steering for both front wheels" if missing.startswith("steer_f") else "")
            )


def _add_signal(name: str) -> str:
    return f'add {name} = {{ column = "...", unit = "{SIGNALS[name]}" }}'


def check_estimators(
    chosen: Estimators, signals: Mapping[str, Column], vehicle: Vehicle, schedules: Schedules | None
) -> None:
    """Every estimator that the file asks for by name has the vehicle data, the signals and the schedules that it needs."""
    cornered = [name for name in ("corner_velocity", "axle_weights") if name in chosen.model_fields_set]
    if schedules is None and (cornered or chosen.velocity != "fusion"):
        name = cornered[0] if cornered else "velocity"
        kind = str(getattr(chosen, name))
        why = "has its tire from a gain schedule" if kind.startswith("kalman") else "runs on gain schedules"
        raise ValueError(
            f"schedules: missing, but estimators.{name} = '{kind}' {why}; add a table "
            '[schedules] with longitudinal = "corner-estimation-longitudinal"'
        )
    if chosen.velocity != "fusion" and (schedules is None or schedules.lateral is None):
        raise ValueError(
            f"schedules.lateral: missing, but estimators.velocity = '{chosen.velocity}' has V_y from nothing else; "
            'add it, such as lateral = "corner-estimation-lateral"'
        )
    if chosen.suspension == "compliant" and (schedules is None or schedules.lateral is None):
        raise ValueError(
            "schedules.lateral: missing, but estimators.suspension = 'compliant' belongs to corner observers of both "
            'directions; add it, such as lateral = "corner-estimation-lateral"'
        )
    for own, (other, kinds) in _PARTS_OF.items():
        if own in chosen.model_fields_set and getattr(chosen, other) not in kinds:
            raise ValueError(
                f"estimators.{own}: belongs to {other} = {' or '.join(kinds)}, and {other} is '{getattr(chosen, other)}'; "
                "choose one of them, or leave it out"
            )
    for place, estimator in ((name, str(getattr(chosen, name))) for name in chosen.model_fields_set):
        needs = f"missing, but estimators.{place} = '{estimator}' needs it"
        for parameter, example in _PARAMETERS.get((place, estimator), ()):
            if getattr(vehicle, parameter) is None:
                raise ValueError(f'vehicle.{parameter}: {needs}; add it, such as "{example}"')
        for signal in _SIGNALS.get((place, estimator), ()):
            if signal not in signals:
                raise ValueError(f"signals.{signal}: {needs}; {_add_signal(signal)}")
        if (place, estimator) in _STEERED and not {"steering", "hand_wheel", "steer_fl"} & signals.keys():
            add = f"{_add_signal('steering')}, or hand_wheel, or steer_fl and steer_fr"
            raise ValueError(f"signals.steering: {needs}; {add}")


_PARTS_OF = {
    "process_covariance": ("corner_velocity", ("kalman-three-state", "kalman-two-state")),
    "sideslip_speed": ("sideslip", CHOICES["sideslip"][1:]),
    "stiffness_noise": ("sideslip", ("adaptive-stiffness", "fixed-stiffness", "sliding-mode")),
}
_YAW = ("yaw_inertia", "3900 kg*m^2")
_STIFFNESS = (_YAW, ("cornering_stiffness_front", "160 kN/rad"), ("cornering_stiffness_rear", "180 kN/rad"))
_TIRE = (*_STIFFNESS, ("relaxation_length", "0.5 m"))
_PARAMETERS = {
    ("lateral_force", "linear"): (_YAW,), ("lateral_force", "unscented"): (_YAW,),
    ("sideslip", "four-wheel-extended"): _TIRE, ("sideslip", "four-wheel-unscented"): _TIRE,
    ("sideslip", "adaptive-stiffness"): _STIFFNESS, ("sideslip", "fixed-stiffness"): _STIFFNESS,
    ("sideslip", "sliding-mode"): _STIFFNESS,
}  # fmt: skip
_STEERED = {(place, name) for place, name in _PARAMETERS if place == "sideslip"}
_SIGNALS = {
    **dict.fromkeys((*_STEERED, ("lateral_force", "linear"), ("lateral_force", "unscented")), ("yaw_rate", "ay")),
    **{("longitudinal_force", name): TORQUES for name in ("unknown-input", "pid", "unscented", "linear")},
    ("attitude", "gyro"): ("roll_rate", "pitch_rate"),
}


class DriveFile(StrictTable):
    """A drive file that was read, checked and converted to SI.

    ``schedules`` are for the corner observers: without them the pipeline of the fusion runs alone.
    ``mounting``: where the inertial unit and the reference sit, if not at the centre of gravity and along the axes of the car.
    ``unsigned_wheels``: the wheel speeds do not tell backward from forward; the gear in ``direction`` does, or the accelerometer.
    ``check``: compare the signals of the log with one another (:mod:`.frames`) before anything is estimated from them.
    """

    schema_: Literal["gainsmith.drive/1"] = Field(alias="schema", examples=["gainsmith.drive/1"])
    name: str = Field(min_length=1, examples=["brake test"])
    source: str = ""
    sample_time: si.Duration = Field(examples=["5 ms"])
    vehicle: Vehicle
    mounting: Mountings = Mountings()
    schedules: Schedules | None = None
    check: bool = True
    unsigned_wheels: bool = False
    direction: Gear | None = None
    observer: Observer = Observer()
    estimators: Estimators = Estimators()
    log: Annotated[list[LogFile], Field(min_length=1)]
    signals: dict[str, Column]
    reference: dict[str, Column] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _tables_agree(self) -> Self:
        check_logs(self.log)
        check_columns(self.signals, self.reference, self.log, self.vehicle)
        check_direction(self.direction, self.unsigned_wheels, self.log)
        check_alignment({**self.reference, **self.signals}, self.log)
        check_signals(self.signals, self.vehicle)
        check_mountings(self.mounting, self.signals, self.reference)
        check_estimators(self.estimators, self.signals, self.vehicle, self.schedules)
        return self

    def log_of(self, column: Column | Gear) -> str:
        """The name of the log that holds a column (the only one, if the file has one)."""
        return column.log if column.log is not None else self.log[0].name


def read_drive(path: Path) -> DriveFile:
    """Read and check a drive file. Raises SpecError, one line: file, key, what is wrong, what would be right.

    >>> read_drive(Path("drive.toml")).name  # doctest: +SKIP
    """
    return load_toml(path, DriveFile, "drive")
