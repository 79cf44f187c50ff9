"""Is V_y lost? After a slide the axle conditions may stay gated for good: they are far from a V_y that is wrong.

An axle that carries no side force does not slip far sideways, on any road. So V_y is lost when, for `lost_time`, both
axles roll, both need less than `unloaded` of friction, both are gated, and both see V_y off by the same: then it starts
again from what they see. What is known of sensors and tires stays.
"""

from __future__ import annotations

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.lateral_fusion import AxleVerdict, LateralFusion


class FusionAdrift(CarsMemory):
    """Counts how long unloaded axles have contradicted V_y of `count` cars."""

    memory = ("astray",)

    def __init__(self, settings: FusionSettings, across: LateralFusion, count: int) -> None:
        self.settings, self.across, self.kit = settings, across, arithmetic((count,))
        self.astray: Number = self.kit.full(0.0)  # s

    def __call__(self, elapsed: Number, speed: Number, axle: AxleVerdict, usable: Signals) -> Number:
        """Sets V_y of the cars that are lost, and says which these are; `speed` V_x, `usable`: the axle does not slip."""
        s, kit, (front, rear) = self.settings, self.kit, axle.innovation
        gated = usable[0] & usable[1] & kit.no(axle.used[0] | axle.used[1])
        if not kit.some(gated):
            self.astray = kit.full(0.0)
            return gated
        calm = (abs(axle.friction[0]) < s.unloaded) & (abs(axle.friction[1]) < s.unloaded)
        doubt = abs(speed) * (s.side_floor + 2.0 * s.side_compliance * s.unloaded) + s.slip_speed  # m/s, of either axle
        contradicts = gated & calm & (abs(front - rear) <= doubt)
        time = self.astray + kit.minimum(elapsed, s.error_memory)
        lost = contradicts & (time > s.lost_time)
        self.astray = kit.where(contradicts & kit.no(lost), time, 0.0)
        if kit.some(lost):
            self.across.filter.restart(lost, self.across.speed + 0.5 * (front + rear), doubt * doubt)
        return lost
