"""What a paper prints, read once from its folder: ``claims.toml`` (every claim) and ``printed.toml`` (tables and numbers)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

from studies.claim import JsonValue, Published


@cache
def published_claims(package: str) -> Mapping[str, Published]:
    """The claims that ``package`` (a study's folder) keeps in its ``claims.toml``, by id, in the order of the file."""
    entries = _read(package, "claims.toml")["claims"]
    return MappingProxyType({entry["id"]: Published(**{"published": None, **entry}) for entry in entries})


def printed(package: str, name: str) -> JsonValue:
    """The printed value of the claim ``name``."""
    return published_claims(package)[name].published


@cache
def printed_numbers(package: str) -> Mapping[str, Any]:
    """Printed tables and values by name, from ``printed.toml``."""
    return MappingProxyType(_read(package, "printed.toml"))


def _read(package: str, name: str) -> dict[str, Any]:
    return tomllib.loads((resources.files(package) / name).read_text(encoding="utf-8"))
