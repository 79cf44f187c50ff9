"""A first drive file from the names, units and ranges of a log's columns: to be read, corrected and kept by a person."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from estimators.arrays import FloatArray
from studies.drives.columns import LogFile
from studies.drives.formats import name_columns, read_table
from studies.drives.guess_names import Guess, guess_column
from studies.drives.guess_units import units_together
from studies.drives.quantities import SIGNALS, factor_to, short
from studies.drives.sniff import sniff
from studies.errors import LogError
from studies.execution.files import write_bytes
from synthesis.errors import SpecError

NEEDED = (*(f"wheel_speed_{corner}" for corner in ("fl", "fr", "rl", "rr")), "ax")
FASTEST = 100.0  # Hz from which on the shipped sample time of 5 ms is taken
RADIUS = 0.33  # m where no reference velocity says it: the shipped schedules are for it
RATES = ("yaw_rate", "roll_rate", "pitch_rate")
WEIGHTLESS = "left out: az must hold gravity, +9.81 m/s^2 at rest"
CALM = 0.3  # share of such samples, those of least acceleration, that the radii are taken from
BY_HAND = "write the drive file by hand (gainsmith new my-car --drive has one with comments)"
MOST_OTHERS = 1000  # characters of the names of columns that were taken for nothing
FAST = 5.0  # m/s of the reference above which wheels roll

WRITTEN = ("time_unit", "time_format", "delimiter", "decimal", "thousands", "encoding", "header_line", "units_row")
"""Keys of a log that a guess writes where they are not the usual ones."""


@dataclass
class _Found:
    """One file: its description, and what its columns were taken for."""

    path: Path
    entry: LogFile
    guesses: dict[str, Guess]
    values: dict[str, FloatArray]
    rate: float
    start: float
    remarks: list[str] = field(default_factory=list)

    @cached_property
    def likely(self) -> dict[str, str]:
        """Units by kind, where the columns show them together."""
        known = {one.name: (self.values[name], one.unit) for name, one in self.guesses.items() if name in self.values}
        return units_together(known, self.rate)


@dataclass(frozen=True)
class Guessed:
    """The text of a drive file, what was found (signal -> column), and the needed signals that were not."""

    text: str
    found: dict[str, str]
    missing: tuple[str, ...]


def write_guess(logs: Sequence[Path], drive: Path | None) -> tuple[Path, Guessed]:
    """Write a drive file for the ``logs``: to ``drive``, else beside the first log; an existing file is never replaced.

    Raises SpecError for a file that is there or cannot be written, LogError for a log that cannot be read or has no clock.

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from studies.truth.export import write_drive
    >>> truth = simulate_manoeuvres([load_manoeuvre("p2-step-steer-dry").model_copy(update={"duration": 2.0})])
    >>> with TemporaryDirectory() as folder:
    ...     log, drive = write_drive(Path(folder), draw(truth, Sensors(), seeds=[0]))
    ...     path, guessed = write_guess([log], Path(folder) / "guessed.toml")
    ...     print(path.name, guessed.found["yaw_rate"])
    guessed.toml yaw_rate
    """
    target = drive or logs[0].with_suffix(".toml")
    if target.exists():
        raise SpecError(f"{target.name}: is there already, and a guess never replaces it; give another --drive")
    guessed = guess(logs)
    try:
        write_bytes(target, guessed.text.encode())
    except OSError as error:
        raise SpecError(f"{target.name}: cannot be written ({error.strerror}); give another --drive") from error
    return target, guessed


def guess(logs: Sequence[Path]) -> Guessed:
    """The drive file as text. Raises LogError for a log that cannot be read or has no clock."""
    files = [_look(path) for path in logs]
    taken: dict[str, str] = {}
    for file in files:  # of two columns for one signal the first is taken
        for column, one in list(file.guesses.items()):
            key = f"{one.table}.{one.name}"
            if one.table != "time" and taken.setdefault(key, column) != column:
                file.remarks.append(f"column {json.dumps(column)} also looks like {key}")
                del file.guesses[column]
    _one_steering(files)
    names = {one.name: column for file in files for column, one in file.guesses.items() if one.table != "time"}
    missing = tuple(name for name in NEEDED if name not in names)
    return Guessed(_text(files, missing), names, missing)


def _look(path: Path) -> _Found:
    entry = sniff(path)
    names = name_columns(path, entry)
    guesses: dict[str, Guess] = {}
    for column, unit in names.items():
        one = guess_column(column, unit)
        if one is not None and one not in guesses.values():
            guesses[column] = one
    clocks = [column for column, one in guesses.items() if one.table == "time"]
    if entry.time in names:
        clocks = [entry.time]
    if not clocks:
        shown = short(", ".join(names), 80)
        raise LogError(f"{path.name}: no column looks like a clock ({shown}); rename it to time, or {BY_HAND}")
    for other in [column for column, one in guesses.items() if one.table == "time" and column != clocks[0]]:
        del guesses[other]
    given = guesses.get(clocks[0], Guess("time", "time", None))
    wanted = dict.fromkeys([clocks[0], *(c for c in guesses if c != clocks[0])], "guess")
    entry = entry.model_copy(update={"time": clocks[0]})
    others = [name for name in names if name not in guesses and name != clocks[0]]
    if len(guesses) <= (clocks[0] in guesses):
        raise LogError(f"{path.name}: no name says what is measured ({short(', '.join(others), 100)}); {BY_HAND}")
    table = read_table(path, wanted, entry)
    stamps = table.values[clocks[0]]
    spacing = np.diff(np.unique(stamps[np.isfinite(stamps)]))
    if not spacing.size:
        raise LogError(f"{path.name}: time column '{short(clocks[0], 40)}' holds less than two stamps; record again")
    step = float(np.median(spacing))
    unit = "s" if entry.time_format == "iso" or table.merged else given.unit or _time_unit(step)
    values = {column: table.values[column] for column in guesses if column != clocks[0]}
    own = [np.diff(stamps[np.isfinite(value)]) for value in values.values()] if table.merged else []
    steps = [float(np.median(one)) for one in own if one.size] or [step]  # columns of a merged table have their own
    step, slowest = (each * factor_to(unit, "s") for each in (min(steps), max(steps)))
    entry = entry.model_copy(update={"time_unit": unit, "max_gap": 5.0 * slowest if slowest > 1.5 * step else None})
    start = float(np.nanmin(stamps)) * factor_to(unit, "s")
    spare = dict.fromkeys(re.sub(r"\[\d+\]", "[]", name) for name in others)  # an array once
    told = [f"not taken for a signal: {short(', '.join(spare), MOST_OTHERS)}"] if spare else []
    return _Found(path, entry, guesses, values, 1.0 / step, start, told)


def _time_unit(step: float) -> str:
    """Of a clock that does not say: logs run at 10 Hz to 10 kHz, so that steps of 0.1 ms to 0.1 s fit one unit only."""
    return next((unit for unit, most in (("s", 0.5), ("ms", 500.0), ("us", 5e5)) if step < most), "ns")


def _one_steering(files: list[_Found]) -> None:
    """A steered axle is described once: both wheels, else one angle, else the hand wheel."""
    where = {one.name: (file, column) for file in files for column, one in file.guesses.items()}
    both = "steer_fl" in where and "steer_fr" in where
    drop = [name for name in ("steer_fl", "steer_fr") if not both]
    rear = [name for name in ("steer_rl", "steer_rr") if name in where]
    steers = [np.nanmax(np.abs(where[name][0].values[where[name][1]]), initial=0.0) > 0.0 for name in rear]
    drop += rear if sum(steers) < 2 else []
    drop += ["steering", "hand_wheel"] if both else ["hand_wheel"] if "steering" in where else []
    for name in drop:
        if name in where:
            file, column = where[name]
            del file.guesses[column]


def _kind(name: str) -> str:
    """What columns of one sensor, and so of one unit, have in common."""
    kind = name.rsplit("_", 1)[0] if name[-3:] in ("_fl", "_fr", "_rl", "_rr") else name
    return "rate" if kind in RATES else kind


def _high(value: FloatArray) -> float:
    known = np.abs(value[np.isfinite(value)])
    return float(np.percentile(known, 99.0)) if known.size else 0.0


def _unit(file: _Found, column: str) -> tuple[str, str, str]:
    """Unit, sign and a remark: from the header if it says one, else from the range of all columns of the kind."""
    one, value = file.guesses[column], file.values[column]
    kind = _kind(one.name)
    alike = [name for name, other in file.guesses.items() if _kind(other.name) == kind and other.table == one.table]
    high = max(_high(file.values[name]) for name in alike)
    middle = float(np.nanmedian(value)) if np.isfinite(value).any() else 0.0
    sign = ', sign = "negative"' if one.name == "az" and middle < 0.0 else ""
    if one.name == "az" and abs(middle) < 0.05:
        return one.unit or "m/s^2", "", WEIGHTLESS
    order = "the order of the wheels is a guess" if kind == "wheel_speed" and re.search(r"\[\d+\]$", column) else ""
    if one.unit is not None:
        return one.unit, sign, order
    lifted = [float(np.nanmedian(file.values[name])) for name, other in file.guesses.items() if other.name == "az"]
    in_g = any(0.5 < abs(one) < 2.0 for one in lifted)  # one sensor, one unit, and only az shows which
    unit = {
        "wheel_speed": "rpm" if high > 400.0 else "rad/s", "torque": "N*m", "steer": "deg" if high > 1.3 else "rad",
        "steering": "deg" if high > 1.3 else "rad", "hand_wheel": "deg" if high > 15.0 else "rad",
        **dict.fromkeys(("ax", "ay", "az"), "g" if in_g else "m/s^2"), "vx": "km/h" if high > 90.0 else "m/s",
        "vy": "m/s",
        **file.likely,
    }.get(kind, "deg/s" if high > 3.0 else "rad/s")  # fmt: skip
    return unit, sign, "unit and order of the wheels are guesses" if order else "the unit is a guess"


def _radii(files: list[_Found]) -> tuple[float, float]:
    """Effective radii, m, of both axles from a reference velocity and free-rolling wheels of one file; else the usual ones."""
    for file in files:
        column = {one.name: name for name, one in file.guesses.items()}
        if "vx" not in column or not {f"wheel_speed_{c}" for c in ("fl", "fr", "rl", "rr")} <= column.keys():
            continue
        si = {
            name: file.values[column[name]] * _factor(file, column[name])
            for name in column
            if name in ("vx", *NEEDED[:4])
        }
        if any(not np.isfinite(_factor(file, column[name])) for name in NEEDED[:4]):
            continue
        found = []
        for pair in (NEEDED[:2], NEEDED[2:4]):
            turned = 0.5 * (si[pair[0]] + si[pair[1]])
            rolls = (si["vx"] > FAST) & (turned > 0.0)
            if "ax" in column and rolls.any():  # wheels slip least where the car neither drives nor brakes
                push = np.abs(file.values[column["ax"]])
                rolls &= push <= np.nanquantile(push[rolls], CALM)
            ratio = si["vx"][rolls] / turned[rolls]
            found.append(float(np.median(ratio)) if ratio.size else np.nan)
        if all(0.2 < one < 0.6 for one in found):
            return round(found[0], 3), round(found[1], 3)
    return RADIUS, RADIUS


def _factor(file: _Found, column: str) -> float:
    try:
        return factor_to(_unit(file, column)[0], "m/s" if file.guesses[column].name == "vx" else "rad/s")
    except ValueError:
        return np.nan


def _text(files: list[_Found], missing: Sequence[str]) -> str:
    radii = _radii(files)
    rate = max(file.rate for file in files)
    step = 5.0 if rate >= FASTEST else 1000.0 / rate
    shipped = step == 5.0 and all(abs(radius / RADIUS - 1.0) < 0.1 for radius in radii)
    named = {one.name for file in files for one in file.guesses.values()}
    lines = [
        "# A guess by gainsmith run --guess: read every line, above all those marked CHECK. Frame: x forward, y left, z up.",
        'schema = "gainsmith.drive/1"', f"name = {_quoted(files[0].path.stem)}", f'sample_time = "{step:.6g} ms"',
        "# unsigned_wheels = true # the wheel speeds have no sign, as in most cars; the gear tells the way, if the log has it:",
        '# direction = { column = "gear", backward = [-1] } # the readings that mean reverse', "",
        "[vehicle] # CHECK: a usual car, not yours",
        'mass = "1600 kg"', 'front_axle_distance = "1.3 m" # front axle to centre of gravity', 'rear_axle_distance = "1.5 m"',
        'cg_height = "0.55 m"', 'front_track = "1.58 m"', 'rear_track = "1.58 m"',
        f'effective_radius_front = "{radii[0]:g} m"' + ("" if radii == (RADIUS, RADIUS) else " # CHECK: from the reference"),
        f'effective_radius_rear = "{radii[1]:g} m"',
        *(['wheel_inertia = "1.2 kg*m^2"'] if any(name.startswith("torque_") for name in named) else []),
        *(["steering_ratio = 15.0"] if "hand_wheel" in named else []), "",
    ]  # fmt: skip
    hash_ = "" if shipped else "# "
    if not shipped:
        mean = 0.5 * (radii[0] + radii[1])
        lines += [
            "# Without schedules the corner observers are left out. For this wheel and sample time:",
            f'#   gainsmith schedules corner-estimation-longitudinal --radius "{mean:g} m" --sample-time "{step:.6g} ms" --out .',
        ]
    lines += [f"{hash_}[schedules]", f'{hash_}longitudinal = "corner-estimation-longitudinal"', ""]
    for file in files:
        lines += _log_lines(file, files)
    several = len(files) > 1
    for table in ("signals", "reference"):
        rows = [row for file in files for row in _rows(file, table, several)]
        if table == "signals":
            rows += [f'# {name} = {{ column = "?", unit = "{SIGNALS[name]}" }} # CHECK: not found' for name in missing]
        if rows:
            lines += [f"[{table}]", *rows, ""]
    lines += [f"# {remark}" for file in files for remark in file.remarks]
    return "\n".join(lines).rstrip() + "\n"


def _log_lines(file: _Found, files: list[_Found]) -> list[str]:
    entry = file.entry
    lines = ["[[log]]", f"name = {_quoted(file.path.stem)}"]
    if len(files) > 1:
        lines.append(f"file = {_quoted(file.path.name)}")
    lines += [f"time = {_quoted(entry.time)}", f'rate = "{float(f"{file.rate:.3g}"):g} Hz"']
    for key in WRITTEN:
        value = getattr(entry, key)
        if value != LogFile.model_fields[key].default:
            lines.append(f"{key} = {json.dumps(value)}")
    if entry.max_gap is not None:
        lines.append(f'max_gap = "{1e3 * entry.max_gap:.3g} ms" # five samples of the slowest signal')
    other = files[0]
    holds = [{one.name for one in each.guesses.values()} for each in (file, other)]
    apart = file is not other and abs(file.start - other.start) > 1e-3
    if apart and any("vx" in one and "ax" in two for one, two in (holds, holds[::-1])):
        to = _quoted(other.path.stem)
        lines.append(f'align = {{ to = {to}, velocity = "vx", acceleration = "ax" }} # CHECK: clocks differ')
    return [*lines, ""]


def _rows(file: _Found, table: str, several: bool) -> list[str]:
    rows = []
    for column, one in file.guesses.items():
        if one.table != table:
            continue
        unit, sign, remark = _unit(file, column)
        log = f"log = {_quoted(file.path.stem)}, " if several else ""
        comment = f" # CHECK: {remark}" if remark else ""
        off = "# " if remark == WEIGHTLESS else ""
        rows.append(f"{off}{one.name} = {{ {log}column = {_quoted(column)}, unit = {_quoted(unit)}{sign} }}{comment}")
    return rows


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
