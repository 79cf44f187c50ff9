"""P2-19M, P2-kappa, P2-Re: the model, its patch constant and radius; P2-O3: the ranks of (24) and of the gramian (A1)."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import sympy as sp
from pint import UnitRegistry

from analysis.observability.gramians import growing_observability
from analysis.observability.matrix import ObservabilityMatrix, observability_matrix
from analysis.observability.rank_loss import rank_loss
from studies.claim import Finding, reproduced
from studies.papers.longitudinal_speed import inputs
from studies.papers.verdicts import erratum
from studies.plots import DASHES, Axis, Figure, Level, Line, Map, Mark, Panel, Words, colours
from studies.study import Cell, PartResult, Scope, Table
from synthesis.models.catalogue.longitudinal_speed import WHEEL_MOTION

TOPIC = inputs.topic()
SPEEDS = (1, 40, 140)  # rad/s
ACCELERATION, JERK = "wheel_acceleration", "wheel_acceleration_rate"
RANK_TOLERANCE = 1e-12  # singular values of the gramian's factor, over the largest, states in their typical sizes
Ranks = npt.NDArray[np.int_]


@TOPIC.claim("P2-19M")
def descriptor_form(M: tuple[tuple[int, ...], ...] = ((1, 0, 0), (0, 1, 0), (0, -1, 1))) -> Finding:
    """M^-1 times (19) against the model, and its third row against d/dt of the first."""
    model = inputs.speed_model()
    inverse = sp.Matrix(M).inv()
    B, A = inverse * sp.Matrix([0, 1, 0]), inverse * model.A
    t = sp.Symbol("t")
    z, v, speed = (sp.Function(name)(t) for name in ("z", "v", "w"))
    rate = sp.Symbol("kappa") * sp.Symbol("effective_radius")
    third = (A * sp.Matrix([z, v, z.diff(t)]) + B * v.diff(t))[2]
    third = third.subs({"wheel_speed": speed, "wheel_acceleration": speed.diff(t)})
    mismatch = sp.simplify((v - rate * speed * z).diff(t) - third)
    computed = {"B": [*map(int, B)], "third_row_of_A": [*map(str, A.row(2))],
                "third_row_minus_derivative_of_the_first": str(mismatch)}  # fmt: skip
    same = sp.Matrix(model.A) == A and sp.Matrix(model.B) == B
    reading = (
        f"M^-1 gives B = {computed['B']}' and {'leaves' if same else 'does not leave'} A as it is; the third row is z'' = V_r' "
        f"- kappa R_e w' z - kappa R_e w z', which differs from d/dt of the bristle equation by {mismatch} (friction left out)."
    )
    return Finding(computed, reproduced(mismatch == 0 and same), reading)


@TOPIC.claim("P2-kappa")
def patch_constant(printed: str = "7/6 L") -> Finding:
    """Unit of kappa as the bristle equation needs it, and the patch length that kappa = 8 1/m means in each form."""
    unit: Any = UnitRegistry()
    patch = unit.Quantity(1.0, "m")
    others = patch * unit.Quantity(1.0, "rad/s") * patch  # R_e, omega, z
    forms = {"7/6 L": 7.0 / 6.0 * patch, "7/(6 L)": 7.0 / 6.0 / patch}
    fits = {name: bool((value * others).is_compatible_with("m/s")) for name, value in forms.items()}
    kappa = Fraction(str(inputs.parameters().tire["longitudinal"].kappa.value))
    lengths = {"7/6 L": kappa * Fraction(6, 7), "7/(6 L)": Fraction(7, 6) / kappa}
    right = lengths["7/(6 L)"]
    metres = {name: float(length) for name, length in lengths.items()}
    computed = {"kappa_1_m": float(kappa), "unit_fits": fits, "patch_length_m": metres}
    reading = (
        f"kappa R_e |omega| z must be a velocity, so kappa is in 1/m: 7/(6 L) fits and gives a patch of L = {right} m = "
        f"{float(right):.4f} m for kappa = {float(kappa):g} 1/m; 7/6 L has the unit of a length and would mean "
        f"{metres['7/6 L']:.2f} m."
    )
    plausible = 0.05 < right < 0.3  # m, contact patches of car tires
    return Finding(computed, erratum(fits[printed], fits["7/(6 L)"] and plausible), reading)


@TOPIC.claim("P2-Re")
def effective_radius(printed: dict[str, float] | None = None) -> Finding:
    """Both printed radii, and the one of the sister paper's Table I."""
    values = TOPIC.printed("P2-Re") if printed is None else printed
    sister = inputs.parameters("corner-estimation").vehicle["effective_radius"].value
    share = values["text"] / values["table"] - 1.0
    computed = {**values, "table_of_P1": sister, "difference_percent": 100.0 * share}
    reading = (
        f"Table I has {values['table']:g} m, the text {values['text']:g} m: {100 * share:.1f} % apart, and as much in every "
        f"wheel speed times radius. Table I of P1, the same car, has {sister:g} m. Here the tire constants of section IV go "
        "with the text's radius."
    )
    return Finding(computed, erratum(values["table"] == values["text"], values["table"] == sister), reading)


