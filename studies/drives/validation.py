"""Turn what pydantic reports into one line that names the key, what is wrong and the nearest known key."""

from __future__ import annotations

import tomllib
import typing
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ValidationError

from synthesis.errors import SpecError, unknown

_Step = int | str
_Model = typing.TypeVar("_Model", bound=BaseModel)


def read_toml(path: Path, model: type[_Model], what: str) -> _Model:
    """The content of a TOML file; ``what`` it is, for the message.

    Raises SpecError, one line: file, key, what is wrong, what would be right.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SpecError(f"{path.name}: cannot be read ({error.strerror}); give the path of a {what} file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SpecError(f"{path.name}: not a TOML file: {error}") from error
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise SpecError(f"{path.name}: {first_error(error, model)}") from error


def first_error(error: ValidationError, model: type[BaseModel]) -> str:
    """The first complaint in full, and how many follow.

    An unknown key comes before a missing one: it is nearly always the missing one, misspelt.
    """
    complaints = error.errors(include_url=False)
    complaints.sort(key=lambda item: item["type"] != "extra_forbidden")
    more = f" (and {len(complaints) - 1} more)" if len(complaints) > 1 else ""
    first = complaints[0]
    return _sentence(first["loc"], first["type"], first["msg"], model) + more


def _sentence(place: Sequence[_Step], kind: str, message: str, model: type[BaseModel]) -> str:
    if kind == "extra_forbidden":
        keys = _keys_at(place[:-1], model)
        return f"{_dotted(place[:-1], 'top level')}: {unknown('key', str(place[-1]), keys)}"
    if kind == "missing":
        return f"{_dotted(place)}: missing; add it"
    text = message.removeprefix("Value error, ")
    return f"{_dotted(place)}: {text}" if place else text


def _dotted(place: Sequence[_Step], empty: str = "") -> str:
    text = ""
    for step in place:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text or empty


def _keys_at(place: Sequence[_Step], model: type[BaseModel]) -> list[str]:
    """The keys that the table at ``place`` may have."""
    for step in place:
        if isinstance(step, int) or model is None:
            continue
        field = next((f for name, f in model.model_fields.items() if step in (name, f.alias)), None)
        if field is None:  # a key of a mapping: its table is the model already stepped into
            continue
        found = _model_in(field.annotation)
        if found is None:
            return []
        model = found
    return [field.alias or name for name, field in model.model_fields.items()]


def _model_in(annotation: object) -> type[BaseModel] | None:
    """The first model inside ``list[M]``, ``dict[str, M]`` or ``M | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for m in map(_model_in, typing.get_args(annotation)) if m is not None), None)
