"""What a stored result depends on: every source and data file of the packages, the libraries, and the scope."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterator, Sequence
from hashlib import sha256
from importlib.metadata import requires, version
from pathlib import Path

from studies.study import Scope

PACKAGES = ("estimators", "synthesis", "analysis", "studies")
SOURCE_ROOT = Path(__file__).parents[2]

# What only shows results: a new colour in the report must not cost a quarter of an hour.
PRESENTATION = ("studies/commands", "studies/report/html", "studies/report/scoreboard", "studies/cli.py")


def fingerprint(scope: Scope, folders: Sequence[Path] | None = None) -> str:
    """Hexadecimal SHA-256 over the files of ``folders`` (default: the four packages), the library versions and ``scope``.

    Two runs with the same fingerprint compute the same results, so that a stored part can be used again.
    """
    digest = sha256(repr((scope, *_libraries())).encode())
    for folder in folders if folders is not None else [SOURCE_ROOT / name for name in PACKAGES]:
        for name, path in _files(folder):
            content = path.read_bytes()
            digest.update(f"\n{name} {len(content)}\n".encode())
            digest.update(content)
    return digest.hexdigest()


def _files(folder: Path) -> Iterator[tuple[str, Path]]:
    """Names relative to the parent of ``folder``, sorted: they do not depend on where the checkout lies."""
    named = {path.relative_to(folder.parent).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    for name, path in sorted(named.items()):
        hidden = any(part.startswith((".", "__pycache__")) for part in path.relative_to(folder).parts)
        if not hidden and not name.startswith(PRESENTATION):
            yield name, path


def _libraries() -> list[str]:
    needed = [line for line in requires("gainsmith") or [] if "extra ==" not in line]
    names = sorted(re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in needed)
    return [f"python {platform.python_version()}", *(f"{name} {version(name)}" for name in names)]
