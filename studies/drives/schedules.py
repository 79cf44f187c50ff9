"""The schedules that a drive file names, and the tire for which each was designed."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from estimators import EstimatorError, GainSchedule
from estimators.schedule import SHIPPED, read_content
from estimators.velocity import BristleTire
from synthesis.errors import SpecError

MODEL = "corner-velocity-{}"
_TIRE = {"sigma0": "sigma0", "sigma1": "sigma1", "sigma2": "sigma2", "kappa": "kappa", "radius": "effective_radius"}
Direction = Literal["longitudinal", "lateral"]


def load_schedule(name: str, folder: Path, sample_time: float, direction: Direction = "longitudinal") -> GainSchedule:
    """The schedule of a direction by shipped name, or by path relative to ``folder`` when the name ends in .json.

    Raises SpecError, before anything runs: unreadable or edited, another model or direction, another sample time.
    """
    content, file = _content(name, folder, direction)
    try:
        schedule = GainSchedule.from_content(content, file)
    except EstimatorError as error:
        raise SpecError(f"schedules.{direction}: {error}") from error
    model = content["model"]["id"]
    wanted = MODEL.format(direction)
    if model != wanted:
        raise SpecError(f"schedules.{direction}: '{name}' is a schedule of {model}; this run needs one of {wanted}")
    if abs(schedule.sample_time - sample_time) > 1e-9 * sample_time:
        raise SpecError(
            f"schedules.{direction}: '{name}' was proved at sample_time = {schedule.sample_time:g} s, the drive file "
            f'asks for {sample_time:g} s; set sample_time = "{schedule.sample_time * 1e3:g} ms" or synthesise another'
        )
    return schedule


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
    try:
        return BristleTire(**{own: float(constants[key]["value"]) for own, key in _TIRE.items()})
    except EstimatorError as error:
        raise SpecError(f"schedules.longitudinal: '{name}': {error}") from error


def _content(name: str, folder: Path, direction: Direction) -> tuple[dict[str, Any], str]:
    """The content of the file, and its name."""
    try:
        if name.endswith(".json"):
            path = folder / name
        else:
            GainSchedule.shipped(name)  # refuses an unknown name with a list of those there are
            path = SHIPPED / f"{name}.json"
        return read_content(path), path.name
    except EstimatorError as error:
        raise SpecError(f"schedules.{direction}: {error}") from error
