"""Hold a sweep against its baseline: what shrank beyond its tolerance, where, and what did it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from studies.sweeps.attribution import attribute
from studies.sweeps.baseline import Baseline
from studies.sweeps.statistics import UNPROVED, Statistic, Summary, number
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError

SHRUNK, MOVED, GREW, SAME, MISSING = "shrunk", "moved", "grew", "same", "missing"
HEADINGS = ("subject", "measure", "statistic", "from", "to", "loss", "at", "what did it")
INDEX_TOLERANCE = 0.02  # of the whole variance, on top of both confidences


@dataclass(frozen=True)
class Comparison:
    """One statistic beside the baseline. `loss` is the share of its distance to worthlessness that it lost (won: negative).

    `shrunk` and `missing` break the build; a Sobol index that `moved` beyond its confidence is reported, and breaks nothing.
    """

    before: Statistic
    after: Statistic | None
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
        head = f"{f.observer}: {f.measure or 'designs'}, {f.name}"
        if now is None:
            return f"{head}: was {number(f.value)}, is not made any more"
        unit = "" if f.unit == "1" else f" {f.unit}"
        place = f" at {now.where(5)}" if now.at else ""
        lost = f" (loss {loss_text(self.loss)}, tolerance {100.0 * self.tolerance:g} %)" if f.kind == "value" else ""
        cause = f"; {self.cause}" if self.cause else ""
        return f"{head}: {number(f.value)} -> {number(now.value)}{unit}{lost}{place}{cause}"

    @property
    def cells(self) -> tuple[str, ...]:
        """What stands below `HEADINGS` in a table."""
        f, now = self.before, self.after
        after, at = ("gone", "") if now is None else (number(now.value), now.where())
        lost = loss_text(self.loss) if f.kind == "value" else ""
        return f.observer, f.measure, f.name, number(f.value), after, lost, at, self.cause


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
            "times); statistics cannot be compared: review the change and use --update-baseline"
        )


def compare(sweep: Sweep, summary: Summary, baseline: Baseline) -> list[Comparison]:
    """Every statistic of the baseline. Raises SpecError as `comparable`."""
    comparable(sweep, baseline)
    now = {statistic.key: statistic for statistic in summary.statistics}
    return [_compared(sweep, before, now.get(before.key), baseline) for before in baseline.summary.statistics]


def _compared(sweep: Sweep, before: Statistic, after: Statistic | None, baseline: Baseline) -> Comparison:
    if after is None:
        return Comparison(before, None, MISSING, math.inf, 0.0)
    observer = next(s for s in sweep.observers if s.name == before.observer)
    if before.kind == "index":
        room = (before.confidence or 0.0) + (after.confidence or 0.0) + INDEX_TOLERANCE
        state = MOVED if not abs(after.value - before.value) <= room else SAME
        return Comparison(before, after, state, 0.0, room)
    if before.kind == "count":
        change = after.value - before.value
        state = SAME if change == 0 or before.name == "designs" else SHRUNK if change > 0 else GREW
        cause = "; ".join(observer.unproved()) if before.name == UNPROVED and state == SHRUNK else ""
        return Comparison(before, after, state, 0.0, 0.0, cause)
    measure = next(m for m in sweep.measures if m.name == before.measure)
    tolerance = sweep.tolerances.get(measure.name, sweep.tolerance)
    loss = measure.loss(before.value, after.value)
    if loss <= tolerance:
        return Comparison(before, after, GREW if loss < -tolerance else SAME, loss, tolerance)
    cause = attribute(sweep, observer, measure, after, baseline.nominal[before.observer])
    return Comparison(before, after, SHRUNK, loss, tolerance, cause)
