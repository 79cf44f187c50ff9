"""The error dynamics of the velocity observer, as printed: matrices and what is said to prove their stability.

P1-26, P1-C-abs: the error matrix and output matrix against the equations that they come from. P1-29-*, P1-41-*, P1-mc: what the
Lyapunov matrices prove in four readings, decided in exact arithmetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Literal

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from studies.claim import Finding, JsonValue, reproduced
from studies.papers.corner_estimation.inputs import CORNERS, DESIGN_SPEED, SPEED_AXIS, STATED_SPEED, Corner, topic
from studies.papers.verdicts import erratum, partly
from studies.plots import ZERO, Axis, Dash, Figure, Level, Line, Mark, Panel, Words, colours, dots
from studies.study import Cell, PartResult, Scope, Table
from synthesis.design.stability import Form
from synthesis.models.catalogue.corner import Direction
from synthesis.models.lpv import LpvModel
from synthesis.published_certificate import CertifiedRange, check_certificate

TOPIC = topic()
L1, L2, P1 = sp.symbols("L1 L2 p1")
PRINTED_ENTRY = -L1 * P1
BACKWARD = -90.0  # rad/s, a wheel that rolls backward at mid-range speed
SPEEDS = (0.0, 40.0, 90.0, 140.0, 180.0)  # rad/s, of the table
Reading = Literal["primal", "swapped", "dual", "adjugate"]
# Each reading: its name in tables and in figures; colour, dash and width of its line.
READINGS: dict[Reading, tuple[str, str, str, Dash, float]] = {
    "primal": ("as printed, V = e'P e", "as printed, V = e'Pe", colours.RED, "dotted", 1.5),
    "swapped": ("states exchanged", "states exchanged", colours.ORANGE, "dash-dot", 1.5),
    "dual": ("V = e'Q^-1 e", "dual, V = e'Q⁻¹e", colours.BLUE, "solid", 2.6),
    "adjugate": ("adjugate", "adjugate", colours.GREEN, "dashed", 1.5),
}
NUMBERS = {"longitudinal": "(29)", "lateral": "(41)"}
RATES = (-800.0, 800.0)  # rad/s^2
BEYOND = 400.0  # rad/s, to see where a matrix that fails in the stated range would hold
Coefficients = list[list[list[str]]]
LYAPUNOV_CLAIMS = ("P1-29-primal", "P1-29-dual", "P1-41-primal", "P1-41-dual", "P1-mc")


def derived_entry() -> sp.Expr:
    """Entry (1,2) of A - L C at standstill, with p1 = sigma1 + sigma2."""
    model = CORNERS["longitudinal"].model
    entry = (model.A - sp.Matrix([L1, L2]) * model.C)[0, 1]
    return sp.expand(entry.subs({"wheel_speed": 0, "sigma2": P1 - sp.Symbol("sigma1")}))


def poles_with(entry: sp.Expr, corner: Corner, omega: ArrayLike) -> FloatArray:
    """Real parts of both frozen error poles in 1/s, (g, 2) ascending, with this entry (1,2) and the printed gains."""
    (first, second), values = corner.gains, corner.constants
    A_e = corner.error_matrices(omega).copy()
    A_e[:, 0, 1] = float(entry.subs({L1: first, L2: second, P1: values["sigma1"] + values["sigma2"]}))
    return np.sort(np.linalg.eigvals(A_e).real, axis=1)


@TOPIC.claim("P1-26")
def entry_of_the_error_matrix(printed: sp.Expr = PRINTED_ENTRY) -> Finding:
    """The printed entry of (26) against A - L C, and what each makes of the poles at standstill."""
    derived = derived_entry()
    forms = {"printed": printed, "corrected": derived}
    slowest = {form: {d: float(poles_with(entry, corner, [0.0]).max()) for d, corner in CORNERS.items()}
               for form, entry in forms.items()}  # fmt: skip
    determinant = sp.expand(sp.Symbol("sigma0") * (L1 * L2 * P1 + printed * L2))
    wrong = sp.expand(printed - derived)
    computed = {"entry": str(derived), "printed_minus_entry": str(wrong), "determinant_of_printed_A0": str(determinant),
                "slowest_pole_at_standstill_1_s": slowest}  # fmt: skip
    reading = (
        f"A - L C has {derived} in place (1,2) of A0. With the printed {printed} the determinant of A0 is "
        f"{determinant}: the slowest pole at standstill is {slowest['printed']['longitudinal']:.3g} 1/s "
        f"longitudinally, against {slowest['corrected']['longitudinal']:.4g} 1/s with the corrected entry."
    )
    return Finding(computed, erratum(wrong == 0, max(slowest["corrected"].values()) < 0.0), reading)


@TOPIC.claim("P1-C-abs")
def absolute_value(signed: bool = True) -> Finding:
    """The output matrix that follows from the bristle equation with |omega|, against the printed one in omega."""
    omega = sp.Symbol("omega", real=True)
    values = CORNERS["longitudinal"].exact_constants
    # mu = sigma0 z + sigma1 z' + sigma2 v_r with z' = v_r - kappa R_e |omega| z of (20)
    s0, s1, kappa, radius = sp.symbols("sigma0 sigma1 kappa effective_radius")
    derived = s0 - s1 * kappa * radius * sp.Abs(omega)
    printed = s0 - s1 * kappa * radius * (omega if signed else sp.Abs(omega))
    forward, backward = (float((printed - derived).subs(values).subs(omega, w)) for w in (-BACKWARD, BACKWARD))
    share = abs(backward) / float(derived.subs(values).subs(omega, BACKWARD))
    decay = float((kappa * radius).subs(values)) * abs(BACKWARD)
    computed = {"wheel_speed_rad_s": [-BACKWARD, BACKWARD], "printed_minus_derived_1_m": [forward, backward],
                "share_of_C11": share, "open_loop_pole_if_A_is_signed_too_1_s": decay}  # fmt: skip
    reading = (
        f"The output follows from (20), which has |omega|. At {-BACKWARD:g} rad/s the printed form agrees; at "
        f"{BACKWARD:g} rad/s its first entry is off by {backward:.4g} 1/m, {100 * share:.0f} % of its value. Signs in "
        f"A as well would let the bristle grow at {decay:.4g} 1/s. |omega| must stand in all of them, as P3 (6) has it."
    )
    return Finding(computed, erratum(sp.simplify(printed - derived) == 0, forward == 0.0), reading)


@TOPIC.part("error-matrix", "Error dynamics of the velocity observer", 2.0)
def error_matrix(scope: Scope) -> PartResult:
    """The misprints of (26) and (23), and both poles of the velocity observer at five wheel speeds."""
    rows, columns, panels = [[speed] for speed in SPEEDS], [SPEED_AXIS.label], []
    omega = np.linspace(0.0, STATED_SPEED, 361)
    for direction, corner in CORNERS.items():
        for row, poles in zip(rows, np.linalg.eigvals(corner.error_matrices(SPEEDS)), strict=True):
            first, second = sorted(poles, key=lambda pole: (pole.real, -pole.imag))
            row.extend([float(first.real), float(second.real), float(abs(first.imag))])
        columns += [f"{direction}, {p} [1/s]" for p in ("faster real part", "slower real part", "imaginary part +-")]
        right, wrong = (poles_with(entry, corner, omega) for entry in (derived_entry(), PRINTED_ENTRY))
        marks: list[Mark] = [
            Line(omega, right, "A − L C (corrected entry)"), Line(omega, wrong, "A₀ as printed in (26)", colours.RED, "dashed"),
            ZERO, dots([0.0], [wrong[0, 1]], color=colours.RED),
        ]  # fmt: skip
        title = "{}, L = [{:g}, {:g}]".format(direction, *corner.gains)
        panels.append(Panel(marks, SPEED_AXIS, "real part of the poles [1/s]", title))
    gains = " and ".join(str(list(corner.gains)) for corner in CORNERS.values())
    caption = f"Poles of the velocity observer error A - L C with the printed gains {gains} at constant wheel speed."
    figure = Figure(
        "poles",
        "Real parts of the two poles of the velocity observer error over wheel speed, with the printed gains. With entry (1,2) "
        "of A0 as printed, without its one, a pole lies at zero at standstill (dot): nothing could be proved. P1 (26).",
        "Two panels, longitudinal and lateral. Corrected poles stay below zero; the printed ones reach zero at standstill.",
        panels, legend="below",
    )  # fmt: skip
    return PartResult(TOPIC.found("P1-26", "P1-C-abs"), [Table("poles", caption, columns, rows)], [figure])


@dataclass(frozen=True)
class Certificate:
    """M(omega) = matrix[0] + omega matrix[1] with printed decimals, offered for a model with these gains."""

    model: LpvModel
    gains: list[list[str]]
    matrix: Coefficients
    form: Form

    def validity(self, end: float = STATED_SPEED) -> CertifiedRange:
        """Where on 0..`end` rad/s it proves stability, in exact arithmetic."""
        return check_certificate(self.model, self.gains, self.matrix, self.form, (0.0, end))

    def at(self, omega: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M (g, 2, 2) and its inequality at both rate bounds (2, g, 2, 2), to be negative: (28), (40) or the dual."""
        constant, slope = (np.array(part, float) for part in self.matrix)
        M = constant + omega[:, None, None] * slope
        A_e = self.model.on(omega).error_dynamics(np.array(self.gains, float))[0]
        half, sign = (M @ A_e, 1.0) if self.form == "primal" else (A_e @ M, -1.0)
        total = half + np.swapaxes(half, 1, 2)
        return M, np.stack([total + sign * rate * slope for rate in RATES])

    def growth(self, omega: FloatArray) -> FloatArray:
        """Largest growth rate of V in 1/s, (g,): eigenvalue of the inequality relative to M; NaN where M is not > 0."""
        M, total = self.at(omega)
        definite = np.linalg.eigvalsh(M)[:, 0] > 0.0
        root = np.linalg.cholesky(np.where(definite[:, None, None], M, np.eye(2)))
        inner = np.linalg.solve(root, total)
        relative = np.linalg.solve(root, np.swapaxes(inner, -1, -2))
        largest = np.linalg.eigvalsh(0.5 * (relative + np.swapaxes(relative, -1, -2)))[..., -1].max(axis=0)
        return np.where(definite, largest, np.nan)


