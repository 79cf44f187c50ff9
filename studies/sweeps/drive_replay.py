"""A recorded drive replayed by the corner observers of many designs at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from analysis.planar_exponential import planar_phi
from studies.drives.baselines import held, mean_over
from studies.drives.drive_file import read_drive
from studies.drives.log import read_log
from studies.drives.prepare import CornerInputs, corner_inputs_of
from studies.drives.replay import centre_map
from studies.sweeps.plant import Grid
from studies.sweeps.subject import Batch, Subject
from synthesis.errors import SpecError
from synthesis.polynomials.matrix import FloatArray

POINTS = 200_000  # designs x corners x samples whose update matrices are held at once


@dataclass(frozen=True)
class Recorded:
    """A drive ready to be replayed: inputs of the corner observers, and the reference V_x (n,)."""

    inputs: CornerInputs
    reference: FloatArray
    sample_time: float


@lru_cache(maxsize=8)
def recorded(drive: str, *logs: str) -> Recorded:
    """Read once in each process. Raises SpecError or LogError."""
    description = read_drive(Path(drive))
    log = read_log([Path(name) for name in logs], description)
    if "vx" not in log.reference:
        raise SpecError(f"{drive}: estimator_nrms needs a reference vx in the log")
    return Recorded(corner_inputs_of(log, description), log.reference["vx"], description.sample_time)


def nrms(files: tuple[str, ...], batch: Batch) -> FloatArray:
    """NRMS of V_x in % (n,), P1 (46): RMS error over the largest magnitude of the reference."""
    drive = recorded(*files)
    step = max(1, POINTS // drive.inputs.wheel_speed.size)
    velocity = np.concatenate([replay_batch(batch, drive, slice(i, i + step)) for i in range(0, batch.count, step)])
    known = np.isfinite(drive.reference) & np.isfinite(velocity).all(axis=0)
    error = velocity[:, known] - drive.reference[known]
    return np.asarray(100.0 * np.sqrt((error**2).mean(axis=1)) / np.abs(drive.reference[known]).max())


def replay_batch(batch: Batch, drive: Recorded, part: slice) -> FloatArray:
    """V_x (n, samples) of some designs: `studies.drives.replay` with one observer for each design and corner.

    x+ = F x + g u + h y with F = I + S (A - L C), g = S (B - L D), h = S L, S = T phi(T (A - L C)): the exact update.
    """
    inputs, subject = drive.inputs, batch.subject
    columns = {name: column[part] for name, column in batch.columns.items()}
    count = len(next(iter(columns.values())))
    F, g, h = _updates(subject, columns, inputs, count)
    nominal = subject.plant.parameters.get("effective_radius")
    share = (
        columns["effective_radius"] / nominal.nominal if nominal and "effective_radius" in columns else np.ones(count)
    )
    surface = share[:, None, None] * inputs.surface_speed
    wheel_part = share[:, None, None] * inputs.radius * inputs.wheel_acceleration - inputs.free
    gain, shift = centre_map(inputs)
    force = np.nan_to_num(inputs.normalised_force)
    out = np.empty((count, len(inputs.time)))
    state = np.zeros((count, 4, 2))
    start = share * float(held(mean_over(inputs.surface_speed))[0])
    velocity = start
    for k in range(len(inputs.time)):
        if k:
            u = wheel_part[:, k] - inputs.per_speed[k] * velocity[:, None]
            state = (F[:, k] @ state[..., None])[..., 0] + g[:, k] * u[..., None] + h[:, k] * force[k][:, None]
        corner = gain[k] * (surface[:, k] - state[..., 1]) + shift[k]
        axles = corner.reshape(count, 2, 2).mean(axis=2)
        out[:, k] = axles.mean(axis=1)
        velocity = np.where(np.isfinite(out[:, k]), out[:, k], velocity) if k else start
    return out


def _updates(
    subject: Subject, columns: Mapping[str, FloatArray], inputs: CornerInputs, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F (n, samples, 4, 2, 2), g and h (n, samples, 4, 2)."""
    (box,) = subject.plant.box
    speed = np.abs(inputs.wheel_speed).ravel()
    coast = ~np.isfinite(inputs.normalised_force).ravel() | ~((speed >= box.minimum) & (speed <= box.maximum))
    points = np.clip(np.nan_to_num(speed), box.minimum, box.maximum)
    whole = subject.at(columns, Grid((box.name,), (box.unit,), points[:, None]))
    M = whole.matrices
    L = np.where(coast[:, None, None], 0.0, whole.gain)
    closed = np.broadcast_to(M.A - L @ M.C, (count, len(points), 2, 2))
    S = subject.sample_time * planar_phi(subject.sample_time * closed)
    shape = (count, *inputs.wheel_speed.shape)
    F = np.eye(2) + S @ closed
    g, h = S @ (M.B - L @ M.D), S @ L
    return F.reshape(*shape, 2, 2), g.reshape(*shape, 2), np.broadcast_to(h, g.shape).reshape(*shape, 2)