TOPIC.show("model", "Model, patch constant and radius", claims=["P2-19M", "P2-kappa", "P2-Re"])


@cache
def speed_observability() -> ObservabilityMatrix:
    """O_3 of (24) with omega' as the parameter of the model and omega'' as its rate."""
    return observability_matrix(inputs.speed_model(), motion=WHEEL_MOTION)


def exact_ranks(acceleration: object = 0, jerk: object = 0) -> list[int]:
    """rank(O_3) at three wheel speeds, in rational numbers."""
    matrix = speed_observability()
    return [matrix.rank_at({"wheel_speed": w, ACCELERATION: acceleration, JERK: jerk}) for w in SPEEDS]


def second_piece() -> float:
    """Wheel speed in rad/s below which rank may be lost while accelerating, for accelerations up to 800 rad/s^2."""
    steady = rank_loss(speed_observability(), {JERK: 0})
    curve = max(steady.curve(ACCELERATION), key=sp.count_ops)
    (top,) = (root for root in sp.real_roots(sp.numer(sp.together(curve - 800))) if root > 0)
    return float(top)


@TOPIC.claim("P2-O3")
def rank_over_the_region(accelerations: tuple[object, ...] = (0, 1, "-5")) -> Finding:
    """Rank at constant speed, while accelerating, and while the acceleration changes; the operating region has them all."""
    ranks = {f"acceleration {a} rad/s^2": exact_ranks(a) for a in accelerations}
    changing, lowest_speed = exact_ranks(0, 1), second_piece()
    (determinant,) = speed_observability().minors(symbolic=True)
    always = rank_loss(speed_observability(), {JERK: 0, ACCELERATION: 0}).always
    computed = {
        "determinant": str(determinant), "wheel_speeds_rad_s": list(SPEEDS), "ranks": ranks,
        "ranks_with_changing_acceleration": changing, "lost_at_every_constant_speed": always,
        "lost_while_accelerating_below_rad_s": lowest_speed,
    }  # fmt: skip
    reading = (
        "The determinant vanishes with the wheel acceleration and its rate: at any constant wheel speed the rank is "
        f"{min(exact_ranks())}, because the third state repeats the first two and both modes decay at kappa R_e omega. It is "
        f"{max(changing)} while the wheel accelerates (apart from speeds below {lowest_speed:.3g} rad/s). What is hidden "
        "decays while the wheel turns, so the model is detectable, except at standstill."
    )
    return Finding(computed, reproduced(min(min(row) for row in ranks.values()) == 3), reading)


@cache
def histories() -> tuple[inputs.WheelRecord, ...]:
    """Wheel speed histories of the kinds that Fig. 1 covers, 6 s each; constant speed is ours."""
    turning = inputs.slalom(45.0, 4.0, 0.5, 6.0)
    return inputs.launch(2.0, 6.0), turning, inputs.braking(80.0, 25.0, 6.0), inputs.constant(40.0, 1200)


def gramian_rank(record: inputs.WheelRecord) -> Ranks:
    """rank V(0, N) of (A1) for every N, (K,)."""
    return growing_observability(record.sequence.A, record.sequence.C, inputs.TYPICAL).rank(RANK_TOLERANCE)


