"""Does a log agree with itself about signs, units and sides? If not: which single mistake of the drive file explains all of it.

Every mistake multiplies the slopes of :mod:`.agreement` by a known factor: a negated column by -1, m/s^2 declared for g by
0.102, left and right wheels exchanged the wheel differences by -1. The mistake that is named explains all slopes that the log
excites; where two explain them equally well, both are named; where none does, two at once, then any factor of one column. Two
columns in one another's place leave no slope at all: they are put back for a trial (:mod:`.exchanged`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display
from studies.drives.agreement import Comparison, compare, wheels_apart
from studies.drives.backward import read_as_forward
from studies.drives.direction import of_known_way
from studies.drives.drive_file import WHEEL_SPEEDS, DriveFile
from studies.drives.exchanged import exchanged
from studies.drives.log import DriveLog, read_log
from studies.drives.plausible import ACCELERATION_UNITS, ANGLE_UNITS, RATE_UNITS, STANDING, WHEEL_UNITS
from studies.drives.quantities import CORNERS, SIGNALS, short
from studies.drives.reference_place import reference_off
from studies.drives.remedies import flip, keys, times_too_large
from studies.errors import LogError

UNITS = {
    "ax": ACCELERATION_UNITS[:2], "ay": ACCELERATION_UNITS[:2], "az": ACCELERATION_UNITS[:2],
    "yaw_rate": RATE_UNITS, "steering": ANGLE_UNITS, "wheels": WHEEL_UNITS,
    **dict.fromkeys(WHEEL_SPEEDS, WHEEL_UNITS),
}  # fmt: skip
AS_GOOD = 0.1  # by which the misfits of two explanations may differ to be told apart: 10 %
MOST_NAMED = 3  # explanations in one line
LONGEST = 200  # characters of all explanations in one line
MANY, NEAR = 80, 0.95
"""Points and quality of a line that may show a factor that is no unit: a slide looks like one for a while."""
ALIKE = (1.15, 1.5)
"""Factors between two units of a wheel speed that no single slope can show: 1 km/h on a wheel of 0.35 m reads like 1.26 rad/s."""
NEARER = 0.55  # of the way, on a logarithmic scale, that all slopes must lie nearer to such a factor than to 1
WEIGHTLESS = 0.05  # az over g below which gravity was taken out
ESCAPE = "correct the drive file (or --no-check)"


@dataclass(frozen=True)
class Mistake:
    """What would be wrong: ``factors`` of reading over truth by group of columns, and the remedy in words.

    A ``rare`` one is named only where no usual one explains the log.
    """

    factors: Mapping[str, float]
    remedy: str
    rare: bool = False


Compared = Callable[[float], Sequence[Comparison]]
"""The comparisons of a log whose wheel speeds are too large by a factor: they enter the steering's prediction nonlinearly."""


@dataclass(frozen=True, repr=False)
class FrameReport(Display):
    """The comparisons of a log, and in one line what contradicts and how to mend it.

    None where nothing does, and where no mistake explains what is off: then it is the drive (slip, drift, bank), no column.
    """

    comparisons: tuple[Comparison, ...]
    complaint: str | None

    def rows(self) -> list[dict[str, Any]]:
        """For tables and JSON: what was compared, slope (1 is right), quality of the line, and what follows."""
        found = []
        for one in self.comparisons:
            line = one.line
            said = "not excited: cannot tell" if line is None else "unclear: cannot tell"
            if one.decides:
                wrong = "off: cannot tell" if self.complaint is None else "contradicts"
                said = "agrees" if one.agrees else wrong
            found.append({
                "comparison": one.title, "slope": None if line is None else line.slope,
                "quality": None if line is None else line.quality, "verdict": said,
            })  # fmt: skip
        return found


def read_checked(paths: Sequence[Path], drive: DriveFile, check: bool = True) -> tuple[DriveLog, tuple[str, ...]]:
    """The log of a drive, and what is assumed of it: nothing once its signals were compared (in its report as "frames").

    Raises LogError: as :func:`.read_log`, and where signals contradict one another, unless ``check`` is False here or in the
    drive file.
    """
    log = read_log(paths, drive)
    if not (check and drive.check):
        return log, ("signs, units and sides of the signals are right: not checked (--no-check, or check = false)",)
    found = check_frames(log.signals, drive, log.files, log.reference)
    if found.complaint is not None:
        raise LogError(found.complaint)
    log.report["frames"] = found.rows()
    return log, ()


