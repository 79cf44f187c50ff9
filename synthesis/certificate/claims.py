"""What a claim says: data from which its name, its unit and every number that a person reads are derived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from synthesis.certificate.poles import CONTINUOUS, DISCRETE
from synthesis.polynomials.enclosure import PolynomialMatrix

ERROR_EQUATION = ("decay rate", "fastest pole", *CONTINUOUS, "gain", "H2 norm", "energy to peak")
UPDATE = (
    "internal update",
    "sampled error",
    "sampled gain",
    "motion gain",
    "drop probability",
    "sampled H2 norm",
    "sampled energy to peak",
    *DISCRETE,
)
KINDS = (*ERROR_EQUATION, *UPDATE)
GAINS = {"gain": "disturbances", "sampled gain": "disturbances", "motion gain": "motion"}  # of energy
WITH_CHANNEL = GAINS | dict.fromkeys(
    ("H2 norm", "energy to peak", "sampled H2 norm", "sampled energy to peak"), "disturbances"
)
KINDS_OF = {  # which kinds say something true about which update (synthesis.loop.observer)
    "held": (
        "decay rate",
        "fastest pole",
        *CONTINUOUS,
        "gain",
        "H2 norm",
        "energy to peak",
        "internal update",
        "sampled gain",
        "sampled H2 norm",
        "sampled energy to peak",
        "motion gain",
        "drop probability",
    ),
    "sampled": (
        *("sampled error", "sampled gain", "sampled H2 norm", "sampled energy to peak", "drop probability"),
        *DISCRETE,
    ),
    "feedback": (
        "sampled error",
        "sampled gain",
        "sampled H2 norm",
        "sampled energy to peak",
        *DISCRETE,
    ),  # synthesis.loop.feedback
}
IMAGINARY = ("imaginary part", "sampled imaginary part")
WITHOUT_UNIT = ("drop probability", "damping ratio", "sampled disc")
LARGER_IS_BETTER = (
    *("decay rate", "internal update", "sampled error", "drop probability"),
    *("slowest pole", "damping ratio", "sampled slowest pole"),
)
UPDATE_OF = {"held": "internal update", "sampled": "sampled error", "feedback": "sampled error"}

WORDS = {
    "decay rate": "error equation: decay rate",
    "fastest pole": "error equation: fastest pole",
    "slowest pole": "error equation: slowest pole",
    "pole radius": "error equation: largest pole",
    "damping ratio": "error equation: damping ratio",
    "imaginary part": "error equation: imaginary part of poles",
    "gain": "error equation: gain",
    "internal update": "update: decay while the plant stands still",
    "sampled error": "update: decay",
    "sampled gain": "update: gain",
    "motion gain": "update: gain of motion",
    "drop probability": "update: drop probability",
    "H2 norm": "error equation: H2 norm",
    "energy to peak": "error equation: generalised H2 norm",
    "sampled H2 norm": "update: H2 norm",
    "sampled energy to peak": "update: generalised H2 norm",
    "sampled slowest pole": "update: slowest pole",
    "sampled fastest pole": "update: fastest pole",
    "sampled imaginary part": "update: imaginary part of poles",
    "sampled disc": "update: radius of poles z",
}


@dataclass(frozen=True)
class ClaimChannel:
    """From inputs, each with the size that counts as one, to estimation errors, or to performance signals of a feedback loop.

    For motion the inputs are states. `sizes` of the errors that count as one, in their order; () where each counts in its unit.
    """

    inputs: Mapping[str, float]
    errors: tuple[str, ...]
    sizes: tuple[float, ...] = ()

    @property
    def error_sizes(self) -> tuple[float, ...]:
        """One for every error."""
        return self.sizes or (1.0,) * len(self.errors)


@dataclass(frozen=True)
class Claim:
    """One property of a loop: `level` in the unit that follows from the kind and the channel, P(u) exact and symmetric."""

    kind: str
    level: float
    P: PolynomialMatrix
    channel: ClaimChannel | None = None
    centre: float | None = None  # of a disc of poles z, which alone has one


def claim_name(kind: str, channel: ClaimChannel | None, units: Mapping[str, str], centre: float | None = None) -> str:
    """What is claimed, in words; sizes of inputs with their units wherever they are not plainly one."""
    if channel is None:
        return WORDS[kind] if centre is None else f"{WORDS[kind]} about {written(centre)}"
    plain = plain_unit(channel)
    motion = "/s" if WITH_CHANNEL[kind] == "motion" else ""
    mark = "'" if motion else ""
    parts = [
        f"{name}{mark}" if plain else f"{written(size)} {_unit(units[name], motion)} {name}{mark}"
        for name, size in channel.inputs.items()
    ]
    shown = [
        f"{written(size)} {units[name]} {name}" if channel.sizes else name
        for name, size in zip(channel.errors, channel.error_sizes, strict=True)
    ]
    return f"{WORDS[kind]} {' + '.join(parts)} -> {' + '.join(shown)}"


def claim_unit(kind: str, channel: ClaimChannel | None, units: Mapping[str, str]) -> str:
    """The unit of a claim's level.

    A gain from one input of size one has the unit error/input. With sizes the inputs are numbers of their sizes, and the gain has
    the unit of the errors ('mixed' if they differ, 1 if they have sizes, too). An H2 norm has the root of a time in it: an energy
    is an integral.
    """
    if channel is None:
        return "1" if kind in WITHOUT_UNIT else "rad/s" if kind in IMAGINARY else "1/s"
    above = {"1" if channel.sizes else units[name] for name in channel.errors}
    top, root = above.pop() if len(above) == 1 else "mixed", "" if kind in GAINS else "s^0.5"
    if not plain_unit(channel):
        return quotient(top, root or "1")
    (name,) = channel.inputs
    if WITH_CHANNEL[kind] == "motion" and units[name] == top:
        return "s"
    below = _unit(units[name], "/s" if WITH_CHANNEL[kind] == "motion" else "")
    if root:
        return f"{enclosed(top)}/({root if below == '1' else f'{enclosed(below)}*{root}'})"
    return quotient(top, below)


def written(number: float) -> str:
    """The number as it stands in a file, with every digit: a rounded level is another claim."""
    return repr(float(number)).removesuffix(".0")


def plain_unit(channel: ClaimChannel) -> bool:
    """Whether the channel has one input, of size one."""
    return list(channel.inputs.values()) == [1.0]


def _unit(unit: str, per_second: str) -> str:
    if not per_second or unit == "1":
        return "1/s" if per_second else unit
    return f"{unit}^2" if unit.endswith("/s") else f"{enclosed(unit)}/s"


def quotient(above: str, below: str) -> str:
    """The unit above/below as text."""
    if above == below:
        return "1"
    return above if below == "1" else f"{enclosed(above)}/({below})"


def enclosed(unit: str) -> str:
    """In parentheses if the unit is a product or a quotient."""
    return f"({unit})" if any(c in unit for c in "*/ ") else unit


def rows_of(names: Sequence[str], channel: ClaimChannel) -> tuple[list[int], list[float]]:
    """Places of the channel's inputs among `names`, and their sizes."""
    return [list(names).index(name) for name in channel.inputs], list(channel.inputs.values())
