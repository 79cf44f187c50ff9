"""Figs 3 to 5: how stability margin and norm move when one tire constant is off by 20 %."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from analysis.labelled import Axis
from analysis.norms import hinf_norm, stability_margin
from analysis.perturbed import PerturbedModel, error_measure
from analysis.sensitivity import OneAtATime, one_at_a_time
from studies.papers.resilient_velocity.setting import DISTURBANCES, Setting
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray

CONSTANTS = ("sigma0", "sigma1", "sigma2", "kappa")
FACTORS = (0.8, 1.2)
CHANGE = 0.2


def _margin(A_e: FloatArray, _: FloatArray) -> FloatArray:
    return stability_margin(A_e)


def _norm(A_e: FloatArray, B_e: FloatArray) -> FloatArray:
    return hinf_norm(A_e, B_e[..., : len(DISTURBANCES)], np.eye(2)).norm


def _deviations(
    setting: Setting, direction: Direction, speeds: FloatArray, name: str, unit: str, measure: Callable[..., FloatArray]
) -> OneAtATime:
    family = PerturbedModel(setting.models[direction])
    return one_at_a_time(
        error_measure(family, setting.gains[direction], measure, wheel_speed=speeds),
        {key: family.nominal[key] for key in CONSTANTS},
        FACTORS,
        axes=(Axis("wheel_speed", speeds, "rad/s"),),
        name=name,
        unit=unit,
    )


def margin_deviations(setting: Setting, direction: Direction, speeds: FloatArray) -> OneAtATime:
    """Stability margin max Re lambda(A_e) in 1/s, axes (parameter, factor, wheel_speed)."""
    return _deviations(setting, direction, speeds, "stability margin", "1/s", _margin)


def norm_deviations(setting: Setting, direction: Direction, speeds: FloatArray) -> OneAtATime:
    """H-infinity norm from both disturbances to both errors, axes (parameter, factor, wheel_speed)."""
    return _deviations(setting, direction, speeds, "H-infinity norm", "1", _norm)


def relative(found: OneAtATime) -> FloatArray:
    """|deviation| / |nominal value|, axes (parameter, factor, wheel_speed)."""
    return np.abs(found.deviations.values) / np.abs(found.nominal.values)
