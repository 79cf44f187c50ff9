"""The level of a norm, or the decay rate, that a Lyapunov function of a given degree proves."""

from __future__ import annotations

import numpy as np

from analysis.lpv.question import Question
from synthesis.certificate.claims import Claim
from synthesis.certificate.rounding import round_down, round_up
from synthesis.certificate.search import Search, Wish

GRIDS = {0: (2,), 1: (5, 9, 17, 33), 2: (5, 9, 15), 3: (5, 7)}  # points along every parameter that the solver sees
TIGHTER = (1e-2, 1e-3)  # times the least level, what buys the margin of a proof: the first that holds, then less
WIDER = (5e-2, 0.2)
NOTHING, SMALL = 1e-9, (1e-4, 1e-2, 1.0)  # against |C| |B| / |A|
SHARES = (0.999, 0.99, 0.97, 0.9, 0.7)  # of the largest decay rate that the solver sees
ENOUGH = 0.98  # of it: then more points are not tried
BISECTIONS = 12
MARGIN = 1e-8  # of the solver, below which nothing is read into a sign
DIGITS, REGIONS, LEVEL_DIGITS = 15, 4000, 6


def proved_norm(question: Question, kind: str, degree: int | tuple[int, ...], size: float) -> Claim | None:
    """The claim with the least level that is proved; `size` is a guess of it. None if no P of the degree was found.

    A norm of zero has no least level: then one is proved that is small against what inputs and outputs could do.
    """
    grids, channel = GRIDS.get(len(question.axes), (3,)), question.channel
    natural = _natural(question)
    if size <= NOTHING * natural:
        search = _search(question, degree, grids[-1], natural)
        tried = (search.prove(Wish(kind, round_up(share * natural, 3), channel))[0] for share in SMALL)
        return next((claim for claim in tried if claim is not None), None)
    for points in grids:
        search = _search(question, degree, points, size)
        least = search.least_gain(Wish(kind, None, channel))
        if not np.isfinite(least):
            continue
        best: Claim | None = None
        # While the solver sees few points it is more points that help; the last time it is room.
        for room in (*TIGHTER, *(WIDER if points == grids[-1] else ())):
            if best is not None and room > TIGHTER[0]:
                break
            claim, _ = search.prove(Wish(kind, round_up(least * (1.0 + room), LEVEL_DIGITS), channel))
            if claim is None and best is not None:
                break
            best = claim or best
        if best is not None:
            return best
    return None


def _natural(question: Question) -> float:
    """|C| |B| / |A| in the middle of the range: of the size of a gain to which no path is closed."""
    A, B, C, D = question.frozen(np.zeros((1, len(question.axes))))
    sizes = [float(np.linalg.norm(x)) for x in (A, B, C, D)]
    return max(sizes[1] * sizes[2] / (1.0 if question.discrete or not sizes[0] else sizes[0]) + sizes[3], 1e-30)


def proved_decay(question: Question, degree: int | tuple[int, ...], most: float) -> Claim | None:
    """The claim with the largest decay rate up to `most`, that of the worst trajectory known, that is proved."""
    kind = "sampled error" if question.discrete else "decay rate"
    best: Claim | None = None
    for points in GRIDS.get(len(question.axes), (3,)):
        search = _search(question, degree, points, None)
        low, high = 0.0, most
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            good = search.largest_margin(Wish(kind, middle)) > MARGIN * min(1.0, most)
            low, high = (middle, high) if good else (low, middle)
        floor = 0.0 if best is None else best.level
        for share in SHARES:
            if share * low <= floor:
                break
            claim, _ = search.prove(Wish(kind, round_down(share * low, LEVEL_DIGITS)))
            if claim is not None:
                best = claim
                break
        if best is not None and best.level >= ENOUGH * low:
            break
    return best


def _search(question: Question, degree: int | tuple[int, ...], points: int, size: float | None) -> Search:
    return Search(
        question.loop, question.names, question.model.parameters, degree,
        points=points, size=size, digits=DIGITS, most_regions=REGIONS,
    )  # fmt: skip
