"""Continuous error dynamics (8), (13): Example 1, Proposition 1 with its energy bound (16), and the norms of Fig. 2."""

from __future__ import annotations

from functools import partial

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from analysis.norms.hinf import stability_margin
from analysis.norms.observer_error import error_hinf_norm
from analysis.norms.static_gain import static_gain
from analysis.switching.similarity import best_diagonal_transform, similarity_bound, symmetric_growth
from estimators.arrays import FloatArray
from studies.claim import ClaimVerdict, Finding, JsonValue, agrees, reproduced
from studies.papers.plain import by_speed, column_table
from studies.papers.resilient_velocity.inputs import DIRECTIONS, PACKAGE, PRINTED, SPEED_AXIS, SPEEDS, Setting, crossing
from studies.papers.topic import Topic
from studies.papers.verdicts import derived, erratum
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Shade, Words, dots
from studies.plots.colours import BLUE, GREY, RED
from studies.study import Table
from synthesis.models.catalogue.corner import Direction

TOPIC = Topic(PACKAGE)
HALF_DIGIT = 0.05  # 1/s; the symmetric part is printed without decimals: 0.5
SHOWN = np.array([0.0, 40.0, 80.0, 140.0])
DISTURBANCES = ("friction", "acceleration_error")  # the two inputs of (8), (13)
AXES: dict[Direction, tuple[float, float]] = {"longitudinal": (0.9985, 1.0), "lateral": (0.995, 1.005)}
DRAWN: dict[Direction, float] = {"longitudinal": 5e-5, "lateral": 5e-4}
"""Half the last digit of the axis labels of Fig. 2: nothing finer can be read from the plot."""
NON_EXPANSIVE = 1e-6


def symmetric_part(setting: Setting, speed: float, transformed: bool = False) -> float:
    """lambda_max((A_e + A_e')/2) in 1/s at one wheel speed, of T A_e T^-1 if `transformed`."""
    A_e = setting.error("longitudinal", speed)[0]
    return float(symmetric_growth(A_e, setting.transform if transformed else None)[0])


def speeds_of_print(setting: Setting, name: str, half_digit: float, transformed: bool = False) -> list[float] | None:
    """The wheel speeds (rad/s) between which the symmetric part rounds to what claim `name` prints; None if it does nowhere.

    It falls with the wheel speed on the whole range, so one root for each end is enough.
    """
    part, printed = partial(symmetric_part, setting, transformed=transformed), TOPIC.printed(name)
    ends = [crossing(part, printed + side) for side in (half_digit, -half_digit)]
    found = [end for end in ends if end is not None]
    return found if len(found) == 2 else None


@TOPIC.claim("P3-ex1-eig")
def eigenvalue(setting: Setting = PRINTED) -> Finding:
    """lambda_max(A_e) at the speed of the example."""
    speed = setting.example_speed
    found = float(stability_margin(setting.error("longitudinal", speed)[0])[0])
    reading = f"Largest eigenvalue of the continuous error matrix A - L C of (8) with Table I at {speed:g} rad/s."
    return Finding(found, reproduced(agrees(found, TOPIC.printed("P3-ex1-eig"), HALF_DIGIT)), reading)


@TOPIC.claim("P3-ex1-sym")
def symmetric(setting: Setting = PRINTED) -> Finding:
    """Its symmetric part, and the wheel speed to which the print belongs."""
    found, published = symmetric_part(setting, setting.example_speed), TOPIC.printed("P3-ex1-sym")
    match = speeds_of_print(setting, "P3-ex1-sym", 0.5)
    where = None if match is None else 0.5 * sum(match)
    rate = None if where is None else float(setting.rolling_rate("longitudinal", where))
    computed = {
        "at_40_rad_per_s": found, "relative_difference": found / published - 1.0,
        "speeds_that_round_to_print_rad_per_s": match, "kappa_Re_omega_there_per_s": rate}  # fmt: skip
    reading = (
        f"Table I gives {found:.0f} 1/s at the stated {setting.example_speed:g} rad/s, {found / published - 1:+.1%} from the "
        "print. "
        + ("No wheel speed gives the print. " if where is None else
           f"The print belongs to {where:.2f} rad/s (kappa R_e omega = {rate:.1f} 1/s). ")
        + "That the symmetric part is far above zero, so that it proves nothing without a transformation, holds all the same."
    )  # fmt: skip
    return Finding(computed, reproduced(agrees(found, published, 0.5)), reading)


