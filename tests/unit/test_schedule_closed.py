"""The format is closed: what is not expected is refused in one short line, however the file was sealed again."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from estimators import GainSchedule, ScheduleError
from estimators.schedule import check_content, read_content, sealed, write_content
from estimators.schedule.check import (
    HIGHEST_ORDER,
    MOST,
    MOST_BREAKPOINTS,
    MOST_CLAIMS,
    MOST_CONSTANTS,
    MOST_PARAMETERS,
    MOST_PROVENANCE,
)
from tests.support.schedule_content import schedule_content

LONGEST_LINE = 300
Path_ = tuple[Any, ...]


def whole() -> dict[str, Any]:
    """Content with everything that the format knows."""
    content = schedule_content()
    content["model"]["constants"]["sigma0"]["source"] = "P1 section IV"
    content["claims"][0] |= {"channel": {"inputs": {"friction": 1.0}, "errors": ["relative_velocity"]}}
    content["provenance"] = {"spec": {"design": {"channels": [{"bound": 1.05, "weights": None}]}}, "note": "none"}
    return content


def entries(value: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    """Everything in a content with its place, from the outside in."""
    yield path, value
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from entries(entry, (*path, key))
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from entries(entry, (*path, index))


def changed(path: Path_, change: Callable[[Any], Any]) -> dict[str, Any]:
    *way, last = ("content", *path)
    root = place = {"content": whole()}
    for key in way:
        place = place[key]
    place[last] = change(place[last])
    return root["content"]


def refused(content: Any, tmp_path: Path) -> str:
    """What is said in memory, and of the file that is sealed again, and in writing it: one short line that names one place."""
    told = []
    file = tmp_path / "s.json"
    file.write_text(json.dumps(sealed(content)), "utf-8")
    for attempt in (
        lambda: check_content(content, "s.json"),
        lambda: GainSchedule.from_content(content, "s.json"),
        lambda: read_content(file),
        lambda: write_content(tmp_path / "t.json", content),
    ):
        with pytest.raises(ScheduleError) as caught:
            attempt()
        words = str(caught.value).replace(str(tmp_path / "t.json"), "s.json").replace(str(file), "s.json")
        assert words.isprintable()
        assert words.startswith("s.json: ")
        assert len(words) <= LONGEST_LINE
        told.append(words)
    assert len({words.split(": ")[1] for words in told}) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["s.json"]
    return told[0].removeprefix("s.json: ")


def dotted(path: Path_) -> str:
    words = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return words.removeprefix(".")


OBJECTS = [path for path, value in entries(whole()) if isinstance(value, dict) and path[:1] != ("provenance",)]
FREE = [("model", "constants"), ("claims", 0, "channel", "inputs")]  # names are keys there
TEXTS = [path for path, value in entries(whole()) if isinstance(value, str)]
LISTS = [path for path, value in entries(whole()) if isinstance(value, list) and path[:1] != ("provenance",)]
NUMBERS = [
    path for path, value in entries(whole())
    if isinstance(value, (int, float)) and not isinstance(value, bool) and "orders" not in path
]  # fmt: skip


def test_the_whole_is_accepted(tmp_path: Path) -> None:
    write_content(tmp_path / "s.json", whole())
    assert read_content(tmp_path / "s.json") == sealed(whole())
    assert len(OBJECTS) > 25 and len(TEXTS) > 40 and len(LISTS) > 50 and len(NUMBERS) > 50


@pytest.mark.parametrize("path", [path for path in OBJECTS if path not in FREE], ids=dotted)
def test_unknown_and_missing_keys_at_every_level(path: Path_, tmp_path: Path) -> None:
    said = refused(changed(path, lambda found: found | {"surplus": 1}), tmp_path)
    assert said.startswith(f"{dotted((*path, 'surplus'))}: unknown key; known: ")
    said = refused(changed(path, lambda found: found | {"surplus\x1b[31m" + "x" * 140_000: 1}), tmp_path)
    assert said.startswith(f"{dotted((*path, 'surplus?[31mxxx'))}")
    optional = {"source", "channel"}
    for key in set(dict(entries(whole()))[path]) - optional:
        said = refused(changed(path, lambda found: {k: v for k, v in found.items() if k != key}), tmp_path)  # noqa: B023
        assert said == f"{dotted((*path, key))}: missing"


@pytest.mark.parametrize("path", TEXTS, ids=dotted)
def test_control_characters_in_every_text(path: Path_, tmp_path: Path) -> None:
    for piece in ("\n", "\r", "\t", "\x00", "\x1b[2J", "\x7f", "\x9b", "\u2028", "\u202e", "\ufeff", "\ud800"):
        said = refused(changed(path, lambda text: f"{text[:2]}{piece}{text[2:]}"), tmp_path)  # noqa: B023
        assert said.startswith(dotted(path) + ": ")


@pytest.mark.parametrize("path", [path for path in TEXTS if path[0] != "provenance"], ids=dotted)
def test_texts_of_any_length(path: Path_, tmp_path: Path) -> None:
    assert refused(changed(path, lambda _: "m" * 140_000), tmp_path).startswith(dotted(path) + ": ")
    if path not in (("description",), ("model", "constants", "sigma0", "source")):  # these may be empty
        assert refused(changed(path, lambda _: ""), tmp_path).startswith(dotted(path) + ": ")
    for value in (None, 3, [], {}, True, [["deep"]] * 1000):
        assert refused(changed(path, lambda _: value), tmp_path).startswith(dotted(path) + ": ")  # noqa: B023


@pytest.mark.parametrize("path", FREE, ids=dotted)
@pytest.mark.parametrize("key", ["m" * 140_000, "\x1b[31m", "a b", "", "1a", "a.b"])
def test_names_that_are_keys(path: Path_, key: str, tmp_path: Path) -> None:
    said = refused(changed(path, lambda found: found | {key: next(iter(found.values()))}), tmp_path)
    assert said.startswith(dotted(path))


@pytest.mark.parametrize("key", ["\x1b[31m", "a\nb"])
def test_control_characters_in_keys_of_the_provenance(key: str, tmp_path: Path) -> None:
    said = refused(changed(("provenance", "spec", "design"), lambda _: {key: 1}), tmp_path)
    assert said.startswith("provenance.spec.design.")


@pytest.mark.parametrize("path", NUMBERS, ids=dotted)
def test_integers_that_float64_does_not_hold_and_sizes_that_no_quantity_has(path: Path_, tmp_path: Path) -> None:
    for number in (2**53 + 1, -(2**53) - 1, 10**300, 10**4000, 1e101):
        said = refused(changed(path, lambda _: number), tmp_path)  # noqa: B023
        assert said.startswith(dotted(path) + ": ")
        assert "not a finite number that float64 holds exactly" in said or "beyond 1e+100" in said


@pytest.mark.parametrize("path", NUMBERS, ids=dotted)
def test_what_is_no_number(path: Path_, tmp_path: Path) -> None:
    for value in ("nan", "1.0", "x" * 140_000, None, True, [], {}, [[1.0]]):
        if path[0] == "provenance":
            continue
        assert refused(changed(path, lambda _: value), tmp_path).startswith(dotted(path) + ": ")  # noqa: B023


@pytest.mark.parametrize("path", LISTS, ids=dotted)
def test_lists_of_any_length(path: Path_, tmp_path: Path) -> None:
    """Thousands of times what is there is refused by its place, without looking at what it holds."""
    said = refused(changed(path, lambda found: (found or [0]) * 5000), tmp_path)
    assert said.startswith(dotted(path[:1]))
    for value in (None, 3, "text", {}):
        assert refused(changed(path, lambda _: value), tmp_path).startswith(dotted(path) + ": ")  # noqa: B023


@pytest.mark.parametrize(
    ("path", "most", "entry"),
    [
        (("scheduling", 0, "breakpoints"), MOST_BREAKPOINTS, lambda k: 140.0 * k / MOST_BREAKPOINTS),
        (("claims",), MOST_CLAIMS, lambda _: whole()["claims"][0]),
        (("scheduling",), MOST_PARAMETERS, lambda k: whole()["scheduling"][0] | {"name": f"p{k}"}),
        *((("model", kind), most, lambda k: {"name": f"s{k}", "unit": "1"}) for kind, most in MOST.items()),
    ],
    ids=lambda value: dotted(value) if isinstance(value, tuple) else "",
)
def test_lists_are_limited(path: Path_, most: int, entry: Callable[[int], Any], tmp_path: Path) -> None:
    said = refused(changed(path, lambda _: [entry(k) for k in range(most + 1)]), tmp_path)
    assert said == f"{dotted(path)}: has {most + 1} entries; at most {most} are read"


def test_objects_with_names_as_keys_are_limited(tmp_path: Path) -> None:
    many = {f"c{k}": {"value": 1.0, "unit": "1"} for k in range(MOST_CONSTANTS + 1)}
    assert refused(changed(("model", "constants"), lambda _: many), tmp_path).startswith("model.constants: has 257")
    said = refused(changed(("claims", 0, "channel", "inputs"), lambda _: dict.fromkeys(many, 1.0)), tmp_path)
    assert said == "claims[0].channel.inputs: has 257 entries; at most 64 are read"


def test_provenance_is_limited(tmp_path: Path) -> None:
    said = refused(changed(("provenance", "note"), lambda _: [[0]] * MOST_PROVENANCE), tmp_path)
    assert said.startswith("provenance.note[")
    assert said.endswith(": is one entry too many here")


@pytest.mark.parametrize("path", [*(("plant", key) for key in "ABCDEF"), ("claims", 0, "P")], ids=dotted)
def test_orders_of_polynomials_are_limited(path: Path_, tmp_path: Path) -> None:
    for order in (HIGHEST_ORDER + 1, 20_000, 10**30, -1, 1.0, "1", True, None, [1]):
        said = refused(changed((*path, "orders", 0), lambda _: [order]), tmp_path)  # noqa: B023
        assert said.startswith(f"{dotted(path)}.orders[0]: orders are integers from 0 to 16, got ")
    said = refused(changed((*path, "orders"), lambda _: [[k % 17] for k in range(18)]), tmp_path)
    assert said == f"{dotted(path)}.orders: has 18 entries; at most 17 are read"


def nested(depth: int, inner: Any = 1.0) -> Any:
    for k in range(depth):
        inner = {"a": inner} if k % 2 else [inner]
    return inner


@pytest.mark.parametrize("depth", [45, 900, 100_000])
@pytest.mark.parametrize(
    "path",
    [
        ("provenance",), ("provenance", "spec", "design"), ("plant", "A", "coefficients", 0), ("gain", "table"), ("name",),
        ("claims", 0, "P"), ("model", "constants", "sigma0", "value"), ("model", "matrices", "A", 0, 0), ("schema",),
        ("scheduling", 0, "breakpoints", 1), ("update", "kind"), ("claims", 0, "channel", "errors", 0),
    ],
    ids=dotted,
)  # fmt: skip
def test_nesting_that_recursion_cannot_follow_is_refused(path: Path_, depth: int, tmp_path: Path) -> None:
    content = changed(path, lambda _: nested(depth))
    for attempt in (check_content, GainSchedule.from_content):
        with pytest.raises(ScheduleError) as caught:
            attempt(content, "s.json")
        assert (
            str(caught.value)
            == f"s.json: {path[0]}: lists and objects are nested too deeply; at most 40 levels are read"
        )
    mark = "MARK"
    text = json.dumps(changed(path, lambda _: mark))
    text = text.replace('"MARK"', "".join("[" if k % 2 else '{"a": ' for k in range(depth)) + "1" + "".join(
        "]" if k % 2 else "}" for k in reversed(range(depth))
    ))  # fmt: skip
    (tmp_path / "s.json").write_text(text)
    with pytest.raises(ScheduleError, match=r"nested too deeply|not a gain schedule") as caught:
        read_content(tmp_path / "s.json")
    assert str(caught.value).isprintable()


def test_content_that_contains_itself_is_refused() -> None:
    content = whole()
    content["provenance"]["self"] = [content, content, content]
    with pytest.raises(ScheduleError, match=r"^s\.json: provenance: lists and objects are nested too deeply"):
        check_content(content, "s.json")


def test_files_of_any_size_are_refused(tmp_path: Path) -> None:
    (tmp_path / "s.json").write_text(json.dumps(whole()) + " " * 8_000_000)
    with pytest.raises(ScheduleError, match=r"s\.json: more than 8000000 bytes; this is no schedule file"):
        read_content(tmp_path / "s.json")


def test_names_of_files_do_not_reach_a_terminal(tmp_path: Path) -> None:
    file = tmp_path / "a\x1b[31m\nb.json"
    file.write_text("{")
    with pytest.raises(ScheduleError, match=r"a\?\[31m\?b\.json: line 1"):
        read_content(file)
    with pytest.raises(ScheduleError, match=r"a\?\[31m\?b\.json: gain: missing"):
        write_content(file, {key: value for key, value in whole().items() if key != "gain"})


@pytest.mark.parametrize("content", [None, [], 3, "text", [[[]]]])
def test_what_is_no_object_is_refused(content: Any) -> None:
    for attempt in (check_content, GainSchedule.from_content):
        with pytest.raises(ScheduleError, match=r"^s\.json: content: expected an object, got "):
            attempt(content, "s.json")