@TOPIC.part("observability", "Observability of the three-state model (Fig. 1)", 4.0)
def observability(scope: Scope) -> PartResult:
    """Exact rank of (24) at points, numerical rank of the gramian along the histories, and Fig. 1."""
    ranks = [gramian_rank(record) for record in histories()]
    rows: list[list[Cell]] = []
    motions = {"constant speed": (), "accelerating, 1 rad/s^2": (1,), "acceleration changing, 1 rad/s^3": (0, 1)}
    for name, motion in motions.items():
        found, where = exact_ranks(*motion), f"at {', '.join(map(str, SPEEDS))} rad/s"
        rows.append(["rank of O3, exact", name, where, min(found), max(found)])
    for record, rank in zip(histories(), ranks, strict=True):
        rows.append(["rank of V(0, N)", record.name, f"{len(rank)} samples", int(rank[len(rank) // 4]), int(rank[-1])])
    caption = (
        "Rank of the time-varying observability matrix (24) in rational numbers (lowest and highest over three wheel "
        "speeds), and numerical rank of the gramian (A1) along wheel speed histories (after a quarter of the record and at "
        f"its end, tolerance {RANK_TOLERANCE:g})."
    )
    table = Table("ranks", caption, ["what", "motion", "where", "rank, first", "rank, last"], rows)
    figure = Figure(
        "gramian-rank",
        "Wheel speed histories (above) and numerical rank of the observability gramian over all samples so far (below, lines "
        f"a little apart; tolerance {RANK_TOLERANCE:g} of the largest singular value of its factor, states in typical sizes). "
        "Full rank comes once the wheel changes its speed: not while it stands, and not at constant speed. Fig. 1 and (A1) "
        "of P2, on histories of our own.",
        "The rank is two during the two seconds of standstill and for constant speed, three otherwise.",
        rank_panels(histories(), ranks, Axis("wheel speed [rad/s]")), (7.2, 4.4), legend="below", share_x="col",
    )  # fmt: skip
    return PartResult(TOPIC.found("P2-O3"), [table], [figure, determinant_figure(81 if scope.quick else 201)])


def rank_panels(records: Sequence[inputs.WheelRecord], ranks: Sequence[Ranks], speed: Axis) -> list[list[Panel]]:
    """Wheel speeds, and below them the ranks of the gramian, a little apart so that no line hides another."""
    upper, lower = [], []
    for k, (record, rank) in enumerate(zip(records, ranks, strict=True)):
        color, dash = colours.CURVES[k], DASHES[k % len(DASHES)]
        apart = 0.05 * (k - (len(records) - 1) / 2)
        upper.append(Line(record.time, record.speed, record.name, color, dash))
        lower.append(Line(record.time, rank + apart, "", color, dash, steps=True))
    below = Axis("rank of V(0, N) [1]", 0.7, 3.4, ticks=[1, 2, 3])
    return [[Panel(upper, "", speed)], [Panel(lower, Axis("time [s]", 0.0, 6.0), below)]]


def determinant_figure(points: int) -> Figure:
    """Size of det O_3 over wheel speed and acceleration."""
    (determinant,) = speed_observability().minors({JERK: 0})
    function = sp.lambdify(["wheel_speed", ACCELERATION], determinant, "numpy")
    speed, acceleration = np.linspace(0.0, 140.0, points), np.linspace(-800.0, 800.0, points + 1)
    size = np.abs(function(speed, acceleration[:, None])) / abs(float(function(140.0, 800.0)))
    bar = "log₁₀ of the determinant over its value at the corner [1]"
    marks: list[Mark] = [
        Map(speed, acceleration, np.log10(size), bar, "Blues", -5.0, 0.0),
        Level(y=0.0, color=colours.RED, dash="dashed", width=1.4),
        Words(70.0, 0.0, "rank 2", colours.RED, offset=(0, 5), horizontal="center"),
    ]
    return Figure(
        "observability-determinant",
        "Size of the determinant of the time-varying observability matrix (24) over wheel speed and wheel acceleration, at "
        "constant acceleration. It vanishes along the dashed line: at any constant wheel speed the three-state model is not "
        "observable, and near it only weakly.",
        "A map that fades to white along zero acceleration and towards low speed.",
        Panel(marks, "wheel speed [rad/s]", "wheel acceleration [rad/s²]", grid=False), (5.6, 4.2),
    )  # fmt: skip
