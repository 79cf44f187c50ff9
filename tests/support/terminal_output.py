"""What `gainsmith certify` prints of changed schedules, read as a person would read it."""

from __future__ import annotations

import copy
import json
import re
from pathlib import Path
from typing import Any

import pytest

from estimators.schedule import read_content, sealed
from studies.cli import main
from tests.support.schedule_judge import Judge, Statement, statement

ROOT = Path(__file__).parents[2]
LATERAL = ROOT / "estimators" / "schedules" / "corner-estimation-lateral.json"
SPRING = ROOT / "tests" / "unit" / "data" / "heated-spring.json"
SAMPLED = ROOT / "tests" / "unit" / "data" / "sampled-longitudinal.json"
LONGEST_LINE = 300
Content = dict[str, Any]


def content(source: Path = LATERAL) -> Content:
    found = copy.deepcopy(read_content(source))
    return {key: value for key, value in found.items() if key not in ("sha256", "section_sha256")}


def write(path: Path, data: Content | str | bytes) -> Path:
    if isinstance(data, dict):
        data = json.dumps(sealed(data))
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def claim(data: Content, kind: str) -> Content:
    return next(c for c in data["claims"] if c["kind"] == kind)


class Told:
    """What `gainsmith certify` printed of one file."""

    def __init__(self, path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.code = main(["certify", str(path)])
        out = capsys.readouterr()
        assert out.err == ""
        self.lines = out.out.rstrip("\n").split("\n")
        assert all(line.isprintable() for line in self.lines), self.lines
        head = self.lines[0].removeprefix(f"{path}: ")
        assert head != self.lines[0]
        self.head = re.sub(r" \(\d+\.\d\d s\)$", "", head)
        assert len(self.head) <= LONGEST_LINE
        self.proved = [line.removeprefix("  proved  ") for line in self.lines[1:] if line.startswith("  proved  ")]
        if self.code == 2:
            assert self.head.startswith("refused: ") and len(self.lines) == 1
        else:
            assert self.code == (0 if self.head.startswith("certified: ") else 1)

    def statements(self, data: Content) -> list[Statement]:
        """The proved lines, read; units have no spaces in these files, but for the products of the spring."""
        said = []
        listed = [line[10:] for line in self.lines[1:] if line.startswith(("  proved  ", "  FAILS   "))]
        for line, stored in zip(listed, data["claims"], strict=True):
            if line in self.proved:
                words, level, unit = re.fullmatch(r"(.*) (\d\S*) (\S+)", line).groups()  # type: ignore[union-attr]
                said.append(statement(words, float(level), unit, stored))
        return said


def refused(data: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    told = Told(write(tmp_path / "attack.json", data), capsys)
    assert told.code == 2, told.lines
    return told.head.removeprefix("refused: ")


def true(data: Content, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Told:
    """Not refused; whatever is printed as proved holds."""
    told = Told(write(tmp_path / "attack.json", data), capsys)
    assert told.code in (0, 1), told.lines
    judge = Judge(data)
    assert judge.plant() + judge.dimensions() == []
    for said in told.statements(data):
        assert judge.unit(said) + judge.truth(said) == []
    return told
