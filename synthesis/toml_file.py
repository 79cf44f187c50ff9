"""TOML files that people write: one strict base of their tables, one reader, and one line for what is wrong in them.

A refusal names the file, the key, what is wrong there, and what would be right: the nearest known key, an example with its
unit, the bound that was broken.
"""

from __future__ import annotations

import json
import tomllib
import typing
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from estimators.display import displayed
from estimators.errors import LONGEST_WORD, printable, unknown
from synthesis.errors import SpecError
from synthesis.toml_places import Places


@displayed({})
class StrictTable(BaseModel):
    """A table that is read once and stays as it is: no unknown key, no number in quotes, no infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


_Step = int | str
_Table = typing.TypeVar("_Table", bound=BaseModel)


def shipped_files(package: str, folder: str) -> dict[str, Path]:
    """The TOML files that come with a package, by name."""
    found = Path(str(resources.files(package) / folder))
    return {path.stem: path for path in sorted(found.glob("*.toml"))}


def find_toml(name: str | Path, shipped: Mapping[str, Path], what: str) -> Path:
    """A path that ends with .toml as it is, else the shipped file of that name. Raises SpecError for an unknown name."""
    path = Path(name)
    if path.suffix == ".toml":
        return path
    if str(name) not in shipped:
        raise SpecError(unknown(what, str(name), shipped) + "; a file of your own ends with .toml")
    return shipped[str(name)]


def read_toml(path: Path, what: str) -> dict[str, typing.Any]:
    """The content of a TOML file; ``what`` it is, for the message. Raises SpecError, one line."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SpecError(f"{path.name}: cannot be read ({error.strerror}); give the path of a {what} file") from error
    except ValueError as error:  # no TOML, no UTF-8, or a number of more digits than Python reads
        raise SpecError(f"{path.name}: not a TOML file: {error}") from error
    except RecursionError as error:
        raise SpecError(f"{path.name}: is nested too deeply for a {what} file; write plain tables") from error


def load_toml(path: Path, model: type[_Table], what: str) -> _Table:
    """A TOML file as ``model``. Raises SpecError, one line: file, key, what is wrong, what would be right."""
    return read_table(model, read_toml(path, what), path.name)


def read_table(model: type[_Table], data: object, where: str, places: Places | None = None) -> _Table:
    """One table. Raises SpecError, one line, that starts with ``where`` it stands: with line and column if `places` are given."""
    if not isinstance(data, dict):
        raise SpecError(f"{where}: is {printable(repr(data), LONGEST_WORD)}; give a table")
    try:
        return model.model_validate(data)
    except ValidationError as error:
        if places is not None:
            where = f"{where}:{places.at(_complaints(error)[0]['loc'])}"
        raise SpecError(f"{where}: {first_error(error, model)}") from error


def read_kind(kinds: Mapping[str, type[_Table]], key: str, data: object, where: str) -> _Table:
    """One table of several kinds, told apart by `key`."""
    if not isinstance(data, dict) or not isinstance(data.get(key), str):
        raise SpecError(f"{where}: needs {key} = one of {', '.join(kinds)}")
    if data[key] not in kinds:
        raise SpecError(f"{where}: {unknown(where.rstrip('0123456789[]').rstrip('s'), data[key], kinds)}")
    return read_table(kinds[data[key]], data, where)


def first_error(error: ValidationError, model: type[BaseModel]) -> str:
    """The first complaint in full, and how many follow.

    An unknown key comes before a missing one: it is nearly always the missing one, misspelt.
    """
    complaints = _complaints(error)
    more = f" (and {len(complaints) - 1} more)" if len(complaints) > 1 else ""
    return _sentence(complaints[0], model) + more


def _complaints(error: ValidationError) -> list[ErrorDetails]:
    return sorted(error.errors(include_url=False), key=lambda item: item["type"] != "extra_forbidden")


