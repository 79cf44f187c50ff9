"""Remark 1, (10): what becomes of the printed continuous gains under the discretisations that the text allows."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from analysis.second_moment import spectral_radius
from studies.claim import ClaimFunction, ClaimVerdict, Finding
from studies.papers.plain import by_speed
from studies.papers.resilient_velocity.setting import HIGHEST_SPEED, PRINTED, Gain, Setting
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import load_parameter_set
from synthesis.polynomials.matrix import FloatArray

SHOWN = np.array([0.0, 40.0, 140.0])
SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 141)
Update = Callable[[FloatArray, FloatArray, FloatArray, float], FloatArray]


def closed_loop(A: FloatArray, L: FloatArray, C: FloatArray, T: float) -> FloatArray:
    """exp((A - L C) T): the observer runs inside the sample."""
    return zero_order_hold(A - L @ C, np.broadcast_to(L, (*A.shape[:-1], 1)), T)[0]


def innovation_held(A: FloatArray, L: FloatArray, C: FloatArray, T: float) -> FloatArray:
    """exp(A T) - int exp(A s) ds L C: (10) word for word, with the innovation as a second input that is held."""
    Phi, Gamma = zero_order_hold(A, np.broadcast_to(L, (*A.shape[:-1], 1)), T)
    return Phi - Gamma @ C


def correction_added(A: FloatArray, L: FloatArray, C: FloatArray, T: float) -> FloatArray:
    """exp(A T) - T L C."""
    return zero_order_hold(A, np.broadcast_to(L, (*A.shape[:-1], 1)), T)[0] - T * L @ C


def forward_euler(A: FloatArray, L: FloatArray, C: FloatArray, T: float) -> FloatArray:
    """I + (A - L C) T."""
    return np.eye(A.shape[-1]) + T * (A - L @ C)


READINGS: Mapping[str, Update] = {
    "closed_loop": closed_loop,
    "innovation_held": innovation_held,
    "correction_added": correction_added,
    "forward_euler": forward_euler,
}


def radii(model: LpvModel, gain: Gain, sample_time: float, update: Update, speeds: FloatArray) -> FloatArray:
    """Spectral radius (g,) of the error update under one reading."""
    numeric = model.on(speeds)
    return spectral_radius(update(numeric.A, np.reshape(gain, (2, 1)), numeric.C, sample_time))


def zero_order_hold_reading(setting: Setting = PRINTED) -> Finding:
    """P3-zoh: stable or not depends on what exactly is held."""
    own = (setting.models["longitudinal"], setting.gains["longitudinal"])
    first = load_parameter_set("corner-estimation")
    published = first.tire["longitudinal"].published
    if published is None or published.gains is None:
        raise ValueError("the set 'corner-estimation' has no published longitudinal gains")
    earlier = (corner_velocity_model(first, "longitudinal", HIGHEST_SPEED), (published.gains[0], published.gains[1]))
    computed: dict[str, object] = {}
    stable: dict[str, bool] = {}
    for name, update in READINGS.items():
        over = radii(*own, setting.sample_time, update, SPEEDS)
        stable[name] = bool((over < 1.0).all())
        computed[name] = by_speed(SHOWN, radii(*own, setting.sample_time, update, SHOWN))
        computed[f"{name}_largest"] = float(over.max())
    computed["gains_of_P1_innovation_held"] = by_speed(
        SHOWN, radii(*earlier, setting.sample_time, innovation_held, SHOWN)
    )
    if all(stable.values()):
        verdict = ClaimVerdict.REPRODUCED
    else:
        verdict = ClaimVerdict.UNDER_SPECIFIED if any(stable.values()) else ClaimVerdict.NOT_REPRODUCED
    good = [name.replace("_", " ") for name, ok in stable.items() if ok]
    bad = [name.replace("_", " ") for name, ok in stable.items() if not ok]
    return Finding(
        computed,
        verdict,
        f"At {1.0 / setting.sample_time:g} Hz the printed longitudinal gain is stable as: "
        f"{', '.join(good) or 'nothing'}; unstable as: {', '.join(bad) or 'nothing'}. Held innovation, which is "
        f"(10) word for word, has the radius {radii(*own, setting.sample_time, innovation_held, SHOWN)[0]:.2f} at "
        "standstill; the closed loop must be discretised, exp((A - L C) T).",
    )


CLAIMS: dict[str, ClaimFunction] = {"P3-zoh": zero_order_hold_reading}
