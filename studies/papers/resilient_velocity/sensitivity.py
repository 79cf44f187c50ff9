"""Figs 3 to 5: how stability margin and H-infinity norm move when one tire constant is off by 20 %."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from analysis.labelled import Axis as LabelledAxis
from analysis.norms import hinf_norm, stability_margin
from analysis.perturbed import PerturbedModel, error_measure
from analysis.sensitivity import OneAtATime, one_at_a_time
from studies.claim import Finding, JsonValue, Verdict, judged
from studies.papers.resilient_velocity.inputs import DIRECTIONS, FINE, PACKAGE, PRINTED, SPEED_AXIS, SPEEDS, Setting
from studies.papers.topic import Topic
from studies.plots import DASHES, Figure, Level, Line, Mark, Panel
from studies.plots.colours import BLUE, GREEN, GREY, ORANGE, RED
from studies.study import Cell, PartResult, Scope, Table
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray

TOPIC = Topic(PACKAGE)
CONSTANTS = ("sigma0", "sigma1", "sigma2", "kappa")
FACTORS = (0.8, 1.2)
CHANGE = 0.2
LOOK = {"sigma0": ("σ₀", BLUE), "sigma1": ("σ₁", RED), "sigma2": ("σ₂", GREEN), "kappa": ("κ", ORANGE)}
MEASURES: Mapping[str, tuple[str, Callable[[FloatArray, FloatArray], FloatArray]]] = {
    "stability margin": ("1/s", lambda A_e, _: stability_margin(A_e)),
    "H-infinity norm": ("1", lambda A_e, B_e: hinf_norm(A_e, B_e[..., :2], np.eye(2)).norm),
}
"""Unit, and function of A_e and B_e: max Re lambda(A_e); from both disturbances to both errors."""

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
    ),
}
"""Of the figures: name, caption, alternative."""


def deviations(setting: Setting, direction: Direction, speeds: FloatArray, name: str) -> OneAtATime:
    """One of `MEASURES`, and what moves it: axes (parameter, factor, wheel_speed)."""
    unit, measure = MEASURES[name]
    family = PerturbedModel(setting.models[direction])
    return one_at_a_time(
        error_measure(family, setting.gains[direction], measure, wheel_speed=speeds),
        {key: family.nominal[key] for key in CONSTANTS},
        FACTORS,
        axes=(LabelledAxis("wheel_speed", speeds, "rad/s"),),
        name=name,
        unit=unit,
    )


def largest_relative(found: OneAtATime) -> dict[str, float]:
    """By constant: the largest |deviation| / |nominal value|."""
    relative = np.abs(found.deviations.values) / np.abs(found.nominal.values)
    return dict(zip(CONSTANTS, relative.max(axis=(1, 2)).tolist(), strict=True))


@TOPIC.claim("P3-fig345")
def small_deviations(setting: Setting = PRINTED) -> Finding:
    """`small` is read as: no larger in proportion than the 20 % that caused it, and stable throughout."""
    computed: dict[str, JsonValue] = {}
    worst: dict[str, float] = {}
    stable, lost = True, 0.0
    for direction in DIRECTIONS:
        margin, norm = (deviations(setting, direction, SPEEDS, name) for name in MEASURES)
        stable &= bool((margin.values.values < 0.0).all())
        lost = float((margin.deviations.values / np.abs(margin.nominal.values)).max())  # of the last, the lateral one
        large_margin, large_norm = largest_relative(margin), largest_relative(norm)
        computed[direction] = {
            "margin_per_s": margin.nominal.at(wheel_speed=40.0).item(),
            "margin_deviation_at_40_per_s": {
                name: [margin.deviations.at(parameter=name, factor=f, wheel_speed=40.0).item() for f in FACTORS]
                for name in CONSTANTS
            },
            "largest_relative_margin_deviation": large_margin,
            "largest_relative_norm_deviation": large_norm,
            "least_stable_margin_per_s": float(margin.values.values.max()),
            "largest_relative_margin_loss": lost,
        }
        for kind, sizes in (("margin", large_margin), ("norm", large_norm)):
            worst |= {f"{direction} {kind}, {constant}": size for constant, size in sizes.items()}
    large = {name: value for name, value in worst.items() if value > CHANGE}
    rest = max(value for name, value in worst.items() if not name.endswith("sigma1"))
    verdict = judged(stable and not large, Verdict.PARTLY if stable else Verdict.NOT_REPRODUCED)
    return Finding(
        computed,
        verdict,
        f"No number is printed; small is read as at most the {CHANGE:.0%} that caused it. "
        + ("Every perturbed observer stays stable" if stable else "A perturbed observer is unstable")
        + f", and sigma_0, sigma_2 and kappa move margin and norm by {rest:.1%} at most; but "
        + (", ".join(f"{name}: {value:.0%}" for name, value in large.items()) or "nothing moves by more")
        + f" of the nominal value. Most of it is gained; the most that is lost is {lost:.0%} of the lateral margin. "
        "Only sigma_1 matters.",
    )


@TOPIC.part("sensitivity", "Tire constants off by 20 % (Figs 3 to 5)", 0.5)
def figs_3_to_5(_: Scope) -> PartResult:
    """The claim, the deviations at one speed, and the curves."""
    return PartResult(TOPIC.found(), [deviation_table()], [deviation_figure(measure) for measure in MEASURES])


def deviation_table(setting: Setting = PRINTED, speed: float = 40.0) -> Table:
    """Figs 3 to 5 at one wheel speed."""
    rows: list[tuple[Cell, ...]] = []
    for direction in DIRECTIONS:
        found = [deviations(setting, direction, np.array([speed]), name).deviations for name in MEASURES]
        for constant in CONSTANTS:
            values = [d.at(parameter=constant, factor=f, wheel_speed=speed).item() for d in found for f in FACTORS]
            rows.append((f"{direction}, {constant}", *values))
    return Table(
        "deviations",
        "What a tire constant that is 20 % too low or too high does to the stability margin (largest real part of "
        f"the eigenvalues; positive deviations are towards instability) and to the H-infinity norm, at {speed:g} "
        "rad/s with the printed gains.",
        ("constant", "margin, -20 % [1/s]", "margin, +20 % [1/s]", "norm, -20 % [1]", "norm, +20 % [1]"),
        rows,
    )


def deviation_figure(measure: str, setting: Setting = PRINTED) -> Figure:
    """Rows: direction; columns: sigma_1, which outweighs the rest, and the other constants on a scale of their own."""
    rows = []
    for direction in DIRECTIONS:
        found = deviations(setting, direction, FINE, measure)
        row = []
        for title, constants in (("σ₁", ("sigma1",)), ("the other constants", ("sigma0", "sigma2", "kappa"))):
            marks: list[Mark] = [Level(y=0.0, color=GREY)]
            for constant in constants:
                symbol, colour = LOOK[constant]
                for factor, dash in zip(FACTORS, (DASHES[1], DASHES[0]), strict=True):
                    curve = found.deviations.at(parameter=constant, factor=factor).values
                    marks.append(Line(FINE, curve, f"{symbol} {factor - 1:+.0%}", colour, dash, 1.7))
            row.append(Panel(marks, SPEED_AXIS, f"deviation [{MEASURES[measure][0]}]", f"{direction}, {title}"))
        rows.append(row)
    return Figure(*WORDS[measure], rows, size=(9.2, 5.8), legend="below", share_x="all")
