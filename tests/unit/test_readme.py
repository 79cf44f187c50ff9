"""The README's Python blocks run, in order, its commands exist, and it stays short."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from studies.cli import parser

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text()


def test_python_blocks_run(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    assert len(blocks) >= 2
    namespace: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), namespace)
    said = capsys.readouterr().out
    assert "certified" in said
    assert "False update" not in said


def test_commands_parse() -> None:
    lines = re.findall(r"^\.venv/bin/gainsmith (.*?)\s*(?:#.*)?$", TEXT, flags=re.MULTILINE)
    assert len(lines) >= 5
    for line in lines:
        parser().parse_args(line.split())


def test_pictures_and_links_exist() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (ROOT / target).exists(), target


def test_it_is_short() -> None:
    assert len(TEXT.splitlines()) <= 150
