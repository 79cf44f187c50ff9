"""The reference list beside the checkout, read for comparison."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "claims.json"


def reference_claims(paper: str) -> dict[str, dict[str, Any]]:
    """The entries of a paper by id; skips the test where the list is absent."""
    if not REFERENCE.is_file():
        pytest.skip("the shared reference claims are not beside the checkout")
    return {entry["id"]: entry for entry in json.loads(REFERENCE.read_text()) if entry["paper"] == paper}
