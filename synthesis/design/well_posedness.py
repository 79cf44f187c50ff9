r"""Does minimising gamma determine the gains? The literal problem of P1 (30)-(32) does not.

At DC the friction term cannot be told from slip velocity: its gain to the velocity error is sigma0/(sigma0 + sigma2 a) for
every L, so gamma has the infimum 1 and is approached only with unbounded gains. The test: for gamma = (1 + s) gamma*, find
the least energy trace(L'PL) that any gains of this degree need (W > X'P^-1 X), and watch it while s goes to zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.design.hinf_observer import ObserverDesign, observer_problem, timed_scale, to_gamma
from synthesis.design.kinked import KinkedUnknown
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import symmetric_block

BACKOFFS = (1e-1, 1e-2, 1e-3)  # closer than this the margins of the solver decide, not the problem
GROWTH = 2.0  # energy that grows by more than this for every decade of back-off is taken as unbounded


@dataclass(frozen=True, repr=False)
class WellPosedness(Display):
    """`gamma` the infimum found; `energy` the least gain energy at (1 + backoff) gamma for every back-off.

    `ill_posed` when the energy keeps growing with every decade; then the optimum has no gains to export.
    """

    gamma: float
    backoffs: tuple[float, ...]
    energy: tuple[float, ...]
    ill_posed: bool

    @property
    def message(self) -> str:
        """What was found, in one line."""
        rows = ", ".join(f"{s:g}: {e:.3g}" for s, e in zip(self.backoffs, self.energy, strict=True))
        if self.ill_posed:
            return (
                f"ill-posed: the infimum gamma = {self.gamma:.5g} is approached with unbounded gains "
                f"(energy by back-off {rows}); bound a noise channel and the poles"
            )
        return f"well-posed: gamma = {self.gamma:.5g}, gain energy by back-off {rows}"


def well_posedness(model: LpvModel, design: ObserverDesign, backoffs: tuple[float, ...] = BACKOFFS) -> WellPosedness:
    """Minimise gamma, then the gain energy at several distances from it. Raises ProblemError if nothing is feasible.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> well_posedness(model, ObserverDesign((Channel(("friction",), ("relative_velocity",)),))).ill_posed
    True
    """
    scale, clock = timed_scale(model, design)
    optimum = solve(observer_problem(model, design, scale, clock=clock), design.settings)
    if optimum.objective is None or not optimum.margins:
        raise ProblemError(f"model '{model.name}': {optimum.message}")
    gamma = to_gamma(model, design, scale, optimum.objective)
    if len(backoffs) < 2:
        raise ProblemError("well-posedness needs at least two back-offs to see a trend")
    energies = []
    for backoff in backoffs:
        problem = energy_problem(model, design, scale, gamma * (1.0 + backoff), clock)
        found = solve(problem, replace(design.settings, verify=False))
        energies.append(float(found.objective or np.inf))
    ratios = [later / earlier for earlier, later in pairwise(energies)]
    return WellPosedness(gamma, tuple(backoffs), tuple(energies), bool(min(ratios) > GROWTH))


def energy_problem(
    model: LpvModel, design: ObserverDesign, scale: FloatArray, gamma: float, clock: float = 1.0
) -> LmiProblem:
    """The constraints of the design at this gamma, and the least w with w I > X'P^-1 X = L'PL everywhere."""
    problem = observer_problem(model, design, scale, gamma, maximise_margin=False, clock=clock)
    P, gains = problem.unknowns["P"], KinkedUnknown.found(problem, model, "X")
    energy = problem.scalar("gain energy")
    size = problem.constant(np.eye(len(model.outputs))).scaled_by(energy)
    for number, piece in enumerate(model.pieces):
        problem.on_cell(number, piece.box)
        problem.require("gain energy", symmetric_block([[size, gains.on(piece).T], [None, problem.here(P)]]))
    problem.minimise("gain energy")
    return problem
