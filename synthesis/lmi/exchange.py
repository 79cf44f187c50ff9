r"""Exchange: solve on a few places, look where the answer fails, add those places, solve again.

Of the many places of a grid (20 x 20 parameter values with 4 rate vertices are 1600) only a handful ever decide. Places that
are not solved for are only looked at: for known decisions that is one evaluation and the least eigenvalue. Where it is locally
least it is followed to its minimum between the places of the grid: with all local minima solved for, exchange converges like
Newton's method (Hettich and Kortanek 1993); with places of a grid alone it stalls in the valleys between them. What then holds
is proved on the continuum, and a place where that proof fails joins the others. Every problem that is solved on the way is a
part of the whole one, so its lower bound and its certificate of infeasibility are those of the whole.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from estimators.arrays import FloatArray
from synthesis.lmi.clarabel_backend import RawAnswer, solve_with_clarabel
from synthesis.lmi.conic import assemble, structural_zeros
from synthesis.lmi.interior import solve_with_interior
from synthesis.lmi.local_minima import STARTS, followed, grid_minima
from synthesis.lmi.problem import Inequality, LmiProblem
from synthesis.lmi.relaxation import RelaxedProblem, SampledInequality, rate_samples, widened
from synthesis.lmi.settings import LmiSettings
from synthesis.polynomials.matrix import MatrixPolynomial

ROUNDS = 20
MORE = 6  # places that one inequality gains in a round
ON_A_LINE = 16  # local minima that it gains if only one variable moves
SHARE = 0.1  # of the worst violation; what is broken by less waits
AT_ONCE = 50_000  # places whose inequality is worked out together: 16 x 16 of them are 100 MB
EDGE = 1e-7  # every inequality is solved for with this margin, and half of it may be missing where it is only looked at
KEPT, NEARLY = 12, 1e-4
"""Places of an inequality that the next problem starts with: the tightest ones, relative to its size."""
SPREAD = 50  # places to start with, beside those furthest out, where the set of the parameters is no box
LOOKED_AT = {0: 1, 1: 9}  # points for each parameter, by their number; 5 for more
SLACK = 0.02  # share of the common margin by which a place that is only looked at may fall short
STEADY = 1e-5  # relative change of an objective that nothing will be proved at
FINE, ROUGH = 1e-6, 1e-3  # relative accuracy of an objective; of a largest margin, and of a least norm


@dataclass
class Family:
    """One inequality at the places where it is looked at.

    `rows(places)` gives its values with unknowns (g, k, k, 1+N), `known(decisions, places)` those of known decisions (g, k, k);
    `held` are those with unknowns that are worked out already.
    `active` are the indices of the places that are solved for. Where the first places are a grid, `shape` and `spacing` are
    those of `synthesis.lmi.local_minima`; without them only the places themselves are looked at.
    """

    name: str
    places: FloatArray
    rows: Callable[[FloatArray], FloatArray]
    known: Callable[[FloatArray, FloatArray], FloatArray]
    active: list[int]
    strict: bool = True
    shape: tuple[int, ...] = ()
    spacing: FloatArray | None = None
    held: FloatArray | None = None

    def values(self) -> FloatArray:
        """With unknowns, at the places that are solved for; each is worked out once."""
        more = self.active[0 if self.held is None else len(self.held) :]
        if more:
            rows = self.rows(self.places[more])
            self.held = rows if self.held is None else np.concatenate([self.held, rows])
        assert self.held is not None
        return self.held

    def add(self, place: FloatArray) -> bool:
        """Look there, and solve for it; False if it is solved for already."""
        near = np.abs(self.places[self.active] - place).max(axis=1, initial=0.0) < 1e-9
        if near.any():
            return False
        self.places = np.vstack([self.places, place])
        self.active.append(len(self.places) - 1)
        return True

    def least(self, decisions: FloatArray, places: FloatArray | None = None) -> FloatArray:
        """The least eigenvalue at every place (g,), worked out for AT_ONCE of them at a time: there may be millions."""
        places = self.places if places is None else places
        parts = np.split(places, range(AT_ONCE, len(places), AT_ONCE))
        return np.concatenate([np.linalg.eigvalsh(self.known(decisions, part))[:, 0] for part in parts])

    def worst(self, decisions: FloatArray, slack: float) -> FloatArray:
        """Places (g, v) that fall short by more than `slack`, worst first, no two of them neighbours."""
        if self.spacing is not None:
            return self._minima(decisions, slack, ON_A_LINE if np.count_nonzero(self.spacing) == 1 else MORE)
        least = self.least(decisions)
        least[self.active] = np.inf
        short = np.flatnonzero(least < -slack)
        chosen: list[int] = []
        for index in short[np.argsort(least[short])]:
            if least[index] > SHARE * least[short].min():
                break
            apart = np.abs(self.places[chosen] - self.places[index]).max(axis=1) if chosen else np.array([np.inf])
            if apart.min() > 0.3:
                chosen.append(int(index))
            if len(chosen) == MORE:
                break
        return self.places[chosen]

    def _minima(self, decisions: FloatArray, slack: float, most: int) -> FloatArray:
        """The least of the local minima that fall short."""
        size = int(np.prod(self.shape))
        starts = grid_minima(self.least(decisions, self.places[:size]), self.shape, -slack)[:STARTS]
        places, values = self.around(decisions, self.places[starts])
        return places[values < -slack][:most]

    def around(self, decisions: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The local minima that places (g, v) lead to, and their values."""
        spacing = np.zeros(places.shape[1]) if self.spacing is None else self.spacing
        return followed(lambda chosen: self.least(decisions, chosen), places, spacing)

    def tightest(self, decisions: FloatArray) -> FloatArray:
        """Places (g, v) that decide at these decisions: what a problem of the same kind does well to start with."""
        places = self.places[self.active]
        values = np.linalg.eigvalsh(self.known(decisions, places))
        order = np.argsort(values[:, 0])[:KEPT]
        return np.asarray(places[order[values[order, 0] < NEARLY * max(1.0, float(values[:, -1].max()))]])


