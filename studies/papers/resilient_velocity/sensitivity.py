"""Figs 3 to 5: stability margin and H-infinity norm with a tire constant off by 20 %; (9), Remark 2: the observability rank."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from analysis.labelled import Axis as LabelledAxis
from analysis.norms.hinf import hinf_norm, stability_margin
from analysis.observability.matrix import observability_matrix
from analysis.observability.modes import frozen_modes, hautus_test
from analysis.observability.rank_loss import rank_loss
from analysis.perturbed import PerturbedModel, error_measure
from analysis.sensitivity import OneAtATime, one_at_a_time
from estimators.arrays import FloatArray
from studies.claim import Finding, JsonValue, reproduced
from studies.papers.resilient_velocity.inputs import DIRECTIONS, FINE, PACKAGE, PRINTED, SPEED_AXIS, SPEEDS, Setting
from studies.papers.topic import Topic
from studies.papers.verdicts import partly
from studies.plots import DASHES, Axis, Figure, Level, Line, Mark, Panel
from studies.plots.colours import BLUE, GREEN, GREY, ORANGE, RED
from studies.study import Cell, Table
from synthesis.models.catalogue.corner import Direction

TOPIC = Topic(PACKAGE)
CONSTANTS = ("sigma0", "sigma1", "sigma2", "kappa")
FACTORS, CHANGE = (0.8, 1.2), 0.2
SPEED = 40.0  # rad/s, of single values
SEARCH = (0, 400)  # rad/s: rank loss is looked for beyond the range as well
LOOK = {"sigma0": ("σ₀", BLUE), "sigma1": ("σ₁", RED), "sigma2": ("σ₂", GREEN), "kappa": ("κ", ORANGE)}
MEASURES: Mapping[str, tuple[str, Callable[[FloatArray, FloatArray], FloatArray]]] = {
    "stability margin": ("1/s", lambda A_e, _: stability_margin(A_e)),
    "H-infinity norm": ("1", lambda A_e, B_e: hinf_norm(A_e, B_e[..., :2], np.eye(2)).norm),
}
"""Unit, and function of A_e and B_e: max Re lambda(A_e); from both disturbances to both errors."""


def deviations(setting: Setting, direction: Direction, speeds: FloatArray, name: str) -> OneAtATime:
    """One of `MEASURES`, and what moves it: axes (parameter, factor, wheel_speed)."""
    (unit, measure), family = MEASURES[name], PerturbedModel(setting.models[direction])
    function = error_measure(family, setting.gains[direction], measure, wheel_speed=speeds)
    nominal, axis = {key: family.nominal[key] for key in CONSTANTS}, LabelledAxis("wheel_speed", speeds, "rad/s")
    return one_at_a_time(function, nominal, FACTORS, axes=(axis,), name=name, unit=unit)


def at_40(found: OneAtATime, constant: str) -> list[float]:
    """The deviations by factor at 40 rad/s."""
    return [found.deviations.at(parameter=constant, factor=f, wheel_speed=SPEED).item() for f in FACTORS]


@TOPIC.claim("P3-fig345")
def small_deviations(setting: Setting = PRINTED) -> Finding:
    """`small` is read as: no larger in proportion than the 20 % that caused it, and stable throughout."""
    computed, worst, stable, lost = dict[str, JsonValue](), dict[str, float](), True, 0.0
    for direction in DIRECTIONS:
        margin, norm = (deviations(setting, direction, SPEEDS, name) for name in MEASURES)
        stable &= bool((margin.values.values < 0.0).all())
        lost = float((margin.deviations.values / np.abs(margin.nominal.values)).max())  # of the last, the lateral one
        computed[direction] = {
            "margin_per_s": margin.nominal.at(wheel_speed=SPEED).item(),
            "margin_deviation_at_40_per_s": {name: at_40(margin, name) for name in CONSTANTS},
            "least_stable_margin_per_s": float(margin.values.values.max()),
            "largest_relative_margin_loss": lost,
        }
        for kind, found in (("margin", margin), ("norm", norm)):
            relative = (np.abs(found.deviations.values) / np.abs(found.nominal.values)).max(axis=(1, 2))
            sizes = dict(zip(CONSTANTS, relative.tolist(), strict=True))
            computed[direction][f"largest_relative_{kind}_deviation"] = sizes
            worst |= {f"{direction} {kind}, {constant}": size for constant, size in sizes.items()}
    large = {name: value for name, value in worst.items() if value > CHANGE}
    rest = max(value for name, value in worst.items() if not name.endswith("sigma1"))
    return Finding(computed, partly(stable and not large, stable), (
        f"No number is printed; small is read as at most the {CHANGE:.0%} that caused it. "
        + ("Every perturbed observer stays stable" if stable else "A perturbed observer is unstable")
        + f", and sigma_0, sigma_2 and kappa move margin and norm by {rest:.1%} at most; but "
        + (", ".join(f"{name}: {value:.0%}" for name, value in large.items()) or "nothing moves by more")
        + f" of the nominal value. Most of it is gained; the most that is lost is {lost:.0%} of the lateral margin. "
        "Only sigma_1 matters."))  # fmt: skip


def _table() -> Table:
    rows: list[list[Cell]] = []
    for d in DIRECTIONS:
        found = [deviations(PRINTED, d, np.array([SPEED]), name) for name in MEASURES]
        rows += [[f"{d}, {constant}", *(v for one in found for v in at_40(one, constant))] for constant in CONSTANTS]
    return Table("deviations",
        "What a tire constant that is 20 % too low or too high does to the stability margin (largest real part of the "
        "eigenvalues; positive deviations are towards instability) and to the H-infinity norm, at "
        f"{SPEED:g} rad/s with the printed gains.",
        ("constant", "margin, -20 % [1/s]", "margin, +20 % [1/s]", "norm, -20 % [1]", "norm, +20 % [1]"), rows)  # fmt: skip


WORDS = {
    "stability margin": (
        "figs-3-4-margin-deviation",
        "Figs 3 and 4 regenerated: how far the stability margin, the largest real part of the eigenvalues of the "
        "error dynamics (about -327 1/s longitudinally, -13.8 1/s laterally), moves when one tire constant is 20 % "
        "lower (dashed) or higher (solid) than in the design. Positive is towards instability. Only σ₁ matters; "
        "the kink of the lateral curve is where two real eigenvalues meet and become a pair. Mind the scales.",
        "Four panels; sigma 1 moves the margin by up to 73 per second longitudinally and 33 laterally, the other "
        "constants by less than 0.7.",
    ),
    "H-infinity norm": (
        "fig-5-norm-deviation",
        "Fig. 5 regenerated: how far the H∞ norm from both disturbances to both errors (near 1) moves when one "
        "tire constant is 20 % lower (dashed) or higher (solid) than in the design. All deviations stay below "
        "0.006, with one exception that a static analysis misses: with σ₁ 20 % higher the lateral error dynamics "
        "resonate above 126 rad/s and the norm rises by up to 0.048. Curves of σ₂ and κ coincide. Mind the scales.",
        "Four panels of small, nearly straight deviations; in the lateral panel of sigma 1 the curve for plus 20 "
        "per cent turns up steeply above 126 rad/s.",
    )}  # fmt: skip
"""Of the figures: name, caption, alternative."""


def deviation_figure(measure: str) -> Figure:
    """Rows: direction; columns: sigma_1, which outweighs the rest, and the other constants on a scale of their own."""
    rows = []
    for direction in DIRECTIONS:
        found = deviations(PRINTED, direction, FINE, measure)
        row, x = [], Axis(SPEED_AXIS.label if direction == DIRECTIONS[-1] else "", SPEED_AXIS.low, SPEED_AXIS.high)
        for title, constants in (("σ₁", ("sigma1",)), ("the other constants", ("sigma0", "sigma2", "kappa"))):
            marks: list[Mark] = [Level(y=0.0, color=GREY)]
            for constant in constants:
                symbol, colour = LOOK[constant]
                for factor, dash in zip(FACTORS, (DASHES[1], DASHES[0]), strict=True):
                    curve = found.deviations.at(parameter=constant, factor=factor).values
                    marks.append(Line(FINE, curve, f"{symbol} {factor - 1:+.0%}", colour, dash, 1.7))
            row.append(Panel(marks, x, f"deviation [{MEASURES[measure][0]}]", f"{direction}, {title}"))
        rows.append(row)
    return Figure(*WORDS[measure], rows, size=(9.2, 5.8), legend="below", share_x="all")


@TOPIC.claim("P3-obs")
def rank_of_observability(setting: Setting = PRINTED) -> Finding:
    """The exact set on which the time-varying observability matrix (9) loses rank."""
    computed, lost_inside, detectable = dict[str, JsonValue](), list[str](), True
    for direction in DIRECTIONS:
        model = setting.models[direction]
        loss = rank_loss(observability_matrix(model))
        roots = [r for r in loss.roots("wheel_speed") if r > 0]
        intervals = loss.interval_over_rates("wheel_speed", search=SEARCH)
        lost_inside += [f"{direction} {float(r):.2f} rad/s" for r in loss.roots_inside("wheel_speed")]
        numeric = model.on(np.union1d(SPEEDS, [float(r) for r in roots if r <= SPEEDS[-1]]))
        detectable &= bool(hautus_test(numeric.A, numeric.C).frozen_detectable.all())
        computed[direction] = {
            "determinant": str(loss.condition),
            "root_at_constant_speed_rad_per_s": [float(r) for r in roots],
            "root_exact": [str(r) for r in roots],
            "over_wheel_accelerations_of_800_rad_per_s2": [[float(a), float(b)] for a, b in intervals],
            "hidden_mode": [str(m.eigenvalue) for m in frozen_modes(model.A, model.C) if m.eigenvalue != 0],
        }
    where = ", ".join(lost_inside)
    return Finding(computed, reproduced(not lost_inside), (
        (f"Rank 2 is lost inside 0..140 rad/s: {where} at constant speed. " if where else "Rank 2 everywhere. ")
        + "det O_2 = (sigma_0 - sigma_1 a)(sigma_0 + sigma_2 a) + sigma_1 (sigma_1 + sigma_2) da/dt with a = kappa "
        "R_e omega vanishes on a curve in wheel speed and acceleration. "
        + ("What is lost is the bristle deflection, which decays, so the pair stays detectable." if detectable else
           "The pair is not detectable.")))  # fmt: skip


TOPIC.show(
    "sensitivity", "Tire constants off by 20 % (Figs 3 to 5)", 0.5, ("P3-fig345",),
    [_table], [partial(deviation_figure, measure) for measure in MEASURES])  # fmt: skip
TOPIC.show("observability", "The observability rank", 1.1, ("P3-obs",))
