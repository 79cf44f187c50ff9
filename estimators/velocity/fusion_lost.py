"""Is the estimate itself lost? Slip and a wrong estimate look alike: every wheel is far from the prediction.

They differ in what the wheels do. Wheels that roll agree with each other, gain the speed that the accelerometer says, and
need no force; a wheel that slips far carries the friction of the road, on the side to which it slips. So an estimate is
lost when, for `lost_time`, all wheels that turn (two at least) are gated, agree within `agreement`, none leaves the car,
and their distance from the prediction, which integrates the accelerometer, changes by no more than `rolling` allows. Once
standstill or wheels that turn have supported the estimate for as long, the clock runs at a tenth while the force could
explain the side to which they are off (beyond `unloaded`): four wheels may well slip together, but they had grip before.

A wheel that does not turn has no vote: four locked wheels agree as well, and are no evidence of anything. A car that
stands beyond doubt for `lost_time` while its estimate moves is lost too; a sliding car decelerates.
"""

from __future__ import annotations

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.velocity.fusion_screen import Screened
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.longitudinal_fusion import WheelVerdict

_PATIENCE = 0.1  # pace of the clock where the force could explain the wheels
_FAR = 1e9


class FusionLost(CarsMemory):
    """Counts how long the wheels of `count` cars have contradicted the estimate as rolling wheels do."""

    memory = ("astray", "since", "apart", "supported")

    def __init__(self, settings: FusionSettings, count: int) -> None:
        self.settings, self.kit = settings, arithmetic((count,))
        zero = self.kit.full(0.0)
        self.astray: Number = zero  # s that count
        self.since: Number = zero  # s since it began
        self.apart: Number = zero  # m/s between the wheels and the prediction when it began
        self.supported: Number = zero  # s of standstill, or of wheels that turned and were used

    def __call__(
        self,
        elapsed: Number,
        standing: Number,
        seen: Screened,
        wheel: WheelVerdict,
        slipping: Signals,
        mu: Signals,
        radius: Signals,
    ) -> Number:
        """Whether the wheels say so; `mu` F_x/F_z, `radius` m of the four wheels."""
        s, kit, choose, no = self.settings, self.kit, self.kit.where, self.kit.no
        if kit.some(self.supported < s.lost_time):
            (used,) = kit.each(lambda counts, still: (counts & no(still),), wheel.used, seen.silent)
            self.supported = self.supported + choose(standing | used[0] | used[1] | used[2] | used[3], elapsed, 0.0)
        news = seen.fresh[0] | seen.fresh[1] | seen.fresh[2] | seen.fresh[3]
        if not kit.some(wheel.gated[0] | wheel.gated[1] | wheel.gated[2] | wheel.gated[3]):
            self.astray = choose(news, 0.0, self.astray)
            return kit.full(False)
        turning, against = 0, kit.full(False)
        low, high, force, surface, gap = _FAR, -_FAR, 0.0, 0.0, 0.0
        told = (
            seen.fresh,
            seen.silent,
            wheel.innovation,
            wheel.gated,
            slipping,
            mu,
            seen.wheel_speed,
            seen.gap,
            radius,
        )
        for fresh, silent, off, far, slips, own, w, age, R in zip(*told, strict=True):
            turns = fresh & no(silent)
            turning = turning + choose(turns, 1, 0)
            against = against | (turns & (slips | no(far)))
            low, high = choose(turns, kit.minimum(low, off), low), choose(turns, kit.maximum(high, off), high)
            force = force + choose(turns, own, 0.0)
            surface = kit.maximum(surface, choose(turns, R * abs(w), 0.0))
            gap = kit.maximum(gap, choose(turns, age, 0.0))
        off, gap, begins = 0.5 * (high + low), kit.minimum(gap, s.error_memory), self.astray == 0.0
        apart, since = choose(begins, off, self.apart), choose(begins, 0.0, self.since) + gap
        rolls = high - low <= s.agreement * surface + s.dead_speed
        rolls = rolls & (abs(off - apart) <= s.dead_speed + s.rolling * since)
        explained = (force * kit.sign(off) > s.unloaded * turning) & (self.supported >= s.lost_time)
        time = self.astray + gap * choose(explained, _PATIENCE, 1.0)
        astray = choose((turning >= 2) & no(against) & rolls, time, 0.0)
        self.astray = choose(news, astray, self.astray)
        self.since, self.apart = choose(news, since, self.since), choose(news, apart, self.apart)
        return self.astray > s.lost_time