def certificate(corner: Corner, reading: Reading, matrix: Coefficients | None = None) -> Certificate:
    """The printed matrix (or `matrix`) as printed, with the states exchanged, as a dual matrix, or as an adjugate."""
    found = corner.lyapunov if matrix is None else matrix
    if reading in ("swapped", "adjugate"):
        found = [[row[::-1] for row in coefficient[::-1]] for coefficient in found]
    if reading == "adjugate":
        found = [[[a, f"-{b}".removeprefix("--")], [f"-{c}".removeprefix("--"), d]] for ((a, b), (c, d)) in found]
    gains = [[str(gain)] for gain in corner.gains]
    return Certificate(corner.model, gains, found, "dual" if reading == "dual" else "primal")


def convexity(model: LpvModel, gain: ArrayLike, slope: ArrayLike, form: Form = "primal") -> FloatArray:
    """A1'P1 + P1 A1 (primal) or A1 Q1 + Q1 A1' (dual), with A1 the part of A_e linear in the wheel speed, (2, 2)."""
    A_e = model.on([0.0, 1.0]).error_dynamics(np.asarray(gain, float))[0]
    A1 = A_e[1] - A_e[0]
    A1[:, 1] = 0.0  # exactly, as (26) has it; the difference above leaves rounding
    half = (A1.T if form == "primal" else A1) @ np.asarray(slope, float)
    return np.asarray(half + half.T)


