"""Longitudinal half of the fusion: one speed, the errors of the inertial unit, the radii, and how far to trust a wheel.

    dV_x/dt = a (1 - s) - b - g + r (V_y + sigma_y z)                               P2 (15) with bias, grade and scale
    R_i w_i = v_xt,i + |V_x| (c + e_i) mu_i - rho_i R_i w_i + error                 a wheel: slip follows the force

s scale error, b bias, g gravity along the road, or what attitude leaves of it, c slip compliance, e_i what side slip adds to it,
mu_i = F_x/F_z, rho_i relative radius error, v_xt,i speed of the wheel centre along the tire, sigma_y the deviation of V_y and z
how many of these it is off. The slip error grows with the friction used; a wheel whose surface leaves the car, or whose
innovation is larger than its own model can explain, is left out while that lasts (the high-slip detection of P2 notes 7 asks the
same two questions). The force tells the side to which a wheel slips: towards the other side a wheel is believed twice as far.
What attitude leaves changes within `levelling_memory`: taken for constant, it would be learned as radii. These are learned from
wheels that roll freely, where no slip hides them: neither one along the tire nor one across it.

Friction opposes slip, so slips along and across are to each other as the forces are (isotropic tire, Pacejka (2006) 3.2.3): a
tire that slides sideways slips along by far more than c mu. What the side slip is beyond c_1 mu_y, over mu_y, is e_i
(`LateralFusion.bend`). Where a wheel is hardly used, c is learned with low-passed forces: those of the same sample hold the
noise of its wheel speeds, and would shrink it.

**An error that stays as long as a turn is not white.** V_y's pulls at V_x by r times itself, and at the steered wheels by
sin(delta) times itself: it is a state; as noise, what is left of it would be taken for bias and grade. That of e_i, for no tire
is quite isotropic, is alike on both wheels of an axle: they count as one witness, and with its density over `side_speed_memory`.
The load that a turn moves from one side to the other changes the radii of an axle by opposite amounts: the noise of its two
wheels is correlated by -1, and their mean has none of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.vehicle import GRAVITY
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.speed_filter_few import speed_filter

SPEED, BIAS, GRADE, SCALE, SLIP, SIDE, RADIUS = 0, 1, 2, 3, 4, 5, 6  # places in the state; RADIUS is the first of four
SIZE = 10
_MOVING = (BIAS, GRADE, SCALE, SIDE)
_STILL = ((SPEED,),)
_SEEN = tuple((SPEED, SLIP, SIDE, RADIUS + wheel) for wheel in range(4))
_AXLES = ((1, 0), (3, 2))  # right and left wheel of each


class WheelUpdate(NamedTuple):
    """What became of the four wheels of a sample."""

    innovation: Signals  # m/s, R w - prediction
    used: Signals
    gated: Signals  # present, but further from the estimate than its model explains


class WheelMotion(NamedTuple):
    """How the four wheels move: v_xt = along V_x + shift."""

    along: Signals
    shift: Signals  # m/s
    acceleration: Signals  # m/s^2, of the car at the wheel
    beside: Signals  # share of V_y in v_xt
    bend: Signals  # slip per unit of F_x/F_z that side slip adds to the compliance


class LongitudinalFusion(CarsMemory):
    """Speed filter of `count` cars; `radius` of the four wheels, m."""

    memory = ("steady",)

    def __init__(self, radius: Signals, settings: FusionSettings, every: int, count: int) -> None:
        s = self.settings = settings
        self.radius, self.kit = radius, arithmetic((count,))
        self.steady: Signals = self.kit.stacked([self.kit.full(0.0)] * 4)  # F_x/F_z, low-passed
        mean, rates = np.zeros((2, SIZE))
        mean[SLIP] = s.slip_compliance
        deviations = [
            1.0,
            s.acceleration_bias,
            GRAVITY * s.grade,
            s.scale,
            s.slip_compliance_spread,
            s.side_speed_spread,
        ]
        spread = np.diag(np.square([*deviations, *[s.radius_single] * 4]))
        spread[RADIUS:, RADIUS:] += s.radius_common**2
        rates[[BIAS, SCALE]], rates[SLIP] = 1.0 / s.sensor_memory, 1.0 / s.slip_memory
        rates[SIDE], rates[RADIUS:] = 1.0 / s.side_speed_memory, 1.0 / s.radius_memory
        self.filter = speed_filter(mean, spread, rates, (GRADE, 1.0 / s.road_length), RADIUS, every, count)
        self._levelling = s.road_length / s.levelling_memory  # m/s
        (self._white,) = self.kit.each(lambda R: ((R * s.wheel_speed_noise) ** 2,), radius)

    @property
    def speed(self) -> Number:
        """V_x, m/s."""
        return self.filter.mean[SPEED]

    def acceleration(self, measured: Number) -> Number:
        """a (1 - s) - b - g, m/s^2: what is left of the measured one along the road."""
        x = self.filter.mean
        return measured * (1.0 - x[SCALE]) - x[BIAS] - x[GRADE]

    def predict(
        self,
        elapsed: Number,
        measured: Number,
        noise: Number,
        yaw_rate: Number,
        lateral: tuple[Number, Number],
        doubted: Number,
        levelled: bool,
    ) -> None:
        """`measured` a_x with the standard deviation `noise` of its mean over the sample, m/s^2; `lateral` V_y and its variance.

        A reading that is `doubted` teaches nothing about the sensor, nor about the road; of one that is `levelled` attitude
        took the gravity, and what it leaves changes with its own errors, not only with the road.
        """
        sigma, teaching, pull = elapsed * noise, elapsed, measured
        left, unsure = lateral
        if self.kit.some(doubted):
            teaching = self.kit.where(doubted, 0.0, elapsed)
            pull = self.kit.where(doubted, self.acceleration(measured), measured)
        shift = elapsed * (pull + yaw_rate * left)
        coupling = (-teaching, -teaching, -teaching * measured, elapsed * yaw_rate * self.kit.sqrt(unsure))
        way = abs(self.speed) + self._levelling if levelled else abs(self.speed)
        self.filter.move(elapsed, way, _MOVING, coupling, shift, sigma * sigma)

    def correct(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        slipping: Signals,
        mu: Signals,
        across: Number,
        unsure: Number,
        course: WheelMotion,
        blind: Number,
    ) -> WheelUpdate:
        """`mu` F_x/F_z of the wheels; `across`: friction used sideways; `unsure`: variance of V_y.

        `blind`: mu may be that of any braking car.
        """
        s, x, kit = self.settings, self.filter.mean, self.kit
        choose, largest = kit.where, kit.maximum
        speed, compliance = x[SPEED], x[SLIP]
        magnitude, way = abs(speed), kit.sign(speed)
        per_speed = s.tooth_pitch / largest(magnitude, s.dead_speed)
        held, lasting = (largest(1.0, 2.0 * memory / elapsed) for memory in (s.error_memory, s.side_speed_memory))
        wrong_way, gate, freely = s.wrong_way_gate**2, s.gate**2, s.free_rolling
        kept, beyond = kit.exp(-elapsed / s.error_memory), kit.sqrt(unsure)
        left = beyond * x[SIDE]
        turned = magnitude * s.slip_load * across
        moved = turned * turned  # what load moves from side to side does to the radii of an axle is opposite
        (self.steady,) = kit.each(lambda old, new: (kept * old + (1.0 - kept) * new,), self.steady, mu)
        hidden = choose(blind, s.unseen_acceleration / GRAVITY, 0.0)

        def predicted(
            w: Number,
            silent: Number,
            force: Number,
            gain: Number,
            shift: Number,
            pull: Number,
            beside: Number,
            bend: Number,
            radius: Number,
            error: Number,
            steady: Number,
        ) -> tuple[Number, ...]:
            surface, late = radius * w, per_speed * pull
            sliding = magnitude * s.slip_bend_spread * bend * force
            slip = (compliance + bend) * force
            expected = gain * speed + shift + beside * left + magnitude * slip
            innovation = surface * (1.0 + error) - expected
            friction = largest(abs(force), hidden)
            share = s.slip_linear + s.slip_cubic * friction * friction
            sigma = magnitude * (s.slip_floor + share * friction) + s.slip_speed
            # what slip, pulse ring and load leave unexplained
            model = sigma * sigma + late * late + moved
            model = choose(silent, largest(model, s.dead_speed**2), model)
            # the measured surface speed here would correlate sensitivity and innovation: noise would shrink the radii
            return (
                innovation,
                model,
                sliding,
                gain + way * slip,
                magnitude * choose(abs(force) < s.unloaded, steady, force),
                beside * beyond,
                -expected / (1.0 + error),
            )

        innovation, model, slid, *values = kit.each(
            predicted, seen.wheel_speed, seen.silent, mu, *course, self.radius, x[RADIUS:], self.steady
        )

        def tested(
            explained: Number,
            off: Number,
            model: Number,
            slid: Number,
            white: Number,
            force: Number,
            fresh: Number,
            slips: Number,
        ) -> tuple[Number, ...]:
            bent = slid * slid
            error = explained + white + model + bent
            far = fresh & (off * off > choose(off * force > 0.0, gate, wrong_way) * error)
            counts = fresh & kit.no(far | slips)
            return far, counts, white + model * held + bent * lasting, kit.no(counts) | (abs(force) < freely)

        explained = self.filter.expect(_SEEN, values)
        gated, used, variance, free = kit.each(
            tested, explained, innovation, model, slid, self._white, mu, seen.fresh, slipping
        )
        learning = free[0] & free[1] & free[2] & free[3] & (across * across < freely * freely) & kit.no(blind)
        shared = [(i, k, slid[i] * slid[k] * lasting - moved * held) for i, k in _AXLES]
        self.filter.weigh(innovation, variance, used, learning, shared)
        return WheelUpdate(innovation, used, gated)

    def zero_velocity_update(self, where: Number) -> None:
        """V_x = 0 for the cars `where`: what it takes to hold them there is bias or grade."""
        if self.kit.some(where):
            self.filter.expect(_STILL, ((1.0,),))
            self.filter.weigh([-self.speed], [self.settings.still_speed**2], [where])

    def calm(self, measured: Number) -> Number:
        """Whether the body accelerates no more than a standing one may, given what is known of bias and grade."""
        f, s = self.filter, self.settings
        unknown = f.variance(BIAS) + f.variance(GRADE) + 2.0 * f.variance(BIAS, GRADE)
        return abs(self.acceleration(measured)) < 3.0 * self.kit.sqrt(unknown + s.still_acceleration**2)
