"""Which claims a deployed table gets, and the best level of each that is proved.

Levels come from the solver or from frozen parameters and are taken a little worse, until the proof holds: what is claimed is what
was proved, with the digits that are written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from synthesis.certificate.claims import LARGER_IS_BETTER, UPDATE_OF, Claim, ClaimChannel
from synthesis.certificate.frozen import critical_probability, frozen_pole_level, slowest_decay
from synthesis.certificate.rounding import round_down, round_up, significant
from synthesis.certificate.search import Search, Wish

SHARES = (0.99, 0.97, 0.94, 0.9, 0.8, 0.6, 0.4, 0.2, 0.1)  # of what frozen parameters allow
MOST_PAIRS = 4  # of a state that moves and an error, each with a claim of its own
WIDER = (1.01, 1.03, 1.1, 1.3, 2.0)  # than the frozen poles of the update
SETTLE = (1.0, 2.0, 5.0, 20.0)  # times the wanted distance from the least gain


def sampled(wish: Wish) -> Wish:
    """The same wish, of the update over a sample in the place of the error equation."""
    return replace(wish, kind=f"sampled {wish.kind}")


def held_claims(
    search: Search,
    levels: Sequence[Wish],
    decay_rate: float,
    fastest_pole: float | None,
    settle: float,
    regions: Mapping[str, float] = MappingProxyType({}),
) -> tuple[Claim, ...] | None:
    """Claims of the error equation and of its update with held measurements; None if a wanted one cannot be had.

    `levels` are wishes of the error equation without a level, one for each channel of the design: its gain or another norm.
    `regions` are kinds of claims about frozen poles with their levels.
    """
    wanted = [Wish("decay rate", decay_rate)] if decay_rate else []
    wanted += [] if fastest_pole is None else [Wish("fastest pole", fastest_pole)]
    wanted += [Wish(kind, level) for kind, level in regions.items() if kind != "fastest pole" or level != fastest_pole]
    found = [search.prove(wish)[0] for wish in wanted]
    found += [best_gain(search, wish, settle) for wish in levels]
    return _with_update(search, levels, found, settle)


def sampled_claims(
    search: Search, levels: Sequence[Wish], settle: float, regions: Sequence[Wish] = ()
) -> tuple[Claim, ...] | None:
    """Claims of the update that corrects once a sample; `regions` are wishes about its poles."""
    return _with_update(search, levels, [search.prove(wish)[0] for wish in regions], settle)


def feedback_claims(
    search: Search, levels: Sequence[Wish], settle: float, regions: Sequence[Wish] = (), widened: bool = False
) -> tuple[Claim, ...] | None:
    """Claims of a feedback law that runs once a sample: decay and the level of every channel; None if one cannot be had.

    `regions` are wishes about the update's poles: as they were asked for, or (`widened`) as wide as sampling makes them.
    """
    found = [largest(search, UPDATE_OF["feedback"], slowest_decay(search.loop))]
    found += [_widened(search, wish) if widened else search.prove(wish)[0] for wish in regions]
    found += [best_gain(search, sampled(wish), settle) for wish in levels]
    return None if any(claim is None for claim in found) else tuple(claim for claim in found if claim is not None)


def _with_update(
    search: Search, levels: Sequence[Wish], found: list[Claim | None], settle: float
) -> tuple[Claim, ...] | None:
    """What the runtime's update gets beside: only the claims about drops and motion may be missing."""
    update = "held" if search.loop.time == "continuous" else "sampled"
    found += [largest(search, UPDATE_OF[update], slowest_decay(search.loop))]
    found += [best_gain(search, sampled(wish), settle) for wish in levels]
    if any(claim is None for claim in found):
        return None
    extra: list[Claim | None] = []
    if update == "held":
        extra += [
            best_gain(search, Wish("motion gain", None, channel), settle)
            for channel in motion_channels(search, [wish.channel for wish in levels if wish.channel is not None])
        ]
    extra += [largest(search, "drop probability", critical_probability(search.loop))]
    return tuple(claim for claim in (*found, *extra) if claim is not None)


def _widened(search: Search, wish: Wish) -> Claim | None:
    """A claim about frozen poles at the wanted level, or at the first above the frozen one that is proved."""
    frozen, larger = frozen_pole_level(search.loop, wish.kind), wish.kind in LARGER_IS_BETTER
    beyond = (frozen / x if larger else frozen * x for x in WIDER)
    tried = [wish.level, *(round_down(x, 3) if larger else round_up(x, 3) for x in beyond if 0.0 < x < np.inf)]
    proved = (search.prove(replace(wish, level=x))[0] for x in tried)
    return next((claim for claim in proved if claim is not None), None)


def motion_channels(search: Search, channels: Sequence[ClaimChannel]) -> list[ClaimChannel]:
    """From every state's motion to every error of the channels; with many of them from all states together, each in its size."""
    states, errors = search.names.states, tuple(dict.fromkeys(name for channel in channels for name in channel.errors))
    if len(states) * len(errors) <= MOST_PAIRS:
        return [ClaimChannel({state: 1.0}, (error,)) for error in errors for state in states]
    sizes = {state: significant(1.0 / scale, 1.0 / scale, 1) for state, scale in zip(states, search.scale, strict=True)}
    return [ClaimChannel(sizes, errors)]


def best_gain(search: Search, wish: Wish, settle: float) -> Claim | None:
    """The least gain of the solver, loosened by `settle` (which buys margin for the proof) or a few times that."""
    least = search.least_gain(wish)
    if not np.isfinite(least):
        return None
    tried = (
        search.prove(Wish(wish.kind, round_up(least * (1.0 + settle * times)), wish.channel))[0] for times in SETTLE
    )
    return next((claim for claim in tried if claim is not None), None)


def largest(search: Search, kind: str, limit: float) -> Claim | None:
    """The largest proved level among some shares of what holds while the parameters stand still."""
    if not limit > 0.0:
        return None
    tried = (search.prove(Wish(kind, round_down(share * limit, 3)))[0] for share in SHARES)
    return next((claim for claim in tried if claim is not None), None)