@TOPIC.claim("P3-ex1-T")
def transformed(setting: Setting = PRINTED) -> Finding:
    """The symmetric part of T A_e T^-1, here and at the wheel speed that fits the print of the plain one."""
    found = symmetric_part(setting, setting.example_speed, transformed=True)
    match = speeds_of_print(setting, "P3-ex1-T", HALF_DIGIT, transformed=True)
    other = speeds_of_print(setting, "P3-ex1-sym", 0.5)
    at_other = None if other is None else symmetric_part(setting, 0.5 * sum(other), transformed=True)
    computed = {
        "at_40_rad_per_s": found, "at_the_speed_that_gives_108750": at_other,
        "speeds_that_round_to_print_rad_per_s": match}  # fmt: skip
    return Finding(computed, reproduced(agrees(found, TOPIC.printed("P3-ex1-T"), HALF_DIGIT)), (
        f"T A_e T^-1 with T = diag({setting.similarity:g}, 1) gives {found:.2f} 1/s at {setting.example_speed:g} rad/s; "
        + ("no wheel speed rounds to the print" if match is None else
           f"{match[0]:.2f} to {match[1]:.2f} rad/s round to it")
        + ("." if at_other is None else
           f", and the speed that fits 108750 gives {at_other:.3f}, which meets it by truncation only.")
        + " The point of the example, that T turns a useless bound into a sharp one, holds."))  # fmt: skip


@TOPIC.claim("P3-ex1-Topt")
def best_transform(setting: Setting = PRINTED) -> Finding:
    """gamma = sqrt(c/b) for the off-diagonal entries b, c of A_e."""
    A_e = setting.error("longitudinal", setting.example_speed)[0]
    found, exact = best_diagonal_transform(A_e), float(stability_margin(A_e)[0])
    b, c = float(A_e[0, 0, 1]), float(A_e[0, 1, 0])
    gamma, growth = float(found.gamma[0]), float(found.growth[0])
    holds = b * c > 0.0 and agrees(gamma, float(np.sqrt(c / b)), 1e-9 * gamma) and agrees(growth, exact, 1e-6)
    return Finding({"gamma_star": gamma, "lmax_sym": growth}, derived(holds), (
        "The off-diagonal entries b, c of A_e have one sign, so gamma = sqrt(c/b) makes T A_e T^-1 symmetric and "
        "its largest eigenvalue that of A_e itself: no diagonal T can do better, and none is needed beyond it."))  # fmt: skip


@TOPIC.claim("P3-prop1-young")
def young(setting: Setting = PRINTED) -> Finding:
    """The quadratic forms in |e| and |B rho| that (16) needs to be positive semidefinite, exactly (P3 notes 4).

    right - left of e'B rho <= p |e|^2 + q |B rho|^2 is the form [[p, -1/2], [-1/2, q]]; B rho = epsilon e makes it tight.
    """
    eps, half = sp.Symbol("epsilon", positive=True), sp.Rational(1, 2)
    tight = sp.Matrix([1, eps])
    forms = [sp.Matrix([[eps / k, -half], [-half, 1 / (k * eps)]]) for k in (4, 2)]  # printed, corrected
    printed, corrected = (sp.simplify(form.det()) for form in forms)
    sides = [float(sp.simplify((eps + (tight.T * form * tight)[0]) / eps)) for form in forms]
    bound = similarity_bound(*setting.error("longitudinal", SPEEDS), setting.transform, disturbance=1.0)
    corrected_holds = corrected == 0 and sp.simplify(forms[1].trace()).is_positive and bound.bounded
    computed = {
        "left_over_epsilon": 1.0, "printed_right_over_epsilon": sides[0], "corrected_right_over_epsilon": sides[1],
        "determinant_printed": float(printed), "determinant_corrected": float(corrected), "eta1_per_s": bound.eta1}  # fmt: skip
    return Finding(computed, erratum(bool(printed >= 0), bool(corrected_holds)), (
        "With B rho = epsilon e the left side of the printed step is epsilon |e|^2 and the right side half of it. "
        "Young's inequality needs |B rho|^2/(2 epsilon) + epsilon |e|^2/2; then eta_1 = 2 lambda_max + epsilon "
        "stays negative over 0..140 rad/s, and boundedness survives."))  # fmt: skip


