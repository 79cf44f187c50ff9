"""A truth on disk: one array file for each signal, mapped into memory when it is read, so that a few runs cost little."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from studies.truth.record import Truth
from studies.truth.signals import UNITS
from studies.truth.vehicle import TruthVehicle
from synthesis.errors import SpecError

RUNS = "runs.json"


def write_truth(truth: Truth, folder: Path) -> None:
    """Write times, signals and what is known of the runs, except their vehicles, to the folder."""
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
        time,
        signals,
        tuple(runs["names"]),
        np.array(runs["duration"]),
        tuple(vehicles),
        tuple(runs["tires"]),
        tuple((int(a), int(b)) for a, b in runs["keys"]),
    )
