"""From corner velocities to those of the centre of gravity, weighted by axle.

An axle value is the mean of its wheels that are known, referred to the centre of gravity by the lever arm; the vehicle's
value is W_f v_f + W_r v_r, W_f + W_r = 1. Fixed weights: P2 (eta_1 = eta_2 = 0.5); P3 takes one axle. By slip: P1 (34),
(44), in the consistent reading: the printed lambda_am is the same for both axles and does not say which of them loses,
so the argument is the difference of their slips (P1 notes 11 item 13).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arithmetic import Arithmetic, ManyCars, Number, Signals
from estimators.arrays import FloatArray
from estimators.errors import EstimatorError
from estimators.vehicle import VehicleParameters
from estimators.velocity.corners import CornerVectors, at_wheel, corner_velocity, tire_frame
from estimators.velocity.slip import side_slip_angle, slip_ratio


@dataclass(frozen=True)
class SlipWeights:
    """W_f = W_s + (W_ub - W_lb)/pi atan(rho (Sigma_r - Sigma_f)), P1 (34)-(35), (44)-(45), Sigma = |s_L| + |s_R|.

    The axle that slips less counts more; with W_ub + W_lb = 1 the weights of both axles add up to one by symmetry, and
    with W_s = 0.5 they are equal where the slips are. `sharpness` rho per unit of slip (or per rad): the papers
    publish none; with 60 a difference of 0.05 in slip gives 0.8 W_ub of the way.

    Raises:
        EstimatorError: bounds that are not 0 <= lower <= 0.5 <= upper <= 1 with sum 1, a sharpness that is not above 0.
    """

    lower: float = 0.05
    upper: float = 0.95
    sharpness: float = 60.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.lower <= 0.5 <= self.upper <= 1.0 and abs(self.lower + self.upper - 1.0) < 1e-9):
            raise EstimatorError(
                f"weights between {self.lower!r} and {self.upper!r}: give 0 <= lower <= 0.5 and upper = 1 - lower"
            )
        if not (math.isfinite(self.sharpness) and self.sharpness > 0):
            raise EstimatorError(
                f"sharpness = {self.sharpness!r} must be finite and above zero; 60 per unit slip is usual"
            )

    def front(self, slip: npt.ArrayLike) -> FloatArray:
        """W_f (...) from the slip ratios or slip angles (..., 4); unknown slips (NaN) count as zero."""
        size = np.nan_to_num(np.absolute(np.asarray(slip, dtype=np.float64)))
        front, rear = size[..., :2].sum(axis=-1), size[..., 2:].sum(axis=-1)
        return np.asarray(self.of_axles(ManyCars(front.shape), front, rear))

    def of_axles(self, kit: Arithmetic, front: Number, rear: Number) -> Number:
        """W_f from Sigma_f and Sigma_r."""
        return 0.5 + (self.upper - self.lower) / math.pi * kit.atan(self.sharpness * (rear - front))


class CentreVelocity(NamedTuple):
    """Velocity of the centre of gravity, m/s, (...), and the axle values (..., 2) it was weighed from."""

    vx: FloatArray
    vy: FloatArray
    axle_vx: FloatArray
    axle_vy: FloatArray


def to_centre(
    vehicle: VehicleParameters,
    corner: CornerVectors,
    yaw_rate: npt.ArrayLike,
    front_weight_x: npt.ArrayLike = 0.5,
    front_weight_y: npt.ArrayLike = 0.5,
) -> CentreVelocity:
    """V_x, V_y from corner velocities in the vehicle frame: P1 (33), (42)-(43), P2 (28), P3 notes 3.

        v_xf = mean over the wheels of V_xc + r y_c        (with both wheels, r y_c cancels: the papers' mean)
        v_yf = -r L_f + mean of V_yc,    v_yr = r L_r + mean of V_yc

    A wheel that is unknown (NaN) is left out; an axle without any gets no weight; NaN where both are. `front_weight_x`
    and `front_weight_y` (...): constants, or from `SlipWeights`; 1 and 0 take one axle, as P3 does.

    Raises:
        EstimatorError: a weight outside [0, 1].
    """
    turn = np.asarray(yaw_rate, dtype=np.float64)[..., None]
    along, across = at_wheel(corner.x, corner.y, -turn, vehicle.corner_x, vehicle.corner_y)
    kit, values = ManyCars(turn.shape[:-1]), []
    for value, weight, name in ((along, front_weight_x, "x"), (across, front_weight_y, "y")):
        share = np.asarray(weight, dtype=np.float64)
        if not ((share >= 0.0) & (share <= 1.0)).all():
            raise EstimatorError(f"front_weight_{name} is not in [0, 1]; it is the share of the front axle")
        mean, *axles = weighed(kit, np.moveaxis(value, -1, 0), share)
        values += [mean, np.stack(axles, axis=-1)]
    vx, axle_x, vy, axle_y = values
    return CentreVelocity(vx, vy, axle_x, axle_y)


class CornerSlip(NamedTuple):
    """Per corner (..., 4): slip ratio, slip angle rad (positive where v_yt is, P1), and v_xt, v_yt m/s."""

    ratio: FloatArray
    angle: FloatArray
    along: FloatArray
    across: FloatArray


def to_corners(
    vehicle: VehicleParameters,
    vx: npt.ArrayLike,
    vy: npt.ArrayLike,
    yaw_rate: npt.ArrayLike,
    steer: npt.ArrayLike,
    wheel_speed: npt.ArrayLike,
    radius: npt.ArrayLike | None = None,
) -> CornerSlip:
    """Back from the centre of gravity to slip ratios and slip angles: P1 6.3; `radius` (..., 4) if it was learned."""
    tire = tire_frame(corner_velocity(vehicle, vx, vy, yaw_rate), steer)
    effective = vehicle.radius if radius is None else np.asarray(radius, dtype=np.float64)
    surface = effective * np.asarray(wheel_speed, dtype=np.float64)
    return CornerSlip(slip_ratio(surface, tire.x), side_slip_angle(tire.x, tire.y), tire.x, tire.y)


def weighed(kit: Arithmetic, value: Signals, front: Number) -> tuple[Number, Number, Number]:
    """Weighted mean of the axle means, and these; of the velocities at the four wheels, NaN where unknown.

    An axle that is unknown leaves all the weight to the other.
    """
    fl, fr, rl, rr = value
    ahead, behind = _mean(kit, fl, fr), _mean(kit, rl, rr)
    both = front * ahead + (1.0 - front) * behind
    return kit.where(kit.known(ahead), kit.where(kit.known(behind), both, ahead), behind), ahead, behind


def _mean(kit: Arithmetic, left: Number, right: Number) -> Number:
    """Of those that are known."""
    return kit.where(kit.known(left), kit.where(kit.known(right), 0.5 * (left + right), left), right)