def norms(setting: Setting, direction: Direction, speeds: FloatArray, *disturbances: str) -> FloatArray:
    """The H-infinity norm from the named disturbances (both if none is named) to both errors at each speed (g,)."""
    chosen = disturbances or DISTURBANCES
    return error_hinf_norm(setting.models[direction], setting.gains[direction], speeds, chosen).norm


def floor(setting: Setting, direction: Direction, speeds: FloatArray) -> FloatArray:
    """sigma_0/(sigma_0 + sigma_2 kappa R_e |omega|) (g,): what every stable gain lets through from friction to slip velocity."""
    tire, rate = setting.parameters.tire[direction], setting.rolling_rate(direction, speeds)
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


def within_axes(direction: Direction, found: FloatArray) -> ClaimVerdict:
    """Whether a norm lies on the axis of the figure."""
    low, high = AXES[direction]
    return reproduced(bool(found.min() >= low - DRAWN[direction] and found.max() <= high + DRAWN[direction]))


@TOPIC.claim("P3-fig2-x")
def longitudinal(setting: Setting = PRINTED) -> Finding:
    """On the axis of the figure."""
    found = norms(setting, "longitudinal", SPEEDS)
    computed = by_speed(SHOWN, norms(setting, "longitudinal", SHOWN))
    return Finding(computed, within_axes("longitudinal", found), (
        f"Continuous error dynamics (8), both disturbances to both errors, peak at zero frequency: {found.min():.5f} to "
        f"{found.max():.7f} over 0..140 rad/s, on the axis of the figure to the accuracy of its labels."))  # fmt: skip


@TOPIC.claim("P3-fig2-y")
def lateral(setting: Setting = PRINTED) -> Finding:
    """On the axis of the figure, with both disturbances and with friction alone."""
    found, friction = (norms(setting, "lateral", SPEEDS, *names) for names in ((), ("friction",)))
    computed = {
        "both_disturbances": by_speed(SHOWN, norms(setting, "lateral", SHOWN)),
        "friction_only": by_speed(SHOWN, norms(setting, "lateral", SHOWN, "friction")),
    }
    return Finding(computed, within_axes("lateral", found), (
        f"Error dynamics (13), both disturbances to both errors: {found.max():.5f} at standstill down to "
        f"{found.min():.5f} at 140 rad/s, inside the axis of the figure; friction alone would give "
        f"{friction.min():.4f} to {friction.max():.4f}, which fits it too."))  # fmt: skip


@TOPIC.claim("P3-fig2-nonexp")
def non_expansive(setting: Setting = PRINTED) -> Finding:
    """Where the norm exceeds 1."""
    computed, where = dict[str, dict[str, JsonValue]](), list[str]()
    for d in DIRECTIONS:
        both, alone = norms(setting, d, SPEEDS), float(norms(setting, d, SPEEDS, "friction").max())
        crossings, largest = norm_crosses_one(setting, d), float(both.max())
        computed[d] = {
            "at_0_rad_per_s": float(both[0]), "largest": largest, "crosses_1_at_rad_per_s": crossings,
            "largest_friction_only": alone}  # fmt: skip
        if largest > 1.0 + NON_EXPANSIVE:
            where.append(f"{d} by {largest - 1.0:.2g} at most, below {', '.join(f'{r:.4g}' for r in crossings)} rad/s")
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
        at = symbolic.expression.subs({name: c.value for name, c in model.constants.items()})
        evaluated = np.array([float(at.subs("wheel_speed", w)) for w in SHOWN])
        attained = error_hinf_norm(model, setting.gains[direction], SPEEDS, ("friction",), ("relative_velocity",)).norm
        excess = attained - floor(setting, direction, SPEEDS)
        holds &= symbolic.free_of_gain
        holds &= bool(np.abs(np.abs(evaluated) - shown).max() <= 1e-12) and bool((excess >= -1e-12).all())
        computed[direction] = by_speed(SHOWN, shown)
        computed[f"{direction}_printed_gain_excess"] = float(excess.max())
    return Finding(computed, derived(holds), (
        "At zero frequency friction and slip velocity look alike to the force: the gain from one to the other is "
        "-sigma0/(sigma0 + sigma2 kappa R_e |omega|) for every L with L_2 != 0. No tuning lowers the norm below "
        "it, it is 1 at standstill, and the printed gains sit on it."))  # fmt: skip


