"""A drive replayed by the corner observers of many designs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.planar_exponential import planar_phi
from estimators.arrays import BoolArray, FloatArray
from studies.drives.corner_inputs import held
from studies.drives.drive_file import read_drive
from studies.drives.log import read_log
from studies.drives.prepare import CornerInputs, corner_inputs_of
from studies.drives.replay import centre_weights, march
from studies.sweeps.observer import Batch, Observer
from studies.sweeps.plant import Grid
from studies.trials.accuracy import nrms as nrms_of_runs
from synthesis.errors import SpecError

POINTS = 500_000  # designs x corners x samples whose update matrices are held at once


@dataclass(frozen=True)
class Recorded:
    """A drive ready to be replayed: inputs of the corner observers, and the reference V_x (n,)."""

    inputs: CornerInputs
    reference: FloatArray
    sample_time: float

    @property
    def known(self) -> BoolArray:
        """Samples (n,) that count: with a reference, and with a wheel that has a speed."""
        return np.isfinite(self.reference) & np.isfinite(centre_weights(self.inputs)).all(axis=1)


def read_recorded(drive: Path, logs: Sequence[Path]) -> Recorded:
    """A drive file and its logs. Raises SpecError or LogError, one line."""
    description = read_drive(drive)
    log = read_log(logs, description)
    if "vx" not in log.reference:
        raise SpecError(f"{drive.name}: estimator_nrms needs [reference] vx, the true velocity in the log")
    found = Recorded(corner_inputs_of(log, description), log.reference["vx"], description.sample_time)
    if not np.abs(found.reference[found.known]).max(initial=0.0) > 0.0:
        raise SpecError(f"{drive.name}: the reference vx is 0 m/s or missing at every sample with a wheel speed")
    return found


def nrms(drive: Recorded, batch: Batch) -> FloatArray:
    """NRMS of V_x in % (n,), P1 (46): RMS error over the largest magnitude of the reference; infinite where it diverges."""
    step = max(1, POINTS // drive.inputs.wheel_speed.size)
    velocity = np.concatenate([replay_batch(batch, drive, slice(i, i + step)) for i in range(0, batch.count, step)])
    found = nrms_of_runs(velocity[:, drive.known], drive.reference[drive.known])
    return np.where(np.isfinite(found), found, np.inf)


def replay_batch(batch: Batch, drive: Recorded, part: slice) -> FloatArray:
    """V_x (n, samples) of some designs: `march` with one observer for each design and corner.

    x+ = F x + g u + h y, the exact update: F = I + S (A - L C), g = S (B - L D), h = S L, S = T phi(T (A - L C)) where y is
    held; F = I + S A - K C, g = S B - K D, h = K, S = T phi(T A) where the gains correct once a sample.
    A missing u is held at its last value, as at run time.
    """
    inputs = drive.inputs
    columns = {name: column[part] for name, column in batch.columns.items()}
    count = len(next(iter(columns.values())))
    nominal, radii = batch.observer.plant.parameters.get("effective_radius"), columns.get("effective_radius")
    share = np.ones(count) if nominal is None or radii is None else radii / nominal.nominal  # over the nominal radius
    F, g, pull = _updates(batch.observer, columns, inputs, count)
    there = np.isfinite(inputs.radius * inputs.wheel_acceleration - inputs.free - inputs.per_speed)
    z, u = np.zeros((2, count, 4))

    def observe(k: int, new: FloatArray, v: FloatArray) -> FloatArray:
        nonlocal z, u
        u = np.where(there[k], new, u)
        z, v = (
            F[0, 0, k] * z + F[0, 1, k] * v + g[0, k] * u + pull[0, k],
            F[1, 0, k] * z + F[1, 1, k] * v + g[1, k] * u + pull[1, k],
        )
        return v

    return march(inputs, observe, share)[0].T


def _updates(
    observer: Observer, columns: Mapping[str, FloatArray], inputs: CornerInputs, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F (2, 2, samples, n, 4), g and h y (2, samples, n, 4).

    Without a force the observer coasts, L = 0; a missing wheel speed is held, one outside the range of the schedule is clipped.
    """
    (box,) = observer.plant.box
    force = inputs.normalised_force.ravel()
    speed = np.abs(np.stack([held(wheel) for wheel in inputs.wheel_speed.T], axis=1).ravel())
    points = np.clip(speed, box.minimum, box.maximum)
    whole = observer.at(columns, Grid((box.name,), (box.unit,), points[:, None]))
    M = whole.matrices
    L = np.where(np.isfinite(force)[:, None, None], whole.gain, 0.0)
    sampled = observer.update == "sampled"
    closed = np.broadcast_to(M.A if sampled else M.A - L @ M.C, (count, len(points), 2, 2))
    S = observer.sample_time * planar_phi(observer.sample_time * closed)
    jump = L if sampled else S @ L  # what the innovation moves, beside what it changes of F
    F = np.eye(2) + S @ closed - (L @ M.C if sampled else 0.0)
    g, pull = S @ M.B - jump @ M.D, jump * np.nan_to_num(force)[:, None, None]
    corners = (count, *inputs.wheel_speed.shape)
    return (
        np.ascontiguousarray(F.reshape(*corners, 2, 2).transpose(3, 4, 1, 0, 2)),
        np.ascontiguousarray(g.reshape(*corners, 2).transpose(3, 1, 0, 2)),
        np.ascontiguousarray(pull.reshape(*corners, 2).transpose(3, 1, 0, 2)),
    )
