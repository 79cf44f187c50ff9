"""Hold a sweep against its baseline: what shrank beyond its tolerance, where, and what did it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from studies.sweeps.baseline import Baseline
from studies.sweeps.evaluate import evaluate
from studies.sweeps.measures import Measure
from studies.sweeps.observer import ROUNDING, Gains, Observer
from studies.sweeps.summary import UNPROVED, Statistic, Summary, number
from studies.sweeps.sweep import Sweep, nominal_of
from synthesis.errors import SpecError

SHRUNK, MOVED, GREW, SAME, MISSING = "shrunk", "moved", "grew", "same", "missing"
HEADINGS = ("subject", "measure", "statistic", "from", "to", "loss", "at", "what did it")
INDEX_TOLERANCE = 0.02  # of the whole variance, on top of both confidences


@dataclass(frozen=True)
class Change:
    """Something that is not as in the baseline: a constant (`name`, before and after), or the gains (name 'gains')."""

    name: str
    before: float
    after: float
    words: str


def changes(observer: Observer, before: Mapping[str, Any]) -> list[Change]:
    """What changed of an observer since the baseline was made."""
    now = nominal_of(observer)
    found = []
    for name, entry in before["constants"].items():
        if name not in now["constants"]:
            continue
        value, unit, after = entry["value"], entry["unit"], now["constants"][name]["value"]
        if abs(after - value) > ROUNDING * max(abs(after), abs(value)):
            percent = f" ({100.0 * (after / value - 1.0):+.3g} %)" if value else ""
            shown = "" if unit == "1" else f" {unit}"
            found.append(Change(name, value, after, f"{name} {value:.6g} -> {after:.6g}{shown}{percent}"))
    if not _same_gains(now, before):
        found.append(Change("gains", np.nan, np.nan, f"{observer.origin}: its gains changed"))
    return found


def _same_gains(now: Mapping[str, Any], before: Mapping[str, Any]) -> bool:
    pairs = [(np.asarray(now[key]), np.asarray(before[key])) for key in ("breakpoints", "gains")]
    return all(a.shape == b.shape and np.allclose(a, b, rtol=ROUNDING, atol=0.0) for a, b in pairs)


def attribute(sweep: Sweep, observer: Observer, measure: Measure, moved: Statistic, before: Mapping[str, Any]) -> str:
    """One sentence: what did most of the loss at the place of the statistic.

    The place is taken back to the baseline's values; then each change is made alone, and the one that costs most is named with
    its share of the loss of all changes together. Values that follow a nominal value (relative ranges, and what is not varied)
    are taken back in proportion, explicit ranges stay.
    """
    found = changes(observer, before)
    if not found:
        return "no constant and no gain changed: the code or its versions did"
    old_gains = Gains(np.asarray(before["gains"], float), np.asarray(before["breakpoints"], float))
    constants = [c for c in found if c.name != "gains"]
    ranges = {v.name: v for v in sweep.ranges[observer.name]}

    def value(name: str, since: set[str]) -> float:
        """A parameter at the statistic's place with only the changes in `since` made."""
        now = observer.parameters[name].nominal
        here = float(moved.at.get(name, now))
        change = next((c for c in constants if c.name == name), None)
        if change is None or name in since or (name in ranges and not ranges[name].relative and here != now):
            return here
        return here * change.before / change.after if change.after else change.before

    names = [n for n in observer.parameters if n in moved.at or n in {c.name for c in constants}]
    values = []
    for since in (set[str](), {c.name for c in found}, *({c.name} for c in found)):
        kept = "gains" in since or len(constants) == len(found)
        owner = observer if kept else replace(observer, gains=old_gains)
        columns = {name: np.array([value(name, since)]) for name in names or list(observer.parameters)[:1]}
        values.append(float(evaluate(owner, [measure], sweep.grid(owner), columns).worst[measure.name][0]))
    losses = [measure.loss(values[0], v) for v in values[1:]]
    worst = int(np.argmax(np.nan_to_num(losses[1:], nan=-np.inf)))
    words, alone, together = found[worst].words, losses[worst + 1], losses[0]
    if len(found) == 1 or alone == together:
        return words + " does it"
    share = alone / together if np.isfinite([alone, together]).all() and together > 0.0 else np.nan
    return words + (f" alone does {number(100.0 * share, 3)} % of it" if np.isfinite(share) else " does most of it")


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
