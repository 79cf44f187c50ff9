"""The estimates of a drive beside its references: errors with units, baselines, and how honest the stated deviations are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from studies.drives.chain import Chain
from studies.drives.evaluation import AXLES, LEAST_FORCE, DriveData, reference_axle_force
from studies.drives.quantities import CORNERS
from studies.sentence import shown
from studies.study import Table

BASELINES = ("mean_wheel_speed", "integrated_acceleration", "quasi_static")
WORDS = {
    "vx": "V_x", "vy": "V_y", "sideslip": "sideslip angle", "force_x": "F_x of the wheels", "force_y": "F_y of the axles",
    "force_z": "F_z of the wheels", "total_force_x": "total F_x",
}  # fmt: skip
COVERED = 95.45  # % of normal errors within two standard deviations
LEAST_COVERED = 90.0  # %: below it the stated deviations are too small
COLUMNS = (
    "quantity",
    "estimate",
    "RMS error",
    "largest error",
    "unit",
    "NRMS [%]",
    "largest reference",
    "within ±2σ [%]",
    "samples",
)


@dataclass(frozen=True)
class Statement:
    """A kind of quantity (``what``), whether the pipeline is nearer than every baseline, and the sentence that says it.

    ``circular``: the reference goes into the estimate, so that it shows nothing.
    """

    what: str
    holds: bool
    sentence: str
    circular: bool = False


def signals_of(metrics: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Deviations by quantity and estimate, V_x first; those that have samples."""
    found = {"vx": metrics["velocity"], **metrics["pipeline"].get("signals", {})}
    kept = {name: {who: e for who, e in entries.items() if e["samples"]} for name, entries in found.items()}
    return {name: entries for name, entries in kept.items() if entries}


def kind_of(signal: str) -> str:
    """``force_x`` of ``force_x_fl``; a quantity that is alone is its own kind."""
    kind, _, place = signal.rpartition("_")
    return kind if place in (*CORNERS, *AXLES) else signal


def statements(metrics: Mapping[str, Any]) -> list[Statement]:
    """One sentence for each kind of quantity that the pipeline estimates and the log has a reference for."""
    notes, signals, found = metrics["pipeline"].get("notes", {}), signals_of(metrics), []
    for kind in dict.fromkeys(map(kind_of, signals)):
        entries = [signals[name] for name in signals if kind_of(name) == kind and "pipeline" in signals[name]]
        if entries:
            sides: dict[bool, list[str]] = {True: [], False: []}
            for other in (b for b in BASELINES if all(b in e for e in entries)):
                wins = sum(e["pipeline"]["rms"] <= e[other]["rms"] for e in entries)
                at = f" at {wins} of {len(entries)}" if 0 < wins < len(entries) else ""
                sides[wins == len(entries)].append(f"{other.replace('_', ' ')}{at} ({_span(entries, other)})")
            text = f"{WORDS.get(kind, kind)}: off by {_span(entries, 'pipeline')} RMS, {_most(entries)} at most"
            near = f"nearer than {' and '.join(sides[True])}" if sides[True] else ""
            far = f"not nearer than {' and '.join(sides[False])}" if sides[False] else ""
            found.append(
                Statement(kind, not sides[False], "; ".join(filter(None, (text, near, far))) + ".", kind in notes)
            )
    return found


def _span(entries: list[Mapping[str, Any]], who: str) -> str:
    values = [e[who]["rms"] for e in entries if who in e]
    low, high, unit = shown(min(values), 3), shown(max(values), 3), entries[0]["pipeline"]["unit"]
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _most(entries: list[Mapping[str, Any]]) -> str:
    return f"{shown(max(e['pipeline']['max_error'] for e in entries), 3)} {entries[0]['pipeline']['unit']}"


def coverage(data: DriveData) -> dict[str, float]:
    """Share of samples whose error lies within two stated standard deviations, %, by quantity; where both are known."""
    if data.chain is None:
        return {}
    found = {}
    for name, (value, deviation, reference, counts) in _stated(data, data.chain):
        known = np.isfinite(value) & np.isfinite(deviation) & np.isfinite(reference) & counts
        if known.any():
            found[name] = 100.0 * float(np.mean(np.abs(value - reference)[known] <= 2.0 * deviation[known]))
    return found


Stated = tuple[FloatArray, FloatArray, FloatArray, BoolArray]


def _stated(data: DriveData, chain: Chain) -> Iterator[tuple[str, Stated]]:
    """Value, deviation, reference, and which samples count: those that the errors are taken over."""
    log, always = data.log.reference, np.ones(data.log.time.shape, bool)
    if "vx" in log:
        yield "vx", (chain.vx, chain.vx_deviation, log["vx"], always)
    if "vy" in log:
        yield "vy", (chain.vy, chain.vy_deviation, log["vy"], always)
    for k, corner in enumerate(CORNERS):
        if (true := log.get(f"force_x_{corner}")) is not None:
            yield f"force_x_{corner}", (chain.force_x[:, k], chain.force_x_deviation[:, k], true, _acting(true))
    for k, axle in enumerate(AXLES):
        if (true := reference_axle_force(data.log, axle)) is not None:
            stated = chain.axle_force_y[:, k], chain.axle_force_y_deviation[:, k]
            yield f"force_y_{axle}", (*stated, true, _acting(true))


def _acting(force: FloatArray) -> BoolArray:
    return np.asarray(np.abs(force) > LEAST_FORCE)


def error_table(metrics: Mapping[str, Any], covered: Mapping[str, float]) -> Table:
    """Every estimate of every quantity."""
    rows = []
    for signal, entries in signals_of(metrics).items():
        for who, e in entries.items():
            within = shown(covered[signal], 3) if who == "pipeline" and signal in covered else None
            nrms = None if e["nrms_percent"] is None else shown(e["nrms_percent"], 3)
            rows.append((
                _named(signal), who.replace("_", " "), shown(e["rms"], 3), shown(e["max_error"], 3), e["unit"], nrms,
                shown(e["reference_peak"], 4), within, e["samples"],
            ))  # fmt: skip
    caption = (
        "Errors of every estimate against the reference, over the samples where both are known. NRMS is the RMS error over "
        "the largest magnitude of the reference; within ±2σ is the share of samples whose error is within two of the "
        f"deviations that the pipeline states (normal errors: {shown(COVERED, 3)} %)."
    )
    return Table("errors", caption, COLUMNS, rows)


def _named(signal: str) -> str:
    kind, place = kind_of(signal), signal.rpartition("_")[2]
    return WORDS.get(signal) or f"{WORDS.get(kind, kind).split(' of ')[0]} {place}"
