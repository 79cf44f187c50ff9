"""What a model is made of besides its matrices: constants, signals, scheduling parameters, all with units."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from keyword import iskeyword

from synthesis.errors import ModelError
from synthesis.models.formula import shown

# Names, 1, products, quotients and single powers: a tower like 9**9**9 would be worked out by pint, digit by digit.
_POWER = r"(?:\*\*|\^) ?(?:[+-]?\d{1,2}(?:\.\d{1,4})?(?![\w.])|\([+-]?\d{1,2}(?:[/.]\d{1,4})?\))(?! ?(?:\*\*|\^))"
_UNIT = re.compile(rf"(?>[A-Za-zµμΩ°%][A-Za-z0-9_µμΩ°%]*+|1(?![\w.])|{_POWER}|[*/() ])++")
LARGEST_POWER, LONGEST_UNIT, LONGEST_NAME = 100, 64, 64


@lru_cache(maxsize=1)
def registry() -> object:
    """The one registry of units."""
    import pint  # 0.2 s: paid only when a model is built

    return pint.UnitRegistry()


@lru_cache(maxsize=256)
def check_unit(unit: str, where: str) -> str:
    """Return the unit if pint knows it; '1' is dimensionless. Raises ModelError naming the place."""
    if unit == "1":
        return unit
    if not unit.strip():
        raise ModelError(f"{where}: the unit is missing; write '1' for a pure number")
    words = "write for example 'rad/s', 'm/s^2' or '1'"
    if len(unit) > LONGEST_UNIT or not _UNIT.fullmatch(unit):
        raise ModelError(f"{where}: '{shown(unit)}' is not a unit; {words}")
    known = registry()  # a pint that does not start is not the unit's fault
    try:
        powers = known.parse_units(unit)._units.values()  # type: ignore[attr-defined]
    except Exception as error:  # pint raises tokenizer, attribute and value errors alike
        raise ModelError(f"{where}: '{shown(unit)}' is not a unit ({shown(str(error), 100)}); {words}") from None
    if any(abs(power) > LARGEST_POWER for power in powers):
        raise ModelError(f"{where}: '{shown(unit)}' has powers beyond {LARGEST_POWER}; {words}")
    return unit


def same_unit(one: str, other: str) -> bool:
    """Whether two units that pint knows are one, however they are written: "(m/s)/(1)" and "m/s"."""
    first, second = (registry().parse_units(unit) for unit in (one, other))  # type: ignore[attr-defined]
    return bool(first == second)


def check_name(name: str, what: str) -> None:
    """Raise ModelError for a name that cannot be a symbol."""
    if not (name.isidentifier() and name.isascii() and len(name) <= LONGEST_NAME):
        raise ModelError(f"{what} '{shown(name)}' needs a name of letters, digits and underscores, like wheel_speed")
    if iskeyword(name):
        raise ModelError(f"{what} '{name}' has a name that a formula cannot use; write {name}_ or another one")


@dataclass(frozen=True)
class Constant:
    """A number of the model with its unit and where it was published.

    >>> Constant(2.0, "kg", "scale").value
    2.0
    """

    value: float
    unit: str
    source: str

    def __post_init__(self) -> None:
        check_unit(self.unit, "constant")
        if not self.source.strip():
            raise ModelError(f"constant {self.value} {self.unit} has no source; say where the number comes from")
        if not isinstance(self.value, (int, float)) or not math.isfinite(self.value):
            raise ModelError(f"constant has the value {self.value}; give a finite number")


@dataclass(frozen=True)
class Signal:
    """A named state, input, output or disturbance.

    >>> Signal("wheel_speed", "rad/s").unit
    'rad/s'
    """

    name: str
    unit: str

    def __post_init__(self) -> None:
        check_name(self.name, "signal")
        check_unit(self.unit, f"signal '{self.name}'")


@dataclass(frozen=True)
class SchedulingParameter:
    """A measured parameter p(t) in [minimum, maximum] with dp/dt in [rate_minimum, rate_maximum].

    An infinite rate means that the parameter may jump; then no Lyapunov function may depend on it.
    `absolute` says that the runtime signal enters by its absolute value (wheel speed in reverse).

    >>> SchedulingParameter("wheel_speed", "rad/s", 0.0, 140.0, -800.0, 800.0).middle
    70.0
    """

    name: str
    unit: str
    minimum: float
    maximum: float
    rate_minimum: float
    rate_maximum: float
    absolute: bool = False

    def __post_init__(self) -> None:
        check_name(self.name, "scheduling parameter")
        where = f"scheduling parameter '{self.name}'"
        check_unit(self.unit, where)
        if not (math.isfinite(self.minimum) and math.isfinite(self.maximum)):
            raise ModelError(f"{where}: range [{self.minimum}, {self.maximum}] {self.unit} is not finite; bound it")
        if not self.minimum < self.maximum:
            raise ModelError(
                f"{where}: range [{self.minimum}, {self.maximum}] {self.unit} is empty or reversed; "
                "give minimum < maximum"
            )
        if math.isnan(self.rate_minimum) or math.isnan(self.rate_maximum):
            raise ModelError(f"{where}: a rate bound is not a number; give numbers or inf")
        if not self.rate_minimum <= 0.0 <= self.rate_maximum:
            raise ModelError(
                f"{where}: rates [{self.rate_minimum}, {self.rate_maximum}] ({self.unit})/s must contain 0; "
                "give rate_minimum <= 0 <= rate_maximum"
            )
        if self.absolute and self.minimum < 0.0:
            raise ModelError(f"{where}: enters as absolute value, so its minimum must be >= 0, not {self.minimum}")

    @property
    def middle(self) -> float:
        """Middle of the range."""
        return 0.5 * (self.minimum + self.maximum)

    @property
    def half_width(self) -> float:
        """Half the width of the range."""
        return 0.5 * (self.maximum - self.minimum)

    @property
    def may_jump(self) -> bool:
        """Whether a rate is unbounded."""
        return math.isinf(self.rate_minimum) or math.isinf(self.rate_maximum)
