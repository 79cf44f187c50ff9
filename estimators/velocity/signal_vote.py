"""Who is outvoted: five witnesses of one number, the centripetal acceleration of the car, and which of them contradict which.

Two witnesses contradict each other where they are further apart than both allowances; live readings count as far apart only
beyond `_ALIVE` on top of that, the margin of a slide. **A signal is outvoted by others that agree with each other while each of
them contradicts it**; a reading that repeats itself (frozen, zero, clipped at its limit) is outvoted by fewer:

    yaw rate    live: by three of a_y, front, rear, steering, while no wheels agree with it
                repeating: by two, wheels among them
    a_y         live: by two of yaw rate, front, rear with which the steering agrees, and only where it reads more than the
                steering says or points to the other side: a car that slides is turned further than its side force carries it,
                never less
                repeating: by one of these three

What can be told apart (fault: who contradicts it; what is reported):

    yaw rate: a_y, front, rear, steering. Found, replaced by the wheels.
    a_y: yaw rate, front, rear. Found where the steering agrees with these, replaced by V_x r.
    one axle's wheels: yaw rate, a_y and the other axle. Nothing here; a wheel's own innovation gates it.
    steering: all others. Like understeer or a drift: its axle condition is gated, nothing is named.
    yaw rate and a_y: front and rear, which agree with the steering. Both found.
    yaw rate and one axle: a_y, the other axle and the steering agree. The yaw rate is found.
    a_y and steering: no grip is known. a_y is found only if it repeats itself; else it looks like a slide.
    yaw rate and both axles: a_y and steering are no proof. Both kept, the yaw rate even if it repeats itself.
    a_y too small, alive, for `SignalMonitor`'s patience: a slide, or a banked road. The bank is let go.
    a_y too large, alive, going straight: the same.
    yaw rate, wheels lost: nothing decides between it and a_y. Both kept.
"""

from __future__ import annotations

from typing import NamedTuple

from estimators.arithmetic import Arithmetic, Number, Signals

YAW_RATE, SIDE, FRONT, REAR, STEERING = range(5)  # the witnesses; SIDE: a_y
_ALIVE = (0.5, 0.1)  # m/s^2, and share of the larger: what a slide adds before a live reading is doubted
Pairs = dict[tuple[int, int], Number]


class Vote(NamedTuple):
    """Conditions: pairs are those of a_y and the yaw rate."""

    wrong: tuple[Number, Number]  # outvoted
    contradicted: tuple[Number, Number]  # by anyone who is not outvoted
    supported: tuple[Number, Number]  # by anyone at all
    grip: Number  # the car follows its steering: yaw rate, wheels and steering agree


def vote(kit: Arithmetic, level: Signals, allowed: Signals, known: Signals, stuck: tuple[Number, Number]) -> Vote:
    """Of the five witnesses `level` with their allowances, m/s^2; `known`: who says anything; `stuck`: a_y, yaw rate repeat."""
    no, (stuck_side, stuck_yaw) = kit.no, stuck
    against, agree, beyond = Pairs(), Pairs(), Pairs()
    for i in range(5):
        for k in range(i + 1, 5):
            both, gap = known[i] & known[k], abs(level[i] - level[k]) - allowed[i] - allowed[k]
            slide = _ALIVE[0] + _ALIVE[1] * kit.maximum(abs(level[i]), abs(level[k]))
            for pairs, holds in ((against, gap > 0.0), (agree, gap <= 0.0), (beyond, gap > slide)):
                pairs[i, k] = pairs[k, i] = both & holds

    def by(far: Pairs, *groups: tuple[int, ...]) -> Number:
        """The yaw rate, by all of a group whose members agree with each other."""
        found = kit.full(False)
        for group in groups:
            all_ = known[YAW_RATE]
            for place, i in enumerate(group):
                all_ = all_ & far[YAW_RATE, i]
                for k in group[:place]:
                    all_ = all_ & agree[i, k]
            found = found | all_
        return found

    doubtful = against[SIDE, FRONT] | against[SIDE, REAR] | against[SIDE, STEERING]  # then a_y is nobody's support
    backed = agree[YAW_RATE, FRONT] | agree[YAW_RATE, REAR] | (agree[YAW_RATE, SIDE] & doubtful)
    wrong_yaw = by(beyond, (1, 2, 3), (2, 3, 4), (1, 2, 4), (1, 3, 4)) & no(backed)
    wrong_yaw = wrong_yaw | (stuck_yaw & by(against, (1, 2), (1, 3), (2, 3), (2, 4), (3, 4)))
    wrong_side = kit.full(False)
    for i, k in ((YAW_RATE, FRONT), (YAW_RATE, REAR), (FRONT, REAR)):
        follows = agree[i, k] & agree[i, STEERING] & agree[k, STEERING]
        wrong_side = wrong_side | (beyond[SIDE, i] & against[SIDE, k] & follows)
    side, steering = level[SIDE], level[STEERING]
    wrong_side = wrong_side & no(agree[SIDE, FRONT] | agree[SIDE, REAR])
    wrong_side = wrong_side & ((side * steering < 0.0) | (abs(side) > abs(steering)))
    one = against[SIDE, FRONT] | against[SIDE, REAR] | (against[YAW_RATE, SIDE] & no(wrong_yaw))
    wrong_side = wrong_side | (stuck_side & one)
    front, rear = (agree[YAW_RATE, i] & agree[i, STEERING] for i in (FRONT, REAR))
    contradicted = (
        (against[YAW_RATE, SIDE] & no(wrong_yaw)) | against[SIDE, FRONT] | against[SIDE, REAR],
        (against[YAW_RATE, SIDE] & no(wrong_side)) | against[YAW_RATE, FRONT] | against[YAW_RATE, REAR],
    )
    supported = (
        agree[YAW_RATE, SIDE] | agree[SIDE, FRONT] | agree[SIDE, REAR],
        agree[YAW_RATE, SIDE] | agree[YAW_RATE, FRONT] | agree[YAW_RATE, REAR],
    )
    return Vote((wrong_side, wrong_yaw), contradicted, supported, agree[YAW_RATE, STEERING] & (front | rear))