def _sentence(complaint: ErrorDetails, model: type[BaseModel]) -> str:
    place, kind = complaint["loc"], complaint["type"]
    if kind == "extra_forbidden":
        table = _table_at(place[:-1], model)
        keys = [field.alias or name for name, field in table.model_fields.items()] if table is not None else []
        return f"{_dotted(place[:-1], 'top level')}: {unknown('key', str(place[-1]), keys)}"
    field = _field_at(place, model)
    example = field.examples[0] if field is not None and field.examples else None
    if kind == "missing":
        return f"{_dotted(place)}: missing; {_addition(place, field, example)}"
    text = _expected(complaint, example) or complaint["msg"].removeprefix("Value error, ")
    return f"{_dotted(place)}: {text}" if place else text


def _addition(place: Sequence[_Step], field: FieldInfo | None, example: object) -> str:
    """What a missing key would look like."""
    if example is not None:
        return f"add it, such as {place[-1]} = {json.dumps(example)}"
    if field is not None and _model_in(field.annotation) is not None:
        table = _dotted(place)
        return f"add a table [[{table}]]" if typing.get_origin(field.annotation) is list else f"add a table [{table}]"
    return "add it"


_BOUNDS = {"greater_than_equal": "ge", "greater_than": "gt", "less_than_equal": "le", "less_than": "lt"}
_WORDS = {"ge": "at least", "gt": "above", "le": "at most", "lt": "below"}


def _expected(complaint: ErrorDetails, example: object) -> str | None:
    """What was found and what is expected instead, for the complaints of pydantic that do not say it."""
    kind, context = complaint["type"], complaint.get("ctx", {})
    found = repr(complaint["input"])
    such = "" if example is None else f", such as {json.dumps(example)}"
    if len(found) > 60:
        found = found[:57] + "..."
    if kind in ("float_type", "float_parsing", "int_type", "int_parsing"):
        return f"{found} is not a number; write one without quotes{such}"
    if kind == "finite_number":
        return f"{found} is not finite; write a finite number{such}"
    if kind in _BOUNDS:
        bound = context[_BOUNDS[kind]]
        return f"{found} is out of range; it must be {_WORDS[_BOUNDS[kind]]} {bound:g}{such}"
    if kind == "literal_error":
        return f"{found} is not known; write {context['expected']}"
    if kind == "string_type":
        return f"{found} is not text; write it in quotes{such}"
    if kind == "string_too_short":
        return f"is empty; write at least one character{such}"
    if kind == "string_too_long":
        return f"{found} is too long; write at most {context['max_length']} character(s)"
    if kind == "bool_type":
        return f"{found} is not a truth value; write true or false"
    if kind in ("model_type", "dict_type"):
        return f"{found} is not a table; write key = value pairs in braces or below a [header]"
    if kind == "list_type":
        return f"{found} is not a list; write it as [[...]] tables or in square brackets"
    return None


def _dotted(place: Sequence[_Step], empty: str = "") -> str:
    text = ""
    for step in place:
        name = f"[{step}]" if isinstance(step, int) else printable(step, LONGEST_WORD)
        text += f".{name}" if text and isinstance(step, str) else name
    return text or empty


def _field_at(place: Sequence[_Step], model: type[BaseModel]) -> FieldInfo | None:
    """The field of the key at ``place``, if it is one of a model."""
    table = _table_at(place[:-1], model) if place else None
    return None if table is None else _field_of(table, place[-1])


def _field_of(model: type[BaseModel], step: _Step) -> FieldInfo | None:
    return next((field for name, field in model.model_fields.items() if step in (name, field.alias)), None)


def _table_at(place: Sequence[_Step], model: type[BaseModel]) -> type[BaseModel] | None:
    """The model of the table at ``place``."""
    for step in place:
        field = None if isinstance(step, int) else _field_of(model, step)
        if field is None:  # an index, or a key of a mapping: its table is the model already stepped into
            continue
        found = _model_in(field.annotation)
        if found is None:
            return None
        model = found
    return model


def _model_in(annotation: object) -> type[BaseModel] | None:
    """The first model inside ``list[M]``, ``dict[str, M]`` or ``M | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for m in map(_model_in, typing.get_args(annotation)) if m is not None), None)
