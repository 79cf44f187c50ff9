"""What free and driven wheels say of their radii over a quarter of a minute, for `soft_tires`.

    y_i = v_xt,i (1 + slip_i)/(R_i w_i) - 1 = rho_i + common + kappa mu_i + e_axle + l a_y s_i + e_i

rho_i relative radius errors; the common error is that of V_x, which cancels. The fusion cannot tell them: a wheel whose radius is
wrong by more than its model explains is left out, as one that slips, and nothing is learned in turns. Whether a tire is soft is a
question of a minute, not of a sample: y is averaged over `MEMORY` of driving, those samples counting most that slip and load
disturb least, and with it what disturbs it. Errors of which time tells nothing are alike in all samples, and no number of these
averages them away: kappa of the slip compliance, e_axle of the tires' curve, l of the load that a turn moves (s_i = 1 to the
left, -1 to the right), the yaw rate's, and V_y's. What changes in y while it is averaged is their doubt, too.
"""

from __future__ import annotations

import numpy as np

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.arrays import FloatArray
from estimators.memory import CarsMemory
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.lateral_fusion import YAW_BIAS, LateralFusion
from estimators.velocity.longitudinal_fusion import SLIP, LongitudinalFusion, WheelMotion

MEMORY = 15.0  # s of driving over which y is averaged: a tire that gets soft shows by 98 % within a minute
PERIOD = 0.05  # s between the samples that are taken: noise counts little in a minute
LARGEST = 0.15  # |y| of any tire that still rolls, a flat one loses 0.1: beyond, a wheel slips or a sensor fails
_LEFT = np.array([1.0, -1.0, 1.0, -1.0])
_ANY = 1.0  # deviation of the common error: as good as unknown
_CAR, _WHEEL = ("weight", "white", "across", "slowness", "turning"), ("off", "square", "use", "curve", "beside")


