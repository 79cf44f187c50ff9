"""What a simulation leaves behind: times, and every signal asked for, of B runs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar
from zlib import crc32

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.display import Display
from estimators.errors import unknown
from studies.truth.signals import UNITS
from studies.truth.vehicle import TruthVehicle
from synthesis.errors import SpecError


@dataclass(frozen=True, repr=False)
class Truth(Display):
    """B runs over n samples. `signals`: name -> (B, n) of the car or (B, n, 4) of the corners fl, fr, rl, rr, SI.

    `duration` (B,) s: a batch goes on to the end of its longest run, and what a shorter one does after its own end means
    nothing; `valid` masks it. `vehicles` are the cars as they were driven.
    """

    shown_units: ClassVar = {"time": "s", "duration": "s"}

    time: FloatArray  # (n,) s
    signals: dict[str, FloatArray]
    names: tuple[str, ...]  # (B,) of the manoeuvres
    duration: FloatArray  # (B,) s
    vehicles: tuple[TruthVehicle, ...]
    tires: tuple[str, ...]  # (B,)
    keys: tuple[tuple[int, int], ...] = ()  # (B,) of the random numbers: manoeuvre, and which of its runs

    def __post_init__(self) -> None:
        if not self.keys:
            seen: Counter[str] = Counter()
            keys = []
            for name in self.names:
                keys.append((crc32(name.encode()), seen[name]))
                seen[name] += 1
            object.__setattr__(self, "keys", tuple(keys))

    @property
    def sample_time(self) -> float:
        """s."""
        return float(self.time[1] - self.time[0])

    @property
    def size(self) -> int:
        """B."""
        return len(self.names)

    @property
    def valid(self) -> BoolArray:
        """(B, n): samples within the run's own duration."""
        return np.asarray(self.time <= self.duration[:, None] + 1e-9)

    @property
    def units(self) -> dict[str, str]:
        """Unit of every recorded signal."""
        return {name: UNITS[name] for name in self.signals}

    def __getitem__(self, name: str) -> FloatArray:
        """A signal by name. Raises SpecError with the nearest names."""
        if name not in self.signals:
            raise SpecError(f"truth: {unknown('signal', name, self.signals)}")
        return self.signals[name]

    def only(self, runs: Sequence[int] | str) -> Truth:
        """The runs with the given numbers, or those of one manoeuvre, cut to the longest of them."""
        rows = [k for k, name in enumerate(self.names) if name == runs] if isinstance(runs, str) else list(runs)
        if not rows:
            raise SpecError(f"truth: {unknown('manoeuvre', str(runs), self.names)}")
        duration = self.duration[rows]
        keep = self.time <= duration.max() + 1e-9
        return Truth(
            self.time[keep], {name: value[rows][:, keep] for name, value in self.signals.items()},
            tuple(self.names[k] for k in rows), duration, tuple(self.vehicles[k] for k in rows),
            tuple(self.tires[k] for k in rows), tuple(self.keys[k] for k in rows),
        )  # fmt: skip

    def until(self, end: float) -> Truth:
        """The samples up to ``end``, s; runs that take longer end there."""
        keep = self.time <= end + 1e-9
        signals = {name: value[:, keep] for name, value in self.signals.items()}
        return replace(self, time=self.time[keep], signals=signals, duration=np.minimum(self.duration, end))

    def every(self, n: int) -> Truth:
        """Every n-th sample."""
        if n == 1:
            return self
        return replace(self, time=self.time[::n], signals={name: v[:, ::n] for name, v in self.signals.items()})


RUNS = "runs.json"


def write_truth(truth: Truth, folder: Path) -> None:
    """Write times, signals and what is known of the runs, except their vehicles, to the folder.

    One array file for each signal, mapped into memory when it is read, so that a few runs cost little.
    """
    np.save(folder / "time.npy", truth.time)
    for name, value in truth.signals.items():
        np.save(folder / f"{name}.npy", value)
    runs = {"names": truth.names, "duration": truth.duration.tolist(), "tires": truth.tires, "keys": truth.keys}
    (folder / RUNS).write_text(json.dumps(runs, indent=1) + "\n", encoding="utf-8")


def read_truth(folder: Path, vehicles: Sequence[TruthVehicle]) -> Truth:
    """The truth that `write_truth` left, read-only; ``vehicles`` of the runs in their order.

    Raises SpecError where there is none, or one of another number of runs.
    """
    try:
        runs = json.loads((folder / RUNS).read_text(encoding="utf-8"))
        time = np.load(folder / "time.npy", allow_pickle=False)
        signals = {
            path.stem: np.load(path, mmap_mode="r", allow_pickle=False)
            for path in sorted(folder.glob("*.npy"))
            if path.stem in UNITS
        }
    except (OSError, ValueError) as error:
        raise SpecError(f"{folder}: no truth can be read there ({error})") from error
    if len(runs["names"]) != len(vehicles):
        raise SpecError(f"{folder}: {len(runs['names'])} runs, but {len(vehicles)} vehicles")
    return Truth(
        time, signals, tuple(runs["names"]), np.array(runs["duration"]), tuple(vehicles), tuple(runs["tires"]),
        tuple((int(a), int(b)) for a, b in runs["keys"]),
    )  # fmt: skip
