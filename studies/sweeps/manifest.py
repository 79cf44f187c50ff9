"""What made a sweep, and where two manifests differ, in words."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import version
from typing import Any

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


def differences(old: Any, new: Any, place: str = "") -> list[str]:
    """Every difference as 'place was old, is now new'; empty if there is none."""
    if isinstance(old, dict) and isinstance(new, dict):
        found = []
        for key in dict.fromkeys([*old, *new]):
            where = f"{place}.{key}" if place else str(key)
            if key not in new:
                found.append(f"{where} was {_short(old[key])}, is now missing")
            elif key not in old:
                found.append(f"{where} is new: {_short(new[key])}")
            else:
                found += differences(old[key], new[key], where)
        return found
    if isinstance(old, list | tuple) and isinstance(new, list | tuple):
        if len(old) != len(new):
            return [f"{place} had {len(old)} entries, has now {len(new)}"]
        return [d for i, (a, b) in enumerate(zip(old, new, strict=True)) for d in differences(a, b, f"{place}[{i}]")]
    return [] if old == new else [f"{place} was {_short(old)}, is now {_short(new)}"]


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
