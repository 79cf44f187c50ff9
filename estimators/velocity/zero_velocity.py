"""Detection of zero velocity: the car stands when its wheels and its body are at rest for long enough.

All wheels with a reading hardly turn, and accelerations and yaw rate are those of a body at rest: a sliding car decelerates,
along or across. What gravity adds on a slope is not known at first; a car whose wheels have never turned, and one that stands
already, needs only accelerations that stay the same: nothing but a car that was parked begins with wheels at rest.

Wheel sensors say nothing below their dead band: a car that creeps looks like one that stands, and what is reported of one with
slow wheels is no more certain than that (`hidden`).
"""

from __future__ import annotations

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.lateral_fusion import YAW_BIAS, LateralFusion
from estimators.velocity.longitudinal_fusion import SPEED, LongitudinalFusion

_STEEPEST = 4.0  # m/s^2 of gravity along or across a slope on which cars are parked: 40 %

_PATIENCE = 0.5
"""s of accelerations that stay the same, where these are not level: sensors that start up may be silent first."""


class ZeroVelocityDetector(CarsMemory):
    """Counts how long `count` cars have been at rest; the thresholds follow from the covariances of the two filters."""

    memory = ("calm", "turned", "level_x", "level_y")

    def __init__(self, settings: FusionSettings, along: LongitudinalFusion, across: LateralFusion, count: int) -> None:
        self.settings, self.kit = settings, arithmetic((count,))
        self._along, self._across = along, across
        self._zero, self._never = self.kit.full(0.0), self.kit.full(False)
        self.calm: Number = self._zero  # s of silent wheels and calm body
        self.turned: Number = self._zero  # 1 once a wheel has turned, or the car was said to move
        self.slow: Number = self._never  # no wheel turns faster than a sensor without pulses may, at this sample
        self.level_x: Number = self._zero  # a_x and a_y, low-passed while the wheels are silent
        self.level_y: Number = self._zero

    def __call__(
        self, seen: ConditionedInputs, ax: Number, ay: Number, turn: Number, elapsed: Number
    ) -> tuple[Number, Number]:
        """Whether the car stands; and whether it does for so long that an estimate which moves must be lost."""
        s, kit, silent, crept = self.settings, self.kit, seen.silent, self.hidden()
        if not kit.some(silent[0] | silent[1] | silent[2] | silent[3]):
            self.calm, self.turned, self.slow = self._zero, kit.full(1.0), self._never
            self._wakes(crept)
            return self._never, self._never
        count, moving = 0, self._never
        for fresh, still in zip(seen.fresh, silent, strict=True):
            count = count + kit.where(fresh, 1, 0)
            moving = moving | (fresh & kit.no(still))
        fastest = kit.full(0.0)
        for w, R in zip(seen.wheel_speed, self._along.radius, strict=True):
            fastest = kit.maximum(fastest, abs(R * w))
        self.slow = (fastest <= s.dead_speed) & (count >= 2)
        self._wakes(crept)
        self.turned = kit.where(fastest > s.dead_speed, 1.0, self.turned)
        unsure = kit.sqrt(self._across.filter.variance(YAW_BIAS))
        calm = (seen.good[0] | seen.good[1] | seen.good[2]) & kit.no(moving) & (count >= 2)
        calm = calm & (abs(turn) < s.still_yaw_rate + 3.0 * unsure)
        level = self._along.calm(ax) & self._across.calm(ay)
        steady = self._steady(ax, ay, elapsed) & ((self.turned == 0.0) | (self.calm > _PATIENCE))
        self.calm = kit.where(calm & (level | steady), self.calm + elapsed, 0.0)
        moves = self._moves() & kit.no(steady & (self.turned == 0.0))
        enough = kit.where(level, s.still_time, _PATIENCE)
        return (self.calm > enough) & kit.no(moves), (self.calm > s.lost_time) & level & moves & seen.alive

    def _wakes(self, crept: Number) -> None:
        """Wheels that tell of the speed again find it as uncertain as they left it: else what it is off by looks like radii."""
        self._along.filter.widen((crept > 0.0) & self.kit.no(self.slow), crept * crept)

    def hidden(self) -> Number:
        """Deviation of the speeds that no measurement can take away, m/s: three of it are the dead band of the wheels."""
        s, speed = self.settings, abs(self._along.speed)
        return self.kit.where(self.slow & (speed < s.dead_band), s.dead_band / 3.0, 0.0)

    def begin(self, where: Number, moving: Number) -> None:
        """Cars that start, and whether they were said to move."""
        self.turned = self.kit.where(where, self.kit.where(moving, 1.0, 0.0), self.turned)

    def stopped(self, silent: Signals) -> Signals:
        """Wheels that do not turn though the car moves."""
        if not self.kit.some(silent[0] | silent[1] | silent[2] | silent[3]):
            return silent
        moves = self._moves()
        return self.kit.each(lambda still: (still & moves,), silent)[0]

    def _steady(self, ax: Number, ay: Number, elapsed: Number) -> Number:
        """Whether both accelerations are what they have been for `still_time`, and no more than a slope gives."""
        kit, s = self.kit, self.settings
        fresh = self.calm == 0.0
        kept = kit.exp(-elapsed / s.still_time)
        self.level_x = kit.where(fresh, ax, kept * self.level_x + (1.0 - kept) * ax)
        self.level_y = kit.where(fresh, ay, kept * self.level_y + (1.0 - kept) * ay)
        same = kit.maximum(abs(ax - self.level_x), abs(ay - self.level_y)) < 3.0 * s.still_acceleration
        return same & (abs(self.level_x) < _STEEPEST) & (abs(self.level_y) < _STEEPEST)

    def _moves(self) -> Number:
        """Whether the estimate is further from zero than its uncertainty and a silent wheel allow, along or across."""
        s, moves = self.settings, self._never
        for half in (self._along, self._across):
            deviation = self.kit.sqrt(half.filter.variance(SPEED))
            moves = moves | (abs(half.speed) > s.gate * deviation + s.dead_speed)
        return moves
