r"""Regions that hold every frozen pole of a design: LMI regions (Chilali, Gahinet 1996), for feedback laws and observers.

With V the matrix of the Lyapunov function (Q or P) and M = (A + B K) Q or P (A - L C):

    disc r                 [r V, M; M', r V] > 0                                        |s| < r
    damping c              -[sin a (M + M'), cos a (M - M'); *, sin a (M + M')] > 0     |Im s| < tan a |Re s|, cos a = c
    vertical strip (a, b)  -(M + M' + 2 a V) > 0,  M + M' + 2 b V > 0                   -b < Re s < -a
    horizontal strip w     [2 w V, M - M'; *, 2 w V] > 0                                |Im s| < w

They are about parameters that stand still; a decay rate holds while they move, too.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from estimators.display import Display
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block


@dataclass(frozen=True, repr=False)
class PoleRegions(Display):
    """Where every frozen pole s is to lie, in all of what is given.

    >>> PoleRegions(vertical_strip=(2.0, 80.0), horizontal_strip=10.0).claims
    {'slowest pole': 2.0, 'fastest pole': 80.0, 'imaginary part': 10.0}
    """

    shown_units: ClassVar = {"disc": "1/s", "vertical_strip": "1/s", "horizontal_strip": "rad/s"}

    disc: float | None = None  # |s| below it, 1/s
    damping: float | None = None  # least damping ratio
    vertical_strip: tuple[float, float] | None = None  # -Re s between both, 1/s
    horizontal_strip: float | None = None  # |Im s| below it, rad/s

    def __post_init__(self) -> None:
        for name, unit in (("disc", "1/s"), ("horizontal_strip", "rad/s")):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < np.inf:
                raise ProblemError(f"regions: {name} {value} {unit} must be a positive number")
        if self.damping is not None and not 0.0 < self.damping < 1.0:
            raise ProblemError(f"regions: damping {self.damping} must be a damping ratio between 0 and 1")
        if self.vertical_strip is not None:
            near, far = self.vertical_strip
            if not 0.0 <= near < far < np.inf:
                raise ProblemError(
                    f"regions: vertical_strip [{near}, {far}] 1/s must hold two rising numbers from zero on: -Re s lies between"
                )

    def __bool__(self) -> bool:
        return any(getattr(self, field.name) is not None for field in fields(self))

    @property
    def bounded(self) -> bool:
        """Whether they keep poles, and with them gains, from running away: by a disc, or by both strips."""
        strips = self.vertical_strip is not None and self.horizontal_strip is not None
        return self.disc is not None or strips

    @property
    def claims(self) -> dict[str, float]:
        """Kinds of claims (`synthesis.certificate.poles`) with their levels."""
        near, far = self.vertical_strip or (None, None)
        found = {
            "slowest pole": near or None, "fastest pole": far, "pole radius": self.disc, "damping ratio": self.damping,
            "imaginary part": self.horizontal_strip,
        }  # fmt: skip
        return {kind: level for kind, level in found.items() if level is not None}


def require_disc(problem: LmiProblem, name: str, radius: float, M: MatrixPolynomial, V: MatrixPolynomial) -> None:
    """Every frozen pole within the disc about zero."""
    problem.require(name, symmetric_block([[V * radius, M], [None, V * radius]]))


def require_damping(problem: LmiProblem, cosine: float, M: MatrixPolynomial) -> None:
    """Every frozen pole in the sector about the negative real axis."""
    both, across = (M + M.T) * -float(np.sqrt(1.0 - cosine**2)), (M.T - M) * cosine
    problem.require("damping", symmetric_block([[both, across], [None, both]]))


def require_regions(
    problem: LmiProblem, regions: PoleRegions, reserve: float, clock: float, M: MatrixPolynomial, V: MatrixPolynomial
) -> None:
    """All of them, tighter by `reserve`; M and V over one denominator, time counted in units of 1/`clock` s."""
    tighter = 1.0 / (1.0 + reserve) / clock
    if regions.disc is not None:
        require_disc(problem, "disc", regions.disc * tighter, M, V)
    if regions.damping is not None:
        require_damping(problem, regions.damping + reserve * (1.0 - regions.damping), M)
    if regions.vertical_strip is not None:
        near, far = regions.vertical_strip
        problem.require("vertical strip, slow side", -(M + M.T + V * (2.0 * near * (1.0 + reserve) / clock)))
        problem.require("vertical strip, fast side", M + M.T + V * (2.0 * far * tighter))
    if regions.horizontal_strip is not None:
        wide = V * (2.0 * regions.horizontal_strip * tighter)
        problem.require("horizontal strip", symmetric_block([[wide, M - M.T], [None, wide]]))


def refuse_regions(regions: PoleRegions) -> None:
    """Raise ProblemError for a design in discrete time, whose poles are others."""
    given = next((field.name for field in fields(regions) if getattr(regions, field.name) is not None), None)
    if given is not None:
        raise ProblemError(
            f"a sampled design has no pole regions (regions.{given}): leave them out, or give a decay rate"
        )
