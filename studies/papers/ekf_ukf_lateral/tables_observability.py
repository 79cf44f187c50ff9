"""Ranks of the model of P4 in the cases that matter."""

from __future__ import annotations

from studies.papers.ekf_ukf_lateral.observability import (
    corrected_model,
    printed_output_model,
    rank_of,
    rank_through_straight,
    rear_difference_model,
    singular_at_standstill,
)
from studies.study import Cell, Table

LAG = "V / sigma"


def rank_table() -> Table:
    """Model, situation, rank and what is hidden."""
    rows: list[list[Cell]] = []
    for name, model in (
        ("y4 corrected", corrected_model()),
        ("y4 as printed", printed_output_model()),
        ("y4 corrected, F_y22 measured as well", rear_difference_model()),
    ):
        for situation, straight in (("steering", False), ("steering held at zero", True)):
            found = rank_of(model, straight)
            hidden = found.structure
            decays = LAG if hidden.proved and hidden.basis.cols else "-"
            rows.append([name, situation, found.rank, "; ".join(hidden.describe()) or "nothing", decays])
    rows.insert(
        2, ["y4 corrected", "steering through zero at 0.1 rad/s", rank_through_straight(), "force_rl - force_rr", LAG]
    )
    at_rest = "no Taylor series: the sideslip rate divides by the speed" if singular_at_standstill() else "regular"
    rows.insert(3, ["y4 corrected", "standstill", None, at_rest, "-"])
    return Table(
        "ranks",
        "Lie-derivative rank of the eight-state model at random states (20 Lie rows, 320-bit ball arithmetic: a "
        "rank is proved from below; what is hidden is proved symbolically). 'Decays with' is the rate in 1/s at "
        "which the hidden part dies out by itself.",
        ("output equation", "situation", "rank of 8 [1]", "hidden direction", "decays with"),
        rows,
    )
