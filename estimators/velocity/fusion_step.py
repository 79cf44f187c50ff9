"""What the vehicle-level fusion returns."""

from __future__ import annotations

from typing import NamedTuple

from estimators.arrays import BoolArray, FlagArray, FloatArray


class FusionStep(NamedTuple):
    """What one step returns, ready for a log; `...` is the batch shape."""

    vx: FloatArray  # (...) m/s at the centre of gravity, body frame
    vy: FloatArray  # (...) m/s, to the left
    vx_deviation: FloatArray  # (...) m/s, standard deviation
    vy_deviation: FloatArray  # (...) m/s
    yaw_rate: FloatArray  # (...) rad/s, without its estimated bias and scale error
    sensor_bias: FloatArray  # (..., 3) of a_x, a_y in m/s^2 and of r in rad/s
    gravity: FloatArray  # (..., 2) m/s^2 in a_x and a_y, from grade and bank
    radius: FloatArray  # (..., 4) effective radii, m, as learned
    slip: FloatArray  # (..., 4) slip ratio, positive when driving
    slip_angle: FloatArray  # (..., 4) rad, positive where v_yt is (P1)
    innovation: FloatArray  # (..., 4) m/s, wheels; NaN where there is no wheel speed
    used: BoolArray  # (..., 4)
    gated: BoolArray  # (..., 4) not used because further from the estimate than its model explains
    high_slip: BoolArray  # (..., 4) not used because the wheel accelerates away from the car
    axle_innovation: FloatArray  # (..., 2) m/s, front and rear axle condition
    axle_used: BoolArray  # (..., 2)
    standing: BoolArray  # (...) standstill was recognised
    flags: FlagArray  # (...) sums of `Flag`
    wheel_flags: FlagArray  # (..., 4)
