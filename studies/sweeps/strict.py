"""Tables of a sweep file: strict, frozen, and refused in one line that offers the nearest names."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from synthesis.errors import SpecError, unknown


class Strict(BaseModel):
    """No unknown keys, no infinite numbers, no silent conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


Table = TypeVar("Table", bound=BaseModel)


def read_toml(path: Path, absent: str) -> dict[str, Any]:
    """The content of a TOML file. Raises SpecError, one line; `absent` is what to say where there is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SpecError(f"{path}: {absent}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise SpecError(f"{path}: {error}") from None


def read_table(kind: type[Table], data: Any, where: str) -> Table:
    """One table. Raises SpecError, one line, with every violation and the nearest known keys."""
    if not isinstance(data, dict):
        raise SpecError(f"{where}: is {data!r}; give a table")
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise SpecError(f"{where}: {_explain(error, kind)}") from None


def read_kind(kinds: Mapping[str, type[Table]], key: str, data: Any, where: str) -> Table:
    """One table of several kinds, distinguished by `key`."""
    if not isinstance(data, dict) or not isinstance(data.get(key), str):
        raise SpecError(f"{where}: needs {key} = one of {', '.join(kinds)}")
    if data[key] not in kinds:
        raise SpecError(f"{where}: {unknown(where.rstrip('0123456789[]').rstrip('s'), data[key], kinds)}")
    return read_table(kinds[data[key]], data, where)


def _explain(error: ValidationError, kind: type[BaseModel]) -> str:
    parts = []
    for entry in error.errors():
        place = ".".join(str(part) for part in entry["loc"])
        if entry["type"] == "extra_forbidden":
            known = kind.model_fields if len(entry["loc"]) == 1 else ()
            parts.append(f"{place}: {unknown('key', str(entry['loc'][-1]), known)}")
        else:
            text = entry["msg"].removeprefix("Value error, ")
            parts.append(f"{place}: {text[0].lower()}{text[1:]}" if place else text)
    return "; ".join(parts)
