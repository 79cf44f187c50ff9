"""What preparations leave for the parts of a run: folders that are whole, of the same sources and scope, or not there."""

from __future__ import annotations

import shutil
from pathlib import Path

from studies.running.store import FOLDER
from studies.running.whole_folder import sweep, whole_folder
from studies.study import Preparation, Scope

HIDDEN = ".prepared"  # no study can have this name
MARK = "fingerprint"


def prepared_root(out: Path) -> Path:
    """The folder that a part finds as ``scope.prepared``."""
    return out / FOLDER / HIDDEN


def is_prepared(out: Path, name: str, fingerprint: str) -> bool:
    """Whether the preparation is there and belongs to the same sources and scope."""
    try:
        return (prepared_root(out) / name / MARK).read_text(encoding="utf-8") == fingerprint
    except (FileNotFoundError, NotADirectoryError, UnicodeDecodeError):
        return False


def prepare(preparation: Preparation, out: Path, scope: Scope, fingerprint: str) -> None:
    """Run the preparation and store what it writes, whole or not at all."""
    with whole_folder(prepared_root(out) / preparation.name) as beside:
        preparation.run(scope, beside)
        (beside / MARK).write_text(fingerprint, encoding="utf-8")


def sweep_prepared(out: Path) -> None:
    """Remove what killed runs left unfinished among the preparations."""
    sweep(prepared_root(out))


def discard_prepared(out: Path) -> None:
    """Remove all preparations: once every part is stored nobody reads them, and they are large."""
    shutil.rmtree(prepared_root(out), ignore_errors=True)
