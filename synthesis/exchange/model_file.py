"""Model files: signals, parameters, constants and matrices as formulas; read, checked and made an `LpvModel`.

Formulas have the grammar of `synthesis.models.formula`: parsed, never evaluated as code. `definitions` are names for formulas
that stand in several places; they are inserted. Every refusal says file, line, column, what is wrong and what would be right.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path as FilePath
from typing import TypeVar

import sympy as sp

from synthesis.certificate.units import PLACES
from synthesis.errors import ModelError, SpecError
from synthesis.exchange.formulas import Formulas
from synthesis.exchange.model_table import ModelFile, ParameterTable, Rows, SignalTable
from synthesis.models.constraint import ParameterConstraint, scaled_set
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, SchedulingParameter, Signal
from synthesis.models.table import LookupTable, check_table
from synthesis.toml_file import read_table, read_toml
from synthesis.toml_places import Path, Places

Made = TypeVar("Made")
SIGNALS = ("states", "inputs", "outputs", "disturbances")
SPECIFICATION = ("design", "deploy")  # tables of a specification, which is no model


def load_model(path: str | FilePath) -> LpvModel:
    """The model of a file.

    Raises SpecError for a file that is no model file, and ModelError for a model that cannot be: names, cycles, units, shapes,
    ranges. Both name the file, the line and the column.

    >>> from importlib.resources import files
    >>> model = load_model(files("studies") / "examples/quarter-car.toml")
    >>> model.name, len(model.states)
    ('quarter-car', 4)
    """
    path = FilePath(path)
    data = read_toml(path, "model")
    if "matrices" not in data and any(key in data for key in SPECIFICATION):
        raise SpecError(f"{path.name}: is a specification, not a model; it names its model in [model]")
    places = Places(path.read_text(encoding="utf-8"))
    table = read_table(ModelFile, data, path.name, places)
    return _Reader(path.name, places, table).model()


class _Reader:
    """One file on its way to a model."""

    def __init__(self, file: str, places: Places, table: ModelFile) -> None:
        self.file, self.places, self.table = file, places, table

    def model(self) -> LpvModel:
        table = self.table
        signals = {kind: self._signals(kind) for kind in SIGNALS}
        parameters = tuple(self._parameter(i, p) for i, p in enumerate(table.parameters))
        constants = {
            name: self._made(("constants", name), Constant, c.value, c.unit, c.source)
            for name, c in table.constants.items()
        }
        tables = {
            name: self._made(("tables", name), LookupTable, t.unit, t.source, tuple(t.over), t.lines, t.values)
            for name, t in table.tables.items()
        }
        for name, one in tables.items():
            self._made(("tables", name), check_table, one, parameters, f"tables.{name}")
        self._unique()
        formulas = Formulas(self.file, self.places, table)
        matrices = {}
        for key, (above, beside, per) in PLACES.items():
            rows: Rows | None = getattr(table.matrices, key)
            top, bottom = signals[above], signals[beside]
            if rows is not None:
                self._shape(key, rows, (above, len(top)), (beside, len(bottom)))
                entries = [
                    [formulas.entry(key, i, j, top[i], bottom[j], per) for j in range(len(bottom))]
                    for i in range(len(top))
                ]
                matrices[key] = sp.Matrix(len(top), len(bottom), [entry for row in entries for entry in row])
        constraints = self._constraints(formulas, parameters)
        formulas.refuse_unused()
        seen = {str(symbol) for matrix in matrices.values() for symbol in matrix.free_symbols}
        constants = {name: c for name, c in constants.items() if name in seen}  # numbers of constraints are worked out
        try:
            return LpvModel(
                table.name,
                table.source,
                parameters=parameters,
                constants=constants,
                constraints=constraints,
                tables=tables,
                **signals,
                **matrices,
            )
        except ModelError as error:
            raise ModelError(f"{self.file}: {error}") from None

    def _signals(self, kind: str) -> tuple[Signal, ...]:
        tables: list[SignalTable] = getattr(self.table, kind)
        return tuple(self._made((kind, i), Signal, s.name, s.unit) for i, s in enumerate(tables))

    def _parameter(self, index: int, table: ParameterTable) -> SchedulingParameter:
        place = ("parameters", index)
        rates = table.rate if isinstance(table.rate, list) else [-table.rate, table.rate]
        if len(rates) != 2:
            raise self._error((*place, "rate"), f"{rates} is neither a bound nor a pair [lowest, highest] of rates")
        return self._made(
            place, SchedulingParameter, table.name, table.unit, table.min, table.max, *rates, table.absolute
        )

    def _constraints(
        self, formulas: Formulas, parameters: tuple[SchedulingParameter, ...]
    ) -> tuple[ParameterConstraint, ...]:
        """In order, each checked against those before it: a set that is empty is refused where it becomes so."""
        found: list[ParameterConstraint] = []
        for i, table in enumerate(self.table.constraints):
            coefficients, largest = table.coefficients or {}, table.max
            if table.formula is not None:
                coefficients, largest = formulas.linear(i)
            place = ("constraints", i)
            found.append(self._made(place, ParameterConstraint, coefficients, largest, table.unit))
            self._made(place, scaled_set, parameters, tuple(found), f"constraints[{i}]")
        return tuple(found)

    def _made(self, place: Path, kind: Callable[..., Made], *values: object) -> Made:
        try:
            return kind(*values)
        except ModelError as error:
            raise self._error(place, str(error)) from None

    def _unique(self) -> None:
        seen: dict[str, str] = {}
        named: list[tuple[Path, str]] = [
            ((kind, i, "name"), s.name)
            for kind in (*SIGNALS, "parameters")
            for i, s in enumerate(getattr(self.table, kind))
        ]
        for key in ("constants", "tables", "definitions"):
            named += [((key, name), name) for name in getattr(self.table, key)]
        for place, name in named:
            if name in seen:
                raise self._error(
                    place, f"'{name}' is the name of one of the {seen[name]} already; names must be unique"
                )
            seen[name] = str(place[0])

    def _shape(self, key: str, rows: Rows, above: tuple[str, int], beside: tuple[str, int]) -> None:
        place: Path = ("matrices", key)
        if len(rows) != above[1]:
            raise self._error(place, f"{key} has {len(rows)} rows; {above[1]} {above[0]} need {above[1]}")
        for i, row in enumerate(rows):
            if len(row) != beside[1]:
                words = f"row {i + 1} of {key} has {len(row)} entries; {beside[1]} {beside[0]} need {beside[1]}"
                raise self._error((*place, i), words)

    def _error(self, place: Path, words: str) -> ModelError:
        return ModelError(f"{self.file}:{self.places.at(place)}: {words}")
