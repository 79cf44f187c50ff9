"""Tables of ranks, both tests, covariance readings and Table II."""

from __future__ import annotations

import numpy as np

from studies.claim import Finding
from studies.papers.longitudinal_speed.claims_observability import SPEEDS, exact_ranks
from studies.papers.longitudinal_speed.covariance import MODES, steady_filter
from studies.papers.longitudinal_speed.figures_observability import RANK_TOLERANCE, drives, gramian_rank
from studies.papers.longitudinal_speed.inputs import printed_numbers, sample_time
from studies.papers.longitudinal_speed.unknown_start import STRUCTURES
from studies.study import Table

SPEED = 40.0  # rad/s


def rank_table() -> Table:
    """Exact rank of (24) at points, and numerical rank of the gramian along records."""
    cases = (("constant speed", 0, 0), ("accelerating, 1 rad/s^2", 1, 0), ("acceleration changing, 1 rad/s^3", 0, 1))
    rows: list[list[str | int | float]] = [
        ["rank of O3, exact", name, f"at {', '.join(map(str, SPEEDS))} rad/s", *_span(exact_ranks(a, j))]
        for name, a, j in cases
    ]
    for record in drives():
        rank = gramian_rank(record)
        rows.append(["rank of V(0, N)", record.name, f"{len(rank)} samples", int(rank[len(rank) // 4]), int(rank[-1])])
    caption = (
        "Rank of the time-varying observability matrix (24) in rational numbers (lowest and highest over three "
        "wheel speeds), and numerical rank of the gramian (A1) along wheel speed histories (after a quarter of the "
        f"record and at its end, tolerance {RANK_TOLERANCE:g})."
    )
    return Table("ranks", caption, ["what", "motion", "where", "rank, first", "rank, last"], rows)


def test_1_table(finding: Finding) -> Table:
    """Seconds until M is zero in every reading."""
    rows = [[name, value] for name, value in finding.computed["seconds_to_zero"].items()]
    caption = (
        f"Test 1 of P2: seconds until M is exactly zero at {1 / sample_time():g} Hz; Fig. 2 of the paper reads 0.03 s."
    )
    return Table("test-1", caption, ["reading", "seconds to zero [s]"], rows)


def test_2_table(finding: Finding) -> Table:
    """Peak and end of N in every reading."""
    rows = [
        [name, e["peak"], e["at_sample"], e["last"], e["riccati"], e["bounded"]] for name, e in finding.computed.items()
    ]
    columns = [
        "record, reading of Q",
        "peak of lambda_max(N)",
        "at sample",
        "at the end",
        "Riccati solution",
        "bounded",
    ]
    caption = (
        "Test 2 of P2: largest eigenvalue of N along 8 s at 200 Hz, 40 rad/s constant, or 0.3 s of 100 rad/s^2 "
        "before, for three readings of the printed scalar Q; rank tolerance 1e-9. State units: m, m/s, m/s."
    )
    return Table("test-2", caption, columns, rows)


def covariance_table() -> Table:
    """Velocity gain and time constant at 40 rad/s."""
    rows: list[list[str | float]] = []
    for structure in STRUCTURES:
        for mode in MODES:
            found = steady_filter(SPEED, structure, mode)
            rows.append([structure, mode.replace("_", " "), found.velocity_gain, found.time_constant])
    caption = f"Steady Kalman filter at {SPEED:g} rad/s and 200 Hz for the readings of the printed scalar covariances, Q = q S."
    return Table(
        "covariance-readings", caption, ["S", "mode", "velocity gain [m/s]", "slowest time constant [s]"], rows
    )


def force_table_2() -> Table:
    """Table II, forces, as printed."""
    numbers = printed_numbers()["table_2_forces"]
    columns = ["corner"] + [f"{drive}: {observer} [%]" for drive in numbers["drives"] for observer in ("UKF", "UIO")]
    return Table(
        "table-2-forces",
        "Table II of P2 as printed: normalised error (NRMS) of the longitudinal force of each corner, measured on "
        "the road.",
        columns,
        numbers["rows"],
    )


def load_table_2() -> Table:
    """Table II, loads, as printed."""
    numbers = printed_numbers()
    columns = ["corner"] + [f"{drive}: {what}" for drive in numbers["table_2_forces"]["drives"]
                            for what in ("NRMS [%]", "largest [kN]")]  # fmt: skip
    rows = numbers["table_2_loads"]["rows"]
    return Table(
        "table-2-loads",
        "Table II of P2 as printed: normalised error and largest value of the vertical loads, measured on the road.",
        columns,
        rows,
    )


def _span(values: list[int]) -> list[int]:
    return [int(np.min(values)), int(np.max(values))]