def primal(direction: Direction, matrix: Coefficients | None = None) -> Finding:
    """The matrix as printed, P of V = e'Pe: does (28) or (40) hold on 0..180 rad/s?"""
    offered = certificate(CORNERS[direction], "primal", matrix)
    inside, wide = offered.validity(), offered.validity(BEYOND)
    first, last = np.linalg.eigvalsh(offered.at(np.array([0.0, STATED_SPEED]))[1]).max(axis=(0, 2)).tolist()
    computed = {
        "holds_everywhere": inside.everywhere, "holds_on_rad_s": inside.intervals,
        f"holds_on_up_to_{BEYOND:g}_rad_s": wide.intervals,
        "largest_eigenvalue_at_0_rad_s": first, "largest_eigenvalue_at_180_rad_s": last,
    }  # fmt: skip
    reading = (
        f"As P of V = e'Pe the printed {NUMBERS[direction]} satisfies its inequality on {_words(wide)} "
        f"rad/s (searched up to {BEYOND:g} rad/s). The largest eigenvalue, to be negative, is {first:.4g} at "
        f"standstill and {last:.4g} at {STATED_SPEED:g} rad/s."
    )
    why = " The large entry weighs the velocity, where a P of these dynamics must weigh the bristle deflection."
    return Finding(computed, reproduced(inside.everywhere), reading + ("" if inside.everywhere else why))


