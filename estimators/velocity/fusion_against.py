"""Do all wheels slip against their force? Friction opposes slip, so no tire does: then the estimate is wrong.

A braked wheel is never faster than the road, a driven one never slower. Which side is possible is known only where the
wheel uses some friction (`unloaded`). When all wheels that turn, three at least, are off to the impossible side by more
than the uncertainty of the estimate, their noise and their radii allow, it is a_x that has brought the estimate there:
for `lost_time` it counts as missing, and forces or wheels take its place (`fusion_thrust`). This needs no torques: where
these are unknown, forces are shares of a_x, and an a_x that points to the wrong side is found out all the same.
"""

from __future__ import annotations

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.velocity.fusion_screen import Screened
from estimators.velocity.longitudinal_fusion import SLIP, SPEED, LongitudinalFusion

_FAR = 1e9


class FusionAgainst(CarsMemory):
    """Remembers of `count` cars for how long a_x is not to be believed."""

    memory = ("left",)

    def __init__(self, along: LongitudinalFusion, count: int) -> None:
        self.along, self.settings, self.kit = along, along.settings, arithmetic((count,))
        self._zero = self.kit.full(0.0)
        self.left: Number = self._zero  # s for which a_x is not believed

    def __call__(self, elapsed: Number, seen: Screened, innovation: Signals, mu: Signals) -> None:
        """`innovation` of the wheels, m/s, from which slip as their forces `mu` make it has been taken."""
        s, kit, choose, filter_ = self.settings, self.kit, self.kit.where, self.along.filter
        speed = filter_.mean[SPEED]
        usual, sure = abs(speed) * filter_.mean[SLIP], s.unloaded

        def power(off: Number, force: Number) -> tuple[Number, ...]:
            return ((off + usual * force) * force,)

        (spent,) = kit.each(power, innovation, mu)  # by friction, per load: slip times force, never below zero
        least = kit.minimum(kit.minimum(spent[0], spent[1]), kit.minimum(spent[2], spent[3]))
        if not kit.some((least < -s.dead_speed * sure) | (self.left > 0.0)):
            return
        turning, least = 0, _FAR
        for work, force, fresh, silent, age in zip(spent, mu, seen.fresh, seen.silent, seen.gap, strict=True):
            turns = fresh & kit.no(silent) & (age < s.error_memory)  # one that repeats itself for longer is dead
            turning = turning + choose(turns, 1, 0)
            wrong = choose(abs(force) > sure, -work / kit.maximum(abs(force), sure), 0.0)  # m/s
            least = kit.minimum(least, choose(turns, wrong, _FAR))
        white = s.wheel_speed_noise * self.along.radius[0]
        unsure = kit.sqrt(filter_.variance(SPEED) + white * white)
        against = (turning >= 3) & (least > s.gate * unsure + s.agreement * abs(speed) + s.dead_speed)
        self.left = choose(against, s.lost_time, kit.maximum(self.left - elapsed, 0.0))