Memory = dict[str, FloatArray]  # places of every inequality that decided when a problem of the same kind was solved


def solve_sampled(
    relaxed: RelaxedProblem,
    settings: LmiSettings,
    tolerance: float = FINE,
    beyond: float = np.inf,
    centre: tuple[FloatArray, float] | None = None,
) -> RawAnswer:
    """Solve a sampled problem with the method for few places and many unknowns (`solve_with_interior`)."""
    if settings.solver.startswith("cvxpy:"):
        from synthesis.lmi.cvxpy_backend import solve_with_cvxpy  # cvxpy takes 1 s to import

        return solve_with_cvxpy(relaxed, settings.solver.removeprefix("cvxpy:"), settings)
    if any(len(structural_zeros(part.values)) for part in relaxed.sampled):
        return solve_with_clarabel(assemble(relaxed), len(relaxed.cost), settings)  # knows of equalities
    blocks = []
    for part in relaxed.sampled:
        values = part.values.copy()
        values[..., 0] -= part.margin * np.eye(values.shape[1])
        blocks.append(values)
    tolerance = max(settings.tolerance, tolerance)
    margins = [part.margin for part in relaxed.sampled]
    most = settings.max_iterations
    found = solve_with_interior(blocks, relaxed.cost, relaxed.weights, tolerance, most, margins, beyond, centre)
    if not found.infeasible:
        return found
    other = solve_with_clarabel(assemble(relaxed), len(relaxed.cost), settings)  # which polishes its evidence
    return other if other.excluded > found.excluded else found


def exchange(
    problem: LmiProblem,
    families: Sequence[Family],
    settings: LmiSettings,
    tolerance: float | None = None,
    beyond: float = np.inf,
    patience: int = 1,
) -> RawAnswer:
    """Solve until no place that is looked at falls short; the families remember what is solved for.

    A cost that is certainly above `beyond` ends it: more places only raise it. Without `verify` an objective that does not move
    for `patience` rounds ends it, too: then it bounds, and nothing else is asked of it.
    """
    index = problem.margin_index
    if tolerance is None:
        tolerance = ROUGH if index is not None or problem.least_norm else FINE
    iterations, seconds, before, steady, answer = 0, 0.0, np.inf, 0, None
    for _ in range(ROUNDS):
        sampled = tuple(
            SampledInequality(
                family.name, widened(family.values(), problem.decisions), family.places[family.active],
                max(settings.margin, EDGE) if family.strict else 0.0,
            )
            for family in families if family.active
        )  # fmt: skip
        answer = solve_sampled(
            RelaxedProblem("exchange", sampled, (), problem.cost, problem.weights), settings, tolerance, beyond,
            None if answer is None else answer.centre,
        )  # fmt: skip
        iterations, seconds = iterations + answer.iterations, seconds + answer.seconds
        if answer.infeasible or not np.isfinite(answer.decisions).all():
            break
        value = float(problem.cost @ answer.decisions)
        if value > beyond:
            break
        steady = steady + 1 if abs(value - before) <= STEADY * abs(value) else 0
        if not settings.verify and index is None and steady == patience:
            break
        if index is not None and hopeless(problem, answer):
            break  # even these places leave no margin
        before = value
        slack = 0.0 if index is None else SLACK * abs(float(answer.decisions[index]))
        slack = max(slack, SLACK * problem.floor, EDGE / 2)
        more = [family.worst(answer.decisions, slack) for family in families]
        if not sum(family.add(place) for family, places in zip(families, more, strict=True) for place in places):
            break
    assert answer is not None
    return replace(answer, iterations=iterations, seconds=seconds)


