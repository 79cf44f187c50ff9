"""P2-tab2: three statements of the text against Table II."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from studies.claim import ClaimFunction, Finding
from studies.papers.longitudinal_speed.inputs import printed_numbers, printed_value
from studies.papers.verdicts import partly


def force_table(rows: Sequence[Sequence[Any]] | None = None) -> Finding:
    """UKF against unknown-input observer cell by cell, and both limits."""
    numbers, limit = printed_numbers(), printed_value("P2-tab2")
    forces = numbers["table_2_forces"]["rows"] if rows is None else rows
    drives = numbers["table_2_forces"]["drives"]
    cells = [(row[0], drive, row[1 + 2 * k], row[2 + 2 * k]) for row in forces for k, drive in enumerate(drives)]
    loads = [value for row in numbers["table_2_loads"]["rows"] for value in row[1::2]]
    worse = [list(cell) for cell in cells if cell[3] < cell[2]]
    ukf, uio = ([cell[i] for cell in cells] for i in (2, 3))
    statements = {
        "ukf_better_everywhere": not worse,
        "ukf_below_limit": max(ukf) < limit["ukf"],
        "loads_within_limit": max(loads) <= limit["load"],
    }
    computed = {
        "largest_ukf_percent": max(ukf), "largest_load_percent": max(loads), "mean_ukf_percent": sum(ukf) / len(ukf),
        "mean_uio_percent": sum(uio) / len(uio), "cells": len(cells), "uio_better": worse, "statements": statements,
    }  # fmt: skip
    shown = ", ".join(f"{corner} in {drive} ({a:g} against {b:g} %)" for corner, drive, a, b in worse) or "none"
    reading = (
        f"Largest UKF error {max(ukf):g} % (below {limit['ukf']:g}: "
        f"{'yes' if statements['ukf_below_limit'] else 'no'}), largest load error {max(loads):g} % (at most "
        f"{limit['load']:g}: {'yes' if statements['loads_within_limit'] else 'no'}). The unknown-input observer is "
        f"better in {len(worse)} of {len(cells)} cells: {shown}. On average the UKF has "
        f"{computed['mean_ukf_percent']:.2f} %, the other {computed['mean_uio_percent']:.2f} %."
    )
    return Finding(computed, partly(all(statements.values()), any(statements.values())), reading)


CLAIMS: dict[str, ClaimFunction] = {"P2-tab2": force_table}
