"""The floor: what the friction term hides from any observer of this structure.

At rest of the bristle P1 (18) gives, with a = kappa R_e |w| and theta the friction level (g about 1),

    z = v_r/(a + sigma0 |v_r|/theta),   Omega_z = -sigma0 |v_r| z/theta = -v_r s/(1 + s),   s = sigma0 |v_r|/(theta a).

The static gain from Omega_z to the velocity error is -sigma0/(sigma0 + sigma2 a) for every gain with L_2 != 0
(:func:`analysis.dc_floor.static_gain`), so the share of the slip velocity that is missed,

    (v_r - v_r_hat)/v_r = s/(1 + s) sigma0/(sigma0 + sigma2 a),   s = (sigma0/kappa) |lambda|/theta,   lambda = v_r/(R_e w),

depends on slip, friction and tire alone. No gain, schedule or degree changes it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from studies.truth.lugre import LuGreParameters
from synthesis.models.parameter_set import Tire

Array = npt.NDArray[np.float64]


def hidden_ratio(tire: Tire, slip: npt.ArrayLike, friction: npt.ArrayLike) -> Array:
    """s = (sigma0/kappa) |lambda|/theta [1]: the slip that friction hides over the slip that deflects the bristles."""
    stiffness = tire.sigma0.value / tire.kappa.value
    return np.asarray(stiffness * np.abs(slip) / np.asarray(friction))


def missed_share(
    tire: Tire, radius: float, wheel_speed: npt.ArrayLike, slip: npt.ArrayLike, friction: npt.ArrayLike
) -> Array:
    """(v_r - v_r_hat)/v_r [1] at rest; ``wheel_speed`` rad/s, ``slip`` v_r/(R_e w), ``friction`` theta, broadcast."""
    s = hidden_ratio(tire, slip, friction)
    a = tire.kappa.value * radius * np.abs(np.asarray(wheel_speed))
    return np.asarray(s / (1.0 + s) * tire.sigma0.value / (tire.sigma0.value + tire.sigma2.value * a))


def resting_force(
    tire: Tire, radius: float, wheel_speed: npt.ArrayLike, slip: npt.ArrayLike, friction: npt.ArrayLike
) -> Array:
    """mu = sigma0 z + sigma2 v_r of P1 (19) with the bristle at rest: what a force sensor would say."""
    speed = radius * np.asarray(wheel_speed)
    relative = np.asarray(slip) * speed
    rate = tire.kappa.value * np.abs(speed) + tire.sigma0.value * np.abs(relative) / np.asarray(friction)
    return np.asarray(tire.sigma0.value * relative / rate + tire.sigma2.value * relative)


def friction_curve(tire: LuGreParameters, relative: npt.ArrayLike) -> Array:
    """g(v_r) [1] of P1 below (19) with exponent 0.5: falls from mu_s to mu_c over the Stribeck velocity; v_r in m/s."""
    fall = np.exp(-np.sqrt(np.abs(relative) / tire.stribeck))
    return np.asarray(tire.sliding + (tire.static - tire.sliding) * fall)
