"""Doors of packages: names listed in the stub ``__init__.pyi`` beside an ``__init__.py``, imported when they are used."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path


def door(package: str, file: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of the package whose ``__init__.py`` is `file`.

    The stub has one line for each name, ``from .module import name as name``, which type checkers read as it is.
    """
    lines = [line.split() for line in Path(file).with_suffix(".pyi").read_text(encoding="ascii").splitlines()]
    homes = {words[3]: words[1] for words in lines if words[:1] == ["from"]}

    def find(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(homes[name], package), name)

    return find, lambda: sorted(homes), sorted(homes)
