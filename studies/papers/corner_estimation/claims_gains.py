"""P1-hinf-figs: which problems have the plotted gains as their answer."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from studies.claim import ClaimFunction, Finding, JsonValue
from studies.papers.corner_estimation.hinf import POINTS, STATES, least_gamma, literal_design
from studies.papers.corner_estimation.inputs import DESIGN_SPEED, DIRECTIONS, corner_model, printed_gains, printed_value
from studies.papers.corner_estimation.kalman import fitted, schedule
from studies.papers.verdicts import under_specified
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray
from synthesis.well_posedness import well_posedness

LETTER = {"longitudinal": "x", "lateral": "y"}
OUTPUTS = {"C_e = I": STATES, "C_e = [0 1]": STATES[1:], "C_e = [1 0]": STATES[:1]}
TREND_POINTS = 40  # grid of the energy trend: it asks how fast, not how much
FIT_SPEED = DESIGN_SPEED / 2  # rad/s: where the Kalman gains are made to equal the printed ones


def axes_of_the_figures(direction: Direction) -> tuple[tuple[float, float], tuple[float, float]]:
    """What the axes of Figs 3, 4 span: L1 in m/s and L2 in m/s^2."""
    ranges = printed_value("P1-hinf-figs")
    first, second = (ranges[f"L{i}{LETTER[direction]}"] for i in (1, 2))
    return (first[0], first[1]), (second[0], second[1])


def inside(gains: FloatArray, direction: Direction) -> list[bool]:
    """Whether L1 and L2 of (g, 2) stay on the axes of the figure."""
    return [
        bool((low <= column.min()) and (column.max() <= high))
        for (low, high), column in zip(axes_of_the_figures(direction), gains.T, strict=True)
    ]


def plotted_gains(degree: int = 1, outputs: Mapping[str, tuple[str, ...]] = OUTPUTS) -> Finding:
    """Gains of the readings of C_e, how they grow towards the optimum, and a Kalman filter through the printed gains."""
    computed: dict[str, JsonValue] = {}
    spread, printed_problem, open_gains = 0.0, [], []
    omega = np.linspace(0.0, DESIGN_SPEED, 71)
    for direction in DIRECTIONS:
        readings = {
            name: least_gamma(direction, degree, "corrected", errors, POINTS).gains for name, errors in outputs.items()
        }
        second = [float(np.abs(gains[:, 1]).max()) for gains in readings.values()]
        spread = max(spread, max(second) / min(second) - 1.0)
        printed_problem.append(all(inside(readings["C_e = I"], direction)))
        noise = fitted(direction, printed_gains(direction), FIT_SPEED)
        readings["Kalman filter"] = schedule(direction, noise, omega)
        posed = well_posedness(corner_model(direction, DESIGN_SPEED), literal_design(degree, points=TREND_POINTS))
        open_gains.append(posed.ill_posed)
        computed[direction] = {
            "intensities_of_friction_and_acceleration": [noise.friction, noise.acceleration],
            "least_gain_energy_by_backoff": dict(zip(map(str, posed.backoffs), posed.energy, strict=True)),
            "gains_unbounded_towards_optimum": posed.ill_posed,
            **{
                name: {"L1": _ends(gains[:, 0]), "L2": _ends(gains[:, 1]), "on_the_axes": inside(gains, direction)}
                for name, gains in readings.items()
            },
        }
    x, y = (computed[direction]["Kalman filter"] for direction in DIRECTIONS)
    reading = (
        f"C_e is not printed: the L2 that minimising gamma returns for {', '.join(outputs)} differ by a factor of "
        f"up to {1.0 + spread:.2g}; for C_e = I the least gain energy grows without bound towards the optimum in "
        f"{sum(open_gains)} of {len(open_gains)} directions. A penalty on force noise, which the paper does not "
        f"state, determines the gains: a steady Kalman filter through the printed gains at {FIT_SPEED:g} rad/s has "
        f"L1x {x['L1'][0]:.3f} to {x['L1'][1]:.3f}, L2x {x['L2'][0]:.4g}, L1y {y['L1'][0]:.3f} to {y['L1'][1]:.3f}, "
        f"L2y {y['L2'][0]:.3g}, all on the axes. The figures' titles name L/(1 + L1 sigma1), the form for an output "
        "with the observer's own derivative."
    )
    return Finding(computed, under_specified(spread, 0.01, all(printed_problem)), reading)


def _ends(values: FloatArray) -> list[float]:
    """At standstill and at the end of the range."""
    return [float(values[0]), float(values[-1])]


CLAIMS: dict[str, ClaimFunction] = {"P1-hinf-figs": plotted_gains}
