"""P2-test1, P2-test2: how fast the filter forgets an initial covariance of which nothing is known (Lemma 1, (25)-(27)).

Both tests run along wheel speed histories, in every reading that P2 leaves open.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from scipy.linalg import solve_discrete_are

from analysis.observability import stochastic
from studies.claim import Finding, reproduced
from studies.papers.longitudinal_speed import inputs
from studies.papers.verdicts import under_specified
from studies.plots import Axis, Dash, Figure, Level, Line, Mark, Panel, colours, dots
from studies.study import PartResult, Scope, Table
from synthesis.models.catalogue.corner import corner_velocity_model

TOPIC = inputs.topic()
SPEEDS = (40.0, 100.0)  # rad/s, 13 and 33 m/s
STRUCTURES = {"I": 1600, "B B'": 600, "B_k B_k'": 600}  # samples until N has settled to 1e-3; the first is slow
RAMP = 100.0  # rad/s^2, a wheel that spins up on slippery ground
Tests = stochastic.StochasticObservability
Curve = tuple[str, Tests, str, Dash]  # label, tests, colour, dash


def both_tests(record: inputs.WheelRecord, structure: str = "I", tolerance: float = stochastic.RANK_TOLERANCE) -> Tests:
    """M and N of (26) along a record with Q = 2.5e-3 S and R = 1e-3."""
    (q, R), s = inputs.noise(), record.sequence
    return stochastic.stochastic_observability(s.A, s.C, q * inputs.structures(s)[structure], R, tolerance)


def two_states(samples: int) -> Tests:
    """The same without the redundant third state: z and V_r alone, accelerating."""
    q, R = inputs.noise()
    record = inputs.accelerating(SPEEDS[0], RAMP, samples, samples)
    model = corner_velocity_model(inputs.parameters(), "longitudinal")
    return stochastic.stochastic_observability_along(model, record.speed, inputs.SAMPLE_TIME, q * np.eye(2), R)


def time_to_zero(found: Tests) -> float:
    """Seconds after which M is exactly zero; inf if not on this record."""
    return np.inf if found.samples_needed is None else found.samples_needed * inputs.SAMPLE_TIME


@TOPIC.claim("P2-test1")
def time_of_test_1(readings: Mapping[str, float] | None = None) -> Finding:
    """When M is zero: while accelerating, at constant speed, without the third state; and how far it has decayed at 0.03 s."""
    printed = float(TOPIC.printed("P2-test1"))
    samples = round(printed / inputs.SAMPLE_TIME)
    steady = {f"{w:g} rad/s": both_tests(inputs.constant(w, 40)).largest_unknown for w in SPEEDS}
    left = {name: float(M[samples]) for name, M in steady.items()}
    found = readings or {
        "three states, accelerating": time_to_zero(both_tests(inputs.accelerating(SPEEDS[0], RAMP, 13, 13))),
        "three states, constant speed": time_to_zero(both_tests(inputs.constant(SPEEDS[0], 400))),
        "two states": time_to_zero(two_states(13)),
    }
    a = inputs.parameters().tire["longitudinal"].kappa.value * inputs.parameters().vehicle["effective_radius"].value
    computed = {
        "seconds_to_zero": {name: value if np.isfinite(value) else "never" for name, value in found.items()},
        f"left_after_{samples}_samples": left,
        "decay_rate_1_s": {name: float(np.log(M[5] / M[6]) / inputs.SAMPLE_TIME) for name, M in steady.items()},
        "twice_kappa_R_omega_1_s": {f"{w:g} rad/s": float(2.0 * a * w) for w in SPEEDS},
    }
    times = {name: f"{value:g} s" if np.isfinite(value) else "never" for name, value in found.items()}
    first, second = (f"{size:{form}}" for size, form in zip(left.values(), (".2e", ".1e"), strict=True))
    reading = (
        f"M is exactly zero after {', '.join(f'{time} ({name})' for name, time in times.items())}. At constant speed it "
        f"decays with 2 kappa R_e omega and is {first} at {printed:g} s and {SPEEDS[0]:g} rad/s, {second} at "
        f"{SPEEDS[1]:g} rad/s. The printed {printed:g} s fits a decay to some unprinted level, or a late start; the theory "
        "needs as many samples as states."
    )
    values = list(found.values())
    spread = max(values) - min(values) if np.isfinite(values).all() else np.inf
    agree = all(abs(value - printed) <= inputs.SAMPLE_TIME for value in values)
    return Finding(computed, under_specified(spread, inputs.SAMPLE_TIME / 2, agree), reading)


def settling(record: inputs.WheelRecord, structure: str = "I") -> dict[str, Any]:
    """Test 2 on a record that ends at a constant speed: the peak of lambda_max(N), when, and where it ends.

    It must end at `riccati`, the stabilising solution at the last speed (inf: there is none); `bounded`: it did, to 1e-3.
    """
    known, s, (q, R) = both_tests(record, structure).largest_known, record.sequence, inputs.noise()
    try:
        steady = solve_discrete_are(s.A[-1].T, s.C[-1].T, q * inputs.structures(s)[structure][-1], R)
        limit = float(np.linalg.eigvalsh(steady)[-1])
    except np.linalg.LinAlgError:  # an undetectable mode on the unit circle: no stabilising solution exists
        limit = np.inf
    peak, last = float(known.max()), float(known[-1])
    return {
        "peak": float(f"{peak:.6g}"), "at_sample": int(known.argmax()), "last": last, "riccati": limit,
        "bounded": bool(np.isfinite(peak) and abs(last - limit) <= 1e-3 * limit),
    }  # fmt: skip


@TOPIC.claim("P2-test2")
def bound_of_test_2(records: Mapping[str, inputs.WheelRecord] | None = None) -> Finding:
    """Peak and end of lambda_max(N), for each reading of Q and each record, against the Riccati solution."""
    computed = {}
    for structure, samples in STRUCTURES.items():
        spun_up = inputs.accelerating(SPEEDS[0], RAMP, 60, samples)
        tried = records or {"constant": inputs.constant(SPEEDS[0], samples), "accelerating": spun_up}
        for name, record in tried.items():
            computed[f"{name}, Q = {inputs.noise()[0]:g} {structure}"] = settling(record, structure)
    cases = list(computed.values())
    bounded, largest = sum(one["bounded"] for one in cases), max(one["peak"] for one in cases)
    reading = (
        f"lambda_max(N) ends at the Riccati solution in {bounded} of {len(cases)} cases (records and readings of the scalar "
        f"Q), so it is bounded there: {cases[0]['last']:.3g} after a peak of {cases[0]['peak']:.3g} for the record "
        f"'{next(iter(tried))}' and Q = q I. What is bounded can be useless: the peak reaches {largest:.3g} where nearly silent "
        "data is taken as seen, so the rank tolerance decides the look of Fig. 3."
    )
    return Finding(computed, reproduced(bounded == len(cases)), reading)


@TOPIC.part("first-test", "Forgetting an unknown start (Figs 2 and 3)", 2.0)
def first_test(scope: Scope) -> PartResult:
    """Figs 2 and 3, and when M is zero."""
    claims = TOPIC.found("P2-test1")
    rows = list(claims[0].finding.computed["seconds_to_zero"].items())
    caption = f"Test 1 of P2: seconds until M is exactly zero at {1 / inputs.SAMPLE_TIME:g} Hz; Fig. 2 of the paper reads 0.03 s."
    moving, turning = inputs.accelerating(SPEEDS[0], RAMP, 40, 80), inputs.slalom(45.0, 4.0, 0.5, 0.4)
    curves: tuple[Curve, ...] = (
        ("constant 40 rad/s", both_tests(inputs.constant(SPEEDS[0], 80)), colours.BLUE, "solid"),
        ("constant 100 rad/s", both_tests(inputs.constant(SPEEDS[1], 80)), colours.GREEN, "dashed"),
        (moving.name, both_tests(moving), colours.RED, "dash-dot"),
        ("slalom, rank tolerance 1e-9", both_tests(turning), colours.ORANGE, "dotted"),
        ("slalom, rank tolerance 1e-2", both_tests(turning, tolerance=1e-2), colours.PURPLE, "dashed"),
        ("two states, accelerating", two_states(80), colours.GREY, "solid"),
    )
    panels = covariance_panels(curves, Axis("time [s]", 0.0, 0.1), round(0.1 / inputs.SAMPLE_TIME) + 1, 1e-9)
    figure = Figure(
        "unknown-start",
        "Both tests for an initial covariance of which nothing is known (200 Hz, Q = 2.5e-3 I, R = 1e-3). Left: M ends at "
        "exactly zero (the line stops at a cross) after as many samples as states while the wheel accelerates, and decays "
        "for ever at constant speed. Right: N stays bounded, but peaks beyond all use where nearly silent data is taken as "
        "seen; a coarser rank tolerance keeps it small. Figs 2 and 3 of P2, on wheel speeds of our own.",
        "Left: lines that stop after two or three samples, and two straight decays. Right: peaks between 0.1 and 1e8 that "
        "fall off.",
        panels, legend="below", columns=3,
    )  # fmt: skip
    return PartResult(claims, [Table("test-1", caption, ["reading", "seconds to zero [s]"], rows)], [figure])


@TOPIC.part("second-test", "Bounded covariance after an unknown start", 5.0)
def second_test(scope: Scope) -> PartResult:
    """Whether N is bounded: its peak and end in every reading."""
    claims = TOPIC.found("P2-test2")
    rows = [[name, *entry.values()] for name, entry in claims[0].finding.computed.items()]
    columns = [
        "record, reading of Q",
        "peak of lambda_max(N)",
        "at sample",
        "at the end",
        "Riccati solution",
        "bounded",
    ]
    caption = (
        "Test 2 of P2: largest eigenvalue of N along 8 s at 200 Hz, 40 rad/s constant, or 0.3 s of 100 rad/s^2 before, for "
        "three readings of the printed scalar Q; rank tolerance 1e-9. State units: m, m/s, m/s."
    )
    return PartResult(claims, [Table("test-2", caption, columns, rows)])


def covariance_panels(
    curves: Iterable[Curve], time: Axis, end: int | None = None, low: float | None = None
) -> list[Panel]:
    """Both tests over the first ``end`` samples, with what Fig. 2 reads; a cross ends the line where M is exactly zero."""
    left, right = list[Mark](), list[Mark]()
    for name, found, color, dash in curves:
        seconds = inputs.SAMPLE_TIME * np.arange(len(found.M))[:end]
        unknown, known, zero = found.largest_unknown[:end], found.largest_known[:end], found.samples_needed
        left.append(Line(seconds[:zero], unknown[:zero], name, color, dash, marker="."))
        right.append(Line(seconds[1:], known[1:], "", color, dash, marker="."))
        if zero:
            left.append(dots(seconds[zero - 1 : zero], unknown[zero - 1 : zero], "", color, "x", 9))
    printed = float(TOPIC.printed("P2-test1"))
    left.append(Level(x=printed, label=f"{printed:g} s, Fig. 2", dash="dotted", width=0.9))
    unknown_axis = Axis("λmax(M), 1 at the start [1]", low, None if low is None else 2.0, "log")
    known_axis = Axis("λmax(N) [1, states in m and m/s]", scale="log")
    first = Panel(left, time, unknown_axis, "test 1: what is still unknown")
    return [first, Panel(right, time, known_axis, "test 2: covariance of what is known")]