def _table() -> Table:
    columns, speeds = dict[str, ArrayLike]({"wheel speed [rad/s]": SPEEDS[::20]}), SPEEDS[::20]
    for d in DIRECTIONS:
        columns[f"{d}, both disturbances [1]"] = norms(PRINTED, d, speeds)
        columns[f"{d}, friction only [1]"] = norms(PRINTED, d, speeds, "friction")
        columns[f"{d}, floor of any gain [1]"] = floor(PRINTED, d, speeds)
    return column_table("norms",
        "H-infinity norm of the error dynamics with the printed gains: from both disturbances of (8), (13) to both errors, from "
        "friction alone, and the floor that no gain can lower.", columns)  # fmt: skip


def _norm_figure() -> Figure:
    panels, top, sparse = [], dict[str, float](), SPEEDS[::20]
    for d, (low, high) in AXES.items():
        both, room = norms(PRINTED, d, SPEEDS), 0.1 * (high - low)
        top[d] = float(both.max())
        marks: list[Mark] = [
            Shade(low, high, "y", "axis of the paper", "0.9", 1.0),
            Level(y=1.0, color=GREY),
            Line(SPEEDS, both, "friction and acceleration error", BLUE, width=1.9),
            Line(SPEEDS, norms(PRINTED, d, SPEEDS, "friction"), "friction alone", RED, "dashed"),
            dots(sparse, floor(PRINTED, d, sparse), "floor of any gain", "0.1", "x")]  # fmt: skip
        for speed in norm_crosses_one(PRINTED, d):
            words = Words(speed, 1.0, f"1 at {speed:.1f} rad/s", BLUE, offset=(12.0 if speed < 70 else -4.0, 11.0))
            marks += [dots(speed, 1.0, color=BLUE, size=6, hollow=True), words]
        y = Axis("H∞ norm to both errors [1]", low - room, high + room, ticks=np.linspace(low, high, 6).tolist())
        panels.append(Panel(marks, SPEED_AXIS, y, d))
    return Figure("fig-2-norms",
        "Fig. 2 regenerated: H∞ norm of the error dynamics with the printed gains over the wheel speed. Both curves lie on "
        "the axis of the paper. Crosses: the static gain σ₀/(σ₀ + σ₂κRₑ|ω|) that no observer gain can lower. With both "
        f"disturbances the norm starts above 1 ({top['longitudinal']:.6f} and {top['lateral']:.4f} at standstill) and falls "
        "below it at the circles; with friction alone it never exceeds 1.",
        "Two panels of nearly straight, falling lines of the norm over wheel speed; the lateral one with both "
        "disturbances starts at 1.0026 and crosses 1 near 80 rad/s.",
        panels, (9.2, 3.9), "below")  # fmt: skip


TOPIC.show(
    "example-1", "Example 1 and the boundedness proof", 0.6,
    ("P3-ex1-eig", "P3-ex1-sym", "P3-ex1-T", "P3-ex1-Topt", "P3-prop1-young"))  # fmt: skip
TOPIC.show(
    "norms", "H∞ norms over the wheel speed (Fig. 2)", 1.2,
    ("P3-fig2-x", "P3-fig2-y", "P3-fig2-nonexp", "P3-hinf-floor"), [_table], [_norm_figure])  # fmt: skip
