"""The README's Python blocks run, in order, and its commands exist."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from studies.cli import parser
from studies.drives.drive_file import Estimators

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text()


def test_python_blocks_run(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    assert len(blocks) >= 3
    namespace: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), namespace)
    assert "certified" in capsys.readouterr().out


def test_the_estimators_that_a_drive_file_can_choose_are_all_there() -> None:
    """The block shows the defaults, and its comments the other names: no more, no fewer."""
    (block,) = re.findall(r"```toml\n(\[estimators\].*?)```", TEXT, flags=re.DOTALL)
    table = tomllib.loads(block)["estimators"]
    assert Estimators(**table) == Estimators()
    assert list(table) == list(Estimators.model_fields)
    for key, rest in re.findall(r"^(\w+) = .*?# or (.*)$", block, flags=re.MULTILINE):
        names = {table[key], *(name.strip() for name in rest.partition(":")[0].split(","))}
        with pytest.raises(ValueError, match="unknown estimator") as caught:
            Estimators(**{key: "zzz"})
        known = re.search(r"known: ([a-z, -]+)", str(caught.value))
        assert known is not None
        assert {name.strip() for name in known[1].split(",")} == names


def test_commands_parse() -> None:
    lines = re.findall(r"^\.venv/bin/gainsmith (.*?)\s*(?:#.*)?$", TEXT, flags=re.MULTILINE)
    assert len(lines) >= 5
    for line in lines:
        parser().parse_args(line.split())


def test_pictures_and_links_exist() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (ROOT / target).exists(), target
