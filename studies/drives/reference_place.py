"""Does the velocity reference stand where the drive file says? What the wheels and the yaw rate make of it, if not.

Brought to the centre of gravity from a place that is wrong by e, and turned by an angle that is wrong by d, it reads

    V_x = V_wheels + e_y r,      V_y = l_r r - a_r V - e_x r,      V_y / V_x = d on straights,

with the slip angle a_r of the rear axle: on ordinary roads half a metre per second of V_y at most while the car is slow.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.agreement import ALONG, MOVING, SURE, TURNS, WINDOW, averaged, surface_speeds
from studies.drives.drive_file import DriveFile
from studies.drives.robust_line import Line, robust_line

SLOW, FAST = 8.0, 5.0  # m/s: below it the rear axle slips little; above it an angle is more than noise
OFF = 0.5  # m by which an arm along y may be wrong: wheels that drive through a turn slip by as much
SPINS = 0.3  # share of their speed by which wheels that roll may be off: an arm of 2 m at 5 m/s and 0.7 rad/s
LEAST = 0.5  # V_x over the speed of wheels that roll
SLIPS = (
    -1.0,
    0.6,
)  # m beside l_r that V_y / r of a slow car may be: soft tires at 8 m/s, and an arm that is a little wrong
TURNED = np.radians(1.5)  # crossfall, toe and bushings leave 0.5 degrees
STRAIGHT = 0.02  # rad/s
ENOUGH = 2.0  # s of straight driving


def reference_off(
    signals: Mapping[str, FloatArray], reference: Mapping[str, FloatArray], drive: DriveFile
) -> tuple[str, str] | None:
    """Key of the drive file that is wrong, and why with the likely value; None where nothing is, or the drive does not tell.

    ``signals``, ``reference`` (n,) in SI at the centre of gravity, the wheel speeds with their sign.
    """
    if "yaw_rate" not in signals or "vx" not in reference or "steer_rl" in drive.signals:
        return None
    place, every = drive.mounting.reference, max(1, round(0.5 * WINDOW / drive.sample_time))

    def mean(value: FloatArray) -> FloatArray:
        return averaged(value, round(WINDOW / drive.sample_time))[::every]

    wheels = mean(surface_speeds(signals, drive.vehicle).mean(axis=1))
    turn, vx, push = mean(signals["yaw_rate"]), mean(reference["vx"]), mean(signals["ax"])
    rolls = (np.abs(wheels) > MOVING) & (np.abs(push) < ALONG)
    if axis := _other_axis(
        vx, mean(reference["vy"]) if "vy" in reference else 0.0 * vx, np.where(rolls, wheels, np.nan)
    ):
        return axis
    rolls &= np.abs(vx - wheels) < SPINS * np.abs(wheels)
    line = robust_line(np.where(rolls, turn, np.nan), vx - wheels, TURNS)
    if _sure(line) and abs(line.slope) > OFF:
        right = _metres("y", place.y - line.slope)
        return "mounting.reference.y", f"{_seen('V_x less that of the wheels', line)}, should be 0; likely {right}"
    if "vy" not in reference:
        return None
    vy, rear = mean(reference["vy"]), drive.vehicle.rear_axle_distance
    straight = (vx > FAST) & (np.abs(turn) < STRAIGHT) & np.isfinite(vy)
    if np.count_nonzero(straight) * every * drive.sample_time > ENOUGH:
        angle = float(np.median(vy[straight] / vx[straight]))
        if abs(angle) > TURNED:
            likely = f'reference = {{ yaw = "{np.degrees(place.yaw - angle):.2g} deg" }}'
            return "mounting.reference.yaw", (
                f"V_y / V_x is {np.degrees(angle):.2g} deg on straights, should be 0; likely {likely}"
            )
    line = robust_line(np.where(rolls & (np.abs(wheels) < SLOW), turn, np.nan), vy, TURNS)
    if not _sure(line) or SLIPS[0] < line.slope - rear < SLIPS[1]:
        return None
    seen = f"{_seen('V_y', line)} below {SLOW:g} m/s, should be near {rear:g} m"
    if SLIPS[0] < -line.slope - rear < SLIPS[1]:
        other = _metres("x", place.x + line.slope - rear)
        return "reference.vy", f"{seen}; likely the other sign for reference.vy (y axis to the right), or {other}"
    return "mounting.reference.x", f"{seen}; likely {_metres('x', place.x + line.slope - rear)}"


def _other_axis(vx: FloatArray, vy: FloatArray, wheels: FloatArray) -> tuple[str, str] | None:
    """What is wrong where V_x is not along the wheels at all: its sign, or V_y in its place."""
    fast = np.abs(wheels) > FAST
    along, across = ((value / wheels)[fast & np.isfinite(value)] for value in (vx, vy))
    if not along.size or not across.size or (ahead := float(np.median(along))) > LEAST:
        return None
    seen, beside = f"V_x over the speed of the wheels is {ahead:.2g}, should be 1", float(np.median(across))
    if ahead < -LEAST:
        return "reference.vx", f"{seen}; likely the other sign for reference.vx"
    if abs(beside) > LEAST:
        angle = "-90" if beside > 0.0 else "90"
        return "reference.vx", f'{seen}; likely V_x and V_y exchanged, or reference = {{ yaw = "{angle} deg" }}'
    return None  # wheels that spin on ice


def _sure(line: Line | None) -> TypeGuard[Line]:
    return line is not None and line.quality >= SURE and not line.anchored


def _seen(what: str, line: Line) -> str:
    return f"{what} over the yaw rate is {line.slope:.2g} m"


def _metres(axis: str, value: float) -> str:
    return f'reference = {{ {axis} = "{value:.1f} m" }}'
