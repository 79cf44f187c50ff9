"""The schedule file: strict JSON that is sealed by digests, read back bit for bit and never half-written."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, NoReturn

from estimators.errors import ScheduleError, printable
from estimators.schedule.check import SCHEMA, SEALS, SECTIONS, check_content, check_depth
from estimators.schedule.checker import quoted, shown
from estimators.schedule.upgrade import FIRST_FORMAT, upgraded
from estimators.whole_files import write_bytes

REGENERATE = "regenerate the file instead of editing it"
LARGEST_FILE = 8_000_000  # bytes


def canonical(content: Mapping[str, Any]) -> bytes:
    """The one byte string of `content`: sorted keys, no spaces, ASCII, shortest decimals that read back exactly.

    Raises:
        ScheduleError: the content holds something that JSON cannot carry exactly (NaN, infinity, numpy arrays).
    """
    try:
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=True)
    except (TypeError, ValueError, RecursionError) as error:
        raise ScheduleError(f"content is not plain JSON data: {error}; use dict, list, str, int, float") from error
    return text.encode("ascii")


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """A plain copy of `content` with `section_sha256` (one digest a section) and `sha256` (everything but itself)."""
    canonical(content)  # refuses what JSON cannot carry before anything is copied
    sections = {key: content[key] for key in sorted(content, key=_place_of) if key not in SEALS}
    copy: dict[str, Any] = json.loads(json.dumps(sections))
    copy["section_sha256"] = {key: _digest(value) for key, value in copy.items()}
    copy["sha256"] = _digest(copy)
    return copy


def check_seal(content: Mapping[str, Any], where: str) -> None:
    """Compares the digests, sections first, so that an edit is reported with the section it was made in.

    Raises:
        ScheduleError: a digest is absent or does not match.
    """
    digests = content.get("section_sha256")
    if not isinstance(digests, dict):
        raise ScheduleError(f"{where}: section_sha256: no digests of the sections; {REGENERATE}")
    sections = [key for key in content if key not in SEALS]
    for key in sections:
        if digests.get(key) != _digest(content[key]):
            words = f"{shown(key)}: this section does not match its sha256: it was edited; {REGENERATE}"
            raise ScheduleError(f"{where}: {words}")
    for key in digests:
        if key not in content:
            words = f"{shown(key)}: this section is missing although it has a sha256; {REGENERATE}"
            raise ScheduleError(f"{where}: {words}")
    body = {key: value for key, value in content.items() if key != "sha256"}
    if content.get("sha256") != _digest(body):
        raise ScheduleError(f"{where}: sha256: the digest of the whole does not match; {REGENERATE}")


def read_content(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Reads and checks a schedule file: JSON, version, digests, then structure; see `check_content`.

    A file of format 1 is returned as format 2, unsealed (`estimators.schedule.upgrade`).

    Raises:
        ScheduleError: names the file, the place in it and what to do.
    """
    where = place_of(path)
    try:
        with Path(path).open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
        text = data.decode("utf-8")
    except OSError as error:
        raise ScheduleError(f"{where}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ScheduleError(f"{where}: byte {error.start} is not UTF-8; this is no schedule file") from error
    if len(data) > LARGEST_FILE:
        raise ScheduleError(f"{where}: more than {LARGEST_FILE} bytes; this is no schedule file")
    content = _parsed(text, where)
    if not isinstance(content, dict) or not isinstance(content.get("schema"), str):
        raise ScheduleError(f"{where}: schema: not a gain schedule; expected an object with schema '{SCHEMA}'")
    if content["schema"] not in (SCHEMA, FIRST_FORMAT):
        words = f"{quoted(content['schema'])} is not understood; this version reads '{SCHEMA}'"
        raise ScheduleError(f"{where}: schema: {words}")
    check_depth(content, where)
    check_seal(content, where)
    if content["schema"] == FIRST_FORMAT:
        return upgraded(content, where)
    check_content(content, where)
    return content


def write_content(path: str | os.PathLike[str], content: Mapping[str, Any]) -> None:
    """Checks, seals and writes `content`: beside the target, flushed to the disk, then renamed over it (`whole_file`)."""
    check_content(content, place_of(path))
    data = _layout(sealed(content), 0).encode("ascii") + b"\n"
    write_bytes(Path(path), data, sync=True)


def place_of(path: str | os.PathLike[str]) -> str:
    """A file's name for messages; a name is foreign text, too."""
    return printable(os.fspath(path), 4096)


def _digest(value: Any) -> str:
    return sha256(canonical(value)).hexdigest()


def _place_of(key: str) -> int:
    return SECTIONS.index(key) if key in SECTIONS else len(SECTIONS)


def _parsed(text: str, where: str) -> Any:
    """Strict JSON: what the standard library lets pass (duplicate keys, NaN, 1e999) is refused."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, value in pairs:
            if key in found:
                raise ScheduleError(f"{where}: the key '{shown(key)}' appears twice in one object; {REGENERATE}")
            found[key] = value
        return found

    def constant(word: str) -> NoReturn:
        raise ScheduleError(f"{where}: {shown(word)} is not a finite number; {REGENERATE}")

    def number(digits: str) -> float:
        value = float(digits)
        return value if math.isfinite(value) else constant(digits)

    try:
        return json.loads(text, object_pairs_hook=unique, parse_constant=constant, parse_float=number)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise ScheduleError(f"{where}: {place}: not JSON ({error.msg}): truncated or edited; {REGENERATE}") from error
    except RecursionError as error:
        raise ScheduleError(f"{where}: nested too deeply to be a gain schedule") from error
    except ScheduleError:
        raise
    except ValueError as error:  # an integer with thousands of digits
        raise ScheduleError(f"{where}: {printable(str(error), 160)}; {REGENERATE}") from error


def _layout(value: Any, depth: int) -> str:
    """JSON with one entry a line where it is long, so that a changed gain shows as one changed line."""
    flat = json.dumps(value, allow_nan=False)
    if len(flat) <= 100 or not isinstance(value, (dict, list)):
        return flat
    inner, outer = "\n" + " " * (depth + 1), "\n" + " " * depth
    if isinstance(value, dict):
        entries = [f"{json.dumps(key)}: {_layout(entry, depth + 1)}" for key, entry in value.items()]
        return "{" + inner + ("," + inner).join(entries) + outer + "}"
    return "[" + inner + ("," + inner).join(_layout(entry, depth + 1) for entry in value) + outer + "]"
