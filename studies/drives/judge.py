"""The estimates of a drive beside its references and the two baselines."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntFlag
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from estimators import Flag, GainSchedule
from estimators.pipeline import Check
from estimators.velocity import slip_ratio
from studies.drives import comparison
from studies.drives.baselines import integrated_acceleration, mean_wheel_speed
from studies.drives.chain import Chain
from studies.drives.drive_file import DriveFile
from studies.drives.log import DriveLog
from studies.drives.metrics import deviation
from studies.drives.prepare import CornerInputs
from studies.drives.quantities import CORNERS
from studies.drives.replay import Replay, centre_map

Array = npt.NDArray[np.float64]
LEAST_SPEED = 2.0
"""m/s below which a slip ratio is not formed: the velocity error is then a large part of it."""

STRAIGHT = 0.01
"""rad below which steered wheels hardly add lateral force to m a_x: the sum of F_x then misses only the drag of air."""


@dataclass(frozen=True)
class DriveData:
    """One replayed drive: what was described, measured, fed to the observers, and estimated."""

    drive: DriveFile
    schedule: GainSchedule
    log: DriveLog
    inputs: CornerInputs
    replay: Replay
    chain: Chain | None = None
    assumptions: tuple[str, ...] = ()

    @cached_property
    def baselines(self) -> dict[str, Array]:
        """V_x (n,) without an observer, m/s, by name."""
        wheels = mean_wheel_speed(self.inputs.surface_speed)
        start = float(wheels[np.flatnonzero(np.isfinite(wheels))[:1]].sum())
        integrated = integrated_acceleration(
            self.inputs.ax, self.inputs.yaw_rate, self.inputs.vy, self.drive.sample_time, start
        )
        return {"mean_wheel_speed": wheels, "integrated_acceleration": integrated}

    @cached_property
    def slip(self) -> Array:
        """Slip ratio (n, 4) from the estimated V_x at the centre of gravity, mapped back to each corner: P1 6.3."""
        return _slip_at(self.inputs, self.replay.velocity)

    @cached_property
    def reference_slip(self) -> Array | None:
        """Slip ratio (n, 4) from V_x, V_y and yaw rate of the reference, if the log has V_x; a measured yaw rate else.

        A steered wheel rolls along a part of V_y: where nobody knows V_y, steered wheels have no reference (NaN).
        """
        known, inputs = self.log.reference, self.inputs
        if "vx" not in known:
            return None
        lateral = known.get("vy", inputs.vy)
        found = _slip_at(replace(inputs, vy=lateral, yaw_rate=known.get("yaw_rate", inputs.yaw_rate)), known["vx"])
        if "vy" in known or "vy" in self.log.signals:
            return found
        return np.where(np.abs(inputs.steer) < STRAIGHT, found, np.nan)


def _slip_at(inputs: CornerInputs, velocity: Array) -> Array:
    gain, shift = centre_map(inputs)
    return moving_slip(inputs.surface_speed, (velocity[:, None] - shift) / gain)


def moving_slip(surface_speed: Array, wheel_velocity: Array) -> Array:
    """`slip_ratio`, NaN below 2 m/s."""
    moves = np.maximum(np.abs(surface_speed), np.abs(wheel_velocity)) >= LEAST_SPEED
    return np.where(moves, slip_ratio(surface_speed, wheel_velocity), np.nan)


def judge(data: DriveData) -> dict[str, Any]:
    """The content of metrics.json: deviations from the references that the log has, counted flags, assumptions."""
    chain = data.chain
    pipeline: dict[str, Any] = {}
    if chain is not None:
        given = (chain, data.log, data.inputs, data.drive)
        pipeline = {
            "estimators": data.drive.estimators.model_dump(),
            "rules": comparison.RULES,
            "notes": comparison.notes(data.drive),
            "signals": comparison.lateral_motion(*given) | comparison.forces(*given),
            "flagged_samples": _counts(chain.flags, Flag),
            "failed_checks": _counts(chain.checks, Check),
            "assumptions": list(chain.assumptions),
        }
    return {
        "drive": data.drive.name,
        "schedule": _schedule_entry(data.schedule),
        "log": data.log.report,
        "velocity": _velocity(data),
        "force": _force(data),
        "pipeline": pipeline,
        "flagged_samples": flag_counts(data.replay.flags),
        "force_sources": dict(zip(CORNERS, data.inputs.force_sources, strict=True)),
        "assumptions": [*data.assumptions, *data.inputs.assumptions],
    }


def _schedule_entry(schedule: GainSchedule) -> dict[str, Any]:
    box = schedule.parameter
    return {
        "name": schedule.name,
        "sha256": schedule.sha256,
        "sample_time_s": schedule.sample_time,
        box.name: {"unit": box.unit, "range": [box.min, box.max], "rate": [box.rate_min, box.rate_max]},
    }


def _velocity(data: DriveData) -> dict[str, Any]:
    if "vx" not in data.log.reference:
        return {}
    reference = data.log.reference["vx"]
    estimates = {"pipeline": data.chain.vx} if data.chain is not None else {}
    estimates |= {"corner_observers": data.replay.velocity, **data.baselines}
    estimates |= {f"corner_{corner}": data.replay.corner_velocity[:, k] for k, corner in enumerate(CORNERS)}
    return {name: deviation(value, reference, "m/s").as_dict() for name, value in estimates.items()}


def _force(data: DriveData) -> dict[str, Any]:
    reference, found = data.log.reference, {}
    for direction, values in (("x", data.inputs.force), ("z", data.inputs.vertical_load)):
        for k, corner in enumerate(CORNERS):
            name = f"force_{direction}_{corner}"
            if name in reference:
                found[name] = deviation(values[:, k], reference[name], "N").as_dict()
    if "ax" in reference and "m*a_x shared by load" not in data.inputs.force_sources:
        straight = np.abs(data.inputs.steer).max(axis=1) < STRAIGHT
        total = np.where(straight, data.inputs.force.sum(axis=1), np.nan)
        found["total_force_x_straight"] = deviation(total, data.drive.vehicle.mass * reference["ax"], "N").as_dict()
    return found


def flag_counts(flags: npt.NDArray[np.int64]) -> dict[str, dict[str, int]]:
    """How many samples of each corner carry each flag; flags that never rose are left out."""
    return {corner: _counts(flags[:, k], Flag) for k, corner in enumerate(CORNERS)}


def _counts(flags: npt.NDArray[np.int64], names: type[IntFlag]) -> dict[str, int]:
    counted = {str(flag.name).lower(): int(np.count_nonzero(flags & flag.value)) for flag in names}
    return {name: count for name, count in counted.items() if count}
