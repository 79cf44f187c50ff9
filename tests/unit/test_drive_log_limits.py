"""Clocks that jump, grids that no memory holds, and files that no log of the drive asks for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.drives.log import read_log
from studies.errors import LogError
from tests.support.drive_logs import HEADER, drive, read, rows
from tests.support.synthetic_drive import DRIVE, columns, write_log


@pytest.mark.parametrize(("gap", "refused"), [(9.0, False), (11.0, True)])
def test_ten_seconds_may_be_missing_and_no_more(tmp_path: Path, gap: float, refused: bool) -> None:
    content = rows(["0", "0.005", "0.01", *(f"{0.015 + gap + 0.005 * k:.3f}" for k in range(5))])
    if not refused:
        log = read(tmp_path, content)
        assert log.report["logs"]["log"]["gaps"] == 1
        assert np.isnan(log.signals["ax"]).sum() == pytest.approx(gap / 0.005, abs=2)
        return
    with pytest.raises(LogError, match=r"time column 't' jumps by 11\.005 s on line 5"):
        read(tmp_path, content)


def test_the_line_of_a_jump_is_that_of_the_file_also_where_rows_are_sorted(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"jumps by 9\d+\.\d+ s on line 3"):
        read(tmp_path, rows(["0.005", "1000.0", "0.000", "0.010", "0.015", "1000.005"]), "sort = true")


def test_more_samples_than_memory_holds_are_refused(tmp_path: Path) -> None:
    """A slow log of many hours on a fast grid: no single gap, and a grid of ten million samples."""
    text = DRIVE.replace("200 Hz", "0.02 Hz").replace('"5 ms"', '"1 ms"')
    log = write_log(
        tmp_path / "log.csv", {"t": np.arange(0, 1e4 + 1, 50.0), **dict.fromkeys(HEADER.split(",")[1:], np.ones(201))}
    )
    with pytest.raises(
        LogError, match=r"span 10000 s, 10000001 samples at sample_time = 0\.001 s, and at most 5000000"
    ):
        read_log([log], drive(tmp_path, text))


def test_a_file_that_fits_no_pattern_is_named_with_the_pattern(tmp_path: Path) -> None:
    plan = drive(tmp_path, DRIVE.replace('name = "log"', 'name = "log"\nfile = "run_*.csv"'))
    other = write_log(tmp_path / "other.csv", columns(0.1))
    for given, named in ((other, "other.csv, which is none"), (tmp_path, f"{tmp_path.name}, with none in it")):
        with pytest.raises(LogError) as caught:
            read_log([given], plan)
        assert str(caught.value).startswith(f"log 'log' needs one file like 'run_*.csv', given: {named}; ")
        assert "\n" not in str(caught.value)
    with pytest.raises(LogError, match=r"^run_7\.csv: cannot be read \(no such file\)"):
        read_log([tmp_path / "run_7.csv"], plan)
    assert read_log([other.rename(tmp_path / "run_7.csv")], plan).time.size == 21
