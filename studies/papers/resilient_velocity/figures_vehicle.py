"""The suspension compliance (14) and the steady LuGre tire (1), (2)."""

from __future__ import annotations

import numpy as np

from estimators.velocity import SuspensionCompliance
from studies.papers.resilient_velocity.claims_friction import ROADS
from studies.papers.resilient_velocity.claims_suspension import oscillator, table_of_estimator
from studies.papers.resilient_velocity.friction import SPEED, peak, steady
from studies.papers.resilient_velocity.ink import COLOUR, SERIES, sheet
from studies.papers.resilient_velocity.setting import DIRECTIONS, PRINTED, Setting
from studies.plots.colours import GREY
from studies.study import Drawing
from synthesis.polynomials.matrix import FloatArray

FORCE = 3000.0  # N, a hard brake or curve at one wheel
DURATION = 0.2  # s


def suspension_figure(setting: Setting = PRINTED) -> Drawing:
    """Response of the wheel velocity to a force step, with the runtime at 200 Hz on it, and over frequency."""
    figure = sheet(9.2, 3.7)
    left, right = figure.subplots(1, 2)
    fastest = 0.0
    time = np.linspace(0.0, DURATION, 801)
    samples = np.arange(1, round(DURATION / setting.sample_time) + 1) * setting.sample_time
    runtime = _runtime(setting, len(samples))
    hertz = np.geomspace(0.5, 100.0, 400)
    for k, (direction, dash) in enumerate(zip(DIRECTIONS, ("-", (0, (6, 2))), strict=True)):
        A, B = oscillator(setting, direction)
        decay, swing = -0.5 * A[1, 1], np.sqrt(-A[1, 0] - 0.25 * A[1, 1] ** 2)
        response = FORCE * B[1, 0] / swing * np.exp(-decay * time) * np.sin(swing * time)
        fastest = max(fastest, float(response.max()))
        left.plot(1e3 * time, response, color=COLOUR[direction], ls=dash, lw=1.7, label=direction)
        left.plot(1e3 * samples, runtime[:, k], "o", color=COLOUR[direction], ms=3.2)
        s = 2j * np.pi * hertz
        gain = np.abs(s * B[1, 0] / (s**2 - A[1, 1] * s - A[1, 0]))
        right.plot(hertz, 1e3 * gain * 1e3, color=COLOUR[direction], ls=dash, lw=1.7, label=direction)
        peak_at = np.sqrt(-A[1, 0]) / (2.0 * np.pi)
        right.axvline(peak_at, color=COLOUR[direction], lw=0.8, ls=":")
        right.annotate(
            f"{peak_at:.1f} Hz",
            (peak_at, 8.0 + 22.0 * k),
            (3, 0),
            textcoords="offset points",
            color=COLOUR[direction],
            fontsize=8,
        )
    left.axhline(0.0, color=GREY, lw=0.8)
    left.set_xlabel("time after the step [ms]")
    left.set_ylabel("wheel against body [m/s]")
    left.set_title(f"force step of {FORCE / 1e3:g} kN", loc="left")
    left.legend(loc="upper right")
    right.set_xscale("log")
    right.set_xlim(0.5, 100.0)
    right.set_ylim(bottom=0.0)
    right.set_xlabel("frequency of the force [Hz]")
    right.set_ylabel("velocity amplitude [mm/s per kN]")
    right.set_title("frequency response", loc="left")
    return Drawing(
        "suspension-compliance",
        "Suspension compliance (14) with Table I: velocity of a wheel against the body after a step of the tire "
        "force (left; lines: continuous model, dots: the runtime estimator at 200 Hz, exact for held forces) and "
        "its amplitude over the frequency of the force (right; dotted: natural frequencies). A step of 3 kN moves "
        f"a wheel at up to {fastest:.2f} m/s against the body within some hundredths of a second, which a slip "
        "computed without it takes for slip.",
        "Left: two damped oscillations, the longitudinal one peaking at 0.44 m/s. Right: two resonance curves with "
        "equal peaks at 12.9 and 19.6 Hz.",
        figure,
    )


def _runtime(setting: Setting, steps: int) -> FloatArray:
    """Velocities (steps, 2) of one corner from the shipped estimator."""
    compliance = SuspensionCompliance(table_of_estimator(setting), setting.sample_time)
    force = np.full(4, FORCE)
    return np.stack([compliance.step(force, force).velocity[0] for _ in range(steps)])


def friction_figure(setting: Setting = PRINTED) -> Drawing:
    """Steady force over slip velocity, and the friction disturbance that the observers do not know."""
    figure = sheet(9.2, 3.9)
    left, right = figure.subplots(1, 2)
    v = np.linspace(0.0, 13.0, 1301)
    pairs = [(d, road) for d in DIRECTIONS for road in ROADS]
    for (direction, road), (colour, dash) in zip(pairs, SERIES, strict=False):
        found = steady(setting, direction, v, road)
        left.plot(v, found.force, color=colour, ls=dash, lw=1.7, label=f"{direction}, θ = {road:g}")
        right.plot(v[1:], np.abs(found.disturbance[1:]) / v[1:], color=colour, ls=dash, lw=1.7)
        if direction == "longitudinal":  # the softer lateral tire rises all the way
            left.plot(*peak(setting, direction, road), "o", mfc="white", mec=colour, ms=5)
    for axis in (left, right):
        axis.set_xlabel("slip velocity v [m/s]")
        axis.set_ylim(bottom=0.0)
    left.set_xlim(0.0, v[-1])
    right.set_xlim(v[1], v[-1])
    right.set_xscale("log")
    right.set_ylim(0.0, 1.0)
    left.set_ylabel("normalised force f [1]")
    right.set_ylabel("share |ϱ| / |v| [1]")
    right.set_title("slip velocity hidden by friction", loc="left")
    left.set_title("steady force", loc="left")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return Drawing(
        "lugre-curves",
        f"Steady average lumped LuGre tire (1), (2) with Table I at {SPEED:g} rad/s (13.2 m/s): normalised force "
        "over slip velocity on a dry (θ = 1) and a slippery road (θ = 0.3), circles at the first maximum (left), "
        "and the friction term that the linear observer models treat as a disturbance, as a share of the slip "
        "velocity (right). It never exceeds the slip velocity, and nearly reaches it once the tire slides: then "
        "the force says little about slip.",
        "Left: force curves rising to a plateau, 0.92 on dry road and 0.29 on the slippery one. Right: shares "
        "rising from zero towards one, first for the longitudinal tire on the slippery road.",
        figure,
    )
