"""Slip of a wheel from its surface speed and the velocity of its centre in the tire frame.

Sign conventions of this module, those of P1: slip ratio positive when driving; slip angle positive where v_yt is (to
the left), so that a positive angle goes with a negative F_y. P4 and P5 count side slip the other way round.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arithmetic import Arithmetic, Number
from estimators.arrays import FloatArray

LEAST_SPEED = 0.5
"""m/s by which slips are divided at least: below, a velocity error of sensor size would read as full slip."""


def slip_ratio(surface_speed: npt.ArrayLike, wheel_velocity: npt.ArrayLike, least: float = LEAST_SPEED) -> FloatArray:
    """lambda = (R_e w - v_xt)/max(|R_e w|, |v_xt|, least), P1 notes 1; arrays that broadcast, m/s.

    With |.|, it holds backwards too: the sign is that of the slip velocity, which is that of the force. It is in
    [-1, 1] unless wheel and car move in opposite directions, then in [-2, 2]. NaN where an input is.
    """
    surface, velocity = np.asarray(surface_speed, dtype=np.float64), np.asarray(wheel_velocity, dtype=np.float64)
    size = np.maximum(np.maximum(np.absolute(surface), np.absolute(velocity)), least)
    out: FloatArray = (surface - velocity) / size
    return out


def side_slip_angle(along: npt.ArrayLike, across: npt.ArrayLike, least: float = LEAST_SPEED) -> FloatArray:
    """alpha = atan(v_yt/max(|v_xt|, least)), rad, P1 notes 1; `along` v_xt and `across` v_yt broadcast, m/s.

    |v_xt|, so that it is opposed to F_y backwards too. NaN where an input is.
    """
    forward, left = np.asarray(along, dtype=np.float64), np.asarray(across, dtype=np.float64)
    out: FloatArray = np.arctan(left / np.maximum(np.absolute(forward), least))
    return out


def slips(kit: Arithmetic, surface: Number, along: Number, across: Number) -> tuple[Number, Number]:
    """`slip_ratio` and `side_slip_angle` of one wheel, of numbers or of arrays."""
    magnitude = kit.maximum(abs(along), LEAST_SPEED)
    return (surface - along) / kit.maximum(magnitude, abs(surface)), kit.atan(across / magnitude)
