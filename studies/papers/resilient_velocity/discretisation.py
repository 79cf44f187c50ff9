"""Remark 1, (10): what becomes of the printed continuous gains under the discretisations that it allows (P3 notes 9 item 10)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from analysis.markov.second_moment import spectral_radius
from estimators.arrays import FloatArray
from studies.claim import ClaimVerdict, Finding, JsonValue, reproduced
from studies.papers.plain import by_speed, column_table
from studies.papers.resilient_velocity.inputs import PACKAGE, PRINTED, SPEEDS, Setting, printed_gain
from studies.papers.topic import Topic
from studies.study import Table
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import load_parameter_set

TOPIC = Topic(PACKAGE)
SHOWN = np.array([0.0, 40.0, 140.0])
SAMPLE_RATES = (100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0)  # Hz
Update = Callable[[FloatArray, FloatArray, FloatArray, float], FloatArray]


def held(A: FloatArray, L: FloatArray, T: float) -> tuple[FloatArray, FloatArray]:
    """exp(A T) and int exp(A s) ds L."""
    return zero_order_hold(A, np.broadcast_to(L, (*A.shape[:-1], 1)), T)


def innovation_held(A: FloatArray, L: FloatArray, C: FloatArray, T: float) -> FloatArray:
    """exp(A T) - int exp(A s) ds L C: (10) word for word, with the innovation as a second input that is held."""
    Phi, Gamma = held(A, L, T)
    return Phi - Gamma @ C


READINGS: Mapping[str, Update] = {
    "closed_loop": lambda A, L, C, T: held(A - L @ C, L, T)[0],  # the observer runs inside the sample
    "innovation_held": innovation_held,
    "correction_added": lambda A, L, C, T: held(A, L, T)[0] - T * L @ C,
    "forward_euler": lambda A, L, C, T: np.eye(A.shape[-1]) + T * (A - L @ C),
}
"""Update of the error from A, L, C and the sample time."""


def radii(model: LpvModel, gain: ArrayLike, sample_time: float, update: Update, speeds: FloatArray) -> FloatArray:
    """Spectral radius (g,) of the error update under one reading."""
    numeric = model.on(speeds)
    return spectral_radius(update(numeric.A, np.reshape(gain, (2, 1)), numeric.C, sample_time))


@TOPIC.claim("P3-zoh")
def zero_order_hold_reading(setting: Setting = PRINTED) -> Finding:
    """Stable or not depends on what exactly is held."""
    T, own = setting.sample_time, (setting.models["longitudinal"], setting.gains["longitudinal"])
    first = load_parameter_set("corner-estimation")
    earlier = (corner_velocity_model(first, "longitudinal", SPEEDS[-1]), printed_gain(first, "longitudinal"))
    computed, stable = dict[str, JsonValue](), dict[str, bool]()
    for name, update in READINGS.items():
        over = radii(*own, T, update, SPEEDS)
        stable[name.replace("_", " ")] = bool((over < 1.0).all())
        computed[name] = by_speed(SHOWN, radii(*own, T, update, SHOWN))
        computed[f"{name}_largest"] = float(over.max())
    computed["gains_of_P1_innovation_held"] = by_speed(SHOWN, radii(*earlier, T, innovation_held, SHOWN))
    good, bad = (", ".join(name for name, ok in stable.items() if ok is wanted) for wanted in (True, False))
    otherwise = ClaimVerdict.UNDER_SPECIFIED if any(stable.values()) else ClaimVerdict.NOT_REPRODUCED
    return Finding(computed, reproduced(all(stable.values()), otherwise), (
        f"At {1.0 / T:g} Hz the printed longitudinal gain is stable as: {good or 'nothing'}; unstable as: {bad or 'nothing'}. "
        f"Held innovation, which is (10) word for word, has the radius {computed['innovation_held']['0']:.2f} at standstill; "
        "the closed loop must be discretised, exp((A - L C) T)."))  # fmt: skip


def _table() -> Table:
    columns: dict[str, ArrayLike] = {"sample rate [Hz]": SAMPLE_RATES}
    for d, model in PRINTED.models.items():
        for name, update in READINGS.items():
            found = [radii(model, PRINTED.gains[d], 1.0 / rate, update, SPEEDS[::2]).max() for rate in SAMPLE_RATES]
            columns[f"{d}, {name.replace('_', ' ')} [1]"] = found
    return column_table("sampling",
        "Largest spectral radius of the error update over 0 to 140 rad/s with the printed gains, for four readings of the "
        "discretisation; above 1 the observer diverges.", columns)  # fmt: skip


TOPIC.show("sampling", "What the printed gains need from the discretisation", 0.3, tables=[_table])