def check_frames(
    signals: Mapping[str, FloatArray],
    drive: DriveFile,
    files: Mapping[str, str],
    reference: Mapping[str, FloatArray] | None = None,
) -> FrameReport:
    """Compare the signals (n,) in SI with one another, and with the ``reference``; ``files`` names the file of each log."""
    if drive.unsigned_wheels:
        signals = of_known_way(signals, drive.vehicle.parameters)
    apart = [one for one in wheels_apart(signals, drive) if one.line is None or abs(one.line.slope) > STANDING]
    wheels = [mistake for corner in CORNERS for mistake in _singles(drive, f"wheel_speed_{corner}")]
    named = _explain(lambda _factor: apart, wheels)
    if named:
        return FrameReport(tuple(apart), _line_of(drive, files, apart, named))

    @functools.cache
    def compared(factor: float) -> Sequence[Comparison]:
        corrected = {name: value / factor if name in WHEEL_SPEEDS else value for name, value in signals.items()}
        return compare(corrected, drive)

    found = tuple(compared(1.0))
    named = _exchanged(signals, drive, found) or _named(compared, drive)
    if not named and not drive.unsigned_wheels and (backward := read_as_forward(signals, drive)) is not None:
        unsigned = Mistake(
            {"wheels": -1.0}, "unsigned_wheels = true at the top of the drive file (backward reads as forward)"
        )
        return FrameReport((*found, backward), _line_of(drive, files, (backward,), [unsigned]))
    if named or (off := reference_off(signals, reference or {}, drive)) is None:
        return FrameReport(found, _line_of(drive, files, found, named) if named else None)
    file = files[drive.log_of(drive.reference["vx"])]
    return FrameReport(found, f"{file}: {off[0]}: {off[1]}; {ESCAPE}")


def _exchanged(signals: Mapping[str, FloatArray], drive: DriveFile, given: Sequence[Comparison]) -> list[Mistake]:
    found = exchanged(signals, drive, given)
    if found is None:
        return []
    (a, b), negated = found
    words = f", and then the other sign for {keys(negated)}" if negated else ""
    return [Mistake({a: 1.0, b: 1.0}, f"signals.{a} and signals.{b} exchanged{words}")]


def _named(compared: Compared, drive: DriveFile) -> list[Mistake]:
    found = compared(1.0)
    for one in found:
        if "az" in one.gains and one.line is not None and abs(one.line.slope) < WEIGHTLESS:
            return [Mistake({"az": 0.0}, "az without gravity: it must read +9.81 m/s^2 at rest; leave signals.az out")]
    known = _mistakes(drive)
    named = _explain(compared, known)
    if not named:
        pairs = [(a, b) for a, b in combinations(known, 2) if not a.factors.keys() & b.factors.keys()]
        both = [Mistake({**a.factors, **b.factors}, f"{a.remedy} and {b.remedy}", a.rare or b.rare) for a, b in pairs]
        named = _explain(compared, both)
    return named or _explain(compared, _any_factor(found, drive)) or _unit_alike(found, drive)


def _unit_alike(found: Sequence[Comparison], drive: DriveFile) -> list[Mistake]:
    """A unit of the wheel speeds that is not far from the right one: every slope with them is off by just that factor."""
    sure = [one for one in found if one.gains.get("wheels") == -1 and "steering" not in one.gains and one.sure]
    mistakes = [
        one for one in _units(drive, "wheels") if ALIKE[0] < max(f := one.factors["wheels"], 1.0 / f) <= ALIKE[1]
    ]
    return [
        Mistake(one.factors, f"{one.remedy}, or another effective_radius")
        for one in mistakes
        if len(sure) > 1
        and max(each.misfit(one.factors) for each in sure) < NEARER * abs(np.log(one.factors["wheels"]))
    ]


def _mistakes(drive: DriveFile) -> list[Mistake]:
    """Every mistake of a drive file that one edit mends, or that is one idea: a frame, a side, a unit of a device."""
    given, found = drive.signals, []
    for group in ("ax", "ay", "az", "yaw_rate", "steering", "wheels"):
        found += _singles(drive, group)
    swapped = "signals.wheel_speed_*: left and right exchanged"
    found += [
        Mistake({"front": -1.0, "rear": -1.0}, swapped),
        Mistake({"front": -1.0}, f"{swapped} at the front"),
        Mistake({"rear": -1.0}, f"{swapped} at the rear"),
    ]
    inertial = [name for name in ("ax", "ay", "az") if name in given]
    if len({given[name].unit for name in inertial}) == 1:
        for sub in (inertial, inertial[:2]):
            if len(sub) > 1:
                unit, own = "ax", given["ax"].unit
                for other in UNITS[unit]:
                    factor = given["ax"].factor_of(own, "m/s^2") / given["ax"].factor_of(other, "m/s^2")
                    found.append(Mistake(dict.fromkeys(sub, factor), f'unit = "{other}" for {keys(sub)}'))
    steered = [name for name in ("steering",) if _columns(drive, "steering")]
    for axes, why in (
        (["ax", "ay"], "sensor turned by 180 degrees"),
        (["ay", "yaw_rate"], "y axis to the right"),
        (["ay", "az", "yaw_rate"], "y axis to the right, z down"),
        (["ay", "yaw_rate", *steered], "y axis to the right"),
        (["ay", "az", "yaw_rate", *steered], "y axis to the right, z down"),
    ):
        if all(name in given or name == "steering" for name in axes):
            names = [column for axis in axes for column in _columns(drive, axis)]
            found.append(Mistake(dict.fromkeys(axes, -1.0), f"{flip(drive, names)} ({why})", rare="ax" in axes))
    unique = {tuple(sorted(one.factors.items())): one for one in found}
    return [one for one in unique.values() if any(factor != 1.0 for factor in one.factors.values())]


