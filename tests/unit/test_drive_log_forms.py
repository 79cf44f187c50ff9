"""Logs as loggers write them: separators, encodings, clocks, units; and for each the key that a refusal names."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from studies.drives import quantities
from studies.drives.csv_log import CsvForm, read_columns
from studies.drives.drive_file import read_drive
from studies.drives.guess import guess
from studies.drives.log import read_log
from studies.errors import LogError
from synthesis.errors import SpecError
from tests.support.drive_logs import HEADER, drive, read, rows
from tests.support.synthetic_drive import DRIVE, columns, write_log

TIMES = [f"{0.005 * k:.3f}" for k in range(6)]
GOOD = rows(TIMES)


def stamped(form: Callable[[float], str]) -> str:
    return rows([form(0.005 * k) for k in range(6)])


FORMS: dict[str, tuple[bytes, str, str]] = {
    "semicolons": (GOOD.replace(",", ";").encode(), 'delimiter = ";"', 'set delimiter = ";"'),
    "tabs": (GOOD.replace(",", "\t").encode(), 'delimiter = "\\t"', 'set delimiter = "\\t"'),
    "UTF-16": (GOOD.encode("utf-16"), 'encoding = "utf-16"', 'is written in UTF-16; set encoding = "utf-16"'),
    "UTF-16 without a mark": (GOOD.encode("utf-16-le"), 'encoding = "utf-16-le"', "is written in UTF-16"),
    "row of units": (
        GOOD.replace("\n", "\ns,m/s,m/s²,rad/s,rad/s,rad/s,rad/s\n", 1).encode(),
        "units_row = true",
        "line 2 is a row of units (s, m/s, rad/s, ",
    ),
    "ISO time": (
        stamped(lambda t: f"2026-03-01T12:00:0{t:.3f}Z").encode(),
        'time_format = "iso"',
        'set time_format = "iso"',
    ),
    "time of day": (stamped(lambda t: f"12:00:0{t:.3f}").encode(), 'time_format = "iso"', 'set time_format = "iso"'),
    "epoch in ms": (
        stamped(lambda t: str(1_772_366_400_000 + round(1000 * t))).encode(),
        'time_unit = "ms"',
        'likely time_unit = "ms"',
    ),
    "epoch in ns": (
        stamped(lambda t: str(1_772_366_400_000_000_000 + round(1e9 * t))).encode(),
        'time_unit = "ns"',
        'likely time_unit = "ns"',
    ),
    "degree sign of a European logger": (
        GOOD.replace("\n", ",5°\n").replace("5°", "Lenkwinkel [°]", 1).encode("cp1252"),
        'encoding = "cp1252"',
        'encoding = "cp1252"',
    ),
}  # fmt: skip


@pytest.mark.parametrize(("content", "key", "remedy"), FORMS.values(), ids=FORMS.keys())
def test_a_refusal_names_the_key_and_the_key_reads_the_log(
    tmp_path: Path, content: bytes, key: str, remedy: str
) -> None:
    log = tmp_path / "log.csv"
    log.write_bytes(content)
    with_key = drive(tmp_path, DRIVE.replace('time = "t"', f'time = "t"\n{key}'))
    found = read_log([log], with_key)
    assert found.time.size == 6
    np.testing.assert_allclose(found.time - found.time[0], 0.005 * np.arange(6), atol=1e-6)
    np.testing.assert_allclose(found.signals["ax"], 1.0)
    with pytest.raises(LogError) as caught:
        read_log([log], drive(tmp_path))
    assert remedy in str(caught.value)
    assert "\n" not in str(caught.value)


def test_decimal_commas(tmp_path: Path) -> None:
    text = GOOD.replace(",", ";").replace(".", ",")
    with pytest.raises(LogError, match=r"line 2: column 't' holds '0,000', not a number; set decimal = \",\""):
        read(tmp_path, text, 'delimiter = ";"')
    found = read(tmp_path, text, 'delimiter = ";"\ndecimal = ","')
    np.testing.assert_allclose(found.time, 0.005 * np.arange(6))
    with pytest.raises(SpecError, match=r"decimal: the comma also separates columns; set delimiter"):
        read(tmp_path, text, 'decimal = ","')


def test_lines_are_counted_with_the_row_of_units(tmp_path: Path) -> None:
    text = GOOD.replace("\n", "\ns,m/s,-,-,-,-,-\n", 1).replace("0.010,1.0", "0.010,ERR")
    with pytest.raises(LogError, match=r"line 5: column 'v' holds 'ERR'"):
        read(tmp_path, text, "units_row = true")
    found = read_columns(_file(tmp_path, "a\nx\n1\n"), {"a": "x"}, CsvForm(units_row=True))
    np.testing.assert_array_equal(found.values["a"], [1])


def _file(folder: Path, text: str) -> Path:
    path = folder / "other.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_time_zones_and_missing_fractions_are_read(tmp_path: Path) -> None:
    stamps = [
        "2026-02-28 23:59:59",
        "2026-02-28T23:59:59.5+00:00",
        "2026-03-01T02:00:00,25+02:00",
        "2026-02-28T22:00:01-0200",
    ]
    path = _file(tmp_path, "t\n" + "".join(f'"{one}"\n' for one in stamps))
    seconds = read_columns(path, {"t": "time"}, CsvForm(iso="t")).values["t"]
    np.testing.assert_allclose(seconds - seconds[0], [0.0, 0.5, 1.25, 2.0], atol=1e-6)
    assert seconds[0] == 1_772_323_199.0
    with pytest.raises(LogError, match=r"line 3: column 't' holds 'noon', not a time such as"):
        read_columns(_file(tmp_path, "t\n12:00:00\nnoon\n"), {"t": "time"}, CsvForm(iso="t"))


def test_gaps_of_an_epoch_clock_are_gaps(tmp_path: Path) -> None:
    """Stamps of 1.7e9 s must not hide a gap behind the rounding that they would need."""
    text = rows([f"{1_772_366_400 + t:.3f}" for t in (0.0, 0.005, 0.01, 0.06, 0.065)])
    found = read(tmp_path, text, 'max_gap = "20 ms"')
    assert found.report["time_origin_s"] == 1_772_366_400
    assert found.time[0] == pytest.approx(0.0, abs=1e-6)
    assert np.count_nonzero(np.isnan(found.signals["ax"])) == 9


@pytest.mark.parametrize(("unit", "scale"), [("m/s", 1.0), ("km/h", 3.6), ("mph", 2.2369362921)])
def test_wheel_speeds_along_the_road(tmp_path: Path, unit: str, scale: float) -> None:
    table = columns(0.5)
    radius = 0.33
    for corner in ("fl", "fr", "rl", "rr"):
        table[f"w_{corner}"] = scale * radius * table[f"w_{corner}"]
    text = re.sub(r'(column = "w_.*?unit = )"rad/s"', rf'\1"{unit}"', DRIVE)
    log = write_log(tmp_path / "log.csv", table)
    found = read_log([log], drive(tmp_path, text))
    np.testing.assert_allclose(found.signals["wheel_speed_rl"], columns(0.5)["w_rl"], rtol=1e-9)
    own = text.replace('"w_fl", unit', '"w_fl", radius = "0.30 m", unit')
    found = read_log([log], drive(tmp_path, own))
    np.testing.assert_allclose(found.signals["wheel_speed_fl"], columns(0.5)["w_fl"] * 0.33 / 0.30, rtol=1e-9)
    with pytest.raises(SpecError, match=r"signals\.ax\.radius: belongs to wheel speeds"):
        drive(tmp_path, DRIVE.replace('"ax", unit', '"ax", radius = "0.3 m", unit'))
    with pytest.raises(SpecError, match=r"signals\.wheel_speed_fl\.unit: unit 'N' has another dimension than rad/s"):
        drive(tmp_path, DRIVE.replace('"w_fl", unit = "rad/s"', '"w_fl", unit = "N"'))


@pytest.mark.parametrize("column", [0, 1, 2, 3])
def test_a_cell_of_1e308_is_no_measurement(tmp_path: Path, column: int) -> None:
    lines = GOOD.splitlines()
    cells = lines[3].split(",")
    cells[column] = "1e308"
    lines[3] = ",".join(cells)
    text = "\n".join(lines) + "\n"
    if column == 0:
        with pytest.raises(LogError, match="time"):
            read(tmp_path, text)
        return
    found = read(tmp_path, text)
    name = HEADER.split(",")[column]
    values = {"v": found.reference["vx"], "ax": found.signals["ax"], "w_fl": found.signals["wheel_speed_fl"]}[name]
    assert np.nanmax(np.abs(values)) <= 1.0


def test_what_is_too_long_is_refused_in_one_short_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    registry, read_by_pint = quantities._registry(), []

    def quantity(value: float, unit: Any) -> Any:
        read_by_pint.append(str(unit))
        if len(str(unit)) > 100:  # pint would take half a minute
            raise ValueError("too long")
        return registry.Quantity(value, unit)

    monkeypatch.setattr(quantities, "_registry", lambda: SimpleNamespace(Quantity=quantity))
    quantities.factor_to.cache_clear()
    cases: list[tuple[Any, str]] = [
        (lambda: read(tmp_path, "x" * 200_000 + "\n1\n"), "line 1 has more than 100000 characters"),
        (lambda: read(tmp_path, ",".join(f"c{k:04}" for k in range(9000)) + "\n1\n"), "unknown column"),
        (lambda: drive(tmp_path, DRIVE.replace('unit = "m/s^2"', f'unit = "{"m" * 140_000}"')), "is not a unit"),
        (
            lambda: drive(tmp_path, DRIVE.replace('"1600.0 kg"', f'"1 {" " * 140_000}kg"')),
            "is not a number with a unit",
        ),
        (lambda: drive(tmp_path, "a = " + "[" * 3000 + "]" * 3000), "nested too deeply"),
        (lambda: drive(tmp_path, DRIVE.replace('time = "t"', 'time = "t"\nencoding = "klingon"')), "unknown encoding"),
        (lambda: read(tmp_path, GOOD, 'encoding = "utf-16"'), "is not in utf-16"),
    ]
    for call, words in cases:
        with pytest.raises((LogError, SpecError)) as caught:
            call()
        message = str(caught.value)
        assert words in message
        assert len(message) <= 300
        assert message.isprintable()
    assert (
        read_by_pint and max(map(len, read_by_pint)) <= quantities.LONGEST_UNIT
    )  # pint takes half a minute for the long ones


@pytest.mark.parametrize("jump", [12.0, 50.0, 1e9])
def test_a_clock_that_jumps_is_refused_before_anything_else(tmp_path: Path, jump: float) -> None:
    table = columns(20.0)
    table["t"][2000:] += jump
    log = write_log(tmp_path / "log.csv", table)
    with pytest.raises(LogError, match=r"time column 't' jumps by .* on line 2002 .* at most 10 s may be missing"):
        read_log([log], drive(tmp_path))


def test_reading_a_log_does_not_draw(tmp_path: Path) -> None:
    """A refusal must not wait for libraries that only results need."""
    code = "import sys, studies.commands.run; print(sorted({'matplotlib', 'sympy', 'scipy'} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2])  # fmt: skip  # noqa: E501
    assert "matplotlib" not in found.stdout


def test_a_drive_file_with_every_key_is_read(tmp_path: Path) -> None:
    keys = 'delimiter = ";"\ndecimal = ","\nencoding = "cp1252"\nunits_row = true\ntime_format = "iso"'
    path = tmp_path / "drive.toml"
    path.write_text(DRIVE.replace('time = "t"', f'time = "t"\n{keys}'), encoding="utf-8")
    log = read_drive(path).log[0]
    assert (log.delimiter, log.decimal, log.encoding, log.units_row, log.time_format) == (
        ";",
        ",",
        "cp1252",
        True,
        "iso",
    )


def mutated(rng: np.random.Generator, data: bytes) -> bytes:
    """One to four cuts, copies, swaps of bytes or words that have hurt before."""
    words = [
        b"1e308",
        b"\xff\xfe",
        b"\0",
        b'"',
        b"\n",
        b",",
        b";",
        b"nan",
        b"-",
        b"=",
        b"[",
        b"9" * 400,
        "µ°\u202e".encode(),
    ]
    for _ in range(int(rng.integers(1, 5))):
        at, length = int(rng.integers(0, len(data) + 1)), int(rng.integers(0, 12))
        match int(rng.integers(0, 4)):
            case 0:
                data = data[:at] + data[at + length :]
            case 1:
                data = data[:at] + words[int(rng.integers(0, len(words)))] + data[at:]
            case 2:
                data = data[:at] + bytes(rng.integers(0, 256, size=length, dtype=np.uint8)) + data[at + length :]
            case _:
                data = data[:at] + data[max(0, at - 40) : at] + data[at:]
    return data


@pytest.mark.parametrize("what", ["log", "drive file", "guess"])
def test_what_is_damaged_is_read_or_refused_in_one_line(tmp_path: Path, what: str) -> None:
    """A small fuzzer: no traceback, no line that floods a terminal, no infinity in what is read."""
    rng = np.random.default_rng(7)
    log, toml = tmp_path / "log.csv", tmp_path / "drive.toml"
    table = (GOOD if what != "guess" else GOOD.replace("t,", "time,", 1)).encode()
    good = drive(tmp_path)
    for _ in range(80):
        log.write_bytes(table if what == "drive file" else mutated(rng, table))
        if what == "drive file":
            toml.write_bytes(mutated(rng, DRIVE.encode()))
        try:
            if what == "guess":
                guess([log])
                continue
            found = read_log([log], read_drive(toml) if what == "drive file" else good)
        except (LogError, SpecError) as error:
            message = str(error)
            assert message.isprintable(), message
            assert len(message) <= 300, message
        else:
            assert not any(np.isinf(value).any() for value in (*found.signals.values(), *found.reference.values()))
