"""Consistency resets: an estimate that the wheels or the axles contradict for long starts again from them.

**V_x.** Is the estimate itself lost? Slip and a wrong estimate look alike: every wheel is far from the prediction.

They differ in what the wheels do. Wheels that roll agree with each other, gain the speed that the accelerometer says, and
need no force; a wheel that slips far carries the friction of the road, on the side to which it slips. So an estimate is
lost when, for `lost_time`, all wheels that turn (two at least) are gated, agree within `agreement`, none leaves the car,
and their distance from the prediction, which integrates the accelerometer, changes by no more than `rolling` allows (wheels
that carry no force, up to `unloaded`, roll whatever the accelerometer says, or the gravity that is taken off it). Once
standstill or wheels that turn have supported the estimate for as long, the clock runs at a tenth while the force could
explain the side to which they are off (beyond `unloaded`): four wheels may well slip together, but they had grip before.

A wheel that does not turn has no vote for another speed: four locked wheels agree as well, and are no evidence of anything.
But it may support the estimate, of a car that stands on ice while the others spin: more wheels must contradict than support,
and against an estimate that was supported before, one that supports is enough. Then it is a `split`: it stays open who is right,
and how far they are apart is reported. A car that stands beyond doubt for `lost_time` while its estimate moves is lost too; a
sliding car decelerates.

**V_y.** Is V_y lost? After a slide the axle conditions may stay gated for good: they are far from a V_y that is wrong.

An axle that carries no side force does not slip far sideways, on any road; one that carries some slips to that side, as far as
its tires need for it or further. So V_y is lost when, for `lost_time`, both axles roll, both are gated, both see V_y off by the
same, and both need less than `unloaded` of friction, or would slip less by V_y than they need: then it starts again from what
they see. What is known of sensors and tires stays.
"""

from __future__ import annotations

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.lateral_fusion import AxleUpdate, LateralFusion
from estimators.velocity.longitudinal_fusion import WheelUpdate

_PATIENCE = 0.1  # rate of the clock where the force could explain the wheels
_FAR = 1e9


class LongitudinalReset(CarsMemory):
    """Counts how long the wheels of `count` cars have contradicted the estimate as rolling wheels do."""

    memory = ("contradicted", "since", "apart", "supported")

    def __init__(self, settings: FusionSettings, count: int) -> None:
        self.settings, self.kit = settings, arithmetic((count,))
        zero = self.kit.full(0.0)
        self.contradicted: Number = zero  # s that count
        self.since: Number = zero  # s since it began
        self.apart: Number = zero  # m/s between the wheels and the prediction when it began
        self.supported: Number = zero  # s of standstill, or of wheels that turned and were used

    def __call__(
        self,
        elapsed: Number,
        standing: Number,
        seen: ConditionedInputs,
        wheel: WheelUpdate,
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
            self.contradicted, self.split = choose(news, 0.0, self.contradicted), kit.full(0.0)
            return kit.full(False)
        turning, support, dissent = 0, 0, kit.full(False)
        low, high, force, most, surface, gap = _FAR, -_FAR, 0.0, 0.0, 0.0, 0.0
        outputs = (
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
        for fresh, silent, off, far, slips, own, w, age, R in zip(*outputs, strict=True):
            turns = fresh & no(silent)
            turning = turning + choose(turns, 1, 0)
            support = support + choose(silent & no(far), 1, 0)
            dissent = dissent | (turns & ((slips & (abs(own) > s.unloaded)) | no(far)))
            low, high = choose(turns, kit.minimum(low, off), low), choose(turns, kit.maximum(high, off), high)
            force, most = force + choose(turns, own, 0.0), kit.maximum(most, choose(turns, abs(own), 0.0))
            surface = kit.maximum(surface, choose(turns, R * abs(w), 0.0))
            gap = kit.maximum(gap, choose(turns, age, 0.0))
        off, gap, begins = 0.5 * (high + low), kit.minimum(gap, s.error_memory), self.contradicted == 0.0
        apart, since = choose(begins, off, self.apart), choose(begins, 0.0, self.since) + gap
        rolls = high - low <= s.agreement * surface + s.dead_speed
        rolls = rolls & ((most < s.unloaded) | (abs(off - apart) <= s.dead_speed + s.rolling * since))
        explained = (force * kit.sign(off) > s.unloaded * turning) & (self.supported >= s.lost_time)
        time = self.contradicted + gap * choose(explained, _PATIENCE, 1.0)
        against = (turning >= 2) & no(dissent)
        split = against & (support > 0) & ((turning == support) | (self.supported >= s.lost_time))
        self.split = choose(split, abs(off), 0.0)
        contradicted = choose(against & rolls & (turning > support) & no(split), time, 0.0)
        self.contradicted = choose(news, contradicted, self.contradicted)
        self.since, self.apart = choose(news, since, self.since), choose(news, apart, self.apart)
        return self.contradicted > s.lost_time


class LateralReset(CarsMemory):
    """Counts how long both axles have contradicted V_y of `count` cars, alike and in a way that no road explains.

    Unloaded ones, which slip on no road, or loaded ones that would slip less than their force takes.
    """

    memory = ("contradicted",)

    def __init__(self, settings: FusionSettings, across: LateralFusion, count: int) -> None:
        self.settings, self.across, self.kit = settings, across, arithmetic((count,))
        self.contradicted: Number = self.kit.full(0.0)  # s

    def __call__(self, elapsed: Number, speed: Number, axle: AxleUpdate, usable: Signals) -> Number:
        """Sets V_y of the cars that are lost, and says which these are; `speed` V_x, `usable`: the axle does not slip."""
        s, kit, (front, rear) = self.settings, self.kit, axle.innovation
        gated = usable[0] & usable[1] & kit.no(axle.used[0] | axle.used[1])
        if not kit.some(gated):
            self.contradicted = kit.full(0.0)
            return gated
        size = [abs(mu) for mu in axle.friction]
        calm, loaded = (size[0] < s.unloaded) & (size[1] < s.unloaded), kit.minimum(*size) > s.unloaded
        grips = loaded & (front * axle.friction[0] < 0.0) & (rear * axle.friction[1] < 0.0)
        slip = 2.0 * s.side_compliance * kit.maximum(kit.maximum(*size), s.unloaded)
        doubt = abs(speed) * (s.side_floor + slip) + s.slip_speed  # m/s, of either axle
        contradicts = gated & (calm | grips) & (abs(front - rear) <= doubt)
        time = self.contradicted + kit.minimum(elapsed, s.error_memory)
        lost = contradicts & (time > s.lost_time)
        self.contradicted = kit.where(contradicts & kit.no(lost), time, 0.0)
        if kit.some(lost):
            self.across.filter.restart(lost, self.across.speed + 0.5 * (front + rear), doubt * doubt)
        return lost
