"""Hold a sweep against its baseline: what shrank beyond its tolerance, where, and what did it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from studies.sweeps.attribution import blame
from studies.sweeps.baseline import Baseline
from studies.sweeps.figures import UNPROVED, Figure, Summary, number
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError

SHRUNK, MOVED, GREW, SAME, MISSING = "shrunk", "moved", "grew", "same", "missing"
INDEX_TOLERANCE = 0.02  # of the whole variance, on top of both confidences


@dataclass(frozen=True)
class Judged:
    """One figure beside the baseline. `loss` is the share of its distance to worthlessness that it lost (won: negative).

    `shrunk` and `missing` break the build; a Sobol index that `moved` beyond its confidence is told, and breaks nothing.
    """

    before: Figure
    after: Figure | None
    state: str
    loss: float
    tolerance: float
    cause: str = ""

    @property
    def good(self) -> bool:
        """Whether the build may go on."""
        return self.state not in (SHRUNK, MISSING)

    @property
    def line(self) -> str:
        """One line that stands alone."""
        f, now = self.before, self.after
        head = f"{f.subject}: {f.measure or 'designs'}, {f.name}"
        if now is None:
            return f"{head}: was {number(f.value)}, is not made any more"
        unit = "" if f.unit == "1" else f" {f.unit}"
        at = ", ".join(f"{name} = {number(v, 5)}" for name, v in now.at.items())
        place = f" at {at}" if at else ""
        lost = f" (loss {loss_text(self.loss)}, tolerance {100.0 * self.tolerance:g} %)" if f.kind == "value" else ""
        cause = f"; {self.cause}" if self.cause else ""
        return f"{head}: {number(f.value)} -> {number(now.value)}{unit}{lost}{place}{cause}"


def loss_text(loss: float) -> str:
    """A loss in per cent."""
    return f"{100.0 * loss:.3g} %" if math.isfinite(loss) else "all of it"


def comparable(sweep: Sweep, baseline: Baseline) -> None:
    """Raises SpecError if the baseline is of another sweep, or of another definition of it."""
    if (baseline.summary.sweep, baseline.summary.form) != (sweep.name, sweep.form):
        raise SpecError(
            f"the baseline is of sweep '{baseline.summary.sweep}' ({baseline.summary.form}), not of '{sweep.name}' "
            f"({sweep.form})"
        )
    if baseline.sha256 != sweep.digest:
        raise SpecError(
            f"the baseline was made from another definition of sweep '{sweep.name}' (designs, ranges, grid, measures, sample "
            "times); figures cannot be compared: review the change and use --update-baseline"
        )


def judge(sweep: Sweep, summary: Summary, baseline: Baseline) -> list[Judged]:
    """Every figure of the baseline. Raises SpecError as `comparable`."""
    comparable(sweep, baseline)
    now = {figure.key: figure for figure in summary.figures}
    return [_judged(sweep, before, now.get(before.key), baseline) for before in baseline.summary.figures]


def _judged(sweep: Sweep, before: Figure, after: Figure | None, baseline: Baseline) -> Judged:
    if after is None:
        return Judged(before, None, MISSING, math.inf, 0.0)
    subject = next(s for s in sweep.subjects if s.name == before.subject)
    if before.kind == "index":
        room = (before.confidence or 0.0) + (after.confidence or 0.0) + INDEX_TOLERANCE
        state = MOVED if not abs(after.value - before.value) <= room else SAME
        return Judged(before, after, state, 0.0, room)
    if before.kind == "count":
        change = after.value - before.value
        state = SAME if change == 0 or before.name == "designs" else SHRUNK if change > 0 else GREW
        cause = "; ".join(subject.unproved()) if before.name == UNPROVED and state == SHRUNK else ""
        return Judged(before, after, state, 0.0, 0.0, cause)
    measure = next(m for m in sweep.measures if m.name == before.measure)
    tolerance = sweep.tolerances.get(measure.name, sweep.tolerance)
    loss = measure.loss(before.value, after.value)
    if loss <= tolerance:
        return Judged(before, after, GREW if loss < -tolerance else SAME, loss, tolerance)
    cause = blame(sweep, subject, measure, after, baseline.nominal[before.subject])
    return Judged(before, after, SHRUNK, loss, tolerance, cause)
