"""Arrays that know their axes: what a sensitivity study returns, plots from and saves."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from estimators.whole_files import write_bytes

SCHEMA = "gainsmith.labelled/1"
Labels: TypeAlias = FloatArray | NDArray[np.str_]


@dataclass(frozen=True)
class Axis:
    """One axis: its name, its unit ('1' for words and pure numbers) and one label for each place, numbers or words."""

    name: str
    labels: Labels
    unit: str = "1"


@dataclass(frozen=True, repr=False)
class LabelledArray(Display):
    """`values` with one named axis for each dimension, a unit, and notes (plain text and numbers) on where it comes from.

    Values may be NaN (not known), and are stored as float64. Raises AnalysisError if an axis is repeated or does not have as many
    labels as the array has places, and for complex or masked values, which would lose a part.

    >>> import numpy as np
    >>> from analysis.labelled import Axis
    >>> from analysis.labelled import Axis
    >>> margin = LabelledArray("margin", np.array([1.0, 2.0]), (Axis("speed", np.array([0.0, 10.0]), "m/s"),), "1/s")
    >>> margin.at(speed=10.0).item()
    2.0
    """

    name: str
    values: FloatArray
    axes: tuple[Axis, ...]
    unit: str = "1"
    notes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if np.iscomplexobj(self.values) or np.ma.is_masked(self.values):
            kind = "complex" if np.iscomplexobj(self.values) else "masked"
            raise AnalysisError(
                f"'{self.name}' has {kind} values; store their parts, or NaN where a value is not known"
            )
        object.__setattr__(self, "values", np.asarray(self.values, dtype=float))
        lengths = tuple(len(axis.labels) for axis in self.axes)
        names = [axis.name for axis in self.axes]
        if lengths != self.values.shape or len(set(names)) != len(names):
            fit = dict(zip(names, lengths, strict=True))
            raise AnalysisError(f"'{self.name}': axes {fit} do not fit the shape {self.values.shape}")

    def axis(self, name: str) -> Axis:
        """The axis of this name."""
        for axis in self.axes:
            if axis.name == name:
                return axis
        raise AnalysisError(unknown("axis", name, (axis.name for axis in self.axes)))

    def at(self, **labels: str | float) -> LabelledArray:
        """The array at one label of some axes: words exactly, numbers to 1e-12 or a millionth of the gap between labels."""
        values, axes = self.values, list(self.axes)
        for name, label in labels.items():
            axis = self.axis(name)
            place = _find(axis, label)
            values = np.take(values, place, axis=axes.index(axis))
            axes.remove(axis)
        return LabelledArray(self.name, np.asarray(values), tuple(axes), self.unit, {**self.notes, **labels})

    def item(self) -> float:
        """The only value."""
        return float(self.values.item())

    def save(self, path: str | Path) -> tuple[Path, Path]:
        """Write PATH.npz (values and labels, no pickles) and PATH.json (names, units, notes, checksum); returns both.

        Each is written beside and renamed, the description last, so a torn pair is noticed when it is read.
        """
        arrays = {"values": self.values, **{f"axis_{i}": np.asarray(axis.labels) for i, axis in enumerate(self.axes)}}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, allow_pickle=False, **arrays)
        data = buffer.getvalue()
        head = {
            "schema": SCHEMA,
            "name": self.name,
            "unit": self.unit,
            "axes": [{"name": a.name, "unit": a.unit, "labels": _plain(np.asarray(a.labels))} for a in self.axes],
            "notes": _plain(dict(self.notes)),
            "sha256": hashlib.sha256(data).hexdigest(),
        }
        try:
            text = (
                json.dumps(head, indent=1, allow_nan=False) + "\n"
            )  # before anything is written: notes may not be plain
        except (TypeError, ValueError) as error:
            raise AnalysisError(
                f"'{self.name}': notes hold what JSON has not ({error}); give texts, numbers and lists"
            ) from None
        files = _pair(path)
        try:
            for file, content in zip(files, (data, text.encode()), strict=True):
                write_bytes(file, content)
        except OSError as error:
            raise AnalysisError(f"{files[0].parent}: cannot be written ({error.strerror or error})") from None
        return files


def load_labelled(path: str | Path) -> LabelledArray:
    """Read what `save` wrote. Raises AnalysisError for files that are missing, edited, torn or of another schema.

    >>> from analysis.labelled import Axis
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = LabelledArray("margin", [1.0, 2.0], (Axis("speed", [0.0, 10.0], "m/s"),), "1/s").save(f"{folder}/margin")
    ...     print(load_labelled(f"{folder}/margin").unit)
    1/s
    """
    array_file, head_file = _pair(path)
    try:
        head = json.loads(head_file.read_text(encoding="utf-8"))
        data = array_file.read_bytes()
        if head.get("schema") != SCHEMA:
            raise AnalysisError(f"{head_file}: schema {head.get('schema')!r} is not {SCHEMA}")
        if hashlib.sha256(data).hexdigest() != head["sha256"]:
            raise AnalysisError(f"{array_file}: checksum differs from {head_file.name}: edited or torn; save it again")
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            values = np.asarray(arrays["values"], float)
            axes = tuple(Axis(a["name"], arrays[f"axis_{i}"], a["unit"]) for i, a in enumerate(head["axes"]))
        return LabelledArray(head["name"], values, axes, head["unit"], head["notes"])
    except (OSError, KeyError, TypeError, AttributeError, ValueError) as error:
        if isinstance(error, AnalysisError):
            raise
        raise AnalysisError(f"{head_file}: not a saved labelled array ({type(error).__name__}: {error})") from None


def _find(axis: Axis, label: str | float) -> int:
    labels = np.asarray(axis.labels)
    if isinstance(label, str) != (labels.dtype.kind == "U"):
        hits = np.zeros(0, int)
    elif isinstance(label, str):
        hits = np.flatnonzero(labels == label)
    else:
        numbers = labels.astype(float)
        apart = np.diff(np.unique(numbers)).min(initial=np.inf)  # labels tell themselves apart, whatever their size
        hits = np.flatnonzero(np.isclose(numbers, label, rtol=1e-12, atol=1e-6 * apart if np.isfinite(apart) else 0.0))
    if not len(hits):
        raise AnalysisError(f"axis '{axis.name}': {unknown('label', str(label), map(str, labels.tolist()))}")
    return int(hits[0])


def _plain(value: Any) -> Any:
    """Numbers of numpy as Python's, what is not finite as a word: JSON has neither."""
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value


def _pair(path: str | Path) -> tuple[Path, Path]:
    stem = Path(path)
    if stem.suffix in {".npz", ".json"}:
        stem = stem.with_suffix("")
    return stem.with_name(stem.name + ".npz"), stem.with_name(stem.name + ".json")
