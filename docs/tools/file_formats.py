"""The page on file formats: keys of the files that users write, from the very classes that read them."""

from __future__ import annotations

import json
import re
import types
import typing
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel

from docs.tools.pages import ROOT

NUMBERS = {float: "number", int: "whole number", str: "text", bool: "true or false"}


def files_page() -> str:
    """`docs/pages/reference/files.md.in` with its tables filled in: a line `{{ module:Class }}` becomes the keys of the class."""
    from importlib import import_module

    def table(match: re.Match[str]) -> str:
        model = getattr(import_module(match[1]), match[2])
        return "\n".join(
            ["| key | value | default |", "|---|---|---|", *(_row(*item) for item in model.model_fields.items())]
        )

    text = (ROOT / "docs/pages/reference/files.md.in").read_text(encoding="utf-8")
    return re.sub(r"^\{\{ ([\w.]+):(\w+) \}\}$", table, text, flags=re.M)


def _row(key: str, field: Any) -> str:
    read_by = f"{field.annotation} {field.metadata}"
    if "_quantity" in read_by:
        value = 'quantity such as `"5 ms"`'
    elif "BeforeValidator" in read_by:
        value = "name = formula"
    else:
        value = _words(field.annotation)
    if field.is_required():
        default = "needed"
    elif field.default_factory is not None or isinstance(field.default, BaseModel):
        default = "see its own keys" if isinstance(field.default, BaseModel) else "empty"
    else:
        default = "none" if field.default in (None, "") else f"`{json.dumps(field.default)}`"
    return f"| `{field.alias or key}` | {value} | {default} |"


def _words(kind: Any) -> str:
    if kind in NUMBERS:
        return NUMBERS[kind]
    origin, inside = get_origin(kind), [part for part in get_args(kind) if part is not type(None)]
    if origin is Literal:
        return ", ".join(f'`"{value}"`' for value in inside)
    if origin in (types.UnionType, typing.Union):
        return " or ".join(_words(part) for part in inside)
    if origin is list:
        return (
            re.sub(r"numbers?$", "numbers", f"list of {_words(inside[0])}")
            if not _is_table(inside[0])
            else "tables, see below"
        )
    if origin is tuple:
        return f"list of {len(inside)} numbers" if Ellipsis not in inside else f"list of {_words(inside[0])}"
    if origin is dict:
        return "table of names" if not inside else f"name = {_words(inside[1])}"
    if origin is typing.Annotated:
        return _words(inside[0])
    return "table, see below" if _is_table(kind) else "see the text"


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
