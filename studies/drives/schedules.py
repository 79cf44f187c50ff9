"""The schedules and corner observers that a drive file names, and the tire for which each was designed."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from estimators import GainSchedule
from estimators.pipeline import KalmanCorners, ScheduledCorners, SwitchedCorners
from estimators.pipeline.corner_kinds import CornerKind
from estimators.schedule import SHIPPED, read_content
from estimators.velocity import BristleTire
from studies.drives.drive_file import DriveFile
from studies.errors import refused_at
from synthesis.errors import SpecError

MODEL = "corner-velocity-{}"
_TIRE = {"sigma0": "sigma0", "sigma1": "sigma1", "sigma2": "sigma2", "kappa": "kappa", "radius": "effective_radius"}
Direction = Literal["longitudinal", "lateral"]
OTHER_WHEEL = 0.10
"""Share by which a radius of the car may differ from that of a schedule: beyond it the schedule is another car's."""
OTHER_PAIR = 0.01  # share by which the radii of a longitudinal and a lateral schedule may differ: they are of one car
SAME_WHEEL = 1e-3  # share below which two radii are the same one, rounded


def load_schedule(
    name: str, folder: Path, sample_time: float, direction: Direction = "longitudinal", drive: DriveFile | None = None
) -> GainSchedule:
    """The schedule of a direction by shipped name, or by path relative to ``folder`` when the name ends in .json.

    Raises SpecError, before anything runs: unreadable or edited, another model or direction, another sample time.
    """
    content, file = _content(name, folder, direction)
    with refused_at(f"schedules.{direction}"):
        schedule = GainSchedule.from_content(content, file)
    model = content["model"]["id"]
    wanted = MODEL.format(direction)
    if model != wanted:
        raise SpecError(f"schedules.{direction}: '{name}' is a schedule of {model}; this run needs one of {wanted}")
    if abs(schedule.sample_time - sample_time) > 1e-9 * sample_time:
        raise SpecError(
            f"schedules.{direction}: '{name}' was proved at sample_time = {schedule.sample_time:g} s, the drive file "
            f'asks for {sample_time:g} s; set sample_time = "{schedule.sample_time * 1e3:g} ms" or '
            f"{'make another' if drive is None else command_for(name, drive)}"
        )
    return schedule


def load_schedules(drive: DriveFile, folder: Path) -> tuple[GainSchedule | None, GainSchedule | None, tuple[str, ...]]:
    """The longitudinal and the lateral schedule that a drive file names (None: it names none), and what is assumed of them.

    Raises SpecError as :func:`load_schedule` and :func:`check_radii`.
    """
    named, time = drive.schedules, drive.sample_time
    if named is None:
        return None, None, ()
    longitudinal = load_schedule(named.longitudinal, folder, time, drive=drive)
    lateral = None if named.lateral is None else load_schedule(named.lateral, folder, time, "lateral", drive)
    return longitudinal, lateral, check_radii(drive, folder)


def command_for(name: str, drive: DriveFile) -> str:
    """What to type for a schedule like ``name`` of this car at this sample time, as a part of a sentence."""
    from studies.spec import Variant, shipped_specs  # models and solvers, needed for a refusal alone

    spec = name if name in shipped_specs() else "SPEC"
    car = drive.vehicle
    radius = round(0.5 * (car.effective_radius_front + car.effective_radius_rear), 6)
    made = Variant(radius, drive.sample_time).name(spec)
    return (
        f'run gainsmith schedules {spec} --radius "{radius:g} m" --sample-time "{drive.sample_time * 1e3:g} ms" --out . '
        f'and name "{made}.json"'
    )


def load_tire(name: str, folder: Path) -> BristleTire:
    """The bristle constants of the model behind the longitudinal schedule.

    Raises SpecError when its model lacks one of them, or has one that no tire has.
    """
    content, _ = _content(name, folder, "longitudinal")
    constants = content["model"].get("constants", {})
    missing = [key for key in _TIRE.values() if key not in constants]
    if missing:
        raise SpecError(
            f"schedules.longitudinal: the model of '{name}' has no constant {', '.join(missing)}, which the Kalman "
            "filters of estimators.corner_velocity need; name a schedule of the bristle model"
        )
    with refused_at(f"schedules.longitudinal: '{name}'"):
        return BristleTire(**{own: float(constants[key]["value"]) for own, key in _TIRE.items()})


