"""Result files are whole or absent, whatever happens while they are written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from studies.drives.output import ready_folder, whole_file, write_csv, write_json


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


def test_folders_are_made_with_their_parents(tmp_path: Path) -> None:
    ready_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()
