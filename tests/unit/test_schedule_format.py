"""The schedule file: sealed, strict, read back bit for bit, never half-written."""

from __future__ import annotations

import json
import math
import os
import random
import signal
import subprocess
import sys
import time
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators import GainSchedule, ScheduleError
from estimators.schedule import SECTIONS, canonical, read_content, sealed, write_content
from tests.support.schedule_content import schedule_content

NUMBERS = st.floats(min_value=-1e100, max_value=1e100)
SINGLES = st.floats(width=32, min_value=-(2.0**99), max_value=2.0**99)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    target = tmp_path / "schedule.json"
    write_content(target, schedule_content())
    return target


def test_sealing_does_not_depend_on_the_order_of_keys_and_leaves_the_original_alone() -> None:
    content = schedule_content()
    untouched = deepcopy(content)
    shuffled = dict(reversed(content.items()))
    assert sealed(content)["sha256"] == sealed(shuffled)["sha256"]
    assert sealed(sealed(content)) == sealed(content)
    assert content == untouched


def test_what_was_written_is_read_and_written_again_byte_for_byte(path: Path, tmp_path: Path) -> None:
    content = read_content(path)
    assert content == sealed(schedule_content())
    write_content(tmp_path / "again.json", content)
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["again.json", "schedule.json"]


@settings(deadline=None, max_examples=40)
@given(pairs=st.lists(st.tuples(NUMBERS, NUMBERS), min_size=4, max_size=4))
def test_numbers_read_back_bit_for_bit(pairs: list[tuple[float, float]], tmp_path_factory: Any) -> None:
    file = tmp_path_factory.mktemp("bits") / "schedule.json"
    write_content(file, schedule_content(gains=pairs))
    table = GainSchedule.load(file).table
    assert table.tobytes() == np.array(pairs).reshape(4, 2, 1).tobytes()


@settings(deadline=None, max_examples=40)
@given(pairs=st.lists(st.tuples(SINGLES, SINGLES), min_size=4, max_size=4))
def test_single_precision_gains_read_back_bit_for_bit(pairs: Any, tmp_path_factory: Any) -> None:
    file = tmp_path_factory.mktemp("bits") / "schedule.json"
    write_content(file, schedule_content(gains=pairs, dtype="float32"))
    table = GainSchedule.load(file).table
    assert table.astype(np.float32).tobytes() == np.array(pairs, dtype=np.float32).tobytes()
    assert (table.astype(np.float32) == table).all()


EDITS = {
    "gain": ("183.1", "183.2"),
    "scheduling": ('"rate_max": 800', '"rate_max": 900'),
    "plant": ("-192.192", "-192.193"),
    "model": ("632.1", "632.2"),
    "claims": ('"level": 80.0', '"level": 90.0'),
    "provenance": ("2024-01-01", "2025-01-01"),
    "update": ('"sample_time": 0.005', '"sample_time": 0.004'),
    "name": ("test-longitudinal", "test-longitudinam"),
    "description": ("nothing proved", "nothing prover"),
}


def test_every_section_is_edited_below() -> None:
    assert set(EDITS) == set(SECTIONS) - {"schema"}


@pytest.mark.parametrize("section", EDITS)
def test_an_edited_file_names_the_section(path: Path, section: str) -> None:
    before, after = EDITS[section]
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))
    with pytest.raises(ScheduleError, match=f"schedule.json: {section}: .*edited; regenerate"):
        read_content(path)


@pytest.mark.parametrize("section", EDITS)
def test_a_removed_section_is_named(path: Path, section: str) -> None:
    content = json.loads(path.read_text())
    del content[section]
    path.write_text(json.dumps(content))
    with pytest.raises(ScheduleError, match=f"{section}: this section is missing"):
        read_content(path)


def test_an_added_section_and_edited_digests_are_refused(path: Path) -> None:
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, "extra": 1}))
    with pytest.raises(ScheduleError, match="extra: this section does not match"):
        read_content(path)
    path.write_text(json.dumps({**content, "sha256": "0" * 64}))
    with pytest.raises(ScheduleError, match="sha256: the digest of the whole"):
        read_content(path)
    path.write_text(json.dumps({key: value for key, value in content.items() if key != "section_sha256"}))
    with pytest.raises(ScheduleError, match="no digests of the sections"):
        read_content(path)


def test_every_truncation_is_refused_with_its_place(path: Path) -> None:
    text = path.read_text()
    for length in range(0, len(text) - 2, 97):
        path.write_text(text[:length])
        with pytest.raises(ScheduleError, match=r"schedule\.json: line \d+, column \d+: not JSON"):
            read_content(path)


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999"])
def test_numbers_that_are_not_finite_are_refused(path: Path, word: str) -> None:
    path.write_text(path.read_text().replace("183.1", word, 1))
    with pytest.raises(ScheduleError, match=f"{word} is not a finite number"):
        read_content(path)


def test_duplicate_keys_are_refused(path: Path) -> None:
    path.write_text(path.read_text().replace('"rate_max": 800', '"rate_max": 800, "rate_max": 900', 1))
    with pytest.raises(ScheduleError, match="key 'rate_max' appears twice"):
        read_content(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"schema": "gainsmith.schedule/3"}', "'gainsmith.schedule/3' is not understood; .* 'gainsmith.schedule/2'"),
        ('{"name": "x"}', "not a gain schedule"),
        ("[1, 2]", "not a gain schedule"),
        ("[" * 100_000, "nested too deeply"),
        ('{"schema": ' + "1" * 5000 + "}", "digits"),
    ],
)
def test_other_files_are_refused(path: Path, text: str, message: str) -> None:
    path.write_text(text)
    with pytest.raises(ScheduleError, match=message):
        read_content(path)


def test_unreadable_files_are_refused(path: Path) -> None:
    with pytest.raises(ScheduleError, match=r"none\.json: cannot be read: No such file"):
        read_content(path.with_name("none.json"))
    with pytest.raises(ScheduleError, match="cannot be read: Is a directory"):
        read_content(path.parent)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ScheduleError, match="byte 0 is not UTF-8"):
        read_content(path)


@pytest.mark.parametrize("value", [math.nan, math.inf, np.float32(1), np.zeros(2), {1, 2}])
def test_content_that_json_cannot_carry_is_refused(value: Any) -> None:
    with pytest.raises(ScheduleError, match="not plain JSON data"):
        canonical({"value": value})


def test_a_failed_write_leaves_the_old_file_and_nothing_beside_it(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = path.read_bytes()
    broken = schedule_content()
    broken["claims"][0]["P"]["coefficients"][0][0][0] = math.nan
    with pytest.raises(ScheduleError, match=r"claims\[0\]\.P\.coefficients\[0\]\[0\]\[0\]: nan is not a finite"):
        write_content(path, broken)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_content(path, schedule_content("lateral"))
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


WRITER = """
import sys
from estimators.schedule import read_content, write_content
path = sys.argv[1]
contents = [read_content(path), read_content(path)]
contents[1]["provenance"]["created"] = "b" * 200_000
print("ready", flush=True)
while True:
    for content in contents:
        write_content(path, content)
"""


def test_a_killed_writer_leaves_a_whole_file(path: Path) -> None:
    draw = random.Random(1)
    root = Path(__file__).parents[2]
    for _ in range(8):
        with subprocess.Popen([sys.executable, "-c", WRITER, path], cwd=root, stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == b"ready\n"
            time.sleep(draw.uniform(0.0, 0.03))
            writer.send_signal(signal.SIGKILL)
        assert writer.returncode == -signal.SIGKILL
        assert read_content(path)["name"] == "test-longitudinal"