def dual(direction: Direction, matrix: Coefficients | None = None) -> Finding:
    """The printed matrix as Q of V = e'Q^-1 e on the stated range, or on the range that the gains are designed for."""
    offered = certificate(CORNERS[direction], "dual", matrix)
    found, designed = offered.validity(), offered.validity(DESIGN_SPEED).everywhere
    omega = np.linspace(0.0, STATED_SPEED, 1801)
    growth = offered.growth(omega)
    computed = {
        "holds_everywhere": found.everywhere, "holds_on_design_range": designed, "holds_on_rad_s": found.intervals,
        "largest_relative_eigenvalue_1_s": float(growth.max()), "at_wheel_speed_rad_s": float(omega[growth.argmax()]),
    }  # fmt: skip
    reading = (
        f"Read as Q of V = e'Q^-1 e, {NUMBERS[direction]} proves stability on {_words(found)} of the stated 0 to "
        f"{STATED_SPEED:g} rad/s, at both bounds of the rate; relative to Q the largest eigenvalue is {growth.max():.4g} "
        f"1/s. The design range of the gains, 0 to {DESIGN_SPEED:g} rad/s, is {'covered' if designed else 'not covered'}."
    )
    return Finding(computed, partly(found.everywhere, designed), reading)


TOPIC.claim("P1-29-primal")(partial(primal, "longitudinal"))
TOPIC.claim("P1-29-dual")(partial(dual, "longitudinal"))
TOPIC.claim("P1-41-primal")(partial(primal, "lateral"))
TOPIC.claim("P1-41-dual")(partial(dual, "lateral"))


def _words(found: CertifiedRange) -> str:
    return " and ".join(f"({low:.7g}, {high:.7g})" for low, high in found.intervals) or "no part"


@TOPIC.claim("P1-mc")
def printed_slopes_are_multi_convex(slopes: dict[Direction, list[list[str]]] | None = None) -> Finding:
    """Sign of A1'P1 + P1 A1 in exact arithmetic, and its eigenvalues in every reading of the matrices."""
    holds, computed = [], dict[str, JsonValue]()
    for direction, corner in CORNERS.items():
        constant, slope = corner.lyapunov
        matrix = [constant, slopes[direction] if slopes else slope]
        offered = {reading: certificate(corner, reading, matrix) for reading in READINGS}
        printed = (offered["primal"].gains, matrix[1])
        gain, P1 = (sp.Matrix([[sp.Rational(entry) for entry in row] for row in rows]) for rows in printed)
        A1 = (corner.model.A - gain * corner.model.C).diff("wheel_speed").subs(corner.exact_constants)
        exact = A1.T * P1 + P1 * A1
        holds.append(bool(exact[0, 0] >= 0 and exact[1, 1] >= 0 and exact.det() >= 0))
        condition = {reading: convexity(o.model, o.gains, o.matrix[1], o.form) for reading, o in offered.items()}
        spread = {reading: np.linalg.eigvalsh(found).tolist() for reading, found in condition.items()}
        computed[direction] = {"eigenvalues": spread, "determinant_as_printed": float(exact.det())}
    lowest = [low for d in CORNERS for low, _ in computed[d]["eigenvalues"].values()]
    shown = "; ".join("{} {:.3g}, {:.3g}".format(d, *computed[d]["eigenvalues"]["primal"]) for d in CORNERS)
    reading = (
        "Column 2 of A1 is zero, so entry (2,2) of the condition is zero and its determinant is minus the square of entry "
        f"(1,2): it can hold only if that entry vanishes. Eigenvalues of the condition as printed: {shown}. Of {len(lowest)} "
        f"readings (two matrices, as printed, exchanged, dual, adjugate) {sum(low >= 0.0 for low in lowest)} meet it."
    )
    return Finding(computed, reproduced(all(holds)), reading)


