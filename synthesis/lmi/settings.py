"""Settings of one solve, one meaning a line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from estimators.errors import unknown
from synthesis.errors import ProblemError

Relaxation = Literal["auto", "grid", "vertex", "exact", "bernstein", "exchange"]


@dataclass(frozen=True)
class LmiSettings:
    """How an LMI problem is relaxed, solved and re-checked.

    >>> LmiSettings(relaxation="exact").relaxation
    'exact'
    """

    relaxation: Relaxation = (
        "auto"  # auto: exact or grid where one parameter and few states make them cheap, else exchange
    )
    points: int = 140  # grid points for each parameter
    cells: int = 1  # pieces of the range of each parameter, each with its own Bernstein coefficients
    margin: float = 1e-8  # every inequality holds by this much, in balanced coordinates
    solver: str = (
        "CLARABEL"  # assembled directly (bernstein and exchange: by `interior`); "cvxpy:NAME": the second back end
    )
    tolerance: float = 1e-8  # gap and feasibility tolerance of the solver
    max_iterations: int = 200  # of the interior-point method
    verify: bool = True  # re-evaluate every inequality outside the solver
    proof_depth: int = 16  # subdivisions before a proof on the continuum gives up
    threads: int = 1  # of the linear solver; small problems lose time with more

    def __post_init__(self) -> None:
        if self.relaxation not in get_args(Relaxation):
            raise ProblemError(unknown("relaxation", self.relaxation, get_args(Relaxation)))
        for name, low in (("points", 2), ("cells", 1), ("max_iterations", 1), ("proof_depth", 1), ("threads", 1)):
            if getattr(self, name) < low:
                raise ProblemError(f"setting {name} = {getattr(self, name)} must be at least {low}")
        for name in ("margin", "tolerance"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ProblemError(f"setting {name} = {getattr(self, name)} must lie between 0 and 1")
