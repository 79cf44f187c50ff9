"""Fig. 2: H-infinity norms of the error dynamics over the wheel speed, and the floor that no gain can lower."""

from __future__ import annotations

import numpy as np
import sympy as sp

from analysis.norms.observer_error import error_hinf_norm
from analysis.norms.static_gain import static_gain
from estimators.arrays import FloatArray
from studies.claim import Finding, JsonValue, reproduced
from studies.papers.plain import by_speed
from studies.papers.resilient_velocity.inputs import DIRECTIONS, PACKAGE, PRINTED, SPEED_AXIS, SPEEDS, Setting
from studies.papers.topic import Topic
from studies.papers.verdicts import derived
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Shade, Words, dots
from studies.plots.colours import BLUE, GREY, RED
from studies.study import PartResult, Scope, Table
from synthesis.models.catalogue.corner import Direction

TOPIC = Topic(PACKAGE)
SHOWN = np.array([0.0, 40.0, 80.0, 140.0])
DISTURBANCES = ("friction", "acceleration_error")  # the two inputs of (8), (13)
AXES: dict[Direction, tuple[float, float]] = {"longitudinal": (0.9985, 1.0), "lateral": (0.995, 1.005)}
DRAWN: dict[Direction, float] = {"longitudinal": 5e-5, "lateral": 5e-4}
"""Half the last digit of the axis labels of Fig. 2: nothing finer can be read from the plot."""
NON_EXPANSIVE = 1e-6


def norms(setting: Setting, direction: Direction, speeds: FloatArray, *disturbances: str) -> FloatArray:
    """The H-infinity norm from the named disturbances (both if none is named) to both errors at each speed (g,)."""
    chosen = disturbances or DISTURBANCES
    return error_hinf_norm(setting.models[direction], setting.gains[direction], speeds, chosen).norm


def floor(setting: Setting, direction: Direction, speeds: FloatArray) -> FloatArray:
    """sigma_0/(sigma_0 + sigma_2 kappa R_e |omega|) (g,): what every stable gain lets through from friction to slip velocity."""
    tire = setting.parameters.tire[direction]
    rate = setting.rolling_rate(direction, speeds)
    return np.asarray(tire.sigma0.value / (tire.sigma0.value + tire.sigma2.value * rate))


def norm_crosses_one(setting: Setting, direction: Direction) -> list[float]:
    """Wheel speeds inside 0..140 rad/s at which a singular value of the static gain S = -A_e^-1 B_e is exactly 1.

    With Table I as exact decimals (0.0016 is 1/625) they are the roots of det(I - S'S), isolated exactly; the numbers
    are rounded at the end only.
    """
    model, speed = setting.models[direction], sp.Symbol("wheel_speed", real=True)
    numbers = {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in model.constants.items()}
    A, C, E, F = (sp.Matrix(getattr(model, key)).subs(numbers) for key in "ACEF")
    L = sp.Matrix([sp.Rational(str(g)) for g in setting.gains[direction]])
    columns = [[s.name for s in model.disturbances].index(name) for name in DISTURBANCES]
    A_e, B_e = A - L * C, (E - L * F)[:, columns]
    S = (-A_e.LUsolve(B_e)).applyfunc(sp.cancel).subs(sp.Symbol("wheel_speed"), speed)
    condition = sp.together((sp.eye(2) - S.T * S).det())
    roots = sp.real_roots(sp.Poly(sp.numer(sp.cancel(condition)), speed))
    return sorted({float(root) for root in roots if 0 < root < SPEEDS[-1]})


def within_axes(setting: Setting, direction: Direction) -> tuple[bool, FloatArray]:
    """Whether the norm lies on the axis of the figure, and the norm over `SPEEDS`."""
    found = norms(setting, direction, SPEEDS)
    low, high = AXES[direction]
    return bool(found.min() >= low - DRAWN[direction] and found.max() <= high + DRAWN[direction]), found


@TOPIC.claim("P3-fig2-x")
def longitudinal(setting: Setting = PRINTED) -> Finding:
    """On the axis of the figure."""
    inside, found = within_axes(setting, "longitudinal")
    return Finding(
        by_speed(SHOWN, norms(setting, "longitudinal", SHOWN)),
        reproduced(inside),
        f"Continuous error dynamics (8), both disturbances to both errors, peak at zero frequency: {found.min():.5f} to "
        f"{found.max():.7f} over 0..140 rad/s, on the axis of the figure to the accuracy of its labels.",
    )


@TOPIC.claim("P3-fig2-y")
def lateral(setting: Setting = PRINTED) -> Finding:
    """On the axis of the figure, with both disturbances and with friction alone."""
    inside, found = within_axes(setting, "lateral")
    friction = norms(setting, "lateral", SPEEDS, "friction")
    return Finding(
        {
            "both_disturbances": by_speed(SHOWN, norms(setting, "lateral", SHOWN)),
            "friction_only": by_speed(SHOWN, norms(setting, "lateral", SHOWN, "friction")),
        },
        reproduced(inside),
        f"Error dynamics (13), both disturbances to both errors: {found.max():.5f} at standstill down to "
        f"{found.min():.5f} at 140 rad/s, inside the axis of the figure; friction alone would give "
        f"{friction.min():.4f} to {friction.max():.4f}, which fits it too.",
    )


