"""From gains to the table that is deployed: breakpoints, rounding, and P solved for again with that table fixed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from synthesis.claim_search import claim_levels, prove_claims
from synthesis.claims import Claim
from synthesis.deployed_loop import DeployedLoop
from synthesis.errors import ProblemError
from synthesis.hinf_observer import ObserverGains
from synthesis.lmi.result import Verdict
from synthesis.polynomials.matrix import FloatArray
from synthesis.well_posedness import well_posedness

SEGMENTS = (7, 14, 28, 56, 112)
REFINEMENT = 4  # a table is compared with one of so many times its segments


@dataclass(frozen=True)
class DeploySettings:
    """How gains become a table."""

    sample_time: float = 0.005  # s
    dtype: Literal["float32", "float64"] = "float64"
    interpolation_cost: float = 0.01  # largest loss of any guarantee against a table four times as fine
    settle: float = 0.005  # certified bounds are this much above their infimum, which buys margin for the proof

    def __post_init__(self) -> None:
        if not 0.0 < self.sample_time < 1.0:
            raise ProblemError(f"sample time {self.sample_time} s must lie between 0 and 1 s")
        if self.dtype not in ("float32", "float64"):
            raise ProblemError(f"dtype '{self.dtype}' of the table must be float32 or float64")
        if not 0.0 < self.interpolation_cost < 1.0:
            raise ProblemError(f"interpolation cost {self.interpolation_cost} must lie between 0 and 1")


@dataclass(frozen=True)
class Deployment:
    """A table with the claims that hold for it."""

    gains: ObserverGains
    settings: DeploySettings
    loop: DeployedLoop
    claims: tuple[Claim, ...]
    cost: float  # relative loss of the worst guarantee through tabulation and rounding

    @property
    def breakpoints(self) -> FloatArray:
        """Parameter values of the table, shape (b,)."""
        return self.loop.breakpoints

    @property
    def table(self) -> FloatArray:
        """Gains as stored, shape (b, nx, ny)."""
        return self.loop.table


def deploy(
    gains: ObserverGains, settings: DeploySettings | None = None, progress: Callable[[str], None] = lambda _: None
) -> Deployment:
    """Tabulate on the coarsest breakpoints that cost less than the allowed share of every guarantee, and prove claims.

    Raises ProblemError if the gains are not certified, if the design is ill-posed, or if no table is fine enough.
    """
    settings = settings or DeploySettings()
    if gains.verdict is not Verdict.CERTIFIED:
        raise ProblemError(f"gains are not certified and are not deployed: {gains.result.message}")
    if len(gains.model.parameters) != 1:
        raise ProblemError(
            f"model '{gains.model.name}' has {len(gains.model.parameters)} scheduling parameters; a deployed table has one"
        )
    if gains.design.fastest_pole is None:  # nothing bounds the gains but the channels themselves
        posed = well_posedness(gains.model, gains.design)
        if posed.ill_posed:
            raise ProblemError(f"model '{gains.model.name}' is not deployed: {posed.message}")
    for segments in SEGMENTS:
        progress(f"{segments} segments")
        loop = tabulate(gains, segments, settings.dtype)
        levels = claim_levels(loop, gains.design)
        finer = claim_levels(tabulate(gains, REFINEMENT * segments, "float64"), gains.design)
        cost = max(levels[name] / finer[name] - 1.0 for name in finer)
        if not cost < settings.interpolation_cost:
            continue
        claims = prove_claims(loop, gains.design, levels, settings.settle, settings.sample_time)
        if claims is not None:
            return Deployment(gains, settings, loop, claims, cost)
    raise ProblemError(
        f"model '{gains.model.name}': no table with up to {SEGMENTS[-1]} segments keeps the guarantee within "
        f"{100 * settings.interpolation_cost:g} %; give the design more back-off or a lower degree"
    )


def tabulate(gains: ObserverGains, segments: int, dtype: str) -> DeployedLoop:
    """Gains at equidistant breakpoints, rounded to the type in which they are stored."""
    (parameter,) = gains.model.parameters
    breakpoints = np.linspace(parameter.minimum, parameter.maximum, segments + 1)
    table = gains.gain(breakpoints).astype(dtype).astype(np.float64)
    return DeployedLoop(gains.model, breakpoints, table)
