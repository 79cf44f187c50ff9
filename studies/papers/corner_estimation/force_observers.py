"""P1-pid-K, P1-prop1: the longitudinal force observer (2)-(8) and its bound; P1-ukf: sigma points of the lateral filter."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Literal, NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are

from analysis.bounds.forces import force_observer_bound, wheel_error_is_hurwitz, wheel_error_matrix
from estimators.arrays import FloatArray
from estimators.forces.planar import planar_model
from estimators.vehicle import VehicleParameters
from studies.claim import Finding, agrees, reproduced
from studies.papers.corner_estimation.inputs import PACKAGE, parameters, topic
from studies.papers.published import printed_numbers
from studies.papers.verdicts import erratum
from studies.plots import DASHES, Axis, Bars, Figure, Level, Line, Mark, Panel, Shade, Words, colours
from studies.study import PartResult, Scope, Table
from synthesis.models.discretise import zero_order_hold

TOPIC = topic()
INERTIA, RADIUS = (parameters().vehicle[name].value for name in ("wheel_inertia", "effective_radius"))  # kg*m^2 and m
ETA1, ETA2, ETA3 = 1.8, 11.4, 50.6  # N s, N m, 1/s: P1 notes 1
DISTURBANCE_RATE = 100.0  # N/s, what the paper takes as the order of magnitude of dOmega_f/dt
STEP = 0.005  # s
# s: well beyond the transient of the wheel speed (1/0.177 s for a factor e), and from where on the asymptotic bound is looked at
SECONDS, LATE = 60.0, 50.0
RUNS = ("ramp", "slope changing sign each second", "cosine, 2.8 rad/s")  # the disturbances
BETA = 2  # of the sigma points in P1 and P2
SPREAD = Fraction(3)  # N + eta = epsilon^2 N = tau^2
SIZES = (3, 1)  # states of the lateral filter of P1, and of the force filter of P2
Form = Literal["printed", "corrected"]
FORMS: tuple[Form, Form] = ("printed", "corrected")


@TOPIC.claim("P1-pid-K")
def wheel_error(gains: tuple[float, float] = (ETA1, ETA2)) -> Finding:
    """Poles of K of (7) by its characteristic polynomial, and Routh-Hurwitz without tolerance."""
    poles = np.linalg.eigvals(wheel_error_matrix(*gains, INERTIA, RADIUS))
    stable = wheel_error_is_hurwitz(*gains, INERTIA, RADIUS)
    size = float(np.abs(poles).max())
    real, imaginary = float(poles.real.max()), float(np.abs(poles.imag).max())
    computed = {"poles_1_s": [[real, imaginary], [float(poles.real.min()), -imaginary]],
                "natural_frequency_rad_s": size, "damping_ratio": -real / size, "hurwitz": stable}  # fmt: skip
    reading = (
        f"K is {'' if stable else 'not '}Hurwitz with poles {real:.8f} +- {imaginary:.8f}j 1/s: slow and hardly damped "
        f"({size:.3g} rad/s, damping ratio {-real / size:.3f}), so a wrong initial wheel speed rings for half a minute."
    )
    return Finding(computed, reproduced(stable and real < 0.0), reading)


def force_errors(eta3: float = ETA3, rate: float = DISTURBANCE_RATE) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time (k,) in s, e_omega (k,) in rad/s (the same in every run) and e_F (k, runs) in N under the disturbances `RUNS`.

    (3) with its e_omega term, started 1 rad/s and 30 N off; states e_omega, e_omega', e_F with
    e_F' = -eta3 e_F + eta1 e_omega' + Omega_f', |Omega_f'| at most `rate` in N/s; exact over each sample.
    """
    A = np.vstack([np.hstack([wheel_error_matrix(ETA1, ETA2, INERTIA, RADIUS), np.zeros((2, 1))]), [0.0, ETA1, -eta3]])
    move, push = zero_order_hold(A, np.array([[0.0], [0.0], [1.0]]), STEP)
    time = np.asarray(STEP * np.arange(round(SECONDS / STEP) + 1), float)
    slopes = rate * np.stack([np.ones_like(time), np.sign(np.sin(np.pi * time + 1e-9)), np.cos(2.8 * time)], axis=1)
    x = np.repeat([[1.0], [0.0], [30.0]], len(RUNS), axis=1)
    states = np.empty((len(time), 3, len(RUNS)))
    for k, slope in enumerate(slopes):
        states[k] = x
        x = move @ x + push * slope
    return time, states[:, 0, 0], states[:, 2]


