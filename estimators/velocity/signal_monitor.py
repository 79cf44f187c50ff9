"""The signal monitor: every signal is predicted from the others with its uncertainty, loses its weight, and comes back.

Which witnesses tell the same number is in `parity`, what they say and by how much each may be off in `turn_monitor` and
`pull_monitor`, and who is outvoted in `signal_vote`. Of all signals alike:

    found      outvoted by others that agree; one that repeats itself (frozen, zero, clipped at its limit) by fewer
    replaced   by what the others say that it should read, with their allowance as its noise: an error that stays counts
               (2 j - 1) times in the j-th sample, up to `error_memory`. Nothing that is replaced teaches bias, scale or slope
    flagged    GATED, and `FusionStep.inertial_used`
    back       when no peer contradicts it and one has agreed with it for `error_memory`

**a_x.** While the wheels have not decided between a_x and the forces, a_x is as unsure as these are apart. Four wheels that
slip against their force disprove it without any torque, for `lost_time`. Where neither a_x nor the forces tell, the wheels
do, by +-`unseen_acceleration`.

**a_y, yaw rate.** Until it was found V_y followed it: its variance grows by that, and what the axles were off by since shortly
before is not held against the tires. While wheels and steering follow the turn, an a_y beyond it is as unsure as they are
apart, from its first sample on. One that repeats itself is replaced at once, for nothing says that the car still does. A car
that follows its steering closely, as one does whose tires carry little, while a_y, alive, contradicts it for 0.5 s is on a
banked road: the variance of the bank grows, and a_y is believed again. An a_y that has lost its gain looks the same. A car that
is caught from a slide turns against its side force for a moment, while a_y goes through zero: only an a_y that is on the other
side of it, or beyond what the steering would carry, by more than its own allowance is doubted.

**Attitude.** A levelled a_y that the turn contradicts while the one that is not levelled agrees: roll is wrong, and nothing is
levelled. The contrary is a banked road, and no fault.

**Steering.** What the two axle conditions say of V_y differs by V_x delta - L r - |V_x| (alpha_f - alpha_r), whatever V_y is.
Where that, low-passed, is more than the model explains and the front axle is the further one from the estimate, its condition
is not used: a wrong steering angle looks like front tires beyond their grip. One that repeats itself is held to less.

**Wheels.** The gate of `longitudinal_fusion`: each innovation is a wheel against the estimate, that the others hold.

**What can be told apart**, derived from the relations by `isolability`; two faults at once, and what is reported where they
cannot be told apart, are in the guide (Why: Faults of sensors):

| at fault | looks like | reported, live | reported, repeating |
|---|---|---|---|
| yaw_rate | - | yaw_rate | yaw_rate |
| ay | slide | ay (unless too small) | ay |
| roll | - | roll | roll |
| wheel fl | - | wheel fl | wheel fl |
| wheel fr | - | wheel fr | wheel fr |
| wheel rl | - | wheel rl | wheel rl |
| wheel rr | - | wheel rr | wheel rr |
| steer | front grip | steer | steer |
| ax | pitch | ax | ax |
| pitch | ax | ax | ax |
| torque | - | - | - |
"""

from __future__ import annotations

from typing import NamedTuple

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.vehicle import VehicleParameters
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.lateral_fusion import SPEED, TIRES, AxleUpdate, LateralFusion
from estimators.velocity.longitudinal_fusion import LongitudinalFusion
from estimators.velocity.pull_monitor import PullMonitor
from estimators.velocity.turn_monitor import TurnMonitor

LOCKED = 2.0  # standard deviations, in place of `gate`, of a steering angle that repeats itself


class Validated(NamedTuple):
    """What the filters are to use; readings a_x, a_y, r without the gravity that is known."""

    reading: tuple[Number, Number, Number]  # what was read, or should have been
    noise: tuple[Number, Number, Number]
    used: tuple[Number, Number, Number]  # whether it is the reading
    doubt: tuple[Number, Number]  # m/s^2 by which a_x and a_y may be off for long; 0 where they are believed
    gravity: tuple[Number, Number]  # m/s^2 that was taken off a_x and a_y
    road: tuple[Number, Number]  # of it, from grade and bank: the tires carry that
    mu: Signals  # F_x/F_z of the wheels, of a size that a tire can have; shares of a_x where unknown
    blind: Number  # whether neither a_x nor the forces tell
    unknown: Number  # whether nothing tells the yaw rate
    steered: Number  # whether the steering is believed
    gated: Number  # whether a signal is there, and is not believed
    contested: Number  # whether a_x and the forces contradict each other by half of what they may


