"""What `gainsmith model` says of a model, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.hidden_modes import HiddenMode, undetectable_mode, unstabilisable_mode
from analysis.observability.range_rank import RangeRank, controllability_over_range, observability_over_range
from estimators.arrays import ComplexArray, FloatArray
from estimators.schedule.check import SHAPES
from synthesis.design.export import formula
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.half_spaces import Faces

ALONG = 201  # points of the first parameter, the others in their middle
DIGITS = 5  # of printed conditions
MOST_ROWS = 9  # of the table of poles


@dataclass(frozen=True)
class Side:
    """Observability or controllability: the rank over the range, and a mode that makes an observer or a controller impossible."""

    rank: RangeRank
    hidden: HiddenMode | None

    def words(self, kind: str, cure: str) -> str:
        """One line."""
        rank = {
            "full": "full rank at every parameter value and admissible rate (proved)",
            "lost": f"rank is lost where {self.condition}{self._places()}",
            "never": "never of full rank",
            "open": "rank not decided over the whole range"
            + (f"; it is lost where {self.condition}" if self.rank.loss else ""),
        }[self.rank.verdict]
        return f"{kind}: {rank}; {cure}: " + (f"no, {self.hidden.words}" if self.hidden else "yes, wherever looked at")

    @property
    def condition(self) -> str:
        """What holds where rank is lost: a rate as a function of the rest, or what vanishes."""
        if self.rank.loss is None:
            return ""
        texts = []
        for factor in self.rank.loss.factors:
            rates = [s for s in factor.free_symbols if str(s).endswith("_rate") and sp.degree(factor, s) == 1]
            if rates:
                (solution,) = sp.solve(factor, rates[0])
                texts.append(f"{rates[0]} = {sp.N(sp.expand(solution), DIGITS)}")
            else:
                size = max(abs(c) for c in sp.Poly(factor, *factor.free_symbols).coeffs())
                texts.append(f"{sp.N(sp.expand(factor / size), DIGITS)} = 0")
        return " or ".join(texts)

    def _places(self) -> str:
        """The interval of the parameter on which some admissible rate loses rank, if there is one parameter."""
        loss = self.rank.loss
        if loss is None or len(loss.matrix.parameters) != 1:
            return ""
        (p,) = loss.matrix.parameters
        try:
            if sp.Symbol(p.name) not in loss.condition.free_symbols:
                return ", at any " + p.name
            if len(loss.condition.free_symbols) == 1:
                pieces = [f"{float(root):.4g}" for root in loss.roots_inside(p.name)]
            else:
                pieces = [f"{float(a):.4g} to {float(b):.4g}" for a, b in loss.interval_over_rates(p.name)]
        except AnalysisError:  # not linear in one rate: the curve is all that can be said
            return ""
        return f": {p.name} {', '.join(pieces)} {p.unit}"


@dataclass(frozen=True)
class Overview:
    """`points` (g, p) with `poles` (g, nx) [1/s] for the table; `line` (h, p) and `line_poles` along the first parameter."""

    model: LpvModel
    points: FloatArray
    poles: ComplexArray
    line: FloatArray
    line_poles: ComplexArray
    observability: Side
    controllability: Side

    def plain(self) -> dict[str, Any]:
        """For machines."""
        model = self.model
        sides = (("observability", self.observability), ("controllability", self.controllability))
        return {
            "name": model.name, "source": model.source,
            **{kind: [{"name": s.name, "unit": s.unit} for s in getattr(model, kind)]
               for kind in ("states", "inputs", "outputs", "disturbances")},
            "parameters": [
                {"name": p.name, "unit": p.unit, "min": p.minimum, "max": p.maximum,
                 "rate": None if p.may_jump else [p.rate_minimum, p.rate_maximum]} for p in model.parameters
            ],
            "constraints": [
                {"coefficients": dict(c.coefficients), "max": c.maximum, "unit": c.unit} for c in model.constraints
            ],
            "constants": {name: {"value": c.value, "unit": c.unit, "source": c.source} for name, c in model.constants.items()},
            **({"tables": {name: table.plain for name, table in model.tables.items()}} if model.tables else {}),
            "matrices": {key: [[formula(e, model) for e in row] for row in getattr(model, key).tolist()] for key in SHAPES},
            "poles": [
                {"at": dict(zip([p.name for p in model.parameters], map(float, point), strict=True)),
                 "poles": [[float(s.real), float(s.imag)] for s in poles]}
                for point, poles in zip(self.points, self.poles, strict=True)
            ],
            **{name: {"rank": side.rank.verdict, "condition": side.condition, "hidden_mode": side.hidden and side.hidden.words}
               for name, side in sides},
        }  # fmt: skip


def overview(model: LpvModel) -> Overview:
    """All of it; symbolic ranks take a second or two for four states."""
    ends = [(p.minimum, p.maximum) for p in model.parameters]
    middle = model.centre[0]
    if len(ends) == 1:
        points = np.union1d(np.linspace(*ends[0], 5), model.cells.lines[0][:MOST_ROWS] if model.tables else [])[:, None]
    else:
        corners = (
            model.physical(Faces.of(model.half_spaces).corners) if model.half_spaces else np.array(list(product(*ends)))
        )
        points = np.array([*corners[: MOST_ROWS - 1], middle]).reshape(-1, len(ends))
    line = np.repeat(np.array([middle]).reshape(1, len(ends)), ALONG if ends else 1, axis=0)
    if ends:
        line[:, 0] = np.linspace(*ends[0], ALONG)
        if model.half_spaces:
            line = line[Faces.of(model.half_spaces).inside(model.scaled(line))]
    return Overview(
        model, points, _poles(model, points), line, _poles(model, line),
        Side(observability_over_range(model), undetectable_mode(model)),
        Side(controllability_over_range(model), unstabilisable_mode(model) if model.inputs else None),
    )  # fmt: skip


def _poles(model: LpvModel, points: FloatArray) -> ComplexArray:
    """Slowest first."""
    found = np.linalg.eigvals(model.on(points).A).astype(complex)
    order = np.lexsort((found.imag, -found.real), axis=-1)
    return np.take_along_axis(found, order, -1)
