"""What an LMI solve returns: an object that can be judged."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from estimators.arrays import FloatArray
from synthesis.polynomials.matrix import MatrixPolynomial


class Verdict(StrEnum):
    """CERTIFIED: proved on the whole box. REFUTED: shown to be false. INCONCLUSIVE: neither.

    >>> print(Verdict.CERTIFIED, Verdict.REFUTED, Verdict.INCONCLUSIVE)
    certified refuted inconclusive
    """

    CERTIFIED = "certified"
    REFUTED = "refuted"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True)
class Margin:
    """One named inequality, re-evaluated outside the solver.

    `value` is the smallest eigenvalue found, divided by the largest eigenvalue magnitude of the same matrix over the
    box (negative: violated); `place` says where; `proved` whether positivity on the whole box was proved.
    """

    name: str
    value: float
    place: str
    proved: bool


@dataclass(frozen=True)
class SolverReport:
    """What the solver said of itself; never evidence."""

    solver: str
    status: str
    iterations: int
    seconds: float  # bare solver time
    assembly_seconds: float  # relaxation and conic data
    verification_seconds: float
    relaxation: str
    dual_bound: float


@dataclass(frozen=True)
class LmiResult:
    """Verdict, margins by name, values of the unknowns (in scaled parameters) and the solver's own report.

    A REFUTED verdict means: the solver gave a certificate of infeasibility of a necessary condition.
    """

    verdict: Verdict
    message: str
    margins: tuple[Margin, ...]
    values: dict[str, MatrixPolynomial]
    decisions: FloatArray
    objective: float | None
    lower_bound: float | None
    report: SolverReport

    @property
    def tightest(self) -> Margin:
        """The inequality with the smallest margin."""
        return min(self.margins, key=lambda margin: margin.value)
