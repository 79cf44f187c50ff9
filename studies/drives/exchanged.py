"""Two columns in one another's place: no slope shows that, for nothing in them follows anything. They are put back on trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimators.arrays import FloatArray
from studies.drives.agreement import SURE, WIDE_MATCH, Comparison, compare
from studies.drives.drive_file import WHEEL_SPEEDS, DriveFile

EXCHANGES = (
    ("ax", "ay"), ("ax", "az"), ("ay", "az"), ("yaw_rate", "roll_rate"), ("yaw_rate", "pitch_rate"),
    ("wheel_speed_fr", "wheel_speed_rl"), ("wheel_speed_fl", "wheel_speed_rr"),
)  # fmt: skip
"""Columns that are taken for one another: axes of the inertial unit, and wheels in the order fl, rl, fr, rr. Wheels of one side
roll alike: front and rear cannot be told apart."""


Exchange = tuple[tuple[str, str], tuple[str, ...]]
"""Two columns, and which of them have the other sign as well."""


def exchanged(signals: Mapping[str, FloatArray], drive: DriveFile, given: Sequence[Comparison]) -> Exchange | None:
    """The exchange that makes a sure line of something in the two columns that follows nothing, and leaves no line off.

    ``given``: the comparisons of the signals (n,) as they are.
    """
    off = [one.line is not None and not (one.decides and one.agrees) for one in given]
    fits: list[tuple[int, float, Exchange]] = []
    for a, b in EXCHANGES:
        groups = {"front", "rear"} if a in WHEEL_SPEEDS else {a, b}
        strange = [k for k, one in enumerate(given) if off[k] and groups & one.gains.keys()]
        if not (strange and {a, b} <= signals.keys()):
            continue
        found = compare({**signals, a: signals[b], b: signals[a]}, drive)
        lines = [found[k].line for k in strange if found[k].match < WIDE_MATCH]
        lost = any(not off[k] and old.decides and not found[k].decides for k, old in enumerate(given))
        if lost or not any(line is not None and line.quality >= SURE for line in lines):
            continue
        for negated in ((),) if a in WHEEL_SPEEDS else ((), (a,), (b,), (a, b)):
            signs = dict.fromkeys(negated, -1.0)
            if all(one.explained(signs) for one in found):
                fits.append((len(negated), sum(one.misfit(signs) for one in found), ((a, b), negated)))
    return min(fits, key=lambda fit: fit[:2])[2] if fits else None
