r"""Regions that hold every frozen pole of a design: LMI regions (Chilali, Gahinet 1996), for feedback laws and observers.

With V the matrix of the Lyapunov function (Q or P) and M = (A + B K) Q or P (A - L C):

    disc r                 [r V, M; M', r V] > 0                                        |s| < r
    damping c              -[sin a (M + M'), cos a (M - M'); *, sin a (M + M')] > 0     |Im s| < tan a |Re s|, cos a = c
    vertical strip (a, b)  -(M + M' + 2 a V) > 0,  M + M' + 2 b V > 0                   -b < Re s < -a
    horizontal strip w     [2 w V, M - M'; *, 2 w V] > 0                                |Im s| < w

They are about parameters that stand still; a decay rate holds while they move, too. Those of the poles z of an update are in
`synthesis.design.sampled_regions`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar, Literal

import numpy as np

from estimators.display import Display
from synthesis.certificate.poles import DISCRETE
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block

NOT_IN = {"continuous": ("sampled_disc",), "discrete": ("disc", "damping")}  # of these times
NO_REGION = {
    "continuous": "is for sampled designs; give disc, damping, vertical_strip or horizontal_strip",
    "discrete": "has no image under z = exp(s T) that inequalities hold exactly, and is not for a sampled design; give "
    "vertical_strip, horizontal_strip or sampled_disc",
}


@dataclass(frozen=True, repr=False)
class PoleRegions(Display):
    """Where every frozen pole s is to lie, in all of what is given; s = ln(z)/T of a sampled design's poles z.

    >>> PoleRegions(vertical_strip=(2.0, 80.0), horizontal_strip=10.0).claims
    {'slowest pole': 2.0, 'fastest pole': 80.0, 'imaginary part': 10.0}
    """

    shown_units: ClassVar = {"disc": "1/s", "vertical_strip": "1/s", "horizontal_strip": "rad/s"}

    disc: float | None = None  # |s| below it, 1/s
    damping: float | None = None  # least damping ratio
    vertical_strip: tuple[float, float] | None = None  # -Re s between both, 1/s
    horizontal_strip: float | None = None  # |Im s| below it, rad/s
    sampled_disc: tuple[float, float] | None = None  # centre q and radius r of |z - q| < r, of sampled designs alone

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

        if self.sampled_disc is not None:
            centre, radius = self.sampled_disc
            if not (abs(centre) < np.inf and max(abs(centre) - 1.0, 0.0) < radius < np.inf):
                raise ProblemError(
                    f"regions: sampled_disc [{centre}, {radius}] must hold the centre and the radius of a disc that meets |z| < 1"
                )

    def __bool__(self) -> bool:
        return any(getattr(self, field.name) is not None for field in fields(self))

    @property
    def bounded(self) -> bool:
        """Whether they keep poles, and with them gains, from running away: by a disc, or by both strips."""
        strips = self.vertical_strip is not None and self.horizontal_strip is not None
        return self.disc is not None or self.sampled_disc is not None or strips

    @property
    def claims(self) -> dict[str, float]:
        """Kinds of claims (`synthesis.certificate.poles`) with their levels."""
        near, far = self.vertical_strip or (None, None)
        found = {
            "slowest pole": near or None, "fastest pole": far, "pole radius": self.disc, "damping ratio": self.damping,
            "imaginary part": self.horizontal_strip,
        }  # fmt: skip
        return {kind: level for kind, level in found.items() if level is not None}

    @property
    def of_update(self) -> list[tuple[str, float, float | None]]:
        """Kinds of claims about the poles z of an update, with level and centre."""
        found: list[tuple[str, float, float | None]] = [
            (f"sampled {kind}", level, None) for kind, level in self.claims.items() if f"sampled {kind}" in DISCRETE
        ]
        return found if self.sampled_disc is None else [*found, ("sampled disc", *self.sampled_disc[::-1])]

    def refuse_for(self, time: Literal["continuous", "discrete"]) -> None:
        """Raise ProblemError for a region that a design in this time does not have."""
        for name in NOT_IN[time]:
            if getattr(self, name) is not None:
                raise ProblemError(f"regions: {name} {NO_REGION[time]}")


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
    """All of them, tighter by `reserve`; M and V over one denominator, time counted in units of 1/`clock` s.

    Raises ProblemError for one of sampled designs.
    """
    regions.refuse_for("continuous")
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
