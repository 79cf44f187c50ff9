"""Result files are whole or absent, whatever happens while they are written."""

from __future__ import annotations

import fcntl
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from studies.execution.files import LOCK, check_folder, only_run, ready_folder, whole_file, write_csv, write_json
from synthesis.errors import SpecError

ROOT = Path(__file__).parents[2]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "metrics.json"
    write_json(path, {"old": 1})
    before = path.read_bytes()
    with pytest.raises(RuntimeError, match="disk"), whole_file(path) as beside:
        beside.write_text("half")
        raise RuntimeError("disk")
    with pytest.raises(ValueError, match="JSON compliant"):
        write_json(path, {"rms": float("nan")})
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_missing_numbers_are_empty_cells(tmp_path: Path) -> None:
    path = tmp_path / "estimates.csv"
    write_csv(path, {"a": np.array([1.0, np.nan]), "b": np.array([1, 2])})
    assert path.read_text() == "a,b\n1.000000,1\n,2\n"
    assert pl.read_csv(path)["a"].null_count() == 1


def test_a_folder_that_cannot_be_is_known_before_there_is_anything_to_write(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("x")
    for out in (tmp_path / "mine", tmp_path / "mine" / "below"):
        with pytest.raises(
            SpecError, match=r"mine.*: cannot be a folder for results \(mine is a file\); give another --out"
        ):
            check_folder(out)
    check_folder(tmp_path / "new" / "below")
    check_folder(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


def test_folders_are_made_with_their_parents(tmp_path: Path) -> None:
    ready_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()


HOLDER = """
import sys
from pathlib import Path
from studies.execution.files import only_run
with only_run(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_folder_is_held_by_one_run_and_left_clean(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path)],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None and other.stdout.readline() == "held\n"
        with pytest.raises(SpecError, match=rf"another run writes here \(process {other.pid}\)"), only_run(tmp_path):
            raise AssertionError("two runs in one folder")
        other.communicate("", timeout=60)
    with only_run(tmp_path):
        assert [path.name for path in tmp_path.iterdir()] == [LOCK]
    assert not list(tmp_path.iterdir())


def test_who_locked_a_file_that_was_just_removed_takes_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lockf, removed = fcntl.lockf, []

    def slow(file: Any, flags: int) -> None:
        lockf(file, flags)
        if not removed:  # the run before ended between our look and our lock
            removed.append(file.fileno())
            (tmp_path / LOCK).unlink()

    monkeypatch.setattr("studies.execution.files.fcntl.lockf", slow)
    with only_run(tmp_path):
        assert removed and (tmp_path / LOCK).exists()