def hopeless(problem: LmiProblem, answer: RawAnswer) -> bool:
    """Whether the largest common margin at the places that were solved for is negative: more places only lower it."""
    return problem.maximise_margin and answer.dual_bound > 0.0


def families_of(problem: LmiProblem, memory: Memory | None = None) -> list[Family]:
    """The inequalities of a problem on a grid of the parameters and at the vertices of the rates that they depend on."""
    families = [_family(problem, entry) for entry in problem.inequalities]
    recall(families, memory or {})
    return families


def recall(families: Sequence[Family], memory: Memory) -> None:
    """Start with the places that decided before."""
    for family in families:
        for place in memory.get(family.name, ()):
            family.add(place)


def remember(families: Sequence[Family], decisions: FloatArray, memory: Memory) -> None:
    """What decides at these decisions."""
    for family in families:
        memory[family.name] = family.tightest(decisions)


def _family(problem: LmiProblem, entry: Inequality) -> Family:
    count = len(problem.parameters)
    degrees = entry.matrix.degrees[:count]
    fine, share = LOOKED_AT.get(count, 5), 2 if count == 1 else 1
    numbers = [2 if d == 1 and count > 1 else max(fine, share * d + 1) if d else 1 for d in degrees]
    lines = [np.linspace(-1.0, 1.0, number) if number > 1 else np.zeros(1) for number in numbers]
    found, points = rate_samples(entry.matrix, count), problem.places_on(lines)
    grid, rates = (np.array(line, float).reshape(len(line), count) for line in (points, found))
    places = np.hstack([np.repeat(grid, len(rates), axis=0), np.tile(rates, (len(grid), 1))])

    def rows(chosen: FloatArray) -> FloatArray:
        return entry.matrix.at(chosen)

    last: dict[bytes, MatrixPolynomial] = {}  # the same decisions are asked about many times

    def known(decisions: FloatArray, chosen: FloatArray) -> FloatArray:
        key = decisions.tobytes()
        if key not in last:
            last.clear()
            last[key] = entry.matrix.substitute(decisions)
        return np.asarray(last[key].at(chosen)[..., 0])

    family = Family(entry.name, places, rows, known, corners(places, count), entry.strict)
    if problem.half_spaces:  # minima would be followed out of the set
        return family
    spacing = np.array([2.0 / (len(line) - 1) if len(line) > 2 else 0.0 for line in lines] + [0.0] * count)
    return replace(family, shape=(*(len(line) for line in lines), len(rates)), spacing=spacing)


def corners(places: FloatArray, count: int) -> list[int]:
    """Indices to start with: every corner of the parameters with one of its rates, opposite ones with opposite rates.

    Where a corner of the ranges is cut off, places that are furthest in some directions and others spread over the set: corners
    alone are too few for unknowns that are affine in every parameter.
    """
    spread = np.abs(places[:, :count]).max(axis=0, initial=0.0)
    at_corner = (np.abs(places[:, :count]) >= spread - 1e-12).all(axis=1)
    sign = np.where(places[:, :count] >= 0.0, 1.0, -1.0)
    agree = (places[:, count:] * sign).sum(axis=1)
    found: dict[tuple[float, ...], int] = {}
    for index in np.flatnonzero(at_corner):
        key = tuple(places[index, :count])
        if key not in found or agree[index] > agree[found[key]]:
            found[key] = int(index)
    moving = [i for i in range(count) if len(places) and np.ptp(places[:, i]) > 0.0]
    chosen = list(found.values())
    if len(chosen) == 2 ** len(moving):
        return chosen
    for signs in product((-1.0, 1.0), repeat=len(moving)):
        far = places[:, moving] @ np.array(signs)
        chosen.append(int(np.lexsort((agree, np.round(far, 9)))[-1]))
    chosen += range(0, len(places), max(1, len(places) // SPREAD))
    return list(dict.fromkeys(chosen))