class SignalMonitor(CarsMemory):
    """Validates the signals of `count` cars."""

    memory = ("astray", "remaining", "mu")
    parts = ("pull", "turn")

    def __init__(
        self, vehicle: VehicleParameters, along: LongitudinalFusion, across: LateralFusion, count: int
    ) -> None:
        self.settings, self.kit, self.across = along.settings, arithmetic((count,)), across
        self.pull, self.turn = PullMonitor(vehicle, along, count), TurnMonitor(vehicle, along, across, count)
        self._zero, self._arm = self.kit.full(0.0), vehicle.rear_axle_distance
        self.astray: Number = self._zero  # m/s, front less rear axle innovation, low-passed
        self.spread: Number = self._zero  # m/s, what the model explains of it with one standard deviation
        self.remaining: Number = self._zero  # s for which the steering is not believed
        self.mu: Signals = self.kit.stacked([self._zero] * 4)  # F_x/F_z of the wheels at the last sample

    def __call__(
        self, elapsed: Number, seen: ConditionedInputs, given: Signals | None, slope: Signals, gravity: Signals | None
    ) -> Validated:
        """One sample: `given` F_x/F_z of the wheels, not finite where unknown; `slope` of their speeds, rad/s^2.

        `gravity`: m/s^2 that an attitude part has taken off a_x and a_y, and of these what grade and bank make.
        """
        known = None if gravity is None else (gravity[1], gravity[3])
        turn = self.turn(elapsed, seen, self.mu, known)
        ahead, road = (self._zero, self._zero) if gravity is None else (gravity[0], gravity[2])
        pull = self.pull(elapsed, seen, given, slope, road)
        self.mu, steered = pull.mu, self.remaining == 0.0
        return Validated(
            reading=(pull.reading, *turn.reading),
            noise=(pull.noise, *turn.noise),
            used=(pull.used, *turn.used),
            doubt=(pull.doubt, turn.doubt),
            gravity=(ahead, turn.gravity),
            road=(road, turn.road),
            mu=pull.mu,
            blind=pull.blind,
            unknown=turn.unknown,
            steered=steered,
            gated=pull.gated | turn.gated | self.kit.no(steered),
            contested=pull.contested,
        )

    def learn(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        innovation: Signals,
        speed: Number,
        yaw_rate: Number,
        axle: AxleUpdate,
        usable: Signals,
    ) -> None:
        """What the corrections say of a_x (by the `innovation` of wheels, m/s), a_y and steering; `yaw_rate` as read."""
        s, kit, P = self.settings, self.kit, self.across.filter.variance
        self.pull.learn(seen, innovation, self.mu)
        (front, rear), (mu, nu) = axle.innovation, axle.friction
        kept, magnitude = kit.exp(-elapsed / s.wheel_lag), abs(speed)
        apart = kit.where(usable[0] & usable[1], front - rear, 0.0)
        self.turn.impossible = self._slips_along(self.across.yaw_rate(yaw_rate), magnitude, axle.friction)
        self.astray = kept * self.astray + (1.0 - kept) * apart
        tires = P(TIRES) * mu * mu + P(TIRES + 2) * nu * nu - 2.0 * P(TIRES, TIRES + 2) * mu * nu
        share = s.side_floor + s.side_linear * s.side_compliance * kit.maximum(abs(mu), abs(nu))
        white = s.steering_noise * s.steering_noise * (1.0 - kept) / (1.0 + kept)
        model = magnitude * magnitude * (tires + 2.0 * share * share + white) + 2.0 * s.slip_speed**2
        self.spread = kit.sqrt(model)
        off = (abs(self.astray) > kit.where(seen.locked, LOCKED, s.gate) * self.spread) & (abs(front) > abs(rear))
        self.remaining = kit.where(off, s.error_memory, kit.maximum(self.remaining - elapsed, 0.0))

    def _slips_along(self, turn: Number, magnitude: Number, mu: Signals) -> Number:
        """1 where both axles push the car to where the rear one slips, by F_y/F_z `mu`: no tire does, a_y leads V_y astray.

        Beyond what the uncertainty of V_y and toe allow; `turn` rad/s, `magnitude` of V_x.
        """
        s, kit, speed = self.settings, self.kit, self.across.filter
        slip = speed.mean[SPEED] - self._arm * turn  # m/s, to the left
        unsure = s.gate * kit.sqrt(speed.variance(SPEED)) + s.side_floor * magnitude + s.dead_speed
        side, least = kit.sign(slip), s.unloaded
        return kit.where((abs(slip) > unsure) & (mu[0] * side > least) & (mu[1] * side > least), 1.0, 0.0)

    def forget(self, where: Number) -> None:
        """Starts the cars `where` afresh."""
        super().forget(where)
        self.pull.forget(where)
        self.turn.forget(where)
