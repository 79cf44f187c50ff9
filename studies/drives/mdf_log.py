"""Reading channels of an MDF log (ASAM MDF 3 and 4) with asammdf: every channel group has stamps of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from studies.drives.quantities import short
from studies.drives.table import LogTable, merge, no_column
from studies.errors import LogError

EXTRA = "pip install 'gainsmith[logs]'"


def read_channels(path: Path, wanted: Mapping[str, str], time: str) -> LogTable:
    """The ``wanted`` channels (name to what they are for) over their common stamps, column ``time``, s from the start.

    A name that several groups have is written ``name@3`` with the number of the group. Samples that the file itself calls invalid
    are left out. Raises LogError, one line: no MDF file, no such channel, a channel in several groups, text, no asammdf.
    """
    series = {}
    with _opened(path) as file:
        for name, role in wanted.items():
            if name == time:
                continue
            plain, at, number = name.rpartition("@") if name not in file.channels_db else (name, "", "")
            places = list(file.channels_db.get(plain, ()))
            if at and number.isdigit():
                places = [place for place in places if place[0] == int(number)]
            if not places:
                raise no_column(path.name, role, name, [one for one in file.channels_db if one not in ("time", "t")])
            if len(places) > 1:
                groups = ", ".join(f"{name}@{group}" for group, _ in places[:5])
                raise LogError(
                    f"{path.name}: {role}: channel '{short(name, 40)}' is in {len(places)} groups; write {groups}"
                )
            series[name] = _samples(path, file.get(plain, group=places[0][0], index=places[0][1]), name, role)
    return merge(series, time)


def name_channels(path: Path) -> dict[str, str]:
    """Every channel with its unit, a column ``time`` for their stamps first."""
    with _opened(path) as file:
        names = {"time": "s"}
        for name, places in file.channels_db.items():
            group, index = places[0]
            if index != file.masters_db.get(group, -1):
                unit = str(file.get_channel_unit(name, group=group, index=index) or "")
                names |= {name: unit} if len(places) == 1 else {f"{name}@{g}": unit for g, _ in places}
    return names


def _samples(path: Path, signal: Any, name: str, role: str) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    values = np.asarray(signal.samples)
    if values.ndim != 1 or values.dtype.kind not in "buif":
        raise LogError(f"{path.name}: {role}: channel '{short(name, 40)}' holds no numbers; choose another channel")
    return np.asarray(signal.timestamps, dtype=np.float64), values.astype(np.float64)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        from asammdf import MDF
    except ImportError as error:
        raise LogError(f"{path.name}: reading MDF needs asammdf; {EXTRA}") from error
    with path.open("rb") as stream:
        start = stream.read(68)
    # said here: asammdf leaves a half-made object behind, which complains once more when it is deleted
    if len(start) < 68 or not start.startswith((b"MDF", b"UnFinMF")) or start[64:66] not in (b"HD", b"##"):
        raise LogError(f"{path.name}: is not a readable MDF file (no header); record or export it again")
    try:
        file = MDF(path)
    except Exception as error:  # asammdf raises whatever its parsers meet in a broken file
        words = short(str(error).splitlines()[0] if str(error) else type(error).__name__, 80)
        raise LogError(f"{path.name}: is not a readable MDF file ({words}); record or export it again") from error
    try:
        yield file
    finally:
        file.close()
