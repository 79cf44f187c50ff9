"""The formulas of one model file: definitions put in order, names, units, and sympy expressions of the entries."""

from __future__ import annotations

import ast
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from graphlib import CycleError, TopologicalSorter
from typing import TypeVar

import sympy as sp

from synthesis.certificate.units import NUMBER, Dimension, check_entry, dimension
from synthesis.errors import ModelError
from synthesis.exchange.extent import NAME, Extent, number
from synthesis.exchange.model_table import ModelFile
from synthesis.models.formula import parse, read, shown, used
from synthesis.models.param import Signal, check_name
from synthesis.toml_places import Path, Places

Value = TypeVar("Value")


class Formulas:
    """Every formula is read twice: in units, one operation at a time, and as an expression with the definitions inserted.

    A model in which everything has the unit 1 is a normalised one, time included, and its units are not checked.
    """

    def __init__(self, file: str, places: Places, table: ModelFile) -> None:
        self.file, self.places, self.table = file, places, table
        named = {p.name: p.unit for p in table.parameters}
        named |= {name: entry.unit for kind in (table.constants, table.tables) for name, entry in kind.items()}
        signals = [s.unit for kind in ("states", "inputs", "outputs", "disturbances") for s in getattr(table, kind)]
        self.with_units = any(unit != "1" for unit in (*named.values(), *signals))
        self.units = {name: dimension(unit, f"{file}: unit of {name}") for name, unit in named.items()}
        self.expressions: dict[str, sp.Expr] = {name: sp.Symbol(name) for name in named}
        self.extents: dict[str, Extent] = dict.fromkeys(named, NAME)
        self.needs: dict[str, set[str]] = {}  # of every definition
        self.mentioned: set[str] = set()
        for kind in ("constants", "tables", "definitions"):
            for name in getattr(table, kind):
                self._placed((kind, name), "", partial(check_name, name, kind.removesuffix("s")))
        self._define()

    def entry(self, key: str, i: int, j: int, above: Signal, beside: Signal, per: str) -> sp.Expr:
        """The expression of one entry of a matrix, whose units fit its place."""
        rate = (f"d {above.name}/dt" if per == "s" else above.name) + f" from {beside.name}"
        path, place = ("matrices", key, i, j), f"{key}[{i}][{j}] ({rate})"
        text = getattr(self.table.matrices, key)[i][j]
        tree = self._placed(path, text, lambda: parse(text, place))
        self.mentioned |= used(tree)
        self._extent(tree, text, path, place)
        expression = self._expression(tree, text, path, place)
        if self.with_units:
            self._unit(tree, text, path, place)
            wanted = dimension(above.unit, place) / dimension(beside.unit, place) / dimension(per, place)
            self._placed(path, text, lambda: check_entry(text, self.units, wanted, place))
        return expression

    def linear(self, i: int) -> tuple[dict[str, float], float]:
        """Of constraint i: the coefficients of the parameters, and what is left of its max.

        Raises ModelError for units that do not fit, and for a formula that is not linear in the parameters.
        """
        table, path, place = self.table.constraints[i], ("constraints", i, "formula"), f"constraints[{i}]"
        text = table.formula or ""
        tree = self._placed(path, text, lambda: parse(text, place))
        self.mentioned |= used(tree)
        self._extent(tree, text, path, place)
        expression = self._expression(tree, text, path, place)
        if self.with_units:
            found, wanted = (
                self._unit(tree, text, path, place),
                self._placed(path, "", lambda: dimension(table.unit, place)),
            )
            if not found.same(wanted):
                words = f"'{shown(text)}' has the unit {found.words}, its max is in {wanted.words}"
                raise ModelError(f"{self.file}:{self.places.at(path)}: {place}: {words}")
        values = {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in self.table.constants.items()}
        names = [p.name for p in self.table.parameters]
        symbols = [sp.Symbol(name) for name in names]
        plain = sp.expand(expression.subs(values))
        if not names or not plain.is_polynomial(*symbols) or sp.Poly(plain, *symbols).total_degree() > 1:
            words = f"'{shown(text)}' is not linear in the parameters {', '.join(names)}"
            raise ModelError(f"{self.file}:{self.places.at(path)}: {place}: {words}")
        polynomial = sp.Poly(plain, *symbols)
        slopes = {name: float(polynomial.coeff_monomial(symbol)) for name, symbol in zip(names, symbols, strict=True)}
        rest = sp.Rational(str(table.max)) - polynomial.coeff_monomial(1)
        return {name: slope for name, slope in slopes.items() if slope}, float(rest)

    def refuse_unused(self) -> None:
        """Raise ModelError for a definition or constant that no matrix needs: it is tied to nothing."""
        waiting, needed = list(self.mentioned), set()
        while waiting:
            name = waiting.pop()
            if name not in needed:
                needed.add(name)
                waiting += self.needs.get(name, ())
        for kind in ("definitions", "constants", "tables"):
            for name in getattr(self.table, kind):
                if name not in needed:
                    where = f"{self.file}:{self.places.at((kind, name))}"
                    raise ModelError(
                        f"{where}: {kind}.{name}: is used in no matrix{' and no constraint' if self.table.constraints else ''}; "
                        "use it or remove it"
                    )

    def _define(self) -> None:
        trees = {}
        for name, text in self.table.definitions.items():
            path = ("definitions", name)
            trees[name] = self._placed(path, text, partial(parse, text, f"definitions.{name}"))
            self.needs[name] = used(trees[name])
        own = {name: {n for n in needs if n in trees} for name, needs in self.needs.items()}
        try:
            order = list(TopologicalSorter(own).static_order())
        except CycleError as error:
            cycle = list(reversed(error.args[1]))  # graphlib tells it from what is needed to what needs it
            where = f"{self.file}:{self.places.at(('definitions', cycle[0]))}"
            raise ModelError(
                f"{where}: definitions.{cycle[0]}: needs itself ({' -> '.join(cycle)}); break the circle"
            ) from None
        for name in order:
            path, text, place = ("definitions", name), self.table.definitions[name], f"definitions.{name}"
            self.extents[name] = self._extent(trees[name], text, path, place)
            self.expressions[name] = self._expression(trees[name], text, path, place)
            if self.with_units:
                self.units[name] = self._unit(trees[name], text, path, place)

    def _extent(self, tree: ast.expr, text: str, path: Path, place: str) -> Extent:
        return self._placed(
            path, text, lambda: self._worded(lambda: read(tree, text.strip(), self.extents, number, place), text, place)
        )

    def _expression(self, tree: ast.expr, text: str, path: Path, place: str) -> sp.Expr:
        found: sp.Expr = self._placed(path, text, lambda: read(tree, text.strip(), self.expressions, _rational, place))
        if found.has(sp.zoo, sp.nan):
            raise ModelError(f"{self.file}:{self.places.at(path)}: {place}: '{shown(text.strip())}' divides by zero")
        return found

    def _unit(self, tree: ast.expr, text: str, path: Path, place: str) -> Dimension:
        return self._placed(
            path, text, lambda: self._worded(lambda: read(tree, text.strip(), self.units, _number, place), text, place)
        )

    @staticmethod
    def _worded(action: Callable[[], Value], text: str, place: str) -> Value:
        """Do it; an error of the arithmetic, which knows no place, gets the formula in front."""
        try:
            return action()
        except ModelError as error:
            words = str(error)
            if words.startswith(place):
                raise
            raise ModelError(f"{place}: '{shown(text.strip())}' {words}", error.offset) from None

    def _placed(self, path: Path, text: str, action: Callable[[], Value]) -> Value:
        """Do it; an error gets file, line and column."""
        try:
            return action()
        except ModelError as error:
            inside = 0 if error.offset is None else error.offset + len(text) - len(text.lstrip())
            raise ModelError(f"{self.file}:{self.places.at(path, inside)}: {error}") from None


def _rational(number: Fraction) -> sp.Rational:
    return sp.Rational(number.numerator, number.denominator)


def _number(_: Fraction) -> Dimension:
    return NUMBER
