"""Is a time-varying observability (or controllability) matrix of full rank over the whole range and all admissible rates?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import ceil, comb, isfinite
from typing import Literal

import sympy as sp
from flint import fmpq, fmpq_mat

from analysis.observability.matrix import ObservabilityMatrix, controllability_matrix, observability_matrix, rate_symbol
from analysis.observability.rank_loss import RankLoss, rank_loss
from estimators.display import Display
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.definite import sign_on_box
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import decimal

Verdict = Literal["full", "lost", "never", "open"]
MOST_MINORS = 120  # of a symbolic matrix: more take minutes
PARTS = 8  # along every variable, where two signs are looked for


@dataclass(frozen=True, eq=False, repr=False)
class RangeRank(Display):
    r"""The rank over the box of parameters and rates.

    `verdict`: "full": everywhere, proved by the sign of a minor's common factor in ball arithmetic; "lost": on the set
    `loss.condition` = 0, which passes through the box (and what constraints leave of it), shown by two exact signs; "never": for
    no value; "open": not decided (a rate without bound, a second derivative; tables, or a matrix too large for symbols: then
    `loss` is None).
    `blocks` is how many outputs with their derivatives were used.
    """

    verdict: Verdict
    blocks: int
    loss: RankLoss | None


def observability_over_range(model: LpvModel) -> RangeRank:
    """With as few derivatives of the outputs as decide it.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> observability_over_range(model).verdict
    'full'
    """
    return _over_range(model, len(model.outputs), lambda blocks: observability_matrix(model, blocks))


def controllability_over_range(model: LpvModel) -> RangeRank:
    """With as few derivatives of the inputs as decide it; "never" without inputs.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> print(controllability_over_range(model).verdict)
    full
    """
    if not model.inputs:
        return RangeRank("never", 0, None)
    return _over_range(model, len(model.inputs), lambda blocks: controllability_matrix(model, blocks))


def _over_range(model: LpvModel, each: int, matrix: Callable[[int], ObservabilityMatrix]) -> RangeRank:
    n = len(model.states)
    found = RangeRank("open", 0, None)
    if model.tables:  # no one formula of the parameters
        return found
    for blocks in range(ceil(n / each), n + 1):
        if comb(blocks * each, n) > MOST_MINORS:
            break
        loss = rank_loss(matrix(blocks))
        found = RangeRank("never" if loss.always else _verdict(loss, model), blocks, loss)
        if found.verdict == "full":
            break
    complete = found.blocks == n
    return found if complete or found.verdict == "full" else RangeRank("open", found.blocks, found.loss)


def _verdict(loss: RankLoss, model: LpvModel) -> Verdict:
    parameters = model.parameters
    symbols = sorted(loss.condition.free_symbols, key=str)
    if not symbols:
        return "full" if not loss.leftover else "open"
    known = {sp.Symbol(p.name): (p.minimum, p.maximum) for p in parameters}
    known |= {rate_symbol(p.name): (p.rate_minimum, p.rate_maximum) for p in parameters}
    box = [known.get(symbol, (0.0, float("inf"))) for symbol in symbols]
    if not all(isfinite(low) and isfinite(high) for low, high in box) or not loss.condition.is_polynomial(*symbols):
        return "open"
    verdicts = [_sign(factor, symbols, box, _admitting(model, symbols)) for factor in loss.factors]
    if "lost" in verdicts:
        return "lost"
    return "full" if all(verdict == "full" for verdict in verdicts) and not loss.leftover else "open"


def _admitting(model: LpvModel, symbols: list[sp.Symbol]) -> Callable[[tuple[fmpq, ...]], bool]:
    """Whether scaled values of the symbols are certainly those of a place in the set, for some values of all other parameters."""
    places = {str(symbol): k for k, symbol in enumerate(symbols)}

    def admitted(point: tuple[fmpq, ...]) -> bool:
        for half_space in model.half_spaces:
            least, alone = fmpq(0), len(model.half_spaces) == 1  # of several, what suits one may break another
            for p, a in zip(model.parameters, half_space.normal, strict=True):
                if p.name in places:
                    least += a * point[places[p.name]]
                elif a != 0:
                    least -= abs(a) if alone else -abs(a)
            if least > half_space.bound:
                return False
        return True

    return admitted


def _sign(
    factor: sp.Expr,
    symbols: list[sp.Symbol],
    box: list[tuple[float, float]],
    admitted: Callable[[tuple[fmpq, ...]], bool],
) -> Verdict:
    polynomial = _polynomial(factor, symbols, box)
    if any(sign_on_box((polynomial * sign).balls()).positive for sign in (1, -1)):
        return "full"
    lines = [[fmpq(2 * k - PARTS, PARTS) for k in range(PARTS + 1)]] * len(symbols)
    values = {_signum(polynomial.at(point)[0, 0]) for point in product(*lines) if admitted(point)}
    return "lost" if 0 in values or len(values) == 2 else "open"


def _polynomial(factor: sp.Expr, symbols: list[sp.Symbol], box: list[tuple[float, float]]) -> PolynomialMatrix:
    """In variables from -1 to 1; a rate that is held at zero has the width zero."""
    terms = {
        powers: fmpq_mat([[fmpq(int(c.p), int(c.q))]]) for powers, c in sp.Poly(factor, *symbols, domain="QQ").terms()
    }
    low, high = ([decimal(float(end)) for end in ends] for ends in zip(*box, strict=True))
    return PolynomialMatrix(terms, (1, 1), len(symbols)).affine(
        [(a + b) / 2 for a, b in zip(low, high, strict=True)], [(b - a) / 2 for a, b in zip(low, high, strict=True)]
    )


def _signum(value: fmpq) -> int:
    return int(value > 0) - int(value < 0)