def _singles(drive: DriveFile, group: str) -> list[Mistake]:
    """Sign and unit of one group of columns, and both at once."""
    names = _columns(drive, group)
    if not names:
        return []
    other = flip(drive, names)
    reversing = " (or reversed with unsigned wheel speeds: unsigned_wheels = true)" if group == "wheels" else ""
    found = [Mistake({group: -1.0}, other + reversing, rare=group == "wheels")]
    for one in _units(drive, group):
        factor = one.factors[group]
        if abs(np.log(factor)) > np.log(ALIKE[1]):
            found += [one, Mistake({group: -factor}, f"{one.remedy} and {other}", rare=True)]
    return found


def _units(drive: DriveFile, group: str) -> list[Mistake]:
    """Another unit of one group of columns, if they have one in common."""
    names = _columns(drive, group)
    if len({drive.signals[name].unit for name in names}) != 1:
        return []
    column, target, radius = drive.signals[names[0]], SIGNALS[names[0]], drive.vehicle.radius_for(names[0])
    given = column.factor_of(column.unit, target, radius)
    return [
        Mistake({group: given / column.factor_of(unit, target, radius)}, f'unit = "{unit}" for {keys(names)}')
        for unit in UNITS[group]
    ]


def _any_factor(found: Sequence[Comparison], drive: DriveFile) -> list[Mistake]:
    """One column read too large or too small by a number that is no unit."""
    groups = {group for one in found for group in one.gains if _columns(drive, group)}
    mistakes = []
    for one in found:
        if one.line is None or one.agrees or one.line.points < MANY or one.line.quality < NEAR:
            continue
        for group in sorted(groups & one.gains.keys()):
            if abs(one.gains[group]) == 1:
                factor = one.line.slope ** one.gains[group]
                mistakes.append(Mistake({group: factor}, times_too_large(_columns(drive, group), factor)))
    return mistakes


def _explain(compared: Compared, mistakes: Sequence[Mistake]) -> list[Mistake]:
    """The mistakes that explain what contradicts, best first, those that are as good included."""
    given = compared(1.0)
    if not any(one.contradicts for one in given):
        return []
    fits = []
    for mistake in mistakes:
        factors = dict(mistake.factors)
        wheels = factors.pop("wheels", 1.0)
        found = compared(wheels)
        silenced = any(old.decides and not new.decides for old, new in zip(given, found, strict=True))
        if not silenced and all(one.explained(factors, wheels) for one in found):
            fits.append((mistake.rare, sum(one.misfit(factors) for one in found), mistake))
    fits.sort(key=lambda fit: fit[:2])
    named: dict[frozenset[str], Mistake] = {}
    for rare, total, mistake in fits:
        if rare == fits[0][0] and total <= fits[0][1] + AS_GOOD:
            named.setdefault(frozenset(mistake.factors), mistake)
    return list(named.values())[:MOST_NAMED]


def _line_of(drive: DriveFile, files: Mapping[str, str], found: Sequence[Comparison], named: list[Mistake]) -> str:
    off = [one for one in found if not one.agrees] or [one for one in found if one.line is not None and not one.decides]
    worst = max(off or found, key=lambda one: one.misfit({}) - np.log(one.band))
    groups = list(named[0].factors)
    names = [name for group in groups for name in _columns(drive, group)] or [WHEEL_SPEEDS[0]]
    column = drive.signals[names[0]]
    place = f"{files[drive.log_of(column)]}: signals.{names[0]}: column '{short(column.column, 30)}' in {short(column.unit)}"
    slope = worst.line.slope if worst.line is not None else np.nan
    seen = f"{worst.title} is {slope:.3g}, should be 1" if worst.decides else f"{worst.title} has no steady slope"
    remedies = [one.remedy for one in named]
    while len(remedies) > 1 and sum(map(len, remedies)) > LONGEST:
        remedies.pop()
    return f"{place}: {seen}; likely {', or '.join(remedies)}; {ESCAPE}"


def _columns(drive: DriveFile, group: str) -> list[str]:
    """The signals of a group that the drive file has."""
    if group in ("wheels", "front", "rear"):
        of = {"wheels": slice(0, 4), "front": slice(0, 2), "rear": slice(2, 4)}[group]
        return list(WHEEL_SPEEDS[of])
    if group == "steering":
        return [name for name in ("steering", "hand_wheel", "steer_fl", "steer_fr") if name in drive.signals]
    return [group] if group in drive.signals else []
