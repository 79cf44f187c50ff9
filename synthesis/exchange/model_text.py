"""A model written as a model file: what `load_model` reads back to the same exact model."""

from __future__ import annotations

import json
from pathlib import Path

from synthesis.design.export import formula
from synthesis.models.extract import MATRICES
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal

SIGNALS = ("states", "inputs", "outputs", "disturbances")


def save_model(model: LpvModel, path: str | Path) -> None:
    """Write `model_text` beside the place of the file and rename it: never half a file.

    >>> from importlib.resources import files
    >>> from tempfile import TemporaryDirectory
    >>> model = load_model(files("studies") / "examples/pmsm.toml")
    >>> with TemporaryDirectory() as folder:
    ...     save_model(model, f"{folder}/copy.toml")
    ...     print(load_model(f"{folder}/copy.toml").A == model.A)
    True
    """
    path = Path(path)
    part = path.with_name(f"{path.name}.part")
    part.write_text(model_text(model), encoding="utf-8")
    part.replace(path)


def model_text(model: LpvModel) -> str:
    """The model as TOML. Definitions of the file that it was read from are inserted; numbers read back bit for bit."""
    lines = [f"name = {_text(model.name)}", f"source = {_text(model.source)}", ""]
    for kind in SIGNALS:
        signals: tuple[Signal, ...] = getattr(model, kind)
        entries = [f"{{ name = {_text(s.name)}, unit = {_text(s.unit)} }}" for s in signals]
        if entries:
            lines += [f"{kind} = [", *(f"  {entry}," for entry in entries), "]"]
    for parameter in model.parameters:
        lines += _parameter(parameter)
    for constraint in model.constraints:
        factors = ", ".join(f"{name} = {_number(c)}" for name, c in constraint.coefficients.items() if c)
        lines += ["", "[[constraints]]", f"coefficients = {{ {factors} }}", f"max = {_number(constraint.maximum)}"]
        lines += [f"unit = {_text(constraint.unit)}"]
    if model.constants:
        lines += ["", "[constants]"]
        lines += [
            f"{name} = {{ value = {_number(c.value)}, unit = {_text(c.unit)}, source = {_text(c.source)} }}"
            for name, c in model.constants.items()
        ]
    for name, table in model.tables.items():
        breakpoints = [list(line) for line in table.breakpoints]
        lines += ["", f"[tables.{name}]", f"unit = {_text(table.unit)}", f"source = {_text(table.source)}"]
        lines += [f"over = {json.dumps(list(table.over))}", f"breakpoints = {breakpoints}"]
        lines += [f"values = {table.values.tolist()}"]
    lines += ["", "[matrices]"]
    for key in MATRICES:
        matrix = getattr(model, key)
        if key in ("A", "C") or any(entry != 0 for entry in matrix):
            rows = [[formula(entry, model) for entry in row] for row in matrix.tolist()]
            lines += [f"{key} = [", *(f"  [{', '.join(map(_entry, row))}]," for row in rows), "]"]
    return "\n".join(lines) + "\n"


def _parameter(parameter: SchedulingParameter) -> list[str]:
    low, high = parameter.rate_minimum, parameter.rate_maximum
    rate = _number(high) if low == -high else f"[{_number(low)}, {_number(high)}]"
    lines = [
        "", "[[parameters]]", f"name = {_text(parameter.name)}", f"unit = {_text(parameter.unit)}",
        f"min = {_number(parameter.minimum)}", f"max = {_number(parameter.maximum)}", f"rate = {rate}",
    ]  # fmt: skip
    return [*lines, "absolute = true"] if parameter.absolute else lines


def _entry(text: str) -> str:
    """Whole numbers stand bare, formulas in quotes."""
    return text if text.removeprefix("-").isdecimal() and len(text) < 10 else _text(text)


def _number(value: float) -> str:
    return repr(float(value))


def _text(value: str) -> str:
    """JSON's escapes are TOML's, all but the one character that JSON leaves as it is."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
