"""What an LMI solve returns: verdict, margins and values, whatever the solver has said."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from estimators.arrays import FloatArray
from estimators.display import Display, counted
from synthesis.polynomials.matrix import MatrixPolynomial


class Verdict(StrEnum):
    """CERTIFIED: proved on the whole box. REFUTED: shown to be false. INCONCLUSIVE: neither.

    >>> print(Verdict.CERTIFIED, Verdict.REFUTED, Verdict.INCONCLUSIVE)
    certified refuted inconclusive
    """

    CERTIFIED = "certified"
    REFUTED = "refuted"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True, repr=False)
class Margin(Display):
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


@dataclass(frozen=True, repr=False)
class LmiResult(Display):
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

    def summary(self) -> tuple[str, ...]:
        """Verdict, objective with its bound, the tightest inequality, what the solver said."""
        objective = "none" if self.objective is None else f"{self.objective:.6g}"
        bound = "" if self.lower_bound is None else f", at least {self.lower_bound:.6g}"
        tight, verdict = "none", str(self.verdict)
        if self.margins:
            tight = f"{self.tightest.name}, margin {self.tightest.value:.3g} at {self.tightest.place}"
        said = self.report
        return (
            f"LmiResult: {self.message if self.message.startswith(verdict) else f'{verdict}; {self.message}'}",
            f"objective: {objective}{bound}",
            f"tightest of {counted(len(self.margins), 'inequality')}: {tight}",
            f"unknowns: {', '.join(f'{n} {v.shape}' for n, v in self.values.items()) or 'none'}",
            f"solver (no evidence): {said.solver}, {said.status}, {said.iterations} iterations, {said.seconds:.3g} s",
        )

    @property
    def tightest(self) -> Margin:
        """The inequality with the smallest margin."""
        return min(self.margins, key=lambda margin: margin.value)
