"""P5-orl, and settings of stiffness and mass in a simulated slalom: what Figs. 10 to 18 of P5 show, on a model."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from studies.claim import ClaimVerdict, Finding, reproduced
from studies.papers.smo_ekf_sideslip.inputs import FACTORS, MASSES, PACKAGE, WHEELBASE, published_car
from studies.papers.smo_ekf_sideslip.observers import LINEAR, Estimates, SimulatedRun, estimates, simulate, with_noise
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Words, dots
from studies.plots.colours import BLUE, GREEN, GREY, ORANGE, RED, TRUTH
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import sample_errors
from studies.trials.histories import backgrounds, setting_lines, truth_line

TOPIC = Topic(PACKAGE)
MODEL_NOTE = (
    "The drive is a single track with the printed car values and axles that saturate at friction 1 (hyperbolic tangent), at "
    "constant speed, without noise: it shows what the equations do. The road tests of the paper are regenerated elsewhere."
)
ERRORS = ("mean error [%]", "std of the error [%]", "estimate / true [1]")
THRESHOLD = 1000.0  # N, lambda_1; not printed
ZONES = (("zones 1, 2: β₁F < 0", RED), ("zones 3, 4: |F| < λ₁", ORANGE), ("zones 5, 6", BLUE))


@TOPIC.claim("P5-orl")
def fixed_stiffness(settings: tuple[float, ...] = FACTORS) -> Finding:
    """Rear sideslip of the observer with F = C beta over the true one, for stiffness settings below, at and above the true."""
    run = simulate(seconds=9.0, friction=LINEAR)
    found = estimates(run, [published_car(stiffness_factor=factor) for factor in settings], adaptive=False)
    turning = run.time > 6.0
    ratio = [estimated_share(rear, run.rear_sideslip[turning]) for rear in found.rear_sideslip[turning].T]
    low, high = ratio[0] - 1.0, ratio[-1] - 1.0
    computed = {
        "stiffness_factors": list(settings), "simulated_rear_sideslip_ratio": ratio,
        "steady_state_ratio": [1.0 / factor for factor in settings]}  # fmt: skip
    otherwise = ClaimVerdict.ERRATUM if low > 0 > high else ClaimVerdict.NOT_REPRODUCED
    return Finding(computed, reproduced(low > 0 and high > 0, otherwise), (
        "The measured force fixes C beta: sideslip comes out as 1/factor. Reduced stiffness overestimates it (factor "
        f"{settings[0]:g}: {ratio[0]:.2f} times the true rear sideslip in the simulated slalom), increased stiffness "
        f"underestimates it (factor {settings[-1]:g}: {ratio[-1]:.2f} times). The text says overestimated for both; the "
        "second must read underestimated."))  # fmt: skip


def estimated_share(estimate: FloatArray, true: FloatArray) -> float:
    """The size of an estimate (n,) against the truth (n,), least squares."""
    return float(estimate @ true / (true @ true))


TOPIC.show("fixed-stiffness", "In which direction a fixed stiffness errs", 2.0)


@TOPIC.part("stiffness-settings", "Fixed and adaptive stiffness in a slalom", 9.0, quick=False)
def stiffness_part(scope: Scope) -> PartResult:
    """Three settings of the stiffness, fixed and adaptive."""
    run, cars = _slalom(scope), [published_car(stiffness_factor=factor) for factor in FACTORS]
    both = estimates(run, cars, adaptive=False), estimates(run, cars)
    return PartResult((), [stiffness_table(run, *both)], [stiffness_figure(run, *both)], [MODEL_NOTE])


@TOPIC.part("zones", "Zones of the sideslip filter", 2.0)
def zones_part(scope: Scope) -> PartResult:
    """The zones of the filter along a noisy slalom."""
    run = with_noise(_slalom(scope))
    return PartResult((), (), [zones(run, estimates(run, [published_car(stiffness_factor=1.5)]))])


@TOPIC.part("mass-settings", "A wrong mass in a slalom", 5.0, quick=False)
def mass_part(scope: Scope) -> PartResult:
    """Three settings of the mass."""
    run = _slalom(scope)
    found = estimates(run, [published_car(mass_change=change) for change in MASSES])
    return PartResult((), [mass_table(run, found)], [mass_figure(run, found)], [MODEL_NOTE])


def _slalom(scope: Scope) -> SimulatedRun:
    return simulate(seconds=11.0 if scope.quick else 18.0)


def _error_cells(run: SimulatedRun, estimate: FloatArray, true: FloatArray) -> list[Cell]:
    """Mean and standard deviation of (8) in %, and the size of the estimate against the true one, from 5 s on."""
    after = run.time > 5.0
    error = sample_errors(estimate[after], true[after])
    return [round(float(error.mean()), 2), round(float(error.std()), 2),
            round(estimated_share(estimate[after], true[after]), 3)]  # fmt: skip


def stiffness_table(run: SimulatedRun, fixed: Estimates, adaptive: Estimates) -> Table:
    """Errors of the rear sideslip by stiffness setting, both observers."""
    rows: list[list[Cell]] = [
        [name, factor, *_error_cells(run, found.rear_sideslip[:, j], run.rear_sideslip)]
        for name, found in (("fixed (ORL)", fixed), ("adaptive (EKF)", adaptive))
        for j, factor in enumerate(FACTORS)
    ]
    return Table("stiffness-settings",
        "Error (8) of the rear sideslip in the simulated slalom (saturating axles, no noise, from 5 s on), and the size of "
        "the estimate against the true one. A model, not the road test of Tables 3 and 4.",
        ("observer", "stiffness setting [1]", *ERRORS), rows)  # fmt: skip


def mass_table(run: SimulatedRun, found: Estimates) -> Table:
    """Errors of forces and sideslip by assumed mass."""
    true = run.body_forces()
    rows: list[list[Cell]] = []
    for j, change in enumerate(MASSES):
        rows += [[change, f"F_y{i + 1}", *_error_cells(run, found.forces[:, j, i], true[:, i])] for i in (0, 1)]
        rows.append([change, "beta_2", *_error_cells(run, found.rear_sideslip[:, j], run.rear_sideslip)])
    return Table("mass-settings",
        "Error (8) in the simulated slalom by assumed mass, and the size of the estimate against the true one: forces scale "
        "with the mass (300 kg are 20.7 %), sideslip does not. A model, not the road test of Table 5.",
        ("mass change [kg]", "quantity", *ERRORS), rows)  # fmt: skip


def _curves(run: SimulatedRun, true: FloatArray, found: FloatArray, labels: list[str]) -> list[Mark]:
    """The truth (n,) and three settings (n, 3)."""
    return [truth_line(run.time, true), *setting_lines(run.time, found.T[:, None], labels)]


def stiffness_figure(run: SimulatedRun, fixed: Estimates, adaptive: Estimates) -> Figure:
    """Figs. 12 to 17 of P5 on a saturating single track."""
    labels = [f"set × {factor:g}" for factor in FACTORS]
    upper, lower = list[Panel](), list[Panel]()
    for found, title in ((fixed, "fixed stiffness (ORL)"), (adaptive, "adaptive stiffness (EKF)")):
        marks = _curves(run, np.degrees(run.rear_sideslip), np.degrees(found.rear_sideslip), labels)
        y = Axis("" if upper else "rear sideslip β₂ [deg]", -8, 8)
        upper.append(Panel(marks, "", y, title, "upper left", columns=2))
    secant = run.forces / np.where(np.abs(run.slips) > np.radians(0.4), run.slips, np.nan)
    for i, name in enumerate(("front", "rear")):
        marks = _curves(run, secant[:, i] / 1e3, adaptive.stiffness[..., i] / 1e3, labels)
        marks[0] = dots(run.time, secant[:, i] / 1e3, "true force / slip angle", GREY, ".", 2.0)
        y = Axis(f"{name} axle stiffness [kN/rad]", 0, 132)
        lower.append(Panel(marks, "time [s]", y, legend="upper left", columns=2))
    return Figure("stiffness-settings",
        "Figs. 12 to 17 of P5 on a model: a slalom (17 m/s, straight for 5 s, lateral acceleration to 0.6 g) of a single "
        "track whose axles saturate, which the observers do not know. Force observer and filter with the stiffness set to "
        "0.5, 1 and 1.5 times the printed one. Above: with fixed stiffness the rear sideslip is too large for the soft "
        "setting and too small for the stiff one; with adaptive stiffness the three settings agree soon after the slalom "
        "begins. Below: the stiffnesses are frozen while driving straight and then converge to common values; the rear one "
        "stays low because the force observer follows the split late.",
        "Upper panels: rear sideslip over time, three spread curves at the left, three nearly equal ones at the right. Lower "
        "panels: front and rear stiffness, constant until 5 s, then converging.",
        [upper, lower], size=(9.4, 5.6), share_x="all")  # fmt: skip


def mass_figure(run: SimulatedRun, found: Estimates) -> Figure:
    """Fig. 18 of P5: forces and sideslip with another assumed mass."""
    labels = [f"m {change:+g} kg" if change else "m" for change in MASSES]
    true = run.body_forces()
    names = [f"{axle} lateral force [kN]" for axle in ("front", "rear")]
    shown = [(name, true[:, i] / 1e3, found.forces[..., i] / 1e3) for i, name in enumerate(names)]
    shown.append(("rear sideslip β₂ [deg]", np.degrees(run.rear_sideslip), np.degrees(found.rear_sideslip)))
    panels = []
    for label, exact, values in shown:
        low, high = (f([f(exact), f(values)]) for f in (np.min, np.max))
        span = high - low  # above it stands the legend
        x, y = Axis("time [s]", 5.0, run.time[-1]), Axis(label, low - 0.05 * span, high + 0.4 * span)
        panels.append(Panel(_curves(run, exact, values, labels), x, y, legend="upper left", columns=2))
    return Figure("mass-settings",
        "Fig. 18 of P5 on a model: the same slalom with the assumed mass 300 kg too small, right, and 300 kg too large. "
        "Forces scale with the assumed mass (they are mass times measured acceleration); the rear sideslip hardly changes, "
        "because mass and force cancel in (10) and the adapted stiffness takes the rest.",
        "Three panels over time: front force, rear force and rear sideslip; force curves differ in size by a fifth, sideslip "
        "curves nearly coincide.",
        panels, size=(9.4, 3.8))  # fmt: skip


def zone_of(slip: FloatArray, force: FloatArray) -> FloatArray:
    """0 for zones 1 and 2 (slip and force disagree), 1 for zones 3 and 4 (small force), 2 for zones 5 and 6 (P5 notes 5)."""
    return np.where(slip * force < 0.0, 0, np.where(np.abs(force) < THRESHOLD, 1, 2))


def zones(run: SimulatedRun, found: Estimates) -> Figure:
    """Figs. 10 and 11: the zones in the plane of front slip angle and force, along a slalom, for one setting."""
    # beta_1 of the estimate from its beta_2: by (11) the two differ by measured quantities alone.
    slip = found.rear_sideslip[:, 0] + run.steering - WHEELBASE * run.yaw_rate / run.speed
    force = found.forces[:, 0, 0] * np.cos(run.steering) - found.forces[:, 0, 2] * np.sin(run.steering)
    stiffness = found.stiffness[:, 0, 0] / 1e3
    kind, ends = zone_of(slip, force), np.array([-5.5, 5.5])
    plane: list[Mark] = [
        dots(np.degrees(slip[kind == k]), force[kind == k] / 1e3, name, color, ".", 3.5)
        for k, (name, color) in enumerate(ZONES)
    ]
    first, last = (value * np.radians(ends) for value in stiffness[[0, -1]])
    plane.append(Line(ends, first, "(C₁ + ΔC₁) β₁ at the start", TRUTH, "dashed", 1.2))
    plane.append(Line(ends, last, "(C₁ + ΔC₁) β₁ at the end", GREEN, width=1.2))
    for level, text in ((-1e-3 * THRESHOLD, "−λ₁"), (1e-3 * THRESHOLD, "λ₁")):
        plane.append(Level(y=level, color=GREY, dash="dotted"))
        plane.append(Words(5.4, level, text, horizontal="right", vertical="bottom"))
    background = backgrounds(run.time, kind, [("", color) for _, color in ZONES], alpha=0.35)
    return Figure("zones",
        "Figs. 10 and 11 of P5 on a model: estimated front lateral force over estimated front slip angle in a slalom with "
        "saturating axles (17 m/s, 0.6 g, noise on yaw rate and accelerations; stiffness set to 1.5 times the printed one), "
        "coloured by the zones that switch the covariances, with the threshold λ₁ = 1 kN (not printed). Right: the adapted "
        "front stiffness moves in zones 5 and 6 and is frozen elsewhere.",
        "Left: a band of points through the origin, red and orange near the axes, blue outside, with two straight lines. "
        "Right: stiffness over time that moves where the background is blue.",
        [Panel(plane, Axis("estimated front slip angle β₁ [deg]", -5.5, 5.5),
               Axis("estimated front lateral force [kN]", -8, 8), legend="upper left"),
         Panel([*background, Line(run.time, stiffness, color=TRUTH)], Axis("time [s]", run.time[0], run.time[-1]),
               "C₁ + ΔC₁ [kN/rad]", "stiffness over time; background: zone", grid=False)],
        size=(9.2, 4.0), widths=(1.1, 1.0))  # fmt: skip
