"""Reading logs: what is repaired, what is counted, and what is refused with the line it stands on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.drives.csv_log import read_columns
from studies.drives.log import read_log
from studies.errors import LogError
from tests.support.drive_logs import HEADER, drive, read, rows
from tests.support.schedule_content import EFFECTIVE_RADIUS
from tests.support.synthetic_drive import DRIVE, columns, write_log

TIMES = ["0.000", "0.005", "0.010", "0.015", "0.020"]
GOOD = rows(TIMES)
REFUSALS = {
    "unknown column": (
        GOOD.replace("w_fl", "w_f1"),
        "log.csv: signals.wheel_speed_fl: unknown column 'w_fl'; did you mean w_",
    ),
    "column twice": (GOOD.replace("v,ax", "ax,ax"), "log.csv: reference.vx: unknown column 'v'; known: "),
    "empty file": ("", "log.csv: is empty; record again or give another file"),
    "header alone": (HEADER + "\n", "log.csv: has a header but no rows; record again or give another file"),
    "single row": (rows(TIMES[:1]), "log.csv: holds a single time stamp; a drive needs at least two"),
    "open quote": (GOOD.replace("v,ax", 'v,"ax'), "log.csv: line 1 opens a quote that it does not close"),
    "text": (
        GOOD.replace("0.010,1.0", "0.010,ERR"),
        "log.csv: line 4: column 'v' holds 'ERR', not a number; leave the cell empty where nothing was measured",
    ),
    "truncated row": (
        GOOD.removesuffix(",1.0,1.0\n"),
        "log.csv: line 6 has 5 fields where the header has 7; the row is cut off: repair or remove the line",
    ),
    "long row": (
        GOOD.replace("0.010,", "0.010,3,"),
        "log.csv: line 4 has 8 fields where the header has 7; repair or remove the line",
    ),
    "time missing": (GOOD.replace("0.010,", ","), "log.csv: line 4 has no time stamp; remove the line"),
    "unsorted": (
        rows(["0.000", "0.010", "0.005", "0.015"]),
        "log.csv: time runs backwards on line 4 (0.005 s after 0.01 s); repair the log, or set sort = true for it in "
        "the drive file",
    ),
    "clock set during the log": (
        rows(["0", "0.005", "0.01", "1700000000.015", "1700000000.02"]),
        "log.csv: time column 't' jumps by 1.7e+09 s on line 5 (from 0.01 s to 1700000000 s), at most 10 s may be missing; "
        "correct the clock from there on, or cut the log in two",
    ),
    "wrong time unit": (
        rows(["0", "5", "10", "15"]),
        "log.csv: rows are 5 s apart where log 'log' says 200 Hz; correct its rate or its time_unit (now 's', "
        'likely time_unit = "ms")',
    ),
}


@pytest.mark.parametrize(("content", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusals_name_file_line_and_remedy(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(LogError) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_refused_duplicate_names_its_line(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"time 0\.005 s appears twice, again on line 4; set duplicates"):
        read(tmp_path, rows(["0", "0.005", "0.005", "0.01"]), 'duplicates = "refuse"')


def test_a_column_name_that_appears_twice_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,a,a\n0,1,2\n")
    with pytest.raises(LogError, match="column 'a' appears 2 times"):
        read_columns(path, {"t": "time", "a": "signal"})


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"^gone\.csv: cannot be read \(no such file\)"):
        read_log([tmp_path / "gone.csv"], drive(tmp_path))


def test_cells_that_hold_no_number_are_missing_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("﻿t,a\n0, 1\n1,\n2,NaN\n3,inf\n4,5e0\n", encoding="utf-8")
    found = read_columns(path, {"t": "time", "a": "signal"})
    np.testing.assert_array_equal(found.values["a"], [1, np.nan, np.nan, np.nan, 5])
    assert found.not_finite == {"a": 3}


@pytest.mark.parametrize(("rule", "expected"), [("mean", 2.0), ("last", 3.0)])
def test_duplicates_are_merged_and_counted(tmp_path: Path, rule: str, expected: float) -> None:
    text = HEADER + "\n" + "".join(f"{t},{v},1,1,1,1,1\n" for t, v in [(0, 0), (0.005, 1), (0.005, 3), (0.01, 4)])
    log = read(tmp_path, text, f'duplicates = "{rule}"')
    np.testing.assert_allclose(log.reference["vx"], [0, expected, 4])
    assert log.report["logs"]["log"]["duplicates"] == 1


def test_unsorted_rows_are_sorted_on_request(tmp_path: Path) -> None:
    text = HEADER + "\n" + "".join(f"{t},{t},1,1,1,1,1\n" for t in (0.0, 0.01, 0.005, 0.015))
    log = read(tmp_path, text, "sort = true")
    np.testing.assert_allclose(log.reference["vx"], log.time, atol=1e-12)
    assert log.report["logs"]["log"]["out_of_order"] == 1


def test_a_clock_that_was_set_back_is_not_sorted_into_itself(tmp_path: Path) -> None:
    """Rows that come late fill gaps, and columns of another sensor at the same times are merged; a second drive is neither."""
    twice = [f"{0.005 * (k % 40):g}" for k in range(60)]
    for extra in ("", "sort = true"):
        with pytest.raises(
            LogError, match=r"backwards on line 42 \(0 s after 0\.195 s\) and goes on from there; correct the clock"
        ):
            read(tmp_path, rows(twice), extra)
    order = [*range(15), *range(30, 40), *range(15, 30)]
    late = read(tmp_path, rows([f"{0.005 * k:g}" for k in order]), "sort = true")
    assert late.time.size == 40
    times = [f"{0.005 * k:g}" for k in range(40)]
    blocks = [f"{t},1,1,,,," for t in times] + [f"{t},,,1,1,1,1" for t in times]
    assert read(tmp_path, HEADER + "\n" + "\n".join(blocks) + "\n", "sort = true").time.size == 40


def test_milliseconds_and_other_delimiters(tmp_path: Path) -> None:
    text = rows(["0", "5", "10", "15"]).replace(",", ";")
    log = read(tmp_path, text, 'time_unit = "ms"\ndelimiter = ";"')
    np.testing.assert_allclose(log.time, [0, 0.005, 0.01, 0.015])


def test_gaps_stay_empty_and_their_ends_stay_measured(tmp_path: Path) -> None:
    log = read(tmp_path, rows(["0", "0.005", "0.01", "0.05", "0.055"]), 'max_gap = "20 ms"')
    missing = np.isnan(log.signals["ax"])
    np.testing.assert_array_equal(log.time[missing], log.time[3:10])
    entry = log.report["logs"]["log"]
    assert (entry["gaps"], entry["largest_gap_s"]) == (1, pytest.approx(0.04))
    assert log.report["grid"]["missing_samples"] == dict.fromkeys(log.report["grid"]["missing_samples"], 7)


def test_linear_signals_survive_resampling_from_a_jittered_clock(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 2, 2000))
    table = {"t": t, **dict.fromkeys(HEADER.split(",")[1:], 3 * t - 1)}
    text = DRIVE.replace("200 Hz", "1 kHz").replace('time = "t"', 'time = "t"\nmax_gap = "100 ms"')
    log = read_log([write_log(tmp_path / "log.csv", table)], drive(tmp_path, text))
    np.testing.assert_allclose(log.signals["ax"], 3 * log.time - 1, atol=1e-9)


TWO = (
    DRIVE.replace("200 Hz", "1 kHz")
    .replace("[signals]", '[[log]]\nname = "imu"\nfile = "*_imu.csv"\ntime = "t"\nrate = "100 Hz"\nCLOCK\n\n[signals]')
    .replace('column = "', 'log = "log", column = "')
    .replace('log = "log", column = "ax"', 'log = "imu", column = "ax"')
    .replace('name = "log"', 'name = "log"\nfile = "*_car.csv"')
)


def two_files(folder: Path, shift: float) -> list[Path]:
    """One drive with a braking pulse, seen by two clocks: that of the inertial unit reads ``shift`` more."""
    car, imu = np.arange(0, 8, 0.001), np.arange(0.5, 7.2, 0.01)
    table = {name: value for name, value in columns(0.0).items() if not name.startswith("T_")}
    values = {name: np.full_like(car, 1.0) for name in table}
    velocity = 20 + np.sin(1.3 * car) + 0.3 * np.cos(7 * car)
    values |= dict.fromkeys((name for name in values if name.startswith("w_")), velocity / EFFECTIVE_RADIUS)
    values |= {"t": car, "v": velocity}
    felt = {"t": imu + shift, "ax": 1.3 * np.cos(1.3 * imu) - 2.1 * np.sin(7 * imu)}
    return [write_log(folder / "run_car.csv", values), write_log(folder / "run_imu.csv", felt)]


@pytest.mark.parametrize("shift", [0.0, 0.0123, -117.2468])
@pytest.mark.parametrize("aligned", ["imu", "log"])
def test_the_offset_between_two_clocks_is_found_below_the_sample_time(
    tmp_path: Path, shift: float, aligned: str
) -> None:
    align = 'align = { to = "OTHER" }'
    text = TWO.replace("CLOCK", align.replace("OTHER", "log") if aligned == "imu" else "")
    if aligned == "log":
        text = text.replace('file = "*_car.csv"', 'file = "*_car.csv"\n' + align.replace("OTHER", "imu"))
    log = read_log(two_files(tmp_path, shift), drive(tmp_path, text))
    entry = log.report["logs"][aligned]
    assert entry["clock_offset_s"] == pytest.approx(shift if aligned == "log" else -shift, abs=2e-4)
    assert entry["alignment"]["correlation"] > 0.9999
    assert entry["alignment"]["slope"] == pytest.approx(1.0, abs=0.01)
    t = log.time - (shift if aligned == "log" else 0.0)
    np.testing.assert_allclose(log.signals["ax"], 1.3 * np.cos(1.3 * t) - 2.1 * np.sin(7 * t), atol=0.01)


def test_a_given_offset_is_used_as_it_is(tmp_path: Path) -> None:
    text = TWO.replace("CLOCK", 'clock_offset = "-2 s"')
    log = read_log(two_files(tmp_path, 2.0), drive(tmp_path, text))
    assert (log.time[0], log.time[-1]) == (pytest.approx(0.5), pytest.approx(7.19))


def test_logs_without_common_time_or_common_drive_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="the logs log, imu do not overlap on one clock"):
        read_log(two_files(tmp_path, 500.0), drive(tmp_path, TWO.replace("CLOCK", "")))
    car, imu = two_files(tmp_path, 0.0)
    t = np.arange(0, 7, 0.01)
    write_log(imu, {"t": t, "ax": np.random.default_rng(2).normal(size=t.size)})
    with pytest.raises(LogError, match=r"cannot be aligned: best correlation 0\.\d\d, needed 0\.9; check the signs"):
        read_log([car, imu], drive(tmp_path, TWO.replace("CLOCK", 'align = { to = "log" }')))


def test_files_find_their_logs(tmp_path: Path) -> None:
    car, imu = two_files(tmp_path, 0.0)
    plan = drive(tmp_path, TWO.replace("CLOCK", ""))
    for given in ([car, imu], [imu, car], [tmp_path]):
        assert read_log(given, plan).report["logs"]["imu"]["file"] == "run_imu.csv"
    with pytest.raises(
        LogError, match=r"log 'imu' needs one file like '\*_imu.csv', given: run_car.csv, which is none"
    ):
        read_log([car], plan)
    other = write_log(tmp_path / "other.csv", columns(0.1))
    with pytest.raises(LogError, match=r"other\.csv: belongs to no log of the drive file"):
        read_log([car, imu, other], plan)


def test_files_without_patterns_are_taken_in_order(tmp_path: Path) -> None:
    text = TWO.replace("CLOCK", "").replace('file = "*_car.csv"', "").replace('file = "*_imu.csv"', "")
    report = read_log(two_files(tmp_path, 0.0), drive(tmp_path, text)).report
    assert (report["logs"]["log"]["file"], report["logs"]["imu"]["file"]) == ("run_car.csv", "run_imu.csv")
