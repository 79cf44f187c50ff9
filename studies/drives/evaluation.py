"""The estimates of a drive beside its references and beside what needs no observer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from enum import IntFlag
from functools import cached_property
from typing import Any, Literal

import numpy as np

from estimators import Flag, GainSchedule
from estimators.arrays import FloatArray, IntArray
from estimators.forces import vertical_loads
from estimators.pipeline import Check
from estimators.velocity import slip_ratio
from studies.drives.chain import Chain
from studies.drives.corner_inputs import held, integrated_acceleration, mean_over, shared_forces
from studies.drives.drive_file import DriveFile
from studies.drives.log import DriveLog
from studies.drives.prepare import CornerInputs, dead_reckoned, first_speed
from studies.drives.quantities import CORNERS
from studies.drives.replay import Replay, centre_map

Axle = Literal["front", "rear"]
AXLES: tuple[Axle, ...] = ("front", "rear")
LEAST_FORCE = 1000.0
"""N that a reference force must exceed for a sample to count: the papers report forces that do something."""
LEAST_SPEED = 2.0
"""m/s below which no slip ratio and no sideslip angle is formed: the velocity error is then a large part of it."""
RULES = {
    "nrms": "RMS error over the largest magnitude of the reference, %",
    "forces": f"samples where the reference force exceeds {LEAST_FORCE:g} N; the peak is that of all samples",
    "sideslip": f"samples where the reference V_x exceeds {LEAST_SPEED:g} m/s",
}
STRAIGHT = 0.01
"""rad below which steered wheels hardly add lateral force to m a_x: the sum of F_x then misses only the drag of air."""


@dataclass(frozen=True)
class Deviation:
    """Deviation of an estimate from a reference over the ``samples`` where both are known.

    ``nrms_percent`` is P1 (46): RMS error over the largest magnitude of the reference, ``reference_peak``, in %; None
    where the reference is zero throughout. ``rms``, ``max_error`` and ``reference_peak`` are in ``unit``; all are None
    where nothing can be compared.
    """

    samples: int
    unit: str
    nrms_percent: float | None
    rms: float | None
    max_error: float | None
    reference_peak: float | None


def deviation(estimate: FloatArray, reference: FloatArray, unit: str) -> Deviation:
    """Compare (n,) samples; missing ones on either side are left out and not counted.

    Raises ValueError when the two differ in length.
    """
    if estimate.shape != reference.shape:
        raise ValueError(f"estimate has shape {estimate.shape}, reference {reference.shape}; they must be the same")
    both = np.isfinite(estimate) & np.isfinite(reference)
    samples = int(np.count_nonzero(both))
    if samples == 0:
        return Deviation(0, unit, None, None, None, None)
    error = estimate[both] - reference[both]
    rms = float(np.sqrt(np.mean(error**2)))
    peak = float(np.max(np.abs(reference[both])))
    return Deviation(
        samples=samples, unit=unit, nrms_percent=100.0 * rms / peak if peak > 0 else None, rms=rms,
        max_error=float(np.max(np.abs(error))), reference_peak=peak,
    )  # fmt: skip


def lateral_motion(chain: Chain, log: DriveLog, inputs: CornerInputs, drive: DriveFile) -> dict[str, dict[str, Any]]:
    """V_y and sideslip of the pipeline, the corner observers, the sideslip part, and of planar dead reckoning."""
    reference, found = log.reference, {}
    if "vy" not in reference:
        return {}
    integrated = dead_reckoned(inputs, drive.sample_time)[1]
    wheels = np.nan_to_num(held(inputs.surface_speed.mean(axis=1)))
    estimates = {"pipeline": chain.vy, "corner_observers": chain.corner_vy, "integrated_acceleration": integrated}
    found["vy"] = _deviations(estimates, reference["vy"], "m/s")
    if "vx" in reference:
        angles = {"pipeline": chain.sideslip, drive.estimators.sideslip: chain.sideslip_part}
        angles["integrated_acceleration"] = np.arctan(integrated / np.maximum(np.abs(wheels), LEAST_SPEED))
        found["sideslip"] = _deviations(angles, reference_sideslip(log), "rad")
    return found


def _deviations(estimates: Mapping[str, FloatArray], reference: FloatArray, unit: str) -> dict[str, dict[str, Any]]:
    """Of the estimates that the drive has."""
    return {name: asdict(deviation(v, reference, unit)) for name, v in estimates.items() if np.isfinite(v).any()}


def reference_sideslip(log: DriveLog) -> FloatArray:
    """arctan(V_y / |V_x|) (n,) of the references, rad; NaN up to 2 m/s, where a small velocity error is a large angle."""
    vx, vy = log.reference["vx"], log.reference["vy"]
    fast = np.abs(vx) > LEAST_SPEED
    return np.where(fast, np.arctan(vy / np.where(fast, np.abs(vx), 1.0)), np.nan)


def quasi_static_axle_forces(log: DriveLog, drive: DriveFile) -> FloatArray:
    """F_y of each axle (n, 2), N, of a car that does not yaw: the share of m a_y that its distance from the CG gives it."""
    front, rear = drive.vehicle.front_axle_distance, drive.vehicle.rear_axle_distance
    ay = log.signals.get("ay", np.zeros_like(log.time))
    return np.outer(drive.vehicle.mass * ay, np.array([rear, front]) / (front + rear))


def reference_axle_force(log: DriveLog, axle: Axle) -> FloatArray | None:
    """Sum of F_y over both wheels of an axle (n,), N, if the log has both."""
    pair = CORNERS[:2] if axle == "front" else CORNERS[2:]
    wheels = [log.reference.get(f"force_y_{corner}") for corner in pair]
    found = [wheel for wheel in wheels if wheel is not None]
    return found[0] + found[1] if len(found) == 2 else None


def notes(drive: DriveFile) -> dict[str, str]:
    """What a reader of a row must know beside it, by signal."""
    measured, reference = drive.signals["ax"], drive.reference.get("ax")
    if reference is None or (drive.log_of(measured), measured.column) != (drive.log_of(reference), reference.column):
        return {}
    torques = any(name.startswith("torque_") for name in drive.signals)
    forces_from = "its forces come from the wheel torques" if torques else "its forces are shares of it"
    return {
        "total_force_x": f"circular: the reference is m times column '{reference.column}', which the pipeline gets as "
        f"signals.ax; {forces_from}, and quasi_static is that column itself"
    }


def forces(chain: Chain, log: DriveLog, inputs: CornerInputs, drive: DriveFile) -> dict[str, dict[str, Any]]:
    """F_x and F_z of each corner, F_y of each axle, and the total F_x against m a_x; quasi-static ones always beside."""
    reference, found, car = log.reference, {}, drive.vehicle
    ax, ay = log.signals["ax"], log.signals.get("ay", np.zeros_like(log.time))
    quasi_z = vertical_loads(car.parameters, ax, ay)
    quasi_x = shared_forces(ax, quasi_z, car.mass, np.zeros_like(quasi_z), np.zeros(4, dtype=np.bool_))
    for k, corner in enumerate(CORNERS):
        along = {"pipeline": chain.force_x[:, k], "corner_input": inputs.force[:, k], "quasi_static": quasi_x[:, k]}
        up = {"pipeline": chain.force_z[:, k], "quasi_static": quasi_z[:, k]}
        for name, estimates in ((f"force_x_{corner}", along), (f"force_z_{corner}", up)):
            if name in reference:
                found[name] = _above_least_force(estimates, reference[name])
    rigid = quasi_static_axle_forces(log, drive)
    for k, axle in enumerate(AXLES):
        true = reference_axle_force(log, axle)
        if true is not None:
            estimates = {"pipeline": chain.axle_force_y[:, k], "quasi_static": rigid[:, k]}
            found[f"force_y_{axle}"] = _above_least_force(estimates, true)
    if "ax" in reference:
        total = np.sum(chain.force_x * np.cos(inputs.steer), axis=1)
        total -= chain.axle_force_y[:, 0] * np.sin(inputs.steer[:, :2].mean(axis=1))
        estimates = {"pipeline": total, "quasi_static": car.mass * ax}
        found["total_force_x"] = _above_least_force(estimates, car.mass * reference["ax"])
    return found


def _above_least_force(estimates: dict[str, FloatArray], reference: FloatArray) -> dict[str, Any]:
    counts = np.abs(reference) > LEAST_FORCE
    peak = float(np.nanmax(np.abs(reference), initial=0.0))
    found = {}
    for name, value in estimates.items():
        entry = deviation(np.where(counts, value, np.nan), reference, "N")
        nrms = None if entry.rms is None else 100.0 * entry.rms / peak
        found[name] = asdict(replace(entry, reference_peak=peak, nrms_percent=nrms))
    return found


@dataclass(frozen=True)
class DriveData:
    """One replayed drive: what was described, measured, fed to the observers, and estimated.

    Without a ``schedule`` no corner observer ran: ``replay`` is None, and slip is formed with the pipeline's V_x.
    """

    drive: DriveFile
    schedule: GainSchedule | None
    log: DriveLog
    inputs: CornerInputs
    replay: Replay | None
    chain: Chain | None = None
    assumptions: tuple[str, ...] = ()

    @cached_property
    def baselines(self) -> dict[str, FloatArray]:
        """V_x (n,) without an observer, m/s, by name."""
        given, time = self.inputs, self.drive.sample_time
        if "vy" in self.log.signals:
            start = first_speed(given)
            integrated = integrated_acceleration(given.ax, given.yaw_rate, given.vy, time, start)
        else:
            integrated = dead_reckoned(given, time)[0]
        return {"mean_wheel_speed": mean_over(given.surface_speed), "integrated_acceleration": integrated}

    @cached_property
    def slip(self) -> FloatArray:
        """Slip ratio (n, 4) from the estimated V_x at the centre of gravity, mapped back to each corner: P1 6.3."""
        nothing = np.full(self.log.time.shape, np.nan)
        alone = nothing if self.chain is None else self.chain.vx
        return _slip_at(self.inputs, alone if self.replay is None else self.replay.velocity)

    @cached_property
    def reference_slip(self) -> FloatArray | None:
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


def _slip_at(inputs: CornerInputs, velocity: FloatArray) -> FloatArray:
    gain, shift = centre_map(inputs)
    return moving_slip(inputs.surface_speed, (velocity[:, None] - shift) / gain)


def moving_slip(surface_speed: FloatArray, wheel_velocity: FloatArray) -> FloatArray:
    """`slip_ratio`, NaN below 2 m/s."""
    moves = np.maximum(np.abs(surface_speed), np.abs(wheel_velocity)) >= LEAST_SPEED
    return np.where(moves, slip_ratio(surface_speed, wheel_velocity), np.nan)


def evaluate(data: DriveData) -> dict[str, Any]:
    """The content of metrics.json: deviations from the references that the log has, counted flags, assumptions."""
    chain = data.chain
    pipeline: dict[str, Any] = {}
    if chain is not None:
        given = (chain, data.log, data.inputs, data.drive)
        pipeline = {
            "estimators": data.drive.estimators.model_dump(), "rules": RULES, "notes": notes(data.drive),
            "signals": lateral_motion(*given) | forces(*given), "flagged_samples": _counts(chain.flags, Flag),
            "failed_checks": _counts(chain.checks, Check), "assumptions": list(chain.assumptions),
        }  # fmt: skip
    return {
        "drive": data.drive.name, "schedule": _schedule(data.schedule), "log": data.log.report,
        "velocity": _velocity(data), "force": _force(data), "pipeline": pipeline,
        "flagged_samples": {
            name: {} if data.replay is None else _counts(data.replay.flags[:, k], Flag) for k, name in enumerate(CORNERS)
        },
        "force_sources": dict(zip(CORNERS, data.inputs.force_sources, strict=True)),
        "assumptions": [*data.assumptions, *data.inputs.assumptions],
    }  # fmt: skip


def _schedule(used: GainSchedule | None) -> dict[str, Any] | None:
    """Which one the corner observers ran with."""
    if used is None:
        return None
    box = used.parameter
    return {
        "name": used.name, "sha256": used.sha256, "sample_time_s": used.sample_time,
        box.name: {"unit": box.unit, "range": [box.min, box.max], "rate": [box.rate_min, box.rate_max]},
    }  # fmt: skip


def _velocity(data: DriveData) -> dict[str, Any]:
    if "vx" not in data.log.reference:
        return {}
    reference = data.log.reference["vx"]
    estimates = {"pipeline": data.chain.vx} if data.chain is not None else {}
    ran = data.replay
    estimates |= {} if ran is None else {"corner_observers": ran.velocity}
    estimates |= data.baselines
    estimates |= {} if ran is None else {f"corner_{c}": ran.corner_velocity[:, k] for k, c in enumerate(CORNERS)}
    return {name: asdict(deviation(value, reference, "m/s")) for name, value in estimates.items()}


def _force(data: DriveData) -> dict[str, Any]:
    reference, found = data.log.reference, {}
    for direction, values in (("x", data.inputs.force), ("z", data.inputs.vertical_load)):
        for k, corner in enumerate(CORNERS):
            name = f"force_{direction}_{corner}"
            if name in reference:
                found[name] = asdict(deviation(values[:, k], reference[name], "N"))
    if "ax" in reference and "m*a_x shared by load" not in data.inputs.force_sources:
        straight = np.abs(data.inputs.steer).max(axis=1) < STRAIGHT
        total = np.where(straight, data.inputs.force.sum(axis=1), np.nan)
        found["total_force_x_straight"] = asdict(deviation(total, data.drive.vehicle.mass * reference["ax"], "N"))
    return found


def _counts(flags: IntArray, names: type[IntFlag]) -> dict[str, int]:
    """How many samples carry each flag; flags that never rose are left out."""
    counted = {str(flag.name).lower(): int(np.count_nonzero(flags & flag.value)) for flag in names}
    return {name: count for name, count in counted.items() if count}
