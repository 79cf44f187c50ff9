"""Which faults of sensors can be told apart, and what the signal monitor reports: derived from its parity relations.

A residual is the difference of two witnesses of a relation (`parity`). It responds to a set of faults unless the same of them
move both witnesses. The residuals that respond are the signature of the set: sets with the same one cannot be told apart by
any rule, whatever their sizes. What is reported is the outcome of the votes of the monitor on that signature (Frank (1990),
Gertler (1998)).
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import NamedTuple

from estimators.arithmetic import arithmetic
from estimators.velocity.parity import CONDITIONS, RELATIONS, SIDE, TURN, UNLEVELLED, Relation, Witness
from estimators.velocity.signal_vote import Readings, vote

Residual = tuple[str, str, str]
"""The relation, and its two witnesses."""
SIGNALS = tuple(
    dict.fromkeys(s for r in RELATIONS for w in r.witnesses for s in sorted(w.made_of) if s not in CONDITIONS)
)
"""What the relations are made of."""


class Faults(NamedTuple):
    """A set of signals at fault."""

    signals: tuple[str, ...]
    signature: frozenset[Residual]
    alike: tuple[tuple[str, ...], ...]  # other sets of no more signals, and conditions, that have the same signature
    live: tuple[str, ...]  # signals that are reported where the readings at fault are live
    small: tuple[str, ...]  # of these, those that are reported where the readings are too small, too
    repeating: tuple[str, ...]  # signals that are reported where the readings at fault repeat themselves


def signature(faults: Iterable[str], levelled: bool = True) -> frozenset[Residual]:
    """Residuals that respond; `levelled`: an attitude part is there."""
    found, bad = set(), frozenset(faults)
    for relation in RELATIONS:
        moved = [(witness.name, _moved_by(witness, bad)) for witness in _witnesses(relation, levelled)]
        found |= {(relation.name, one, two) for (one, a), (two, b) in combinations(moved, 2) if a != b}
    return frozenset(found)


def isolability(most: int = 2, levelled: bool = True) -> tuple[Faults, ...]:
    """All sets of up to `most` signals at fault."""
    usable = [signal for signal in SIGNALS if signature([signal], levelled)]
    sets = [group for size in range(1, most + 1) for group in combinations(usable, size)]
    seen = {group: signature(group, levelled) for group in [*sets, *((condition,) for condition in CONDITIONS)]}
    found = []
    for group in sets:
        alike = [one for one, own in seen.items() if one != group and len(one) <= len(group) and own == seen[group]]
        reports = (_reported(group, levelled, *how) for how in ((False, True), (False, False), (True, True)))
        found.append(Faults(group, seen[group], tuple(alike), *reports))
    return tuple(found)


def table(levelled: bool = True, most: int = 1) -> str:
    """The sets of `most` signals as a table in Markdown."""
    rows = ["| at fault | looks like | reported, live | reported, repeating |", "|---|---|---|---|"]
    for faults in isolability(most, levelled):
        if len(faults.signals) == most:
            live = [name if name in faults.small else f"{name} (unless too small)" for name in faults.live]
            cells = [" and ".join(faults.signals), ", ".join(" and ".join(group) for group in faults.alike)]
            cells += [", ".join(names) for names in (live, faults.repeating)]
            rows.append("| " + " | ".join(cell or "-" for cell in cells) + " |")
    return "\n".join(rows)


def _witnesses(relation: Relation, levelled: bool) -> tuple[Witness, ...]:
    """Without an attitude part a_x and a_y are what they read, and there is no second a_y."""
    if levelled:
        return relation.witnesses
    if relation is not TURN:
        return tuple(witness._replace(made_of=witness.made_of - {"pitch"}) for witness in relation.witnesses)
    plain = relation.witnesses[UNLEVELLED]._replace(name=relation.witnesses[SIDE].name)
    return (*relation.witnesses[:SIDE], plain, *relation.witnesses[SIDE + 1 : UNLEVELLED])


def _moved_by(witness: Witness, bad: frozenset[str]) -> frozenset[str]:
    both = witness.made_of & bad
    return both if both & CONDITIONS.keys() or len(both) >= witness.least else frozenset()


def _reported(group: tuple[str, ...], levelled: bool, repeating: bool, large: bool) -> tuple[str, ...]:
    """What the votes find where faults are large and no sum of some is a sum of others."""
    size = {name: 10.0 * 3.0**place for place, name in enumerate(SIGNALS)}
    found = []
    for relation in RELATIONS:
        witnesses = _witnesses(relation, levelled)
        level = [sum(size[name] for name in _moved_by(witness, frozenset(group))) for witness in witnesses]
        blank = [0.0] * (len(relation.witnesses) - len(level))
        stuck = tuple(repeating and rule.signal in group for rule in relation.rules)
        plausible = tuple(large or not rule.one_sided for rule in relation.rules)
        impossible = tuple(large and rule.one_sided and rule.signal in group for rule in relation.rules)
        readings = Readings(
            (*level, *blank), (0.1,) * len(relation.witnesses), (True,) * len(level) + (False,) * len(blank)
        )
        verdicts, _ = vote(arithmetic(()), relation, readings, stuck, plausible, impossible)
        found += [rule.signal for rule, verdict in zip(relation.rules, verdicts, strict=True) if verdict.wrong]
    return tuple(found)
