"""Blind changes of the text of real files, drawn by hypothesis: bytes, numbers, texts, keys, lines, nesting."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from hypothesis import strategies as st

NUMBER = re.compile(rb"(?<![\w.\"])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")
TEXT = re.compile(rb'"[^"\n]*"')
KEY = re.compile(rb'(?m)^[ \t]*"?\w[\w.]*"?[ \t]*[=:].*$')
NUMBERS = (
    b"1e308", b"-1e308", b"1e999", b"nan", b"inf", b"-inf", b"NaN", b"-Infinity", b"18446744073709551616",
    b"1e-320", b"-0.0", b"0", b"-1",
    b"1", b"1000000", b"9" * 400, b"9" * 5000, b"0x10", b"1_0", b"true", b"null", b'"1"', b'""', b"[]", b"{}",
    b"[[1]]", b"1979-05-27",
    b"07:32:00", b"1,5", b"1;2", b"",
)  # fmt: skip
TEXTS = (
    b'""', b'" "', b'"\xc3\xa9"', b'"\\u0000"', b'"a\\nb"', b'"\\u001b[2J"', b'"\xff"', b'"' + b"x" * 300 + b'"',
    b'"' + b"m*" * 9000 + b'm"',
    b'"9**9**9 m"', b'"1e308 s"', b'"-612 m"', b'"2**64"', b'"nan"', b'"../../x"', b'"/"', b"'\"'", b"0", b"true",
    b"[]", b"{}", b"null",
)  # fmt: skip
PIECES = (
    b"\n", b"\r", b"\0", b"\x1b[31m", b"\xff\xfe", b"\xef\xbb\xbf", b'"', b"'", b"#", b",", b";", b"[", b"}", b"=",
    b"[" * 3000,
    b"x = " + b"[" * 3000, b"a." * 3000 + b"b = 1\n", b'{"a":' * 3000, b"h," * 20000, b"[x]\n", b"[[x]]\n",
    b"points = 18446744073709551616\n",
)  # fmt: skip


@dataclass(frozen=True)
class Change:
    """A way to change a file; `place` counts what can be changed so, `value` what is put there."""

    way: str
    place: int
    value: int


def changes() -> st.SearchStrategy[list[Change]]:
    """One to three of them."""
    numbers = st.integers(0, 1 << 20)
    return st.lists(st.builds(Change, st.sampled_from(sorted(WAYS)), numbers, numbers), min_size=1, max_size=3)


def changed(data: bytes, todo: list[Change]) -> bytes:
    """The file after all of them."""
    for change in todo:
        data = WAYS[change.way](data, change.place, change.value)
    return data


def _replaced(pattern: re.Pattern[bytes], values: tuple[bytes, ...], data: bytes, place: int, value: int) -> bytes:
    found = list(pattern.finditer(data))
    if not found:
        return data
    hit = found[place % len(found)]
    return data[: hit.start()] + values[value % len(values)] + data[hit.end() :]


def _flip(data: bytes, place: int, value: int) -> bytes:
    at = place % max(len(data), 1)
    return data[:at] + bytes([data[at] ^ (1 << value % 8)]) + data[at + 1 :] if data else data


def _piece(data: bytes, place: int, value: int) -> bytes:
    at = place % (len(data) + 1)
    return data[:at] + PIECES[value % len(PIECES)] + data[at:]


def _cut(data: bytes, place: int, value: int) -> bytes:
    at = place % (len(data) + 1)
    return data[:at] + data[at + 1 + value % 40 :]


def _twice(data: bytes, place: int, value: int) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    a, b = place % len(lines), value % len(lines)
    return b"".join([*lines[:b], lines[a], *lines[b:]])


WAYS: dict[str, Callable[[bytes, int, int], bytes]] = {
    "number": lambda data, place, value: _replaced(NUMBER, NUMBERS, data, place, value),
    "text": lambda data, place, value: _replaced(TEXT, TEXTS, data, place, value),
    "text of another place": lambda data, place, value: _replaced(TEXT, tuple(TEXT.findall(data)) or (b"",), data, place, value),
    "no key": lambda data, place, value: _replaced(KEY, (b"",), data, place, value),
    "flip": _flip,
    "piece": _piece,
    "cut": _cut,
    "end": lambda data, place, _: data[: place % (len(data) + 1)],
    "line twice": _twice,
}  # fmt: skip
