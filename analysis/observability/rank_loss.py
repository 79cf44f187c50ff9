"""Where an observability matrix loses rank: the set solved for, in exact numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.matrix import ObservabilityMatrix, exact_number
from analysis.observability.real_roots import numerator, real_roots
from estimators.display import Display
from estimators.errors import unknown

Interval = tuple[sp.Expr, sp.Expr]


@dataclass(frozen=True, eq=False, repr=False)
class RankLoss(Display):
    r"""The set {condition = 0} in the space of parameters and their time derivatives.

    `condition` is the determinant, or for more rows than states the greatest common divisor of the maximal minors;
    `leftover` are the minors divided by it: where all of them vanish together rank is lost as well (fewer dimensions).
    `always`: every minor is identically zero. `frozen`: the parameters were held, so the set is no set of lost
    observability.
    """

    condition: sp.Expr
    leftover: tuple[sp.Expr, ...]
    always: bool
    frozen: bool
    matrix: ObservabilityMatrix

    @property
    def factors(self) -> tuple[sp.Expr, ...]:
        """The irreducible factors of the condition that are not constant, each a piece of the set."""
        return tuple(sorted((f for f, _ in sp.factor_list(numerator(self.condition))[1]), key=sp.count_ops))

    def curve(self, solved_for: str) -> tuple[sp.Expr, ...]:
        """The set as a graph: every solution of the condition for one parameter or rate."""
        symbol = self._symbol(solved_for)
        return tuple(sp.factor(s) for s in sp.solve(self.condition, symbol))

    def roots(self, parameter: str, values: Mapping[str, object] | None = None) -> tuple[sp.Expr, ...]:
        """Real roots in one parameter, everything else fixed by `values`; a symbol not named there is held at 0.

        Raises AnalysisError where the condition is no polynomial: its roots may be without end (`roots_inside` has a range).
        """
        return real_roots(self._at(parameter, values), self._symbol(parameter))

    def roots_inside(self, parameter: str, values: Mapping[str, object] | None = None) -> tuple[sp.Expr, ...]:
        """The roots within the range of the model's parameter."""
        low, high = (exact_number(parameter, end) for end in self._range(parameter))
        return real_roots(self._at(parameter, values), self._symbol(parameter), (low, high))

    def interval_over_rates(
        self, parameter: str, rates: tuple[object, object] | None = None, search: tuple[object, object] | None = None
    ) -> tuple[Interval, ...]:
        """All values of the parameter at which some rate within its bounds loses rank, as closed exact intervals.

        `rates` and `search` default to the model's rate bounds and range. Raises AnalysisError if the condition is not
        linear in the rate or contains other symbols.
        """
        symbol = self._symbol(parameter)
        others = self.condition.free_symbols - {symbol}
        if len(others) != 1 or not _is_linear(self.condition, next(iter(others))):
            raise AnalysisError(
                f"{self.matrix.name}: the condition in {', '.join(sorted(map(str, others))) or 'no rate'} is not linear in one "
                "rate; fix the other symbols or use curve()"
            )
        (rate,) = others
        found = next((p for p in self.matrix.parameters if p.name == parameter), None)
        low, high = (exact_number(parameter, v) for v in search or self._range(parameter))
        if rates is None:
            if found is None:
                raise AnalysisError(f"{self.matrix.name}: '{parameter}' has no rate bounds; give rates=(low, high)")
            rates = (found.rate_minimum, found.rate_maximum)
        slow, fast = (exact_number("rate", v) for v in rates)
        slope, offset = sp.Poly(self.condition, rate).all_coeffs()
        common = sp.gcd(slope, offset)  # where it vanishes rank is lost at every rate
        always = set(real_roots(common, symbol, (low, high)))
        slope, offset = sp.cancel(slope / common), sp.cancel(offset / common)
        cuts = {low, high} | always
        for expression in (slope * slow + offset, slope * fast + offset, slope):
            if expression != 0:
                cuts |= set(real_roots(expression, symbol, (low, high)))

        def lost(value: sp.Expr) -> bool:
            """Whether slope rate + offset = 0 for some rate in its bounds."""
            if value in always:
                return True
            a, b = (sp.simplify(e.subs(symbol, value)) for e in (slope, offset))
            return bool(b == 0 if a == 0 else slow <= -b / a <= fast)

        pieces: list[Interval] = []
        edges = sorted(cuts)
        for place, edge in enumerate(edges):
            if lost(edge):
                if not (pieces and pieces[-1][1] == edge):
                    pieces.append((edge, edge))
                after = edges[place + 1] if place + 1 < len(edges) else None
                middle = None if after is None else sp.nsimplify(sp.N((edge + after) / 2, 30), rational=True)
                if middle is not None and lost(middle):
                    pieces[-1] = (pieces[-1][0], after)
        return tuple(pieces)

    def _at(self, parameter: str, values: Mapping[str, object] | None) -> sp.Expr:
        symbol = self._symbol(parameter)
        given = {self._symbol(name): exact_number(name, v) for name, v in (values or {}).items()}
        rest = {s: sp.Integer(0) for s in self.condition.free_symbols - {symbol} - set(given)}
        return self.condition.subs({**rest, **given})

    def _symbol(self, name: str) -> sp.Symbol:
        if sp.Symbol(name) not in self.condition.free_symbols:
            known = sorted(map(str, self.condition.free_symbols))
            raise AnalysisError(
                f"{self.matrix.name}: rank loss does not depend on '{name}'; {unknown('symbol', name, known)}"
            )
        return sp.Symbol(name)

    def _range(self, parameter: str) -> tuple[object, object]:
        for p in self.matrix.parameters:
            if p.name == parameter:
                return p.minimum, p.maximum
        raise AnalysisError(f"{self.matrix.name}: '{parameter}' has no range; give search=(low, high)")


def rank_loss(matrix: ObservabilityMatrix, values: Mapping[str, object] | None = None) -> RankLoss:
    """Solve for the set where the matrix has less than full column rank; `values` fixes parameters or rates first.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> print(rank_loss(observability_matrix(model)).always)
    False
    """
    minors = matrix.minors(values)
    if not minors:
        return RankLoss(sp.Integer(0), (), True, matrix.frozen, matrix)
    minors = tuple(numerator(minor) for minor in minors)
    common = minors[0]
    for minor in minors[1:]:
        common = sp.gcd(common, minor)
    condition = sp.factor(common)
    leftover = tuple(q for q in (sp.cancel(m / condition) for m in minors) if q.free_symbols)
    complete = len(leftover) < len(minors)  # a constant among them cannot vanish
    return RankLoss(condition, () if complete else leftover, False, matrix.frozen, matrix)


def _is_linear(expression: sp.Expr, symbol: sp.Symbol) -> bool:
    return bool(expression.is_polynomial(symbol) and sp.Poly(expression, symbol).degree() == 1)
