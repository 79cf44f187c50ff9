"""What made a result: versions of the packages that compute, and a fingerprint of our own code."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import version

from studies.execution.fingerprint import Sources

ROOTS = ("studies.sweeps.engine", "studies.sweeps.spec")  # all that a measure of a sweep file may use
OTHERS = ("gainsmith", "numpy", "scipy", "sympy", "pyarrow")


@cache
def versions() -> dict[str, str]:
    """By name; `code` covers every module that a measure of a file may use, so that an edit is never taken for a repeat."""
    return {
        "code": Sources().fingerprint(None, ROOTS)[:16],
        "python": platform.python_version(),
        "machine": platform.machine(),
        **{name: version(name) for name in OTHERS},
    }
