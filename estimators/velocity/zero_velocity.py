"""Detection of zero velocity: the car stands when its wheels and its body are at rest for long enough.

All wheels with a reading hardly turn, and accelerations and yaw rate are those of a body at rest: a sliding car decelerates.
"""

from __future__ import annotations

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.lateral_fusion import YAW_BIAS, LateralFusion
from estimators.velocity.longitudinal_fusion import SPEED, LongitudinalFusion


class ZeroVelocityDetector(CarsMemory):
    """Counts how long `count` cars have been at rest; the thresholds follow from the covariances of the two filters."""

    memory = ("calm",)

    def __init__(self, settings: FusionSettings, along: LongitudinalFusion, across: LateralFusion, count: int) -> None:
        self.settings, self.kit = settings, arithmetic((count,))
        self._along, self._across = along, across
        self._zero, self._never = self.kit.full(0.0), self.kit.full(False)
        self.calm: Number = self._zero  # s of silent wheels and calm body

    def __call__(self, seen: ConditionedInputs, ax: Number, turn: Number, elapsed: Number) -> tuple[Number, Number]:
        """Whether the car stands; and whether it does for so long that an estimate which moves must be lost."""
        s, kit, silent = self.settings, self.kit, seen.silent
        if not kit.some(silent[0] | silent[1] | silent[2] | silent[3]):
            self.calm = self._zero
            return self._never, self._never
        count, moving = 0, self._never
        for fresh, still in zip(seen.fresh, silent, strict=True):
            count = count + kit.where(fresh, 1, 0)
            moving = moving | (fresh & kit.no(still))
        unsure = kit.sqrt(self._across.filter.variance(YAW_BIAS))
        calm = seen.present & kit.no(moving) & (count >= 2) & self._along.calm(ax)
        calm = calm & (abs(turn) < s.still_yaw_rate + 3.0 * unsure)
        self.calm = kit.where(calm, self.calm + elapsed, 0.0)
        moves = self._moves()
        return (self.calm > s.still_time) & kit.no(moves), (self.calm > s.lost_time) & moves & seen.alive

    def stopped(self, silent: Signals) -> Signals:
        """Wheels that do not turn though the car moves."""
        if not self.kit.some(silent[0] | silent[1] | silent[2] | silent[3]):
            return silent
        moves = self._moves()
        return self.kit.each(lambda still: (still & moves,), silent)[0]

    def _moves(self) -> Number:
        """Whether the estimate is further from zero than its uncertainty and a silent wheel allow."""
        deviation = self.kit.sqrt(self._along.filter.variance(SPEED))
        return abs(self._along.speed) > self.settings.gate * deviation + self.settings.dead_speed
