"""Reading fields of ROS 1 and ROS 2 bags and MCAP files with rosbags: a column is ``/topic.field`` or ``/topic.field[0]``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.drives.mdf_log import EXTRA
from studies.drives.quantities import short
from studies.drives.table import LogTable, merge, no_column
from studies.errors import LogError

HEADER = "header.stamp"
MOST_ELEMENTS = 16  # of an array that are listed as columns
_ELEMENT = re.compile(r"(.+)\[(\d+)\]")


def read_fields(path: Path, wanted: Mapping[str, str], time: str) -> LogTable:
    """The ``wanted`` fields (name to what they are for) over their common stamps, column ``time``, s.

    Stamps are those of the recorder; with ``time = "header.stamp"`` those in the headers of the messages. Raises LogError, one
    line: no bag, no such topic or field, a field that is no number, no rosbags.
    """
    by_topic: dict[str, list[str]] = {}
    for name in wanted:
        if name != time:
            by_topic.setdefault(name.partition(".")[0], []).append(name)
    rows: dict[str, tuple[list[float], list[float]]] = {name: ([], []) for names in by_topic.values() for name in names}
    with _opened(path) as bag:
        for topic, names in by_topic.items():
            if topic not in bag.topics:
                raise no_column(path.name, wanted[names[0]], names[0], bag.topics)
        chosen = [one for one in bag.connections if one.topic in by_topic]
        for connection, stamp, raw in bag.messages(connections=chosen):
            message = bag.deserialize(raw, connection.msgtype)
            when = 1e-9 * stamp
            if time == HEADER:
                when = _field(path, message, f"{connection.topic}.{HEADER}.sec", HEADER)
                when += 1e-9 * _field(path, message, f"{connection.topic}.{HEADER}.nanosec", HEADER)
            for name in by_topic[connection.topic]:
                rows[name][0].append(when)
                rows[name][1].append(_field(path, message, name, wanted[name]))
    for name, (stamps, _) in rows.items():
        if not stamps:
            raise LogError(f"{path.name}: {wanted[name]}: topic '{name.partition('.')[0]}' has no messages")
    return merge({name: (np.array(stamps), np.array(values)) for name, (stamps, values) in rows.items()}, time)


def name_fields(path: Path) -> dict[str, str]:
    """Every number in the first message of every topic, a column ``time`` first; messages carry no units."""
    names = {"time": "s"}
    with _opened(path) as bag:
        for topic, info in bag.topics.items():
            if info.msgcount:
                connection, _, raw = next(iter(bag.messages(connections=info.connections)))
                names |= dict.fromkeys(_numbers(bag.deserialize(raw, connection.msgtype), topic), "")
    return names


def _numbers(value: Any, name: str) -> Iterator[str]:
    if is_dataclass(value):
        for one in fields(value):
            if one.name not in ("__msgtype__", "header"):
                yield from _numbers(getattr(value, one.name), f"{name}.{one.name}")
    elif isinstance(value, np.ndarray):
        yield from (f"{name}[{k}]" for k in range(min(value.size, MOST_ELEMENTS)) if value.dtype.kind in "buif")
    elif isinstance(value, int | float):
        yield name


def _field(path: Path, message: Any, name: str, role: str) -> float:
    value, (topic, _, rest) = message, name.partition(".")
    for part in rest.split("."):
        element = _ELEMENT.fullmatch(part)
        known = [one.name for one in fields(value)] if is_dataclass(value) else []
        if (element[1] if element else part) not in known:
            raise no_column(path.name, role, name, [f"{topic}.{one}" for one in known])
        value = getattr(value, element[1] if element else part)
        if element:
            value = value[int(element[2])] if int(element[2]) < len(value) else np.nan
    if not isinstance(value, int | float | np.number):
        raise LogError(f"{path.name}: {role}: field '{short(name, 60)}' is no number; name a field in it")
    return float(value)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise LogError(f"{path.name}: reading bags and MCAP needs rosbags; {EXTRA}") from error
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
            yield bag
    except LogError:
        raise
    except Exception as error:  # rosbags raises whatever its parsers meet in a broken file
        words = short(str(error).splitlines()[0] if str(error) else type(error).__name__, 80)
        raise LogError(f"{path.name}: is not a readable bag ({words}); record or export it again") from error
