"""The matrix: every signal at fault in every way on every drive, through the default pipeline, and what its estimates do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimators.arrays import AnyArray, BoolArray, FloatArray
from estimators.faults import DRIVING
from estimators.forces import AttitudeObserver
from estimators.pipeline import Check, EstimationPipeline, VehicleSignals
from studies.beyond.fault_matrix.drives import FAULT, driven
from studies.beyond.fault_matrix.faults import DELAY, FAULTS, SEVERE, SIGNALS
from studies.trials.estimation import TEST_CAR, assumed_car
from studies.truth import Measured, draw

BOUND, FLAG_TIME, RECOVERY, PATIENCE = 0.5, 0.2, 2.0, 1.0
"""m/s during the fault and from `RECOVERY` s after it on; s until a fault that matters is flagged; s beyond three deviations."""
_CHECKS = int(Check.FORCE_BALANCE | Check.LATERAL_BALANCE | Check.LOAD_SUM)
Case = tuple[str, str]


def cases() -> list[Case]:
    """(signal, fault), the first without any."""
    return [("none", "none"), *((signal, fault) for signal in SIGNALS for fault in FAULTS)]


@dataclass(frozen=True)
class Cell:
    """One signal with one fault on one drive: the worst of all sensor draws."""

    signal: str
    fault: str
    drive: str
    vx: float  # m/s, largest error of V_x during the fault
    vy: float
    vx_after: float  # from two seconds after it on
    vy_after: float
    beyond: float  # s, longest time beyond three deviations, V_x or V_y
    flagged: bool | None  # whether in time; None where the signal never was far off for so long
    pitch: float  # rad, largest error of the body's pitch during the fault

    def missed(self) -> str:
        """What it misses, by letter: x, y during the fault, r recovery, s deviations, f flag."""
        found = {"x": self.vx > BOUND, "y": self.vy > BOUND, "r": max(self.vx_after, self.vy_after) > BOUND}
        found |= {"s": self.beyond > PATIENCE, "f": self.flagged is False}
        return "".join(letter for letter, holds in found.items() if holds)


def faulty(drawn: Measured, chosen: Sequence[Case]) -> tuple[dict[str, FloatArray], BoolArray]:
    """Signals (cases, seeds, drives, n[, 4]), and where (cases, seeds, drives, n) the one at fault is far from its reading."""
    at, late = _samples(drawn), round(DELAY / drawn.sample_time)
    shape = (len(chosen), *drawn.batch_shape)
    signals = {
        name: np.broadcast_to(value, (len(chosen), *value.shape)).copy() for name, value in drawn.signals.items()
    }
    off = np.zeros((*shape, drawn.time.size), dtype=np.bool_)
    for k, (signal, fault) in enumerate(chosen):
        if signal == "none":
            continue
        name, wheel = signal.split()[0], SIGNALS[signal]
        for place in np.ndindex(drawn.batch_shape):
            true = drawn.signals[name][place]
            channel = true if wheel is None else true[:, wheel]
            target = signals[name][k][place]
            (target if wheel is None else target[:, wheel])[at] = FAULTS[fault](channel, at, late)
            gap = np.abs(target - true).reshape(drawn.time.size, -1)
            off[k][place] = ~(gap <= SEVERE[name]).all(axis=1)  # NaN is far off
    return signals, off


def matrix(seeds: int, chosen: Sequence[Case] | None = None) -> list[Cell]:
    """Every case on every drive, all in one batch."""
    chosen = cases() if chosen is None else chosen
    drawn = draw(driven(), TEST_CAR, range(seeds))
    signals, off = faulty(drawn, chosen)
    estimates, flagged = _estimated(drawn, signals, len(chosen))
    time, truth = drawn.sample_time, drawn.truth
    errors = [np.abs(estimates[name] - truth[name]) for name in ("vx", "vy")]
    tilt = np.abs(estimates["pitch"] - truth["pitch"])
    deviations = (estimates["vx_deviation"], estimates["vy_deviation"])
    beyond = np.any([error > 3.0 * spread for error, spread in zip(errors, deviations, strict=True)], axis=0)
    during = _samples(drawn)
    after = slice(during.stop + round(RECOVERY / time), None)
    found = []
    for k, (signal, fault) in enumerate(chosen):
        for b, drive in enumerate(truth.names):
            vx, vy, vx_after, vy_after = (float(e[k, :, b, part].max()) for part in (during, after) for e in errors)
            longest = max(_longest(row) for row in beyond[k, :, b]) * time
            in_time = _flagged_in_time(off[k, :, b], flagged[k, :, b], round(FLAG_TIME / time))
            pitch = float(tilt[k, :, b, during].max())
            found.append(Cell(signal, fault, drive, vx, vy, vx_after, vy_after, longest, in_time, pitch))
    return found


def _samples(drawn: Measured) -> slice:
    return slice(*(round(end / drawn.sample_time) for end in FAULT))


def _estimated(drawn: Measured, signals: dict[str, FloatArray], count: int) -> tuple[dict[str, FloatArray], BoolArray]:
    shape, time = (count, *drawn.batch_shape), drawn.sample_time
    pipeline = EstimationPipeline(assumed_car(drawn), time, shape, attitude=AttitudeObserver(time, shape))
    names = ("vx", "vy", "vx_deviation", "vy_deviation", "pitch")
    rows: dict[str, list[FloatArray]] = {name: [] for name in names}
    flagged: list[AnyArray] = []
    for k in range(drawn.time.size):
        step = pipeline.step(VehicleSignals(**{name: value[:, :, :, k] for name, value in signals.items()}))
        for name in names:
            rows[name].append(getattr(step, name))
        sums = (step.flags & ~int(DRIVING)) | (step.consistency.failed & _CHECKS)
        flagged.append((sums != 0) | (step.wheel_flags != 0).any(axis=-1))
    return {name: np.stack(row, axis=-1) for name, row in rows.items()}, np.stack(flagged, axis=-1)


def _longest(condition: BoolArray) -> int:
    """Samples in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], condition, [False]]).astype(np.int8)))
    return int(np.diff(edges)[::2].max(initial=0))


def _flagged_in_time(off: BoolArray, flagged: BoolArray, samples: int) -> bool | None:
    """Whether every draw (seeds, n) is flagged within the samples from which its signal is far off without a break."""
    verdicts = []
    for far, flags in zip(off, flagged, strict=True):
        whole = np.flatnonzero(np.convolve(far, np.ones(samples))[: far.size] >= samples)
        if whole.size:
            verdicts.append(bool(flags[whole[0] - samples + 1 : whole[0] + 2].any()))
    return all(verdicts) if verdicts else None
