"""Units of columns that do not say them, from one another: what a speed gains is what the accelerometer felt meanwhile.

The ratio of both is 1 for m/s and m/s^2, 3.6 for km/h, 9.8 for m/s and g, 35 for km/h and g: no two pairs of units are alike. A
wheel speed that reads like the speed of the car is a surface speed in the same unit.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.quantities import factor_to
from studies.drives.robust_line import robust_line

SPEEDS, PULLS = ("m/s", "km/h", "mph"), ("m/s^2", "g")
SPAN = 1.0  # s over which a speed gains something
SURE, NEAR = 0.9, 1.2  # quality of the line, and factor up to which the ratio is that of two units
SAME = 1.1  # factor up to which two columns read the same


def units_together(columns: Mapping[str, tuple[FloatArray, str | None]], rate: float) -> dict[str, str]:
    """Likely units by kind (ax, ay, az, vx, vy, wheel_speed) of ``columns``: by signal (n,) in its unit, and that if it is told.

    Empty where the drive does not show them: without vx or ax, at constant speed, from columns with clocks of their own.
    """
    if not {"vx", "ax"} <= columns.keys():
        return {}
    (vx, speed), (ax, pull) = columns["vx"], columns["ax"]
    found = _pair(_gained(vx, ax, max(1, round(SPAN * rate))), speed, pull)
    wheels, unit = columns.get("wheel_speed_fl"), speed or found.get("vx")
    if unit is not None and wheels is not None:
        moves = np.abs(vx) > 0.3 * np.nanmax(np.abs(vx), initial=0.0)
        if moves.any() and 1.0 / SAME < abs(np.nanmedian(wheels[0][moves] / vx[moves])) < SAME:
            found["wheel_speed"] = unit
    return found


def _gained(vx: FloatArray, ax: FloatArray, span: int) -> float:
    """What the speed gains over what is felt, in their units; NaN where neither changes, or they do not follow one another."""
    gain, total = vx[span:] - vx[:-span], np.concatenate([[0.0], np.cumsum(ax)])
    felt = SPAN * (total[span:-1] - total[: -span - 1]) / span
    if gain.size <= 5 * span or not min(spread := (float(np.std(felt)), float(np.std(gain)))) > 0.0:  # False for NaN
        return np.nan
    line = robust_line(felt / spread[0], gain / spread[1], 1.0)
    sure = line is not None and line.quality >= SURE and line.slope > 0.0 and not line.anchored
    return line.slope * spread[1] / spread[0] if line is not None and sure else np.nan


def _pair(ratio: float, speed: str | None, pull: str | None) -> dict[str, str]:
    off = {
        (v, a): abs(np.log(ratio * factor_to(v, "m/s") / factor_to(a, "m/s^2")))
        for v in ((speed,) if speed else SPEEDS)
        for a in ((pull,) if pull else PULLS)
    }
    (v, a), least = min(off.items(), key=lambda one: one[1])
    return {"vx": v, "vy": v, **dict.fromkeys(("ax", "ay", "az"), a)} if least < np.log(NEAR) else {}
