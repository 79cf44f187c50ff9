"""The worst case in a box of parameters, found by search: corners, a spread of samples, evolution, local descent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import Field
from scipy.optimize import differential_evolution, minimize

from analysis.errors import AnalysisError
from analysis.sensitivity.box import Box, Ranges
from analysis.sensitivity.designs import Design, FullGrid, Sobol, require_power
from analysis.sensitivity.measure import Measure, evaluate
from estimators.arrays import FloatArray
from estimators.display import Display

MOST_CORNERS = 12  # parameters; beyond, the search starts from samples alone


class WorstCaseSearch(Design):
    """Settings of `worst_case`. As a design of several measures it has one point for each: the worst that is found."""

    kind: Literal["worst case"] = "worst case"
    samples: int = Field(default=256, ge=2)
    generations: int = Field(default=30, ge=0)
    seed: int = Field(default=0, ge=0)

    def check(self, box: Box) -> None:
        """Its samples are Sobol points."""
        require_power("samples", self.samples)


@dataclass(frozen=True, repr=False)
class WorstCase(Display):
    """`value` at `parameters`; `sampled` is the worst of the corners and samples the search began with.

    A search bounds the true worst case from one side only; it proves nothing about what it has not visited.
    """

    value: float
    parameters: dict[str, float]
    sampled: float
    found_by: str
    evaluations: int


def worst_case(
    measure: Measure,
    ranges: Ranges,
    largest: bool = True,
    samples: int = 256,
    generations: int = 60,
    seed: int = 0,
) -> WorstCase:
    """The largest (or smallest) value of a scalar measure over the box of `ranges`.

    All corners (up to 12 parameters) and Sobol samples come first, then differential evolution (Storn, Price 1997) on
    whole populations, then a bounded simplex descent from the best point in unit coordinates; the best of all wins. An
    infinite value (an unstable model, say) ends the search: nothing is worse. Raises AnalysisError for bad ranges and
    measures that are not scalar.

    >>> round(worst_case(lambda at: at["a"] - at["b"] ** 2, {"a": (0.0, 1.0), "b": (-1.0, 1.0)}).value, 6)
    1.0
    """
    box = Box.of(ranges)
    sign = -1.0 if largest else 1.0
    count = 0
    unit = Box.of(dict.fromkeys(box.names, (0.0, 1.0)))
    limits: Any = [(0.0, 1.0)] * len(box.names)  # scipy's own types are narrower than what it takes

    def cost(place: FloatArray) -> FloatArray:
        """Unit coordinates (d, N) to sign * measure (N,)."""
        nonlocal count
        values = evaluate(measure, box.columns(box.scaled(np.clip(place.T, 0.0, 1.0))))
        if values.ndim != 1:
            raise AnalysisError(
                f"a worst case needs one number for each sample, not the shape {values.shape[1:]}; reduce it"
            )
        count += values.size
        return sign * values

    def single(x: FloatArray) -> float:
        return float(cost(x[:, None])[0])

    require_power("samples", samples)
    start = Sobol(samples=samples, seed=seed).everywhere(unit)
    if len(box.names) <= MOST_CORNERS:
        start = np.concatenate([FullGrid(levels=2).everywhere(unit), start])
    first = cost(start.T)
    place = int(np.argmin(first))
    best, where, how = float(first[place]), start[place], "samples"
    if np.isfinite(best):
        order = np.argsort(first, kind="stable")[: max(8, 6 * len(box.names))]
        population: Any = cost
        if generations > 0 and len(order) >= 5:
            evolved = differential_evolution(
                population, limits, init=start[order], vectorized=True, updating="deferred", polish=False,
                maxiter=generations, rng=np.random.default_rng(seed), tol=1e-10,
            )  # fmt: skip
            if evolved.fun < best:
                best, where, how = float(evolved.fun), np.asarray(evolved.x), "evolution"
        for _ in range(2):  # a restarted simplex does not stay collapsed on a face
            if not np.isfinite(best):
                break
            options: Any = {
                "xatol": 1e-10,
                "fatol": 1e-14,
                "maxfev": 400 * len(box.names),
                "initial_simplex": _simplex(where),
            }
            polished = minimize(
                single, where, method="Nelder-Mead", bounds=limits,
                options=options,
            )  # fmt: skip
            if polished.fun < best:
                best, where, how = float(polished.fun), np.asarray(polished.x), "descent"
    parameters = {k: float(v[0]) for k, v in box.columns(box.scaled(np.clip(where, 0.0, 1.0))[None]).items()}
    return WorstCase(sign * best, parameters, float(sign * first[place]), how, count)


def _simplex(start: FloatArray, size: float = 0.05) -> FloatArray:
    """A simplex inside the unit box: each edge leads away from the nearer face."""
    step = np.where(start < 0.5, size, -size)
    return np.asarray(np.concatenate([start[None], start + np.diag(step)]))
