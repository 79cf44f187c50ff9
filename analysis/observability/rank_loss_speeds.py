"""The lowest parameter value at which observability is lost, for thousands of perturbed copies of a model at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.matrix import observability_matrix, rate_symbol
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.models.lpv import LpvModel

REAL = 1e-7  # imaginary part of a real root, relative to its size: double roots split by the root of the rounding error


@dataclass(frozen=True, eq=False, repr=False)
class RankLossSpeeds(Display):
    r"""The determinant c(p, p', constants) of the time-varying observability matrix, compiled over the constants.

    Rank is lost at p if c(p, p') = 0 for some rate p' in its bounds. c is linear in p', so that is where c has two signs, or
    none, at the two ends of the rate: the set begins at the lower end of the range or at a root of c at one of the rate's ends.
    Raises AnalysisError for models whose condition is of another form.

    >>> import numpy as np
    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> RankLossSpeeds(model).lowest({"sigma0": np.array([150.0, 180.0, 210.0])}).shape  # rad/s, one a copy of the model
    (3,)
    """

    model: LpvModel
    _coefficients: tuple[Callable[..., Any], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if len(self.model.parameters) != 1 or len(self.model.outputs) != 1:
            raise AnalysisError(
                f"model '{self.model.name}': rank-loss speeds need one scheduling parameter and one output, not "
                f"{len(self.model.parameters)} and {len(self.model.outputs)}; use analysis.observability.rank_loss"
            )
        (p,) = self.model.parameters
        minors = observability_matrix(self.model).minors(symbolic=True)
        symbol, rate = sp.Symbol(p.name), rate_symbol(p.name)
        condition = sp.numer(sp.together(minors[0])) if minors else sp.Integer(0)
        other = condition.free_symbols - {symbol, rate} - {sp.Symbol(name) for name in self.model.constants}
        if other or p.may_jump or sp.degree(condition, rate) > 1:
            raise AnalysisError(
                f"model '{self.model.name}': the condition must be linear in one bounded rate, without higher derivatives"
            )
        names = [sp.Symbol(name) for name in self.model.constants]
        ends = [sp.Poly(condition.subs(rate, end), symbol) for end in (p.rate_minimum, p.rate_maximum)]
        compiled = tuple(sp.lambdify(names, poly.all_coeffs(), modules="numpy") for poly in ends)
        object.__setattr__(self, "_coefficients", compiled)

    def lowest(self, constants: Mapping[str, FloatArray]) -> FloatArray:
        """The lowest value of the parameter at which some rate in its bounds loses rank; inf where none does.

        `constants` (n,) by name; those not named keep their nominal value. The result is (n,).
        """
        (p,) = self.model.parameters
        given = [np.asarray(constants.get(name, c.value), float) for name, c in self.model.constants.items()]
        size = np.broadcast_shapes(*(a.shape for a in given))
        ends = [_stacked(function(*given), size) for function in self._coefficients]
        at_start = [_horner(c, np.full(c.shape[0], p.minimum)) for c in ends]
        lost = at_start[0] * at_start[1] <= 0.0
        roots = np.concatenate([real_roots(c) for c in ends], axis=-1)
        inside = (roots >= p.minimum) & (roots <= p.maximum)
        first = np.where(inside, roots, np.inf).min(axis=-1, initial=np.inf)
        return np.where(lost, p.minimum, first).reshape(size)


def real_roots(coefficients: FloatArray) -> FloatArray:
    """Real roots of polynomials (n, d + 1), highest power first, as (n, d); NaN fills up. By companion matrices."""
    count, degree = coefficients.shape[0], coefficients.shape[1] - 1
    out = np.full((count, max(degree, 0)), np.nan)
    if degree < 1:
        return out
    flat = np.abs(coefficients[:, 0]) <= 1e-14 * np.abs(coefficients).max(axis=1)
    if flat.any():  # a leading coefficient that vanishes: the polynomial is of a lower degree
        out[flat, : degree - 1] = real_roots(coefficients[flat, 1:])
    rest = np.flatnonzero(~flat)
    companion = np.zeros((len(rest), degree, degree))
    companion[:, 0] = -coefficients[rest, 1:] / coefficients[rest, :1]
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    roots = np.linalg.eigvals(companion)
    out[rest] = np.where(np.abs(roots.imag) <= REAL * np.abs(roots), roots.real, np.nan)
    return out


def _stacked(parts: Any, size: tuple[int, ...]) -> FloatArray:
    return np.stack([np.broadcast_to(np.asarray(part, float), size).reshape(-1) for part in parts], axis=-1)


def _horner(coefficients: FloatArray, at: FloatArray) -> FloatArray:
    value = np.zeros(len(at))
    for column in coefficients.T:
        value = value * at + column
    return value
