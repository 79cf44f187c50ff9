"""Parts and preparations on disk: written whole, read back only when they belong to the same sources and scope."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from studies.claim import JsonValue
from studies.execution.files import json_bytes, plain, whole_folder
from studies.plots.save import save_figure
from studies.study import PartResult, Preparation, Scope

FOLDER = ".parts"
FILE = "part.json"
SEAL = "sha256"  # of the rest: the report reads its parts without doubting each entry
PREPARED = ".prepared"  # no study can have this name
MARK = "fingerprint"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


@dataclass(frozen=True)
class StoredPart:
    """What a part left on disk, as JSON holds it; ``folder`` has ``<figure>.svg`` and ``.png`` for each figure."""

    folder: Path
    fingerprint: str
    claims: list[dict[str, JsonValue]] = field(default_factory=list)
    tables: list[dict[str, Any]] = field(default_factory=list)
    figures: list[dict[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    measures: dict[str, float | None] = field(default_factory=dict)


def part_folder(out: Path, study: str, part: str) -> Path:
    """Where the part is kept below the output folder ``out``."""
    return out / FOLDER / study / part


def write_part(folder: Path, result: PartResult, fingerprint: str) -> None:
    """Store ``result`` in ``folder``, whole or not at all. Raises ValueError or TypeError for what cannot be stored."""
    content = content_of(result, fingerprint)
    with whole_folder(folder) as beside:
        for figure in result.figures:
            save_figure(figure, beside)
        (beside / FILE).write_bytes(json_bytes(content | {SEAL: _digest(content)}))


def content_of(result: PartResult, fingerprint: str) -> dict[str, Any]:
    """``result`` as JSON; checks that names can be file names, differ, and that every row fills its columns."""
    check_names("table", [table.name for table in result.tables])
    check_names("figure", [figure.name for figure in result.figures])
    check_distinct("claim", [claim.published.id for claim in result.claims])
    for table in result.tables:
        for number, row in enumerate(table.rows, 1):
            if len(row) != len(table.columns):
                cells = f"{len(row)} cells for {len(table.columns)} columns"
                raise ValueError(f"table '{table.name}': row {number} has {cells}")
    return {
        "fingerprint": fingerprint,
        "claims": [plain(claim.row(), f"claim {claim.published.id}") for claim in result.claims],
        "tables": [
            {"name": t.name, "caption": t.caption, "columns": list(t.columns), "rows": plain(list(t.rows), t.name)}
            for t in result.tables
        ],
        "figures": [{"name": d.name, "caption": d.caption, "alternative": d.alternative} for d in result.figures],
        "notes": list(result.notes),
        "measures": plain(result.measures, "measures"),
    }  # fmt: skip


def read_part(folder: Path, fingerprint: str) -> StoredPart | None:
    """The stored part, or None when there is none, when it is damaged, or when it has another fingerprint."""
    try:
        content = json.loads((folder / FILE).read_text(encoding="utf-8"))
        whole = isinstance(content, dict) and content.pop(SEAL, None) == _digest(content)
    except (FileNotFoundError, NotADirectoryError, ValueError, RecursionError):
        return None
    if not whole or content.get("fingerprint") != fingerprint:
        return None
    stored = StoredPart(folder=folder, **content)
    names = [f"{figure['name']}.{kind}" for figure in stored.figures for kind in ("svg", "png")]
    return stored if all((folder / name).is_file() for name in names) else None


def _digest(content: dict[str, Any]) -> str:
    return sha256(json_bytes(content)).hexdigest()


def prepared_root(out: Path) -> Path:
    """The folder that a part finds as ``scope.prepared``."""
    return out / FOLDER / PREPARED


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


def discard_prepared(out: Path) -> None:
    """Remove all preparations: once every part is stored nobody reads them, and they are large."""
    shutil.rmtree(prepared_root(out), ignore_errors=True)


def check_names(what: str, names: Sequence[str]) -> None:
    """Raises ValueError unless all ``names`` can be file names and differ."""
    for name in names:
        if not NAME.fullmatch(name):
            raise ValueError(f"{what} '{name}': names are letters, digits, '-', '_' and '.'")
    check_distinct(what, names)


def check_distinct(what: str, names: Sequence[str]) -> None:
    """Raises ValueError when a name occurs twice."""
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"{what} '{twice[0]}' occurs twice")