@TOPIC.claim("P3-fig2-nonexp")
def non_expansive(setting: Setting = PRINTED) -> Finding:
    """Where the norm exceeds 1."""
    computed: dict[str, dict[str, JsonValue]] = {}
    where = []
    for d in DIRECTIONS:
        both, alone = norms(setting, d, SPEEDS), float(norms(setting, d, SPEEDS, "friction").max())
        crossings, largest = norm_crosses_one(setting, d), float(both.max())
        computed[d] = {
            "at_0_rad_per_s": float(both[0]), "largest": largest, "crosses_1_at_rad_per_s": crossings,
            "largest_friction_only": alone,
        }  # fmt: skip
        if largest > 1.0 + NON_EXPANSIVE:
            below = ", ".join(f"{r:.4g}" for r in crossings)
            where.append(f"{d} by {largest - 1.0:.2g} at most, below {below} rad/s")
    friction = all(entry["largest_friction_only"] <= 1.0 + NON_EXPANSIVE for entry in computed.values())
    reading = (
        (f"With both disturbances the norm exceeds 1 ({'; '.join(where)}). " if where else "The norm stays at 1 or below. ")
        + ("For the friction disturbance alone the statement holds." if friction else "It fails for friction alone as well.")
    )  # fmt: skip
    return Finding(computed, reproduced(not where), reading)


@TOPIC.claim("P3-hinf-floor")
def any_gain(setting: Setting = PRINTED) -> Finding:
    """The static gain from friction to slip velocity with a symbolic gain, and the printed gains above it."""
    computed: dict[str, JsonValue] = {"formula": "sigma0 / (sigma0 + sigma2 kappa Re |omega|)"}
    holds = True
    for direction in DIRECTIONS:
        model, shown = setting.models[direction], floor(setting, direction, SHOWN)
        symbolic = static_gain(model, "friction", "relative_velocity")
        constants = {name: c.value for name, c in model.constants.items()}
        evaluated = np.array([float(symbolic.expression.subs({**constants, "wheel_speed": w})) for w in SHOWN])
        attained = error_hinf_norm(model, setting.gains[direction], SPEEDS, ("friction",), ("relative_velocity",)).norm
        excess = attained - floor(setting, direction, SPEEDS)
        holds &= symbolic.free_of_gain
        holds &= bool(np.abs(np.abs(evaluated) - shown).max() <= 1e-12) and bool((excess >= -1e-12).all())
        computed[direction] = by_speed(SHOWN, shown)
        computed[f"{direction}_printed_gain_excess"] = float(excess.max())
    return Finding(
        computed,
        derived(holds),
        "At zero frequency friction and slip velocity look alike to the force: the gain from one to the other is "
        "-sigma0/(sigma0 + sigma2 kappa R_e |omega|) for every L with L_2 != 0. No tuning lowers the norm below "
        "it, it is 1 at standstill, and the printed gains sit on it.",
    )


@TOPIC.part("norms", "H∞ norms over the wheel speed (Fig. 2)", 1.2)
def fig_2(_: Scope) -> PartResult:
    """Fig. 2 and its floor, drawn and in numbers."""
    speeds, columns, names = SPEEDS[::20], [SPEEDS[::20]], []
    for d in DIRECTIONS:
        columns += [norms(PRINTED, d, speeds), norms(PRINTED, d, speeds, "friction"), floor(PRINTED, d, speeds)]
        names += [f"{d}, {what} [1]" for what in ("both disturbances", "friction only", "floor of any gain")]
    table = Table(
        "norms",
        "H-infinity norm of the error dynamics with the printed gains: from both disturbances of (8), (13) to both "
        "errors, from friction alone, and the floor that no gain can lower.",
        ("wheel speed [rad/s]", *names),
        np.stack(columns, axis=1).tolist(),
    )
    return PartResult(TOPIC.found(), [table], [norm_figure()])


def norm_figure(setting: Setting = PRINTED) -> Figure:
    """One panel for each direction, on the axis range of the paper."""
    panels, top = [], {}
    sparse = SPEEDS[::20]
    for d in DIRECTIONS:
        low, high = AXES[d]
        both, room = norms(setting, d, SPEEDS), 0.1 * (high - low)
        top[d] = float(both.max())
        marks: list[Mark] = [
            Shade(low, high, "y", "axis of the paper", "0.9", 1.0),
            Level(y=1.0, color=GREY),
            Line(SPEEDS, both, "friction and acceleration error", BLUE, width=1.9),
            Line(SPEEDS, norms(setting, d, SPEEDS, "friction"), "friction alone", RED, "dashed"),
            dots(sparse, floor(setting, d, sparse), "floor of any gain", "0.1", "x"),
        ]
        for speed in norm_crosses_one(setting, d):
            offset = (12.0 if speed < 70 else -4.0, 11.0)
            marks += [
                dots(speed, 1.0, color=BLUE, size=6, hollow=True),
                Words(speed, 1.0, f"1 at {speed:.1f} rad/s", BLUE, offset=offset),
            ]
        y = Axis("H∞ norm to both errors [1]", low - room, high + room, ticks=np.linspace(low, high, 6).tolist())
        panels.append(Panel(marks, SPEED_AXIS, y, d))
    return Figure(
        "fig-2-norms",
        "Fig. 2 regenerated: H∞ norm of the error dynamics with the printed gains over the wheel speed. Both curves lie on "
        "the axis of the paper. Crosses: the static gain σ₀/(σ₀ + σ₂κRₑ|ω|) that no observer gain can lower. With both "
        f"disturbances the norm starts above 1 ({top['longitudinal']:.6f} and {top['lateral']:.4f} at standstill) and falls "
        "below it at the circles; with friction alone it never exceeds 1.",
        "Two panels of nearly straight, falling lines of the norm over wheel speed; the lateral one with both "
        "disturbances starts at 1.0026 and crosses 1 near 80 rad/s.",
        panels,
        size=(9.2, 3.9),
        legend="below",
    )
