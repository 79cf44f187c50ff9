"""Units of a drive file, and what may be measured in a drive log.

A quantity is a number and a unit in one string, ``"2300 kg"``; a log column has a unit alone, ``"rpm"``. Both are
read by pint and kept in SI. Nothing is evaluated: a pattern takes number and unit apart before pint sees the unit.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Mapping
from typing import Annotated

import numpy as np
import pint
from pydantic import BeforeValidator

from estimators.arrays import FloatArray
from studies.errors import escaped

CORNERS = ("fl", "fr", "rl", "rr")  # corner order of every array: front left, front right, rear left, rear right


def at_corners(signals: Mapping[str, FloatArray], name: str) -> FloatArray:
    """(n, 4) of the columns of a log; NaN where there is none."""
    nothing = np.full(next(iter(signals.values())).shape, np.nan)
    return np.stack([signals.get(f"{name}_{corner}", nothing) for corner in CORNERS], axis=-1)


def _corners(name: str, unit: str) -> dict[str, str]:
    return {f"{name}_{corner}": unit for corner in CORNERS}


SIGNALS: dict[str, str] = {
    **_corners("wheel_speed", "rad/s"), **_corners("steer", "rad"), **_corners("torque", "N*m"), "steering": "rad",
    "hand_wheel": "rad", "ax": "m/s^2", "ay": "m/s^2", "az": "m/s^2", "yaw_rate": "rad/s", "roll_rate": "rad/s",
    "pitch_rate": "rad/s", "vy": "m/s",
}  # fmt: skip
"""What the observers may use, and its SI unit."""

REFERENCES: dict[str, str] = {
    "vx": "m/s", "vy": "m/s", "ax": "m/s^2", "yaw_rate": "rad/s", **_corners("force_x", "N"),
    **_corners("force_y", "N"), **_corners("force_z", "N"),
}  # fmt: skip
"""What the estimates may be compared with, and its SI unit; never an input."""

_UNIT = re.compile(r"(1/)?[A-Za-zµ°][A-Za-zµ°_]*([*/ ]+[A-Za-zµ°][A-Za-zµ°_]*|(\^|\*\*)-?[0-9])*")
_QUANTITY = re.compile(r"\s*([-+]?[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]{1,3})?)\s*(.*?)\s*")
_EXAMPLES = {
    "s": "s, ms, us, min", "Hz": "Hz, kHz", "rad": "rad, deg", "rad/s": "rad/s, deg/s, rpm", "m/s": "m/s, km/h, mph",
    "m/s^2": "m/s^2, g", "N": "N, kN", "N/rad": "N/rad, kN/rad", "N*m": "N*m, kN*m", "kg": "kg, t",
    "N/m": "N/m, kN/m", "N*s/m": "N*s/m", "N*m*s/rad": "N*m*s/rad", "kg*m^2": "kg*m^2", "m": "m, cm, mm",
}  # fmt: skip


LONGEST_UNIT, LONGEST_QUANTITY = 40, 80  # characters: what is longer is no unit, and takes pint half a minute to refuse


def short(text: str, most: int = 60) -> str:
    """``text`` fit for a message: at most ``most`` characters, control characters escaped."""
    shown = text if len(text) <= most else f"{text[: most - 3]}..."
    return escaped(shown)


def wheel_factor(unit: str, radius: float) -> float:
    """As :func:`factor_to` to rad/s, also from a surface speed such as m/s or km/h over ``radius``, m."""
    try:
        return factor_to(unit, "rad/s")
    except ValueError:
        try:
            return factor_to(unit, "m/s") / radius
        except ValueError:
            pass
        raise


@functools.cache
def _registry() -> pint.UnitRegistry[float]:
    return pint.UnitRegistry()


@functools.cache
def factor_to(unit: str, target: str) -> float:
    """What a number in ``unit`` is multiplied by to be in ``target`` (an SI unit of this module).

    Raises ValueError on an unknown unit, on another dimension, and on a unit that leaves open whether it counts turns
    or radians (``Hz`` for a wheel speed): pint takes radians for plain numbers, a drive log must not.
    """
    examples = _EXAMPLES.get(target, target)
    if len(unit) > LONGEST_UNIT or not _UNIT.fullmatch(unit):
        raise ValueError(f"'{short(unit)}' is not a unit; use one such as {examples}")
    if target == "m/s^2" and unit in ("g", "G"):  # pint's g is the gram; nobody logs accelerations in grams
        unit = "standard_gravity"
    try:
        wanted = _registry().Quantity(1.0, target)
        given = _registry().Quantity(1.0, unit)
        value = given.to(wanted.units)
    except pint.DimensionalityError as error:
        raise ValueError(f"unit '{unit}' has another dimension than {target}; use one such as {examples}") from error
    except Exception as error:  # pint raises its own, tokenizer and attribute errors for a word it does not know
        raise ValueError(f"unknown unit '{unit}'; use one such as {examples}") from error
    if _counts_angle(given) != _counts_angle(wanted):
        raise ValueError(f"unit '{unit}' does not count angle the way {target} does; use one such as {examples}")
    factor = float(value.magnitude)
    if not math.isfinite(factor) or factor == 0:
        raise ValueError(f"unit '{unit}' cannot be converted to {target}; use one such as {examples}")
    return factor


def _counts_angle(quantity: pint.Quantity[float]) -> bool:
    return any(str(name) == "radian" for name, _ in quantity.to_root_units().unit_items())


def to_si(text: object, target: str) -> float:
    """The number of a quantity such as ``"5 ms"`` in the SI unit ``target``; ValueError on anything else."""
    example = _EXAMPLES.get(target, target).split(",")[0]
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise ValueError(f'write a number and a unit in quotes, such as "1.5 {example}"')
    if not isinstance(text, str):
        raise ValueError(f'{text} has no unit; write it in quotes with its unit, such as "{text} {example}"')
    match = _QUANTITY.fullmatch(text) if len(text) < LONGEST_QUANTITY else None
    if match is None or not match[2]:
        raise ValueError(f"'{short(text)}' is not a number with a unit; write it like \"1.5 {example}\"")
    return float(match[1]) * factor_to(match[2], target)


def _quantity(target: str, lowest: float, highest: float, *, inclusive: bool) -> Callable[[object], float]:
    """Reads a number with its unit; what no car, log or manoeuvre can have is refused, not computed with."""
    bound = f"{'at least' if inclusive else 'above'} {lowest:g} {target}, at most {highest:g}"
    if lowest < 0.0:
        bound = f"between {lowest:g} and {highest:g} {target}"

    def read(text: object) -> float:
        value = to_si(text, target)
        if not lowest <= value <= highest or (value == lowest and not inclusive):
            raise ValueError(f"'{text}' is out of range; it must be finite and {bound}")
        return value

    return read


Mass = Annotated[float, BeforeValidator(_quantity("kg", 0.0, 1e6, inclusive=False))]
Length = Annotated[float, BeforeValidator(_quantity("m", 0.0, 1e6, inclusive=False))]
Inertia = Annotated[float, BeforeValidator(_quantity("kg*m^2", 0.0, 1e9, inclusive=False))]
Duration = Annotated[float, BeforeValidator(_quantity("s", 0.0, 1e7, inclusive=False))]
Stiffness = Annotated[float, BeforeValidator(_quantity("N/rad", 0.0, 1e9, inclusive=False))]
Lag = Annotated[float, BeforeValidator(_quantity("s", 0.0, 10.0, inclusive=True))]
Offset = Annotated[float, BeforeValidator(_quantity("s", -1e11, 1e11, inclusive=True))]
Spring = Annotated[float, BeforeValidator(_quantity("N/m", 0.0, 1e12, inclusive=False))]
Damper = Annotated[float, BeforeValidator(_quantity("N*s/m", 0.0, 1e9, inclusive=True))]
Damping = Annotated[float, BeforeValidator(_quantity("N*m*s/rad", 0.0, 1e9, inclusive=True))]
Place = Annotated[float, BeforeValidator(_quantity("m", -1e4, 1e4, inclusive=True))]
Angle = Annotated[float, BeforeValidator(_quantity("rad", -1e3, 1e3, inclusive=True))]
Velocity = Annotated[float, BeforeValidator(_quantity("m/s", -1e3, 1e3, inclusive=True))]
Torque = Annotated[float, BeforeValidator(_quantity("N*m", 0.0, 1e8, inclusive=False))]
Power = Annotated[float, BeforeValidator(_quantity("W", 0.0, 1e10, inclusive=False))]
Rate = Annotated[float, BeforeValidator(_quantity("Hz", 0.0, 1e7, inclusive=False))]
AngularSpeed = Annotated[float, BeforeValidator(_quantity("rad/s", 0.0, 1e5, inclusive=True))]