@TOPIC.part("printed-lyapunov", "What the printed Lyapunov matrices prove", 2.0)
def printed_lyapunov(scope: Scope) -> PartResult:
    """All claims about (29) and (41), and where each reading holds and how fast V grows at most."""
    rows: list[list[Cell]] = []
    for (direction, corner), (reading, (name, *_)) in product(CORNERS.items(), READINGS.items()):
        offered = certificate(corner, reading)
        found = offered.validity()
        where = "; ".join(f"{low:.2f} to {high:.2f}" for low, high in found.intervals) or "nowhere"
        worst = float(np.nanmax(offered.growth(np.linspace(0.0, STATED_SPEED, 361))))
        rows.append([NUMBERS[direction], direction, name, found.everywhere, where, worst])
    caption = (
        f"The printed Lyapunov matrices in four readings, judged exactly on 0 to {STATED_SPEED:g} rad/s at wheel accelerations "
        "of +-800 rad/s^2: where all inequalities hold, and the largest growth rate of V on a grid of 0.5 rad/s."
    )
    columns = ["matrix", "direction", "reading", "holds on the whole range", "holds on [rad/s]",
               "largest growth rate [1/s]"]  # fmt: skip
    return PartResult(
        TOPIC.found(*LYAPUNOV_CLAIMS), [Table("lyapunov-readings", caption, columns, rows)], [growth_figure()]
    )


def growth_figure() -> Figure:
    """Growth rate of V over wheel speed in four readings of (29), (41)."""
    omega = np.linspace(0.0, STATED_SPEED, 721)
    ticks = {-1e3: "−10³", -1e2: "−10²", -10.0: "−10", 0.0: "0", 10.0: "10", 1e2: "10²", 1e3: "10³",
             1e5: "10⁵", 1e7: "10⁷"}  # fmt: skip
    y = Axis("largest growth rate of V [1/s]", -2e3, 5e7, "symlog", ticks, linear=10.0)
    panels = []
    for direction, corner in CORNERS.items():
        marks: list[Mark] = [ZERO, Level(x=DESIGN_SPEED, color=colours.GREY, dash="dotted")]
        for reading, (_, name, colour, dash, width) in READINGS.items():
            offered = certificate(corner, reading)
            marks.append(Line(omega, offered.growth(omega), name, colour, dash, width))
            spans = offered.validity().intervals if reading == "dual" else ()
            for end in (w for span in spans for w in span if 0.0 < w < STATED_SPEED):
                text = Words(end, 0.0, f"{end:.1f}", offset=(-6, 6), horizontal="right")
                marks += [dots([end], [0.0], color=colour), text]
        panels.append(Panel(marks, SPEED_AXIS, y, f"{direction}, {NUMBERS[direction]}"))
    return Figure(
        "printed-lyapunov",
        "Largest growth rate of V along the error dynamics, over both bounds of the wheel acceleration (±800 rad/s²), for "
        "the printed Lyapunov matrices in four readings; below zero the matrix proves stability at that wheel speed. "
        f"Logarithmic beyond ±10 1/s. Dots: exact ends of the dual reading. Dotted line: {DESIGN_SPEED:g} rad/s, the end of "
        "the design range. As printed (41) holds on 0.03 rad/s, too little to see. P1 (28), (29), (40), (41).",
        "As printed both matrices give growth rates of 1e5 to 1e7 per second; the dual reading is negative over "
        "the whole range longitudinally, and up to 162 rad/s laterally.",
        panels, legend="below",
    )  # fmt: skip
