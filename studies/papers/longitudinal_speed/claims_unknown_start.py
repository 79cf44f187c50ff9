"""P2-test1, P2-test2: how fast the filter forgets an initial covariance of which nothing is known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from studies.claim import ClaimFunction, Finding, judged
from studies.papers.longitudinal_speed.inputs import (
    WheelRecord,
    accelerating,
    constant,
    noise,
    parameters,
    printed_value,
    sample_time,
)
from studies.papers.longitudinal_speed.unknown_start import (
    RAMP,
    SPEEDS,
    STRUCTURES,
    both_tests,
    settling,
    standard_settlings,
    time_to_zero,
    two_states,
)
from studies.papers.verdicts import under_specified


def time_of_test_1(readings: Mapping[str, float] | None = None) -> Finding:
    """When M is zero: while accelerating, at constant speed, without the third state; and how far it has decayed at 0.03 s."""
    printed = float(printed_value("P2-test1"))
    samples = round(printed / sample_time())
    steady = {speed: both_tests(constant(speed, 40)).largest_unknown for speed in SPEEDS}
    moving = both_tests(accelerating(SPEEDS[0], RAMP, 13, 13))
    found = (
        {
            "three states, accelerating": time_to_zero(moving),
            "three states, constant speed": time_to_zero(both_tests(constant(SPEEDS[0], 400))),
            "two states": time_to_zero(two_states()),
        }
        if readings is None
        else dict(readings)
    )
    a = parameters().tire["longitudinal"].kappa.value * parameters().vehicle["effective_radius"].value
    rate = {speed: float(np.log(values[5] / values[6]) / sample_time()) for speed, values in steady.items()}
    computed = {
        "seconds_to_zero": {name: value if np.isfinite(value) else "never" for name, value in found.items()},
        f"left_after_{samples}_samples": {
            f"{speed:g} rad/s": float(values[samples]) for speed, values in steady.items()
        },
        "decay_rate_1_s": {f"{speed:g} rad/s": value for speed, value in rate.items()},
        "twice_kappa_R_omega_1_s": {f"{speed:g} rad/s": 2.0 * a * speed for speed in SPEEDS},
    }
    shown = ", ".join(
        f"{value:g} s ({name})" if np.isfinite(value) else f"never ({name})" for name, value in found.items()
    )
    reading = (
        f"M is exactly zero after {shown}. At constant speed it decays with 2 kappa R_e omega and is "
        f"{steady[SPEEDS[0]][samples]:.2e} at {printed:g} s and {SPEEDS[0]:g} rad/s, "
        f"{steady[SPEEDS[1]][samples]:.1e} at {SPEEDS[1]:g} rad/s. The printed {printed:g} s fits a decay to some "
        "unprinted level, or a late start; the theory needs as many samples as states."
    )
    values = list(found.values())
    spread = max(values) - min(values) if np.isfinite(values).all() else np.inf
    agree = all(abs(value - printed) <= sample_time() for value in values)
    return Finding(computed, under_specified(spread, sample_time() / 2, agree), reading)


def bound_of_test_2(records: Mapping[str, WheelRecord] | None = None) -> Finding:
    """Peak and end of lambda_max(N), for each reading of Q and each record, against the Riccati solution."""
    q, _ = noise()
    found = (
        standard_settlings()
        if records is None
        else {(name, s): settling(record, s) for s in STRUCTURES for name, record in records.items()}
    )
    computed = {
        f"{name}, Q = {q:g} {s}": {
            "peak": float(f"{one.peak:.6g}"), "at_sample": one.peak_sample,
            "last": one.last, "riccati": one.limit, "bounded": one.bounded,
        }
        for (name, s), one in found.items()
    }  # fmt: skip
    (record, structure), first = next(iter(found.items()))
    largest = max(one.peak for one in found.values())
    bounded = sum(one.bounded for one in found.values())
    reading = (
        f"lambda_max(N) ends at the Riccati solution in {bounded} of {len(found)} cases (records and readings of "
        f"the scalar Q), so it is bounded there: {first.last:.3g} after a peak of {first.peak:.3g} for the record "
        f"'{record}' and Q = q {structure}. What is bounded can be useless: the peak reaches {largest:.3g} where "
        "nearly silent data is taken as seen, so the rank tolerance decides the look of Fig. 3."
    )
    return Finding(computed, judged(bounded == len(found)), reading)


CLAIMS: dict[str, ClaimFunction] = {"P2-test1": time_of_test_1, "P2-test2": bound_of_test_2}
