"""What the tables of a drive file must agree on; every refusal names the key and what would be right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimators.errors import unknown
from studies.drives.drive_tables import Align, Column, Estimators, LogFile, Schedules, Vehicle
from studies.drives.quantities import CORNERS, REFERENCES, SIGNALS

WHEEL_SPEEDS = tuple(f"wheel_speed_{corner}" for corner in CORNERS)
TORQUES = tuple(f"torque_{corner}" for corner in CORNERS)


def check_logs(logs: Sequence[LogFile]) -> None:
    """Every log has a name of its own."""
    names = [log.name for log in logs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"log: two entries are called '{name}'; give every log its own name")


def check_columns(signals: Mapping[str, Column], reference: Mapping[str, Column], logs: Sequence[LogFile]) -> None:
    """Every signal is a known one, has a unit that measures it, and says which log holds it."""
    names = [log.name for log in logs]
    for table, known, columns in (("signals", SIGNALS, signals), ("reference", REFERENCES, reference)):
        for name, column in columns.items():
            _check_column(f"{table}.{name}", name, column, known, names)


def _check_column(place: str, name: str, column: Column, known: dict[str, str], logs: list[str]) -> None:
    if name not in known:
        raise ValueError(f"{place}: {unknown('signal', name, known)}")
    if column.factor == 0:
        raise ValueError(f"{place}.factor: 0 is not a scale; use a finite number other than zero")
    try:
        column.scale(known[name])
    except ValueError as error:
        raise ValueError(f"{place}.unit: {error}") from error
    if column.log is None and len(logs) > 1:
        raise ValueError(f"{place}.log: missing; say which log holds column '{column.column}': {', '.join(logs)}")
    if column.log is not None and column.log not in logs:
        raise ValueError(f"{place}.log: {unknown('log', column.log, logs)}")


def check_alignment(columns: Mapping[str, Column], logs: Sequence[LogFile]) -> None:
    """A log is aligned to one with a clock of its own: velocity in one of the two, acceleration in the other."""
    for log in logs:
        if log.align is not None:
            _check_alignment(f"log '{log.name}'.align", log, log.align, columns, logs)


def _check_alignment(
    place: str, log: LogFile, align: Align, columns: Mapping[str, Column], logs: Sequence[LogFile]
) -> None:
    others = [other.name for other in logs if other.name != log.name and other.align is None]
    if align.to not in others:
        raise ValueError(f"{place}.to: {unknown('log', align.to, others)} (a log with a clock of its own)")
    if log.clock_offset != 0:
        raise ValueError(f"{place}: clock_offset is given as well; keep one of the two")
    for role in (align.velocity, align.acceleration):
        if role not in columns:
            raise ValueError(f"{place}: {unknown('signal', role, columns)}")
    held = {columns[align.velocity].log, columns[align.acceleration].log}
    if held != {log.name, align.to}:
        raise ValueError(
            f"{place}: one of {align.velocity}, {align.acceleration} must be in log '{log.name}', "
            f"the other in '{align.to}'"
        )


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
        raise ValueError(
            f"signals: {' and '.join(steering)} say the same thing; keep steering, hand_wheel, or steer_fl and steer_fr"
        )
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


def check_estimators(chosen: Estimators, signals: Mapping[str, Column], vehicle: Vehicle, schedules: Schedules) -> None:
    """Every estimator that the file asks for by name has the vehicle data, the signals and the schedules that it needs."""
    if chosen.velocity != "fusion" and schedules.lateral is None:
        raise ValueError(
            f"schedules.lateral: missing, but estimators.velocity = '{chosen.velocity}' has V_y from nothing else; "
            'add it, such as lateral = "corner-estimation-lateral"'
        )
    wanted = {name: str(getattr(chosen, name)) for name in chosen.model_fields_set}
    parameters, needed = _PARAMETERS, _SIGNALS
    for place, estimator in wanted.items():
        for parameter, example in parameters.get((place, estimator), ()):
            if getattr(vehicle, parameter) is None:
                raise ValueError(
                    f"vehicle.{parameter}: missing, but estimators.{place} = '{estimator}' needs it; "
                    f'add it, such as "{example}"'
                )
        for signal in needed.get((place, estimator), ()):
            if signal not in signals:
                raise ValueError(
                    f"signals.{signal}: missing, but estimators.{place} = '{estimator}' needs it; {_add_signal(signal)}"
                )
        if (place, estimator) in _STEERED and not any(
            name in signals for name in ("steering", "hand_wheel", "steer_fl")
        ):
            raise ValueError(
                f"signals.steering: missing, but estimators.{place} = '{estimator}' needs it; {_add_signal('steering')}, "
                "or hand_wheel, or steer_fl and steer_fr"
            )


_YAW = ("yaw_inertia", "3900 kg*m^2")
_STIFFNESS = (_YAW, ("cornering_stiffness_front", "160 kN/rad"), ("cornering_stiffness_rear", "180 kN/rad"))
_TIRE = (*_STIFFNESS, ("relaxation_length", "0.5 m"))
_PARAMETERS = {
    ("lateral_force", "linear"): (_YAW,),
    ("lateral_force", "unscented"): (_YAW,),
    ("sideslip", "four-wheel-extended"): _TIRE,
    ("sideslip", "four-wheel-unscented"): _TIRE,
    ("sideslip", "adaptive-stiffness"): _STIFFNESS,
    ("sideslip", "fixed-stiffness"): _STIFFNESS,
    ("sideslip", "sliding-mode"): _STIFFNESS,
}
_STEERED = {(place, name) for place, name in _PARAMETERS if place == "sideslip"}
_SIGNALS = {
    **dict.fromkeys((*_STEERED, ("lateral_force", "linear"), ("lateral_force", "unscented")), ("yaw_rate", "ay")),
    **{("longitudinal_force", name): TORQUES for name in ("unknown-input", "pid", "unscented", "linear")},
    ("attitude", "gyro"): ("roll_rate", "pitch_rate"),
}