@TOPIC.claim("P1-prop1")
def force_bound(eta3: float = ETA3, rate: float = DISTURBANCE_RATE) -> Finding:
    """sup|Omega_f'| / eta3, and what three disturbances of that slope really leave."""
    bound = force_observer_bound(eta3, rate).ultimate
    time, _, force = force_errors(eta3, rate)
    late = dict(zip(RUNS, np.abs(force[time >= LATE]).max(axis=0).tolist(), strict=True))
    computed = {"bound_N": bound, "largest_late_error_N": late, "seen_from_s": LATE}
    ramp, largest, printed = late[RUNS[0]], max(late.values()), float(TOPIC.printed("P1-prop1"))
    # What is left of the wheel speed's transient at LATE adds a share below 1e-3.
    met = agrees(bound, printed, 0.5) and largest <= bound * (1.0 + 1e-3) and abs(ramp / bound - 1.0) <= 1e-3
    reading = (
        f"The bound is {bound:.8f} N, printed as about {printed:g} N. From {LATE:g} s on, when the wheel speed error "
        f"has died out, the full error equation leaves {ramp:.5f} N under a ramp, which attains it, and at most "
        f"{largest:.5f} N otherwise. The bound is asymptotic: before that e_omega drives the force error."
    )
    return Finding(computed, reproduced(met), reading)


@TOPIC.part("wheel-force", "Longitudinal force observer", 2.0)
def wheel_force(scope: Scope) -> PartResult:
    """Force error against the bound of Proposition 1 with the wheel speed error that delays it; and what noise becomes."""
    time, wheel_speed, force = force_errors()
    bound = force_observer_bound(ETA3, DISTURBANCE_RATE).ultimate
    lines = [Line(time, force[:, k], name, colours.CURVES[k], DASHES[k], 1.4) for k, name in enumerate(RUNS)]
    inside = Shade(-bound, bound, label=f"±{bound:.3f} N, the bound", alpha=0.18)
    left = Panel([*lines, inside], Axis("time [s]", 0.0, 6.0), Axis("force error [N]", -4.0, 6.0))
    spin = Line(time, wheel_speed, width=1.0)
    right = Panel([spin], Axis("time [s]", 0.0, 40.0), "virtual wheel speed error [rad/s]")
    errors = Figure(
        "force-observer-error",
        "Left: first seconds of the error of the longitudinal force observer with the printed gains, started 1 "
        f"rad/s and 30 N off (cut off), under three disturbances whose slope stays within {DISTURBANCE_RATE:g} N/s. "
        "Right: error of its virtual wheel speed, which pushes the force error a little over the bound until it "
        "has died out. Behind that the bound holds, and the ramp attains it. P1 (3)-(8), Proposition 1.",
        "Left: force errors fall within 0.1 s to about two newtons and follow the disturbance. Right: an "
        "oscillation of 2.6 rad/s that takes 30 seconds to decay.",
        [left, right], legend="below",
    )  # fmt: skip
    # The force estimate to the wheel equation as implemented, (1 + a - 1/z)/(1 - (1 - a)/z).
    a = ETA3 * STEP
    frequency = np.geomspace(0.1, 0.5 / STEP, 400)
    z = np.exp(2j * np.pi * frequency * STEP)
    gain = np.abs((1.0 + a - 1.0 / z) / (1.0 - (1.0 - a) / z))
    limit = (2 + a) / (2 - a)
    level = Level(limit, label=f"(2 + a)/(2 − a) = {limit:.3f}", color=colours.GREY, dash="dashed", width=1.5)
    x, y = Axis("frequency [Hz]", scale="log"), Axis("gain from (T − I dω/dt)/R to the force [1]", 0.9, 1.4)
    noise = Figure(
        "force-observer-noise",
        "Gain of the force observer as the paper implements it (200 Hz, integral of the equation's force minus the "
        f"last estimate, a = η₃ Ts = {a:.3f}), started at the measured wheel speed: it smooths nothing and amplifies "
        "the fastest noise, so the wheel acceleration must come filtered. P1 (2) and its implementation note.",
        "The gain is one at low frequency and rises to 1.29 at 100 hertz.",
        Panel([Line(frequency, gain), level], x, y, legend="upper left"), size=(4.8, 3.2),
    )  # fmt: skip
    return PartResult(TOPIC.found("P1-pid-K", "P1-prop1"), figures=[errors, noise])


class Weights(NamedTuple):
    """W0m, W0c, the weight of the 2 N outer points; the sum of the mean's and the variance per axis, which must be one."""

    centre_mean: Fraction
    centre_spread: Fraction
    outer: Fraction
    total: Fraction
    second_moment: Fraction


def weights(size: int, form: Form) -> Weights:
    """For N states with epsilon^2 = 3/N: W_i = (N + eta)/2 as printed, 1/(2 (N + eta)) corrected."""
    centre = (SPREAD - size) / SPREAD
    outer = SPREAD / 2 if form == "printed" else 1 / (2 * SPREAD)
    return Weights(centre, centre + 1 - SPREAD / size + BETA, outer, centre + 2 * size * outer, 2 * outer * SPREAD)