def check_radii(drive: DriveFile, folder: Path) -> tuple[str, ...]:
    """Are the schedules for wheels like those of the car? Returns what has to be assumed where they nearly are.

    Compared is ``effective_radius`` of each schedule's model, as a share of it. Raises SpecError, one line: more than 10 %
    off the car's radii, or schedules whose radii differ by more than 1 %.
    """
    if drive.schedules is None:
        return ()
    named: dict[Direction, str] = {"longitudinal": drive.schedules.longitudinal}
    if drive.schedules.lateral is not None:
        named["lateral"] = drive.schedules.lateral
    found = {direction: _radius(name, folder, direction) for direction, name in named.items()}
    assumed = []
    for direction, radius in found.items():
        name = named[direction]
        if radius is None:
            assumed.append(f"{direction} schedule '{name}' does not say for which effective_radius: taken as fitting")
        else:
            assumed += _against_car(drive, direction, name, radius)
    along, across = found["longitudinal"], found.get("lateral")
    if along is not None and across is not None and abs(across / along - 1.0) > OTHER_PAIR:
        raise SpecError(
            f"schedules: '{named['longitudinal']}' is for effective_radius = {along:g} m, "
            f"'{named['lateral']}' for {across:g} m; name two schedules of one car"
        )
    return tuple(assumed)


def _against_car(drive: DriveFile, direction: Direction, name: str, radius: float) -> list[str]:
    car = drive.vehicle
    off = {"front": car.effective_radius_front / radius - 1.0, "rear": car.effective_radius_rear / radius - 1.0}
    axle = max(off, key=lambda one: abs(off[one]))
    found = f"{radius * (1.0 + off[axle]):g} m"
    if abs(off[axle]) > OTHER_WHEEL:
        raise SpecError(
            f"schedules.{direction}: '{name}' is for effective_radius = {radius:g} m, vehicle.effective_radius_{axle} is "
            f"{found}, {100 * off[axle]:+.0f} % (at most {100 * OTHER_WHEEL:g} %); correct the radius, or "
            f"{command_for(name, drive)}"
        )
    if abs(off[axle]) <= SAME_WHEEL:
        return []
    return [
        f"{direction} schedule '{name}' is for effective_radius = {radius:g} m, the car has up to {found} "
        f"({100 * off[axle]:+.1f} %): taken as fitting"
    ]


def _radius(name: str, folder: Path, direction: Direction) -> float | None:
    """``effective_radius`` of the model behind a schedule, m; None where it has none."""
    content, _ = _content(name, folder, direction)
    constant = content["model"].get("constants", {}).get("effective_radius")
    if constant is None:
        return None
    radius = float(constant["value"])
    if not radius > 0.0:
        raise SpecError(
            f"schedules.{direction}: '{name}' has effective_radius = {radius:g} m; no wheel has, name another schedule"
        )
    return radius


def _content(name: str, folder: Path, direction: Direction) -> tuple[dict[str, Any], str]:
    """The content of the file, and its name."""
    with refused_at(f"schedules.{direction}"):
        if not name.endswith(".json"):
            GainSchedule.shipped(name)  # refuses an unknown name with a list of those there are
            return read_content(SHIPPED / f"{name}.json"), f"{name}.json"
        path = folder / name
        if not path.is_file():
            raise SpecError(
                f"schedules.{direction}: no file '{name}' beside the drive file; give its path from there, or the "
                f"name of a shipped schedule: {', '.join(sorted(file.stem for file in SHIPPED.glob('*.json')))}"
            )
        return read_content(path), path.name


def corner_observer(drive: DriveFile, folder: Path, schedule: GainSchedule) -> CornerKind:
    """What ``estimators.corner_velocity`` of the drive file asks for; ``folder`` is that of the drive file.

    ``lpv``: P1 (24). ``gain-switched``: the schedule up to 15 % of slip, P3's gain of high slip beyond it, P3 (19), Example 2.
    ``kalman-three-state``, ``kalman-two-state``: P2 (19)-(23) with the covariances switched by P2 (29) and |dw/dt|.

    Raises SpecError, one line, when the schedule cannot serve it.
    """
    kind = drive.estimators.corner_velocity
    with refused_at(f"estimators.corner_velocity = '{kind}'"):
        if kind == "gain-switched":
            return SwitchedCorners(schedule)
        if kind == "lpv":
            return ScheduledCorners(schedule)
        tire = load_tire(drive.schedules.longitudinal if drive.schedules is not None else "", folder)
        states: Literal[2, 3] = 3 if kind == "kalman-three-state" else 2
        return KalmanCorners(tire, schedule.sample_time, states=states, process=drive.estimators.process_covariance)
