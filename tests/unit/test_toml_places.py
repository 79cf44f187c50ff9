"""Places of values in TOML: every value stands where it is said to stand, in every way in which it can be written."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from synthesis.toml_places import Places

ROOT = Path(__file__).parents[2]
EVERYTHING = '''
title = "a # no comment" # a comment [x]
'quoted key' = 'C:\\path'
a.b . c = 1_000
a.b.d = [1.5, [ "x", 'y' ], # comment, with [brackets]
  { k = true, "l m" = -inf }, ]
when = 1979-05-27T07:32:00Z
text = """one "quoted"
two \\""" three"""
raw = \'\'\'a 'b' \'\'\'
[table.inner]
x = "=]}"
[[list]]
n = 1
[list.sub]
m = 2
[[list]]
n = 3
[[list.deep]]
o = 4
[[list.deep]]
o = { p = { q = "end" } }
'''


def scalars(data: Any, path: tuple[int | str, ...] = ()) -> Iterator[tuple[tuple[int | str, ...], Any]]:
    if isinstance(data, (dict, list)):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from scalars(value, (*path, key))
    else:
        yield path, data


def value_at(text: str, offset: int) -> Any:
    """The shortest piece from there that tomllib reads as one value and that something ends."""
    for end in range(offset + 1, len(text) + 1):
        if text[end : end + 1] in ("", "\n", ",", "]", "}", " "):
            try:
                return tomllib.loads(f"x = {text[offset:end]}")["x"]
            except tomllib.TOMLDecodeError:
                continue
    raise AssertionError(text[offset : offset + 20])


FILES = [
    path
    for folder in ("examples", "templates", "specs", "manoeuvres")
    for path in (ROOT / "studies" / folder).glob("*.toml")
]


@pytest.mark.parametrize("text", [EVERYTHING, *(path.read_text() for path in sorted(FILES)[:12])], ids=lambda t: t[:12])
def test_every_value_stands_where_it_is_said_to(text: str) -> None:
    places, found = Places(text), list(scalars(tomllib.loads(text)))
    assert len(found) > 5
    for path, value in found:
        assert value_at(text, places.offsets[path]) == value, path


def test_lines_and_columns_are_counted_from_one() -> None:
    places = Places(EVERYTHING)
    assert places.at(("title",)) == "2:10" and places.at(("title",), inside=4) == "2:14"
    assert places.at(("list", 1, "deep", 1, "o", "p", "q")) == "22:18"
    assert places.at(("list", 1, "absent")) == "17:1"  # the nearest table around it
    assert places.at(("absent",)) == "1:1"
