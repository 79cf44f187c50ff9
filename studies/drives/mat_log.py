"""Reading variables of a MATLAB file up to version 7: vectors, ``struct.field``, and columns of a matrix ``name[0]``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.quantities import short
from studies.drives.table import LogTable, no_column, table_of
from studies.errors import LogError

MOST_ELEMENTS = 16  # columns of a matrix that is a table of signals
HDF5 = b"\x89HDF"


def read_variables(path: Path, wanted: Mapping[str, str], time: str) -> LogTable:
    """The ``wanted`` variables (name to what they are for), all as long as the ``time``.

    Raises LogError, one line: no MATLAB file, version 7.3, no such variable, no vector of numbers, another length.
    """
    found = _vectors(path)
    for name, role in wanted.items():
        if name not in found:
            raise no_column(path.name, role, name, found)
        if found[name].size != found[time].size:
            raise LogError(
                f"{path.name}: {role}: variable '{short(name, 40)}' has {found[name].size} samples, '{short(time, 40)}' has "
                f"{found[time].size}; a signal with another time belongs to a [[log]] of its own, with the same file"
            )
    return table_of({name: found[name] for name in wanted}, None)


def name_variables(path: Path) -> dict[str, str]:
    """Every vector of numbers; MATLAB has no units."""
    return dict.fromkeys(_vectors(path), "")


def _vectors(path: Path) -> dict[str, FloatArray]:
    from scipy.io import loadmat

    with path.open("rb") as stream:
        newer = stream.read(128 + 4)
    if newer.startswith(HDF5) or b"MATLAB 7.3" in newer:
        raise LogError(f"{path.name}: is a MATLAB 7.3 file, which is HDF5; save it again with save(name, '-v7')")
    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except Exception as error:  # scipy raises whatever its parser meets in a broken file
        words = short(str(error).splitlines()[0] if str(error) else type(error).__name__, 80)
        raise LogError(f"{path.name}: is not a readable MATLAB file ({words}); save it again with '-v7'") from error
    found: dict[str, FloatArray] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            _collect(found, name, value)
    return found


def _collect(found: dict[str, FloatArray], name: str, value: Any) -> None:
    for one in getattr(value, "_fieldnames", ()):
        _collect(found, f"{name}.{one}", getattr(value, one))
    if isinstance(value, np.ndarray) and value.dtype == object:  # a struct array, of which Simulink labels each entry
        for k, one in enumerate(value.flat):
            _collect(found, f"{name}.{getattr(one, 'label', '') or k}", one)
    if isinstance(value, np.ndarray) and value.dtype.kind in "buif":
        if value.ndim == 1:
            found[name] = value.astype(np.float64)
        elif value.ndim == 2 and value.shape[1] <= MOST_ELEMENTS < value.shape[0]:
            found |= {f"{name}[{k}]": column for k, column in enumerate(value.T.astype(np.float64))}
