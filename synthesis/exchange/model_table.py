"""The tables of a model file, as they are written; what they mean is for `synthesis.exchange.model_file`."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from synthesis.toml_file import StrictTable


def _spelled(entry: object) -> str:
    """A number stands for the formula that spells it."""
    if isinstance(entry, (int, float)) and not isinstance(entry, bool):
        return repr(entry)
    if isinstance(entry, str):
        return entry
    raise ValueError(f'{entry!r} is neither a number nor a formula in quotes, such as "-damping/mass"')


Entry = Annotated[str, BeforeValidator(_spelled)]
Rows = list[list[Entry]]


class SignalTable(StrictTable):
    """One state, input, output or disturbance."""

    name: str = Field(min_length=1, examples=["velocity"])
    unit: str = Field(examples=["m/s"])


class ParameterTable(StrictTable):
    """One scheduling parameter; `rate` is a bound on both sides or a pair, inf for a parameter that jumps."""

    model_config = ConfigDict(allow_inf_nan=True)
    name: str = Field(min_length=1, examples=["speed"])
    unit: str = Field(examples=["m/s"])
    min: float = Field(examples=[0.0])
    max: float = Field(examples=[40.0])
    rate: float | list[float] = Field(examples=[5.0])
    absolute: bool = False


class ConstantTable(StrictTable):
    """One number with its unit and the place where it was found."""

    value: float = Field(examples=[2.0])
    unit: str = Field(examples=["kg"])
    source: str = Field(min_length=1, examples=["data sheet"])


class TableTable(StrictTable):
    """One quantity over parameters: breakpoints of each of them (a plain list for one), and a value for every breakpoint."""

    unit: str = Field(examples=["1/s"])
    source: str = Field(min_length=1, examples=["bench test"])
    over: Annotated[list[str], Field(min_length=1)]
    breakpoints: list[float] | list[list[float]]
    values: list[Any]

    @property
    def lines(self) -> tuple[tuple[float, ...], ...]:
        """Breakpoints of every parameter."""
        lines = [line for line in self.breakpoints if isinstance(line, list)]
        return tuple(map(tuple, lines)) if lines else (tuple(x for x in self.breakpoints if isinstance(x, float)),)


class ConstraintTable(StrictTable):
    """One inequality between parameters: a formula that is linear in them, or their coefficients, up to `max` in `unit`."""

    formula: Entry | None = Field(default=None, examples=["load + gain*speed"])
    coefficients: dict[str, float] | None = None
    max: float = Field(examples=[3.0])
    unit: str = Field(default="1", examples=["kg"])

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Self:
        if (self.formula is None) == (self.coefficients is None):
            raise ValueError('needs either formula, such as "load + 2*speed", or coefficients, such as { load = 1.0 }')
        return self


class MatrixTables(StrictTable):
    """x' = A x + B u + E d,  y = C x + D u + F d; those left out are zero."""

    A: Rows
    C: Rows
    B: Rows | None = None
    D: Rows | None = None
    E: Rows | None = None
    F: Rows | None = None


class ModelFile(StrictTable):
    """A whole model file."""

    name: str = Field(min_length=1, max_length=80, examples=["mass-spring"])
    source: str = Field(min_length=1, examples=["Newton; data sheet of the spring"])
    states: Annotated[list[SignalTable], Field(min_length=1)]
    outputs: Annotated[list[SignalTable], Field(min_length=1)]
    inputs: list[SignalTable] = Field(default_factory=list)
    disturbances: list[SignalTable] = Field(default_factory=list)
    parameters: list[ParameterTable] = Field(default_factory=list)
    constants: dict[str, ConstantTable] = Field(default_factory=dict)
    tables: dict[str, TableTable] = Field(default_factory=dict)
    definitions: dict[str, Entry] = Field(default_factory=dict)
    constraints: list[ConstraintTable] = Field(default_factory=list)
    matrices: MatrixTables
