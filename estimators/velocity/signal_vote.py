"""Who is outvoted: witnesses of one number, which of them contradict which, and by whom a signal loses its weight.

Two witnesses contradict each other where they are further apart than both allowances, and agree where they are not; a live
reading is doubted only where they are further apart by the margin of a slide, too. **A signal is outvoted by a group of
others that agree with each other while each of them contradicts it**, unless a backer agrees with it. A reading that repeats
itself (frozen, zero, clipped at its limit) is outvoted by smaller groups, whoever backs it. The groups are data (`parity`).
"""

from __future__ import annotations

from typing import NamedTuple

from estimators.arithmetic import Arithmetic, Number
from estimators.velocity.parity import Groups, Relation

Pairs = dict[tuple[int, int], Number]


class Readings(NamedTuple):
    """By the witnesses of a relation, in its order."""

    level: tuple[Number, ...]
    allowed: tuple[Number, ...]  # by which each may be off
    known: tuple[Number, ...]  # who says anything


class Verdict(NamedTuple):
    """Of one signal; conditions."""

    wrong: Number  # outvoted
    contradicted: Number  # by one of its peers who is not outvoted
    supported: Number  # by one of its peers


def vote(
    kit: Arithmetic,
    relation: Relation,
    readings: Readings,
    stuck: tuple[Number, ...],
    plausible: tuple[Number, ...],
    seconded: tuple[Number, ...],
) -> tuple[tuple[Verdict, ...], Pairs]:
    """One verdict for each rule of the relation, in their order; and which two witnesses agree.

    Of each rule `stuck`: its signal repeats itself, `plausible`: its live reading may be doubted at all, `seconded`:
    it cannot be on any road, so that a group needs neither another witness to second it nor that margin.
    """
    no, never = kit.no, kit.full(False)
    against, agree, beyond = _pairs(kit, relation, readings)
    wrong: list[Number] = []
    out: dict[int, Number] = {}  # witnesses for which a signal is already found: no fault of another, and no voters

    def outvoted(me: int, groups: Groups, slides: Number, second: int | None, sure: Number) -> Number:
        found = never
        for group in groups:
            all_, far = kit.full(True), no(slides)
            for place, i in enumerate(group):
                all_ = all_ & against[me, i] & no(out.get(i, never))
                far = far | beyond[me, i]
                for k in group[:place]:
                    all_ = all_ & agree[i, k]
                if second is not None:
                    all_ = all_ & (agree[i, second] | sure)
            found = found | (all_ & far)
        return found

    for rule, repeats, open_, sure in zip(relation.rules, stuck, plausible, seconded, strict=True):
        me, backed = rule.witness, out.get(rule.witness, never)
        for friend in rule.backers:
            backed = backed | agree[me, friend]
        found = outvoted(me, rule.live, no(sure), rule.second, sure) & open_ & no(backed)
        found = readings.known[me] & (found | (repeats & outvoted(me, rule.repeating, never, None, never)))
        wrong.append(found)
        out[me] = out.get(me, never) | found
    verdicts = []
    for rule, found in zip(relation.rules, wrong, strict=True):
        contradicted = supported = never
        for peer in rule.peers:
            contradicted = contradicted | (against[rule.witness, peer] & no(out.get(peer, never)))
            supported = supported | agree[rule.witness, peer]
        verdicts.append(Verdict(found, contradicted, supported))
    return tuple(verdicts), agree


def _pairs(kit: Arithmetic, relation: Relation, readings: Readings) -> tuple[Pairs, Pairs, Pairs]:
    """Which two contradict each other, agree, and are further apart than a slide can bring them."""
    (level, allowed, known), (floor, share) = readings, relation.slide
    found: tuple[Pairs, Pairs, Pairs] = ({}, {}, {})
    for i in range(len(relation.witnesses)):
        for k in range(i):
            both, gap = known[i] & known[k], abs(level[i] - level[k]) - allowed[i] - allowed[k]
            slide = floor + share * kit.maximum(abs(level[i]), abs(level[k]))
            for pairs, holds in zip(found, (gap > 0.0, gap <= 0.0, gap > slide), strict=True):
                pairs[i, k] = pairs[k, i] = both & holds
    return found
