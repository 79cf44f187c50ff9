"""Who did it: the share of each changed constant, and of changed gains, in a statistic that moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from studies.sweeps.evaluate import evaluate
from studies.sweeps.measure import Measure
from studies.sweeps.observer import SAME, Gains, Observer
from studies.sweeps.statistics import Statistic, number
from studies.sweeps.sweep import Sweep, nominal_of


@dataclass(frozen=True)
class Change:
    """Something that is not as in the baseline: a constant (`name`, before and after, unit), or the gains (name 'gains')."""

    name: str
    before: float
    after: float
    unit: str
    words: str


def changes(observer: Observer, before: Mapping[str, Any]) -> list[Change]:
    """What changed of an observer since the baseline was made."""
    now = nominal_of(observer)
    found = []
    for name, entry in before["constants"].items():
        if name not in now["constants"]:
            continue
        value, unit, after = entry["value"], entry["unit"], now["constants"][name]["value"]
        if abs(after - value) > SAME * max(abs(after), abs(value)):
            percent = f" ({100.0 * (after / value - 1.0):+.3g} %)" if value else ""
            shown = "" if unit == "1" else f" {unit}"
            found.append(Change(name, value, after, unit, f"{name} {value:.6g} -> {after:.6g}{shown}{percent}"))
    if not _same_gains(now, before):
        found.append(Change("gains", np.nan, np.nan, "", f"{observer.origin}: its gains changed"))
    return found


def _same_gains(now: Mapping[str, Any], before: Mapping[str, Any]) -> bool:
    pairs = [(np.asarray(now[key]), np.asarray(before[key])) for key in ("breakpoints", "gains")]
    return all(a.shape == b.shape and np.allclose(a, b, rtol=SAME, atol=0.0) for a, b in pairs)


def attribute(
    sweep: Sweep, observer: Observer, measure: Measure, statistic: Statistic, before: Mapping[str, Any]
) -> str:
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
        here = float(statistic.at.get(name, now))
        change = next((c for c in constants if c.name == name), None)
        if change is None or name in since or (name in ranges and not ranges[name].relative and here != now):
            return here
        return here * change.before / change.after if change.after else change.before

    names = [n for n in observer.parameters if n in statistic.at or n in {c.name for c in constants}]
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
