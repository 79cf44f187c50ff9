"""Where two pieces of plain data differ, in words."""

from __future__ import annotations

from typing import Any


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
