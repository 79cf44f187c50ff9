"""The README's Python blocks run, in order, and its commands exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from studies.cli import parser

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text()


def test_python_blocks_run(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    assert len(blocks) >= 3
    namespace: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), namespace)
    assert "certified" in capsys.readouterr().out


def test_commands_parse() -> None:
    lines = re.findall(r"^\.venv/bin/gainsmith (.*?)\s*(?:#.*)?$", TEXT, flags=re.MULTILINE)
    assert len(lines) >= 5
    for line in lines:
        parser().parse_args(line.split())


def test_pictures_and_links_exist() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (ROOT / target).exists(), target
