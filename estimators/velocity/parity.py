"""The parity relations of the signal monitor, as data: which witnesses tell one number, what they are made of, who outvotes whom.

    turn    m/s^2, centripetal   yaw rate V_x r; a_y levelled and less V_y'; front and rear wheels V_x (v_r - v_l)/t; steering
                                 V_x^2 tan(delta)/L; a_y as it is, where an attitude part levels the other
    pull    m/s^2, along         a_x, levelled; forces sum F_x/m; the middle of what the wheels gain
    speed   m/s                  each wheel; the estimate, which the other wheels and the inertial unit hold
    axles   m/s, V_y             the front axle condition, the rear one; the estimate

Any two witnesses of a relation are a residual: it responds to a fault unless the same signals at fault are in both. Road and
tires move witnesses, too, and no sensor is at fault then (`CONDITIONS`). What of all this can be told apart is derived from
here by `isolability`. `speed` and `axles` are voted on by the gates of the two filters.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

Groups = tuple[tuple[int, ...], ...]

YAW_RATE, SIDE, FRONT, REAR, STEERING, UNLEVELLED = range(6)  # SIDE: a_y
UNIT, FORCES, WHEELS = range(3)  # UNIT: a_x
ESTIMATE, FRONT_AXLE, REAR_AXLE = range(3)


class Rule(NamedTuple):
    """By whom the reading of a signal is outvoted: by any of the groups whose members agree with each other and contradict it."""

    signal: str
    witness: int  # that speaks for it
    live: Groups
    repeating: Groups = ()  # the same for one that repeats itself; an empty group: at once
    second: int | None = None  # who must agree with a group against a live reading
    backers: tuple[int, ...] = ()  # whoever agrees with one of these is not outvoted while alive
    peers: tuple[int, ...] = ()  # who keep it out while one contradicts it, and bring it back when one agrees
    one_sided: bool = False  # a live reading that is too small looks like a condition of the road: it is not doubted


class Witness(NamedTuple):
    """What it is made of, and how many of these signals must be at fault to move it: the middle of four heeds no single one."""

    name: str
    made_of: frozenset[str]
    least: int


class Relation(NamedTuple):
    """Witnesses of one number, and the rules of their vote."""

    name: str
    witnesses: tuple[Witness, ...]
    rules: tuple[Rule, ...]
    slide: tuple[float, float] = (0.0, 0.0)  # m/s^2, and share of the larger: added before a live reading is doubted


CONDITIONS = {
    "slide": "the car turns further than its side force carries it",
    "bank": "cross slope",
    "front grip": "the front tires are beyond what they carry",
    "slip": "all four wheels slip alike",
    "grade": "a slope that is not known yet",
}
CORNERS = ("wheel fl", "wheel fr", "wheel rl", "wheel rr")


def _witness(name: str, *made_of: str, least: int = 1) -> Witness:
    return Witness(name, frozenset(made_of), least)


def _pairs(*places: int) -> Groups:
    return tuple(combinations(places, 2))


TURN = Relation(
    "turn",
    (
        _witness("yaw rate", "yaw_rate"),
        _witness("a_y", "ay", "roll", "slide"),
        _witness("front wheels", *CORNERS[:2]),
        _witness("rear wheels", *CORNERS[2:]),
        _witness("steering", "steer", "front grip"),
        _witness("a_y not levelled", "ay", "slide", "bank"),
    ),
    (
        Rule(
            "yaw_rate", YAW_RATE,
            live=tuple(combinations((SIDE, FRONT, REAR, STEERING), 3)),
            # a frozen gyro of a car that slides: its steering and a_y may agree on less than the turn
            repeating=tuple(pair for pair in _pairs(SIDE, FRONT, REAR, STEERING) if pair != (SIDE, STEERING)),
            backers=(FRONT, REAR), peers=(SIDE, FRONT, REAR),
        ),
        Rule("roll", SIDE, live=_pairs(YAW_RATE, FRONT, REAR), second=UNLEVELLED, peers=(YAW_RATE, FRONT, REAR)),
        Rule(
            "ay", SIDE,
            live=_pairs(YAW_RATE, FRONT, REAR), repeating=((YAW_RATE,), (FRONT,), (REAR,)),
            second=STEERING, backers=(FRONT, REAR), peers=(YAW_RATE, FRONT, REAR), one_sided=True,
        ),
    ),
    slide=(0.5, 0.1),
)  # fmt: skip
PULL = Relation(
    "pull",
    (
        _witness("a_x", "ax", "pitch"),
        _witness("forces", "torque"),
        _witness("wheels", *CORNERS, "slip", "grade", least=2),
    ),
    (Rule("ax", UNIT, live=((FORCES, WHEELS),), repeating=((),), peers=(FORCES, WHEELS)),),
)
SPEED = Relation(
    "speed",
    (_witness("estimate"), *(_witness(corner, corner, "slip") for corner in CORNERS)),
    tuple(Rule(corner, place, live=((ESTIMATE,),)) for place, corner in enumerate(CORNERS, 1)),
)
AXLES = Relation(
    "axles",
    (
        _witness("estimate"),
        _witness("front axle", "ay", "yaw_rate", "steer", "slide", "front grip"),
        _witness("rear axle", "ay", "yaw_rate", "slide"),
    ),
    (Rule("steer", FRONT_AXLE, live=((ESTIMATE, REAR_AXLE),)),),
)
RELATIONS = (TURN, PULL, SPEED, AXLES)
