"""Numbers behind Figs 2 to 8, for those who want to compare."""

from __future__ import annotations

import numpy as np

from studies.papers.resilient_velocity.claims_markov import SPEEDS as CHAIN_SPEEDS
from studies.papers.resilient_velocity.claims_markov import STAYS, margins
from studies.papers.resilient_velocity.claims_norms import floor, norms
from studies.papers.resilient_velocity.claims_sampling import READINGS, radii
from studies.papers.resilient_velocity.deviations import CONSTANTS, FACTORS, margin_deviations, norm_deviations
from studies.papers.resilient_velocity.drops import critical, radius
from studies.papers.resilient_velocity.setting import DIRECTIONS, HIGHEST_SPEED, PRINTED, Setting
from studies.study import Cell, Table

SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 8)
SLOW = np.array([0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 28.0, 40.0, 80.0, 140.0])
SAMPLE_RATES = np.array([100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0])  # Hz


def norm_table(setting: Setting = PRINTED) -> Table:
    """Fig. 2."""
    columns = [SPEEDS]
    for direction in DIRECTIONS:
        columns += [
            norms(setting, direction, SPEEDS),
            norms(setting, direction, SPEEDS, "friction"),
            floor(setting, direction, SPEEDS),
        ]
    names = [
        f"{d}, {what} [1]" for d in DIRECTIONS for what in ("both disturbances", "friction only", "floor of any gain")
    ]
    return Table(
        "norms",
        "H-infinity norm of the error dynamics with the printed gains: from both disturbances of (8), (13) to both "
        "errors, from friction alone, and the floor that no gain can lower.",
        ("wheel speed [rad/s]", *names),
        np.stack(columns, axis=1).tolist(),
    )


def deviation_table(setting: Setting = PRINTED, speed: float = 40.0) -> Table:
    """Figs 3 to 5 at one wheel speed."""
    rows: list[tuple[Cell, ...]] = []
    at = np.array([speed])
    for direction in DIRECTIONS:
        margin, norm = margin_deviations(setting, direction, at), norm_deviations(setting, direction, at)
        for name in CONSTANTS:
            values = [
                m.deviations.at(parameter=name, factor=f, wheel_speed=speed).item()
                for m in (margin, norm)
                for f in FACTORS
            ]
            rows.append((f"{direction}, {name}", *values))
    return Table(
        "deviations",
        "What a tire constant that is 20 % too low or too high does to the stability margin (largest real part of "
        f"the eigenvalues; positive deviations are towards instability) and to the H-infinity norm, at {speed:g} "
        "rad/s with the printed gains.",
        ("constant", "margin, -20 % [1/s]", "margin, +20 % [1/s]", "norm, -20 % [1]", "norm, +20 % [1]"),
        rows,
    )


def chain_table(setting: Setting = PRINTED) -> Table:
    """Fig. 6."""
    found = margins(setting, STAYS, CHAIN_SPEEDS)
    return Table(
        "markov-margins",
        "Margin 1 - rho of mean-square stability with the transition matrix (23): rows by the probability of "
        "staying in high slip, columns by wheel speed.",
        ("probability of staying [1]", *(f"{w:g} rad/s" for w in CHAIN_SPEEDS)),
        [(float(s), *map(float, row)) for s, row in zip(STAYS, found, strict=True)],
    )


def drop_table(setting: Setting = PRINTED) -> Table:
    """Figs 7 and 8."""
    columns = [SLOW]
    for direction in DIRECTIONS:
        columns += [critical(setting, direction, SLOW), radius(setting, direction, SLOW, setting.example_drop)]
    names = [
        f"{d}, {what} [1]"
        for d in DIRECTIONS
        for what in ("critical drop probability", f"radius at p = {setting.example_drop:g}")
    ]
    return Table(
        "drops",
        "Critical drop probability of the force measurement and second-moment radius at the drop probability of "
        "Example 3, exact update at 200 Hz, printed gains.",
        ("wheel speed [rad/s]", *names),
        np.stack(columns, axis=1).tolist(),
    )


def sampling_table(setting: Setting = PRINTED) -> Table:
    """The readings of (10) over the sample rate."""
    rows = []
    for rate in SAMPLE_RATES:
        worst = [
            float(
                radii(
                    setting.models[d], setting.gains[d], 1.0 / rate, update, np.linspace(0.0, HIGHEST_SPEED, 71)
                ).max()
            )
            for d in DIRECTIONS
            for update in READINGS.values()
        ]
        rows.append((float(rate), *worst))
    names = [f"{d}, {name.replace('_', ' ')} [1]" for d in DIRECTIONS for name in READINGS]
    return Table(
        "sampling",
        "Largest spectral radius of the error update over 0 to 140 rad/s with the printed gains, for four readings "
        "of the discretisation; above 1 the observer diverges.",
        ("sample rate [Hz]", *names),
        rows,
    )
