"""The matrix: signals at fault on every drive, through the default pipeline, and what its estimates do."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product

import numpy as np

from estimators.arrays import AnyArray, BoolArray, FloatArray
from estimators.faults import DRIVING
from estimators.forces import AttitudeObserver
from estimators.pipeline import Check, EstimationPipeline, VehicleSignals
from studies.beyond.fault_matrix.drives import FAULT, driven
from studies.beyond.fault_matrix.faults import DELAY, FAULTS, PAIRED, SEVERE, SIGNALS, Case
from studies.beyond.fault_matrix.observable import Healthy, healthy, shares
from studies.trials.estimation import TEST_CAR, assumed_car
from studies.truth import Measured, draw

BOUND, FLAG_TIME, RECOVERY, PATIENCE = 0.5, 0.2, 2.0, 1.0
"""m/s during the fault and from `RECOVERY` s after it on; s until a fault that matters is flagged; s beyond three deviations."""
_CHECKS = int(Check.FORCE_BALANCE | Check.LATERAL_BALANCE | Check.LOAD_SUM)
_TOGETHER = 800  # cars in one batch: 300 MB
_PLACES = {**SIGNALS, **PAIRED}


def cases() -> list[Case]:
    """One signal at fault, the first without any."""
    return [(), *(((signal, fault),) for signal in SIGNALS for fault in FAULTS)]


def double_cases() -> list[Case]:
    """Two signals at fault at once, each in every lasting way."""
    lasting = ("missing", "frozen", "zero", "negated")
    return [((one, a), (two, b)) for one, two in combinations(PAIRED, 2) for a, b in product(lasting, lasting)]


@dataclass(frozen=True)
class Cell:
    """Signals at fault on one drive: the worst of all sensor draws."""

    case: Case
    drive: str
    vx: float  # m/s, largest error of V_x during the fault
    vy: float
    vx_after: float  # from two seconds after it on
    vy_after: float
    beyond: float  # s, longest time beyond three deviations, V_x or V_y
    flagged: bool | None  # whether in time; None where no signal ever was far off for so long
    share: float  # where not: largest residual, per what is allowed, of a relation that the fault moves
    pitch: float  # rad, largest error of the body's pitch during the fault

    @property
    def signal(self) -> str:
        """Of several " and " between them."""
        return " and ".join(signal for signal, _ in self.case) or "none"

    @property
    def fault(self) -> str:
        """Likewise."""
        return " and ".join(fault for _, fault in self.case) or "none"

    @property
    def hidden(self) -> bool:
        """Whether it is not flagged, and no relation could show it."""
        return self.flagged is False and self.share <= 1.0

    def missed(self) -> str:
        """What it misses, by letter: x, y during the fault, r recovery, s deviations, f flag.

        A fault that no relation can show (`observable`) is not missed.
        """
        found = {"x": self.vx > BOUND, "y": self.vy > BOUND, "r": max(self.vx_after, self.vy_after) > BOUND}
        found |= {"s": self.beyond > PATIENCE, "f": self.flagged is False and not self.hidden}
        return "".join(letter for letter, holds in found.items() if holds)


def faulty(drawn: Measured, chosen: Sequence[Case]) -> tuple[dict[str, FloatArray], BoolArray]:
    """Signals (cases, seeds, drives, n[, 4]), and where (cases, seeds, drives, n) one at fault is far from its reading."""
    at, late = _samples(drawn), round(DELAY / drawn.sample_time)
    shape = (len(chosen), *drawn.batch_shape)
    signals = {
        name: np.broadcast_to(value, (len(chosen), *value.shape)).copy() for name, value in drawn.signals.items()
    }
    off = np.zeros((*shape, drawn.time.size), dtype=np.bool_)
    for k, case in enumerate(chosen):
        for signal, fault in case:
            name, wheels = signal.split()[0], _PLACES[signal]
            for place in np.ndindex(drawn.batch_shape):
                true, target = drawn.signals[name][place], signals[name][k][place]
                given = FAULTS[fault](true if wheels is None else true[:, wheels], at, late)
                target[at] = given if wheels is None else target[at]
                if wheels is not None:
                    target[at, wheels] = given
                gap = np.abs(target - true).reshape(drawn.time.size, -1)
                off[k][place] |= ~(gap <= SEVERE[name]).all(axis=1)  # NaN is far off
    return signals, off


def matrix(seeds: Sequence[int], chosen: Sequence[Case] | None = None) -> list[Cell]:
    """Every case on every drive, many in one batch."""
    chosen = cases() if chosen is None else chosen
    drawn = draw(driven(), TEST_CAR, seeds)
    most = max(1, _TOGETHER // math.prod(drawn.batch_shape))
    reference = cache(lambda: healthy(drawn))
    batches = (chosen[first : first + most] for first in range(0, len(chosen), most))
    return [cell for batch in batches for cell in _batch(drawn, batch, reference)]


def _batch(drawn: Measured, chosen: Sequence[Case], reference: Callable[[], Healthy]) -> list[Cell]:
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
    for k, case in enumerate(chosen):
        late, in_time = _late(off[k], flagged[k], round(FLAG_TIME / time))
        share = np.zeros(late.shape)
        if late.any():
            of = {name: value[k] for name, value in signals.items()}
            share = np.where(
                late, shares(reference(), of, {name: estimates[name][k] for name in ("roll", "pitch")}), 0.0
            )
        for b, drive in enumerate(truth.names):
            vx, vy, vx_after, vy_after = (float(e[k, :, b, part].max()) for part in (during, after) for e in errors)
            longest = max(_longest(row) for row in beyond[k, :, b]) * time
            pitch = float(tilt[k, :, b, during].max())
            found.append(
                Cell(case, drive, vx, vy, vx_after, vy_after, longest, in_time[b], float(share[:, b].max()), pitch)
            )
    return found


def _samples(drawn: Measured) -> slice:
    return slice(*(round(end / drawn.sample_time) for end in FAULT))


def _estimated(drawn: Measured, signals: dict[str, FloatArray], count: int) -> tuple[dict[str, FloatArray], BoolArray]:
    shape, time = (count, *drawn.batch_shape), drawn.sample_time
    pipeline = EstimationPipeline(assumed_car(drawn), time, shape, attitude=AttitudeObserver(time, shape))
    names = ("vx", "vy", "vx_deviation", "vy_deviation", "roll", "pitch")
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


def _late(off: BoolArray, flagged: BoolArray, samples: int) -> tuple[BoolArray, list[bool | None]]:
    """Of (seeds, drives, n): the samples in which a flag was due and did not come, and whether any was due, by drive.

    It is due within the samples from which a signal is far off without a break.
    """
    late, in_time = np.zeros_like(off), np.full(off.shape[:2], np.nan)
    for place in np.ndindex(off.shape[:2]):
        whole = np.flatnonzero(np.convolve(off[place], np.ones(samples))[: off.shape[-1]] >= samples)
        if whole.size:
            due = slice(whole[0] - samples + 1, whole[0] + 2)
            in_time[place] = flagged[place][due].any()
            late[place][due] = not in_time[place]
    return late, [None if np.isnan(of).all() else not (of == 0.0).any() for of in in_time.T]
