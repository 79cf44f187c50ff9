"""Observer gain schedules that carry their own proof: everything that users call, behind one door.

`import gainsmith` or `from gainsmith import LpvModel, design_observer, deploy`. The names are those of the doors `estimators`,
`synthesis`, `analysis` and `studies`, and are imported when they are used.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("estimators", "synthesis", "analysis", "studies")
__version__ = version("gainsmith")


def hidden_by() -> tuple[str, str] | None:
    """(package, folder) of a folder of somebody else's that Python finds in the place of one of ours; None if there is none."""
    home = Path(__file__).resolve().parents[1]
    for name in PACKAGES:
        spec = find_spec(name)
        folders = (spec.submodule_search_locations if spec else None) or ()
        file = [spec.origin] if spec and spec.origin and not folders else []
        found = [Path(place).resolve() for place in (*folders, *file)]
        if home / name not in found:
            return name, str(found[0]) if found else "nothing"
    return None


if _hidden := hidden_by():
    raise ImportError(
        f"{_hidden[1]} hides gainsmith's package '{_hidden[0]}': rename that folder, or run from another one"
    )


_HOMES = {name: package for package in PACKAGES for name in import_module(package).__all__}
__all__: list[str] = sorted(_HOMES)  # noqa: PLE0605 - a list, made of the doors


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"gainsmith has no '{name}'; there are: {', '.join(__all__)}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
