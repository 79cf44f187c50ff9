"""Tables of poles, Lyapunov readings, exact proofs and conditioning."""

from __future__ import annotations

import numpy as np

from studies.claim import Finding
from studies.papers.corner_estimation.claims_lyapunov import reading_table
from studies.papers.corner_estimation.inputs import DIRECTIONS, STATED_SPEED, corner_model, printed_gains
from studies.study import Table

SPEEDS = (0.0, 40.0, 90.0, 140.0, 180.0)  # rad/s


def pole_table() -> Table:
    """Both frozen error poles with the printed gains at five wheel speeds."""
    rows: list[list[float]] = [[omega] for omega in SPEEDS]
    for direction in DIRECTIONS:
        gain = np.array(printed_gains(direction))[:, None]
        A_e = corner_model(direction).on(np.array(SPEEDS)).error_dynamics(gain)[0]
        for row, poles in zip(rows, np.linalg.eigvals(A_e), strict=True):
            first, second = sorted(poles, key=lambda pole: (pole.real, -pole.imag))
            row.extend([float(first.real), float(second.real), float(abs(first.imag))])
    columns = ["wheel speed [rad/s]"]
    for direction in DIRECTIONS:
        columns += [
            f"{direction}, {what} [1/s]" for what in ("faster real part", "slower real part", "imaginary part +-")
        ]
    gains = " and ".join(str(list(printed_gains(direction))) for direction in DIRECTIONS)
    caption = f"Poles of the velocity observer error A - L C with the printed gains {gains} at constant wheel speed."
    return Table("poles", caption, columns, rows)


def lyapunov_table() -> Table:
    """Where each reading of (29), (41) proves stability."""
    caption = (
        f"The printed Lyapunov matrices in four readings, judged exactly on 0 to {STATED_SPEED:g} rad/s at wheel "
        "accelerations of +-800 rad/s^2: where all inequalities hold, and the largest growth rate of V on a grid "
        "of 0.5 rad/s."
    )
    columns = [
        "matrix",
        "direction",
        "reading",
        "holds on the whole range",
        "holds on [rad/s]",
        "largest growth rate [1/s]",
    ]
    return Table("lyapunov-readings", caption, columns, reading_table())


def proof_table(gains: Finding, boxes: Finding) -> Table:
    """Constant diagonal P for the printed gains and for the printed boxes."""
    rows = []
    for name, entry in (*gains.computed.items(), *((f"box of P1, {d}", e) for d, e in boxes.computed.items())):
        low, high = entry["weights_of_diag_w_1"]
        rows.append([name, float(low), float(high), entry["weight"], entry["proved_exactly"]])
    caption = (
        "Constant Lyapunov matrices diag(w, 1) that prove stability for every wheel speed from 0 to 180 rad/s and "
        "any rate: the interval of admissible weights w in closed form, and a round one that was checked in "
        "rational numbers."
    )
    columns = ["gains", "least w [1/s^2]", "greatest w [1/s^2]", "w checked [1/s^2]", "proved exactly"]
    return Table("diagonal-proofs", caption, columns, rows)


def conditioning_table(finding: Finding) -> Table:
    """Natural scale, margins with and without it, and what vertices alone prove."""
    rows = []
    for name, entry in finding.computed.items():
        (scaled,) = (value for key, value in entry.items() if key.startswith("margin_scaled"))
        loose = entry["vertices_only"]
        rows.append([name, entry["scale_of_z"], entry["natural_condition_number"], *entry["margin_unscaled"].values(),
                     scaled, loose["solver"], loose["largest_growth_1_s"], loose["at_rad_s"]])  # fmt: skip
    caption = (
        "Search for a constant P with I <= P <= kappa I (margin: largest t with A_e'P + P A_e < -t I), with z in "
        "metres and with z multiplied by g; and an affine P from the vertices alone: what the solver says, and how "
        "fast V really grows in between."
    )
    columns = ["design", "g [1/s]", "g^2 [1/s^2]", "margin, kappa 1e3", "margin, kappa 1e4", "margin with g, kappa 2",
               "solver at the vertices", "largest growth rate [1/s]", "at [rad/s]"]  # fmt: skip
    return Table("conditioning", caption, columns, rows)
