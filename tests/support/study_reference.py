"""The reference list beside the checkout, read for comparison."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "claims.json"


def reference_claims(paper: str) -> dict[str, dict[str, Any]]:
    """The entries of a paper by id; skips the test where the list is absent."""
    if not REFERENCE.is_file():
        pytest.skip("the shared reference claims are not beside the checkout")
    return {entry["id"]: entry for entry in json.loads(REFERENCE.read_text()) if entry["paper"] == paper}


def numbers(text: object) -> list[float]:
    """All numbers of a text (or of the JSON text of a value), signs included."""
    found = re.findall(
        r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", text if isinstance(text, str) else json.dumps(text)
    )
    return [float(entry) for entry in found]
