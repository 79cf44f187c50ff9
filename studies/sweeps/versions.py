"""What made a result: versions of the packages that compute, and a digest of our own code."""

from __future__ import annotations

import hashlib
import platform
from functools import lru_cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path

PACKAGES = (
    "analysis",
    "estimators",
    "studies.drives",
    "studies.trials",
    "studies.sweeps",
    "studies.truth",
    "synthesis",
)
OTHERS = ("gainsmith", "numpy", "scipy", "sympy", "pyarrow")


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """By name; `code` is a digest of every module that a measure may use, so that an edit is never taken for a repeat."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        root = Path(str(resources.files(package)))
        for path in sorted(root.rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    found = {name: version(name) for name in OTHERS}
    return {
        "code": digest.hexdigest()[:16],
        "python": platform.python_version(),
        "machine": platform.machine(),
        **found,
    }
