"""Spellings of numbers, times and line ends: read alike, or refused with the key that reads them."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from studies.drives.csv_log import CsvForm, read_columns
from studies.drives.guess_names import guess_column
from studies.drives.iso_time import iso_seconds
from studies.drives.sniff import sniff
from studies.errors import LogError
from tests.support.drive_logs import read as read_rows
from tests.support.drive_logs import rows

PLAIN = "t,a,b\n0.0,1136.5,1\n0.5,-2.25,2\n1.0,3,3\n"
WANTED = dict.fromkeys("tab", "signal")


def read(folder: Path, text: str, form: CsvForm | None = None) -> list[list[float]]:
    path = folder / "log.csv"
    path.write_bytes(text.encode())
    return [read_columns(path, WANTED, form).values[name].tolist() for name in "tab"]


@pytest.mark.parametrize(
    ("text", "form"),
    [
        (PLAIN.replace("\n", "\r"), CsvForm()),
        (PLAIN.replace("\n", "\r\n"), CsvForm()),
        (PLAIN + "\n\n", CsvForm()),
        ("logger,7\n\n" + PLAIN, CsvForm(header_line=3)),
        (PLAIN.replace(",", ";").replace("1136.5", "1,136.5"), CsvForm(delimiter=";", thousands=",")),
        (PLAIN.replace(",", ";").replace("1136.5", "1'136.5"), CsvForm(delimiter=";", thousands="'")),
        (PLAIN.replace("1136.5", "1\u202f136.5"), CsvForm(thousands=" ")),
        (
            PLAIN.replace(",", ";").replace("1136.5", "1.136,5").replace("2.25", "2,25"),
            CsvForm(delimiter=";", decimal=",", thousands="."),
        ),
    ],
)
def test_what_means_the_same_reads_the_same(tmp_path: Path, text: str, form: CsvForm) -> None:
    wanted = read(tmp_path, PLAIN)
    if form.decimal == ",":  # the clock of this log has a point, which is read as a thousand there
        text = text.replace("0.0;", "0;").replace("0.5;", "0,5;").replace("1.0;", "1;")
    assert read(tmp_path, text, form) == wanted


@pytest.mark.parametrize("word", ["NA", "n/a", "#N/A", "null", "None", "-", "1.#QNAN", "NaN", ""])
def test_words_for_nothing_are_missing(tmp_path: Path, word: str) -> None:
    found = read(tmp_path, PLAIN.replace("-2.25", word))
    assert np.isnan(found[1][1]) and found[1][::2] == [1136.5, 3.0]


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        (PLAIN.replace("-2.25", "ERR"), "leave the cell empty"),  # negative control: no word for nothing
        (PLAIN.replace(",", ";").replace("1136.5", "1,136.5"), 'set thousands = ","'),
        (PLAIN.replace("1136.5", "1 136.5"), 'set thousands = " "'),
        (PLAIN.replace("\n0.", ",\n0.").replace("3,3", "3,3,"), 'ends with a "," that the header does not have'),
        (PLAIN.replace("0.5,", "05/01/2024 10:00:00,"), "write time stamps as seconds, or as 2024-05-01T12"),
        ("t,a,b\ns,m/s2,1/min\n0,1,2\n1,2,3\n", "set units_row = true"),
    ],
)
def test_a_refusal_names_the_key_or_the_edit(tmp_path: Path, text: str, remedy: str) -> None:
    form = CsvForm(delimiter=";" if ";" in text else ",")
    if remedy.startswith("ends"):
        text = text.replace("t,a,b,", "t,a,b")
    with pytest.raises(LogError) as caught:
        read(tmp_path, text, form)
    assert remedy in str(caught.value)


def test_dates_in_every_usual_spelling() -> None:
    wanted = datetime(2024, 5, 1, 12, 0, 0, 250_000, tzinfo=UTC).timestamp()
    cells = [
        "2024-05-01T12:00:00.25", "2024/05/01 12:00:00.250", "01.05.2024 12:00:00,25", "20240501T120000.25Z",
        "2024-05-01 12:00:00.25 UTC", "2024-05-01 14:00:00.25+02", "2024-05-01T17:30:00.25+0530",
    ]  # fmt: skip
    assert np.array_equal(iso_seconds(pl.Series(cells)), np.full(len(cells), wanted))
    unclear = iso_seconds(pl.Series(["05/01/2024 12:00:00", "12345.25", "2024-13-01T12:00:00"]))
    assert np.isnan(unclear).all()


def test_a_time_of_day_goes_on_over_midnight_and_a_step_back_stays_one() -> None:
    found = iso_seconds(pl.Series(["23:59:59.5", "23:59:59.9", "", "00:00:00.3", "00:00:00.2"]))
    assert np.allclose(found[[0, 1, 3, 4]], [86399.5, 86399.9, 86400.3, 86400.2], atol=1e-9, rtol=0.0)


def test_the_first_lines_say_where_the_header_is_and_how_thousands_are_written(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("Logger;v1\n\ntime;a;b;c\n0,5;1.234,5;1;1\n0,6;1.334,5;1;1\n")
    found = sniff(path)
    assert (found.header_line, found.delimiter, found.decimal, found.thousands) == (3, ";", ",", ".")
    path.write_text("time,a,b,c\n0.5,1,1,1\n")
    assert (sniff(path).header_line, sniff(path).thousands) == (1, "")


@pytest.mark.parametrize(
    ("column", "found"),
    [
        ("Vitesse roue AVG (tr/min)", ("signals", "wheel_speed_fl", "rpm")),
        ("Accélération latérale (m/s²)", ("signals", "ay", "m/s^2")),
        ("Raddrehzahl hinten rechts", ("signals", "wheel_speed_rr", None)),
        ("yaw rate in °/s", ("signals", "yaw_rate", "deg/s")),
        ("a_x/(m/s²)", ("signals", "ax", "m/s^2")),
        ("AccX, raw [g]", ("signals", "ax", "g")),
        ("v_avg", None),  # an average, not a French wheel
        ("raw", None),
    ],
)
def test_names_in_more_languages_and_orders(column: str, found: tuple[str, str, str | None] | None) -> None:
    assert guess_column(column) == found


def test_a_column_slower_than_its_log_does_not_vanish_in_silence(tmp_path: Path) -> None:
    text = rows([f"{0.005 * k:.3f}" for k in range(200)])
    lines = text.splitlines()
    slow = [line if k % 8 == 1 or k == 0 else ",".join([*line.split(",")[:-1], ""]) for k, line in enumerate(lines)]
    read_rows(tmp_path, text)
    with pytest.raises(LogError, match=r"has a sample every 0\.04 s, .*set max_gap = \"200 ms\" for log 'log'"):
        read_rows(tmp_path, "\n".join(slow) + "\n")