@TOPIC.claim("P1-ukf")
def sums_of_the_weights(printed_form: Form = "printed", sizes: tuple[int, ...] = SIZES) -> Finding:
    """Sums of the weights and second moments in rational numbers, both forms."""
    wrong, right = ([weights(n, form) for n in sizes] for form in (printed_form, FORMS[1]))
    entries = {"outer_weight": "outer", "sum_of_mean_weights": "total", "second_moment": "second_moment"}
    computed = {
        f"N={size}": {
            "N_plus_eta": float(SPREAD), "centre_weights": [float(w.centre_mean), float(w.centre_spread)],
            **{name: {"printed": float(getattr(printed, of)), "corrected": float(getattr(w, of))}
               for name, of in entries.items()},
        }
        for size, printed, w in zip(sizes, wrong, right, strict=True)
    }  # fmt: skip
    sums = ", ".join(f"{w.total} for N = {size}" for size, w in zip(sizes, wrong, strict=True))
    reading = (
        f"(N + eta)/2 gives mean weights that add up to {sums}. 1/(2 (N + eta)) gives {right[0].outer}, "
        f"a sum of {right[0].total} and the right second moment, with tau = sqrt({SPREAD})."
    )
    good = [all(w.total == 1 and w.second_moment == 1 for w in form) for form in (wrong, right)]
    return Finding(computed, erratum(*good), reading)


def filter_lag(process: float, measurement: float, newtons: float) -> float:
    """Slowest time constant in s of the steady filter of (10) for the axle forces, straight ahead.

    Random walk of F_yf, F_yr with covariance `process` I in units of `newtons` N, outputs a_y and dr/dt with `measurement` I
    in m/s^2 and rad/s^2; the front difference is not seen at zero steering and left out.
    """
    C = planar_model(VehicleParameters.published_suv(), np.array(0.0), np.zeros(4)).C[1:, :2] * newtons
    Q, R = process * np.eye(2), measurement * np.eye(2)
    P = solve_discrete_are(np.eye(2), C.T, Q, R)
    update = np.eye(2) - P @ C.T @ np.linalg.inv(C @ P @ C.T + R) @ C
    return float(-STEP / np.log(np.abs(np.linalg.eigvals(update)).max()))


@TOPIC.part("sigma-weights", "Sigma points and covariances of the lateral force filter", 1.0)
def sigma_weights(scope: Scope) -> PartResult:
    """Weights of both papers in both forms, and the lag of the filter in every reading of its covariances."""
    found = {(f"N = {n}", form): weights(n, form) for n, form in product(SIZES, FORMS)}
    weight_table = Table(
        "sigma-weights",
        "Sigma point weights with epsilon = sqrt(3/N), beta = 2 in rational numbers; sum and second moment must be one.",
        ["states", "form", "W0 of the mean", "W0 of the covariance", "W_i", "sum of the mean weights", "second moment"],
        [[*names, *map(str, w)] for names, w in found.items()],
    )
    units = (("N", 1.0), ("kN", 1e3))
    readings = (entry.values() for entry in printed_numbers(PACKAGE)["force_filter"]["readings"])
    lag_table = Table(
        "filter-lag",
        "Slowest time constant of the lateral force filter straight ahead at 200 Hz, for every reading of the printed "
        "covariances Q I and R I: with forces in newtons it cannot follow a lane change, with kilonewtons it can. The unit "
        "is not printed.",
        ["covariances", "unit of force", "Q", "R", "time constant [s]"],
        [[name, unit, Q, R, filter_lag(Q, R, size)] for (name, Q, R), (unit, size) in product(readings, units)],
    )
    marks: list[Mark] = [Level(1.0)]
    names = ("W = (N + η)/2, as printed", "W = 1/(2 (N + η))")
    for form, name, colour, shift in zip(FORMS, names, (colours.RED, colours.BLUE), (-0.19, 0.19), strict=True):
        totals = {k + shift: weights(n, form).total for k, n in enumerate(SIZES)}
        marks.append(Bars([*totals], [*map(float, totals.values())], name, colour, 0.36, alpha=0.85))
        for place, total in totals.items():
            marks.append(Words(place, float(total), str(total), offset=(0, 2), horizontal="center"))
    x = Axis(ticks={0: "N = 3, lateral forces (P1)", 1: "N = 1, wheel force (P2)"})
    figure = Figure(
        "sigma-weights",
        "What the sigma point weights of the mean add up to, as printed and corrected, in both papers; the line "
        "marks one, without which every predicted mean is off by that factor. P1 notes 3, P2 notes 3.",
        "Bars: the printed weights add up to 9 for three states and 11/3 for one, the corrected ones to 1.",
        Panel(marks, x, "sum of the mean weights [1]", legend="upper right"), size=(4.8, 3.0),
    )  # fmt: skip
    return PartResult(TOPIC.found("P1-ukf"), [weight_table, lag_table], [figure])
