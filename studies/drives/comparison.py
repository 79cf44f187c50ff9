"""Every signal that the log has a reference for: the pipeline beside the corner observers and beside what needs neither."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from estimators.forces import vertical_loads
from studies.drives.baselines import held, integrated_acceleration
from studies.drives.chain import Chain
from studies.drives.corner_inputs import shared_forces
from studies.drives.drive_file import DriveFile
from studies.drives.log import DriveLog
from studies.drives.metrics import deviation
from studies.drives.prepare import CornerInputs
from studies.drives.quantities import CORNERS

Array = npt.NDArray[np.float64]
Axle = Literal["front", "rear"]
AXLES: tuple[Axle, ...] = ("front", "rear")
LEAST_FORCE = 1000.0
"""N that a reference force must exceed for a sample to count: the papers report forces that do something."""
LEAST_SPEED = 2.0
"""m/s that the reference must exceed for a sideslip angle to count."""
RULES = {
    "nrms": "RMS error over the largest magnitude of the reference, %",
    "forces": f"samples where the reference force exceeds {LEAST_FORCE:g} N; the peak is that of all samples",
    "sideslip": f"samples where the reference V_x exceeds {LEAST_SPEED:g} m/s",
}


def lateral_motion(chain: Chain, log: DriveLog, inputs: CornerInputs, drive: DriveFile) -> dict[str, dict[str, Any]]:
    """V_y and sideslip of the pipeline, the corner observers, the sideslip part, and the integral of a_y - r V_x."""
    reference, found = log.reference, {}
    if "vy" not in reference:
        return {}
    ay = log.signals.get("ay", np.zeros_like(log.time))
    wheels = np.nan_to_num(held(inputs.surface_speed.mean(axis=1)))
    integrated = integrated_acceleration(ay, -inputs.yaw_rate, wheels, drive.sample_time, 0.0)
    estimates = {"pipeline": chain.vy, "corner_observers": chain.corner_vy, "integrated_acceleration": integrated}
    found["vy"] = {
        name: deviation(value, reference["vy"], "m/s").as_dict()
        for name, value in estimates.items()
        if np.isfinite(value).any()
    }
    if "vx" in reference:
        true = reference_sideslip(log)
        angles = {"pipeline": chain.sideslip, drive.estimators.sideslip: chain.sideslip_part}
        angles["integrated_acceleration"] = np.arctan(integrated / np.maximum(np.abs(wheels), LEAST_SPEED))
        found["sideslip"] = {
            name: deviation(value, true, "rad").as_dict() for name, value in angles.items() if np.isfinite(value).any()
        }
    return found


def reference_sideslip(log: DriveLog) -> Array:
    """arctan(V_y / |V_x|) (n,) of the references, rad; NaN up to 2 m/s, where a small velocity error is a large angle."""
    vx, vy = log.reference["vx"], log.reference["vy"]
    fast = np.abs(vx) > LEAST_SPEED
    return np.where(fast, np.arctan(vy / np.where(fast, np.abs(vx), 1.0)), np.nan)


def quasi_static_axle_forces(log: DriveLog, drive: DriveFile) -> Array:
    """F_y of each axle (n, 2), N, of a car that does not yaw: the share of m a_y that its distance from the CG gives it."""
    front, rear = drive.vehicle.front_axle_distance, drive.vehicle.rear_axle_distance
    ay = log.signals.get("ay", np.zeros_like(log.time))
    return np.outer(drive.vehicle.mass * ay, np.array([rear, front]) / (front + rear))


def reference_axle_force(log: DriveLog, axle: Axle) -> Array | None:
    """Sum of F_y over both wheels of an axle (n,), N, if the log has both."""
    pair = CORNERS[:2] if axle == "front" else CORNERS[2:]
    wheels = [log.reference.get(f"force_y_{corner}") for corner in pair]
    found = [wheel for wheel in wheels if wheel is not None]
    return found[0] + found[1] if len(found) == 2 else None


def notes(drive: DriveFile) -> dict[str, str]:
    """What a reader of a row must know to judge it, by signal."""
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
    none = np.zeros(4, dtype=np.bool_)
    quasi_x = shared_forces(ax, quasi_z, car.mass, np.zeros_like(quasi_z), none)
    for k, corner in enumerate(CORNERS):
        along = {"pipeline": chain.force_x[:, k], "corner_input": inputs.force[:, k], "quasi_static": quasi_x[:, k]}
        up = {"pipeline": chain.force_z[:, k], "quasi_static": quasi_z[:, k]}
        for name, estimates in ((f"force_x_{corner}", along), (f"force_z_{corner}", up)):
            if name in reference:
                found[name] = _judged(estimates, reference[name])
    rigid = quasi_static_axle_forces(log, drive)
    for k, axle in enumerate(AXLES):
        true = reference_axle_force(log, axle)
        if true is not None:
            estimates = {"pipeline": chain.axle_force_y[:, k], "quasi_static": rigid[:, k]}
            found[f"force_y_{axle}"] = _judged(estimates, true)
    if "ax" in reference:
        total = np.sum(chain.force_x * np.cos(inputs.steer), axis=1)
        total -= chain.axle_force_y[:, 0] * np.sin(inputs.steer[:, :2].mean(axis=1))
        estimates = {"pipeline": total, "quasi_static": car.mass * ax}
        found["total_force_x"] = _judged(estimates, car.mass * reference["ax"])
    return found


def _judged(estimates: dict[str, Array], reference: Array) -> dict[str, Any]:
    counts = np.abs(reference) > LEAST_FORCE
    found = {}
    for name, value in estimates.items():
        entry = deviation(np.where(counts, value, np.nan), reference, "N")
        peak = float(np.nanmax(np.abs(reference), initial=0.0))
        whole = entry.as_dict() | {"reference_peak": peak}
        found[name] = whole | {"nrms_percent": None if entry.rms is None else 100.0 * entry.rms / peak}
    return found
