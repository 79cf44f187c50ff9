"""The files of a run: per study result.json, tables and figures; over all studies claims.json."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from studies.execution.files import json_bytes, whole_folder
from studies.parts.record import StudyRecord
from synthesis.errors import SpecError

SCHEMA = "gainsmith.study/1"
RESULT = "result.json"


def write_study(record: StudyRecord, out: Path) -> None:
    """Fill ``out/<id>`` anew, whole or not at all."""
    with whole_folder(out / record.id) as folder:
        for kind in ("tables", "figures"):
            if any(getattr(stored, kind) for stored in record.stored):
                (folder / kind).mkdir()
        for stored in record.stored:
            for table in stored.tables:
                write_table(folder / "tables" / f"{table['name']}.csv", table["columns"], table["rows"])
            for figure in stored.figures:
                for kind in ("svg", "png"):
                    name = f"{figure['name']}.{kind}"
                    shutil.copyfile(stored.folder / name, folder / "figures" / name)
        (folder / RESULT).write_bytes(json_bytes(result_content(record), 2))


def result_content(record: StudyRecord) -> dict[str, Any]:
    """``result.json``: what was computed, with which scope and sources, and what failed."""
    return {
        "schema": SCHEMA, "id": record.id, "title": record.title, "paper": record.paper, "summary": record.summary,
        "scope": {"quick": record.scope.quick, "seeds": record.scope.seeds},
        "gainsmith": version("gainsmith"), "fingerprint": record.fingerprint,
        "parts": [
            {
                "name": part.name, "title": part.title, "notes": part.stored.notes, "measures": part.stored.measures,
                "claims": [claim["id"] for claim in part.stored.claims],
                "tables": [
                    {"name": t["name"], "caption": t["caption"], "columns": t["columns"],
                     "file": f"tables/{t['name']}.csv"}
                    for t in part.stored.tables
                ],
                "figures": [
                    {**figure, "files": [f"figures/{figure['name']}.{kind}" for kind in ("svg", "png")]}
                    for figure in part.stored.figures
                ],
            }
            for part in record.parts if part.stored is not None
        ],
        "failed": [{"part": part.name, "message": part.failure} for part in record.parts if part.stored is None],
        "left_out": list(record.left_out), "claims": record.claims, "missing_claims": list(record.missing_claims),
    }  # fmt: skip


def check_replaceable(folder: Path) -> None:
    """Raises SpecError unless ``folder`` is absent or was written by a study: nothing else is ever replaced."""
    if folder.exists() and read_result(folder) is None:
        raise SpecError(f"{folder}: exists and is no result of a study; move it away or give another --out")


def read_result(folder: Path) -> dict[str, Any] | None:
    """``result.json`` of a study's folder, or None where there is none."""
    try:
        content = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) and content.get("schema") == SCHEMA else None


def write_table(path: Path, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Comma-separated, full precision, what is missing an empty cell, truth values ``true`` and ``false`` as in JSON."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([json.dumps(value) if isinstance(value, bool) else value for value in row] for row in rows)