class SoftTireMonitor(CarsMemory):
    """Weighted sums over the last `MEMORY` of driving of `count` cars; none of them moves an estimate."""

    memory = ("since", *_CAR, *_WHEEL)

    def __init__(self, settings: FusionSettings, along: LongitudinalFusion, across: LateralFusion, count: int) -> None:
        self.settings, self._along, self._across, self.radius = settings, along, across, along.radius
        self.kit = kit = arithmetic((count,))
        zero = kit.full(0.0)
        self.since: Number = zero  # s since the last sample that was taken
        self.weight: Number = zero
        self.white: Number = zero  # variance of the noise, times the square of the weight
        self.across: Number = zero  # a_y, g
        self.slowness: Number = zero  # 1/V_x, s/m
        self.turning: Number = zero  # |r/V_x|, 1/m
        four = kit.stacked([zero] * 4)
        self.off: Signals = four  # y - mean
        self.square: Signals = four  # of it
        self.use: Signals = four  # mu = F_x/F_z
        self.curve: Signals = four  # slip that the tires' curve leaves open
        self.beside: Signals = four  # what V_y leaves open

    def __call__(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        course: WheelMotion,
        mu: Signals,
        across: Number,
        unsure: Number,
        turn: Number,
        slipping: Signals,
        blind: Number,
    ) -> None:
        """`across` a_y/g, `unsure` variance of V_y, `turn` yaw rate; `mu` F_x/F_z, not known where `blind`."""
        kit, s = self.kit, self.settings
        self.since = self.since + elapsed
        due = self.since >= PERIOD
        if not kit.some(due):
            return
        speed, compliance = self._along.speed, self._along.filter.mean[SLIP]
        magnitude = kit.maximum(abs(speed), s.dead_band)
        beyond = kit.sqrt(unsure) / magnitude

        def seen_of(
            w: Number, along: Number, shift: Number, side: Number, bend: Number, force: Number, R: Number
        ) -> tuple[Number, ...]:
            surface, size = R * w, abs(force)
            rolls = abs(surface) > s.dead_band
            expected = along * speed + shift + magnitude * (compliance + bend) * force
            y = kit.where(rolls, expected / kit.where(rolls, surface, 1.0) - 1.0, 1.0)
            curve = (s.slip_linear + s.slip_cubic * size * size + s.slip_bend_spread * bend) * size
            return y, curve, abs(side) * beyond

        y, curve, beside = kit.each(
            seen_of, seen.wheel_speed, course.along, course.shift, course.beside, course.bend, mu, self.radius
        )
        mean, most = 0.25 * (y[0] + y[1] + y[2] + y[3]), self._largest(curve)
        fresh = seen.fresh[0] & seen.fresh[1] & seen.fresh[2] & seen.fresh[3]
        usual = kit.no(slipping[0] | slipping[1] | slipping[2] | slipping[3] | blind) & (self._largest(y) < LARGEST)
        good = due & fresh & usual
        white = ((s.wheel_speed_noise * self.radius[0]) ** 2 + s.slip_speed**2 * 2.0 * s.error_memory / PERIOD) / (
            magnitude * magnitude
        )
        floor = s.slip_floor * s.slip_floor + (s.slip_load * across) ** 2 + most * most
        weight = kit.where(good, s.slip_floor**2 / (floor + white * PERIOD / MEMORY), 0.0)
        kept = kit.where(good, kit.exp(-self.since / MEMORY), 1.0)
        self.weight = kept * self.weight + weight
        self.white = kept * kept * self.white + weight * weight * white
        self.across = kept * self.across + weight * across
        self.slowness = kept * self.slowness + weight / magnitude
        self.turning = kept * self.turning + weight * abs(turn) / magnitude

        def summed(
            off: Number, square: Number, use: Number, bent: Number, left: Number, *new: Number
        ) -> tuple[Number, ...]:
            value, force, curve, side = new
            gap = kit.where(good, value - mean, 0.0)
            return (
                kept * off + weight * gap,
                kept * square + weight * gap * gap,
                kept * use + weight * force,
                kept * bent + weight * curve,
                kept * left + weight * side,
            )

        self.off, self.square, self.use, self.curve, self.beside = kit.each(
            summed, self.off, self.square, self.use, self.curve, self.beside, y, mu, curve, beside
        )
        self.since = kit.where(due, 0.0, self.since)

    def _largest(self, values: Signals) -> Number:
        a, b, c, d = (abs(value) for value in values)
        return self.kit.maximum(self.kit.maximum(a, b), self.kit.maximum(c, d))

    def averages(self, arm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """y less its mean (b, 4), and the covariance (b, 4, 4) of what is not rho in it; `arm` y of the wheels, m."""
        filters = (self._along.filter, SLIP), (self._across.filter, YAW_BIAS)
        slip_variance, yaw_bias = (np.reshape(each.variance(place), -1) for each, place in filters)
        s = self.settings
        weight, white, across, slowness, turning = (np.asarray(getattr(self, name)).reshape(-1) for name in _CAR)
        known = weight > 0.0
        total = np.where(known, weight, 1.0)
        four = (np.asarray(getattr(self, name)).reshape(4, -1).T / total[:, None] for name in _WHEEL)
        off, square, use, curve, beside = four
        alike = np.stack((curve[:, :2].mean(axis=1), curve[:, 2:].mean(axis=1)), axis=1).repeat(2, axis=1)
        lever = -arm * np.sqrt(yaw_bias * slowness**2 + (s.scale * turning) ** 2)[:, None] / total[:, None]
        ahead, behind = alike * [1, 1, 0, 0], alike * [0, 0, 1, 1]
        patterns = (
            np.sqrt(slip_variance)[:, None] * use,
            s.slip_load * (across / total)[:, None] * _LEFT,
            lever,
            beside,
            ahead,
            behind,
        )
        N = sum(np.einsum("bi,bj->bij", one, one) for one in patterns) + _ANY**2
        noise = white / total**2
        changes = np.maximum(square - off**2, 0.0) * (s.side_speed_memory / MEMORY)
        own = s.slip_floor**2 + noise[:, None] + changes + np.where(known, 0.0, _ANY**2)[:, None]
        return off, N + own[:, :, None] * np.eye(4)
