"""Break rates, what happens at 200 Hz, and the simulated confirmation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from studies.beyond.implementability.break_rates import BreakCurve, unstable_wheel_speeds
from studies.beyond.implementability.designs import Design
from studies.beyond.implementability.simulate import RUNTIME, growth
from studies.beyond.implementability.updates import BREAKABLE, LASTING, UPDATES, spectral_radius
from studies.study import Cell, Table

RATES = (50.0, 100.0, 200.0, 500.0, 1000.0)  # Hz
STEP_AWAY = 0.03  # of the break rate, to either side


def rate_table(designs: Sequence[Design], curves: Mapping[tuple[str, str], BreakCurve]) -> Table:
    """Worst break rate of each design and scheme, and the wheel speed at which it breaks."""
    rows: list[list[Cell]] = []
    for design in designs:
        row: list[Cell] = [design.name]
        for scheme in BREAKABLE:
            curve = curves[design.name, scheme]
            row += [round(curve.worst_rate, 2), round(curve.worst_wheel_speed, 2)]
        rows.append(row)
    columns = [
        "design",
        *(text for scheme in BREAKABLE for text in (f"{scheme}: needs [Hz]", f"{scheme}: worst at [rad/s]")),
    ]
    return Table(
        "break-rates",
        "Sample rate that each discretisation needs to be stable at every constant wheel speed from 0 to 140 "
        f"rad/s, and the wheel speed at which it breaks first, by root finding. {', '.join(LASTING)} are stable at "
        "every rate, as the continuous observers are.",
        columns,
        rows,
    )


def radius_table(name: str, designs: Sequence[Design]) -> Table:
    """Largest spectral radius over the wheel speeds, and the unstable wheel speeds at 200 Hz."""
    rows: list[list[Cell]] = []
    for design in designs:
        A, L, C = design.matrices(design.grid())
        for scheme, update in UPDATES.items():
            largest = [float(spectral_radius(update(A, L, C, np.full(len(A), 1.0 / rate))).max()) for rate in RATES]
            unstable = unstable_wheel_speeds(design, scheme, 0.005)
            text = "; ".join(f"{low:.2f} to {high:.2f}" for low, high in unstable) or "none"
            rows.append([design.name, scheme, *(round(value, 4) for value in largest), text])
    return Table(
        name,
        "Largest spectral radius over the wheel speeds 0 to 140 rad/s at five sample rates (above 1 the error "
        "grows by this factor in every sample), and the wheel speeds that are unstable at the 200 Hz of the "
        "papers.",
        ("design", "discretisation", *(f"radius at {rate:g} Hz [1]" for rate in RATES), "unstable at 200 Hz [rad/s]"),
        rows,
    )


def confirmation_table(
    designs: Sequence[Design], curves: Mapping[tuple[str, str], BreakCurve], samples: int = 400
) -> Table:
    """Simulated growth on both sides of every break, and of the runtime at the lower rate."""
    rows: list[list[Cell]] = []
    for design in designs:
        for scheme in BREAKABLE:
            curve = curves[design.name, scheme]
            low, high = curve.worst_rate * (1.0 - STEP_AWAY), curve.worst_rate * (1.0 + STEP_AWAY)
            found = [growth(design, scheme, rate, curve.worst_wheel_speed, samples) for rate in (low, high)]
            exact = growth(design, RUNTIME, low, curve.worst_wheel_speed, 60)
            confirmed = found[0] > 1.0 > found[1] and exact < 1.0
            rows.append(
                [
                    design.name,
                    scheme,
                    round(curve.worst_rate, 2),
                    *(round(value, 4) for value in (*found, exact)),
                    confirmed,
                ]
            )
    return Table(
        "confirmation",
        f"Observers run sample by sample at the worst wheel speed, {100 * STEP_AWAY:g} % below and above the "
        "computed break rate: factor by which the error changes in every sample. The last factor is that of the "
        "runtime's exact update at the lower rate.",
        (
            "design",
            "discretisation",
            "break rate [Hz]",
            "growth below [1]",
            "growth above [1]",
            "runtime below [1]",
            "confirmed",
        ),
        rows,
    )
