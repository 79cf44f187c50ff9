"""Reads a ``claims.toml`` and puts every published claim beside the function that computes it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources

from studies.claim import Claim, ClaimFunction, Published
from synthesis.errors import SpecError


def published_claims(package: str) -> dict[str, Published]:
    """The claims that ``package`` (a study's folder) keeps in its ``claims.toml``, by id, in the order of the file."""
    text = (resources.files(package) / "claims.toml").read_text(encoding="utf-8")
    entries = tomllib.loads(text)["claims"]
    return {e["id"]: Published(**{"published": None, **e}) for e in entries}


def computed_claims(package: str, functions: Mapping[str, ClaimFunction]) -> list[Claim]:
    """Compute the claims of ``functions`` (by id). Raises SpecError for an id that ``claims.toml`` does not hold."""
    published = published_claims(package)
    unknown = sorted(set(functions) - set(published))
    if unknown:
        raise SpecError(f"{package}: no published claim {', '.join(unknown)} in claims.toml")
    return [Claim(published[name], compute()) for name, compute in functions.items()]
