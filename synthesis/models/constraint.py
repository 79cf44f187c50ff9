"""Sets of scheduling parameters that are not boxes: linear inequalities between the parameters, beside their ranges."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flint import fmpq

from estimators.display import Display
from estimators.errors import unknown
from estimators.schedule.constraints import MOST, constraint_words
from synthesis.errors import ModelError
from synthesis.models.param import SchedulingParameter, check_unit
from synthesis.polynomials.half_spaces import HalfSpace, HalfSpaces, centre_of, corners_of
from synthesis.polynomials.rational import decimal

TOUCH, ROUNDED = fmpq(1, 2**40), fmpq(1, 2**47)
"""So far beyond an inequality is still proved, in parts of the range and of its terms: a runtime tests it in float64."""


@dataclass(frozen=True, repr=False)
class ParameterConstraint(Display):
    """sum of coefficients[name] * name <= maximum, the parameters in their units, the sum and `maximum` in `unit`.

    >>> ParameterConstraint({"load": 1.0, "speed": 2.0}, 3.0).words
    'load + 2 speed <= 3'
    """

    coefficients: Mapping[str, float]
    maximum: float
    unit: str = "1"

    def __post_init__(self) -> None:
        numbers = (*self.coefficients.values(), self.maximum)
        if not all(isinstance(x, (int, float)) and math.isfinite(x) for x in numbers):
            raise ModelError(f"constraint {dict(self.coefficients)} <= {self.maximum}: give finite numbers")
        check_unit(self.unit, "constraint")
        moving = [name for name, factor in self.coefficients.items() if factor]
        if len(moving) < 2:
            what = f"names {moving[0]} only; write it as its range" if moving else "names no parameter; remove it"
            raise ModelError(f"constraint '{self.words}' {what}")

    @property
    def words(self) -> str:
        """As an engineer writes it."""
        moving = {name: factor for name, factor in self.coefficients.items() if factor}
        return constraint_words(moving, self.maximum, self.unit)


def half_spaces_of(
    axes: Sequence[tuple[str, fmpq, fmpq]], constraints: Sequence[ParameterConstraint], where: str
) -> HalfSpaces:
    """The inequalities in the scaled parameters u of `axes` (name, minimum, maximum), exactly.

    Raises ModelError (place first) for an unknown parameter, a set that is empty or has no interior, and an inequality that cuts
    nothing off what the others leave.
    """
    if len(constraints) > MOST:
        raise ModelError(f"{where}: {len(constraints)} constraints; give {MOST} at most")
    found, names = [], [name for name, _, _ in axes]
    for constraint in constraints:
        for name in constraint.coefficients:
            if name not in names:
                raise ModelError(f"{where}: constraint '{constraint.words}': {unknown('parameter', name, names)}")
        factors = [decimal(float(constraint.coefficients.get(name, 0.0))) for name in names]
        normal = tuple(c * (high - low) / 2 for c, (_, low, high) in zip(factors, axes, strict=True))
        middle = sum((c * (low + high) / 2 for c, (_, low, high) in zip(factors, axes, strict=True)), fmpq(0))
        bound = decimal(float(constraint.maximum))
        terms = sum(
            (abs(c) * max(abs(low), abs(high)) for c, (_, low, high) in zip(factors, axes, strict=True)), fmpq(0)
        )
        slack = TOUCH * sum((abs(a) for a in normal), fmpq(0)) + ROUNDED * (terms + abs(bound))
        found.append(HalfSpace(normal, bound - middle, slack))
    if found:
        _check_set(tuple(found), constraints, len(axes), where)
    return tuple(found)


def _check_set(half_spaces: HalfSpaces, constraints: Sequence[ParameterConstraint], count: int, where: str) -> None:
    """Raise ModelError for a set without interior, and for an inequality that cuts nothing off."""
    zeros, ones = (fmpq(0),) * count, (fmpq(1),) * count
    words = " and ".join(f"'{constraint.words}'" for constraint in constraints)
    corners = corners_of(zeros, ones, half_spaces)
    if not corners:
        raise ModelError(f"{where}: no parameter values in the ranges satisfy {words}; the set is empty")
    middle = centre_of(corners)
    if not all(_inside(h, middle) for h in half_spaces) or not all(abs(u) < 1 for u in middle):
        raise ModelError(
            f"{where}: what {words} leaves of the ranges has no interior; loosen it, or replace a parameter by the others"
        )
    for number, constraint in enumerate(constraints):
        others = half_spaces[:number] + half_spaces[number + 1 :]
        if all(half_spaces[number].holds(corner) for corner in corners_of(zeros, ones, others)):
            what = "the ranges" + (" and the other constraints" if others else "")
            raise ModelError(
                f"{where}: constraint '{constraint.words}' cuts nothing off {what}; remove it or check its numbers"
            )


def _inside(half_space: HalfSpace, point: tuple[fmpq, ...]) -> bool:
    return bool(sum((a * u for a, u in zip(half_space.normal, point, strict=True)), fmpq(0)) < half_space.bound)


def scaled_set(
    parameters: Sequence[SchedulingParameter], constraints: Sequence[ParameterConstraint], where: str
) -> HalfSpaces:
    """`half_spaces_of` for the parameters of a model."""
    axes = [(p.name, decimal(p.minimum), decimal(p.maximum)) for p in parameters]
    return half_spaces_of(axes, constraints, where)


def still_cutting(
    parameters: Sequence[SchedulingParameter], constraints: Sequence[ParameterConstraint]
) -> tuple[ParameterConstraint, ...]:
    """Those constraints that still cut something off the ranges themselves (of a model whose range has become smaller)."""

    def largest(constraint: ParameterConstraint) -> fmpq:
        ends = {p.name: (decimal(p.minimum), decimal(p.maximum)) for p in parameters}
        factors = {name: decimal(float(c)) for name, c in constraint.coefficients.items()}
        return sum((max(c * low, c * high) for name, c in factors.items() for low, high in (ends[name],)), fmpq(0))

    return tuple(c for c in constraints if largest(c) > decimal(float(c.maximum)))
