"""Local minima between the places of a grid, and what exchange makes of them: valleys no longer stall it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from estimators.arrays import FloatArray
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.errors import ProblemError
from synthesis.lmi import exchange as exchanges
from synthesis.lmi.local_minima import APART, followed, grid_minima
from synthesis.lmi.result import Verdict
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")
BOTTOMS = np.array([[-0.41, 0.33], [0.58, -0.27]])
DEPTHS = np.array([-0.3, -0.2])


def two_valleys(places: FloatArray) -> FloatArray:
    """Paraboloids of different depths, the smaller counting; a third variable lifts."""
    far = ((places[:, None, :2] - BOTTOMS) ** 2).sum(axis=2)
    return np.asarray((far + DEPTHS).min(axis=1) + 0.1 * (1.0 - places[:, 2]))


def grid_of(points: int) -> tuple[FloatArray, FloatArray]:
    line = np.linspace(-1.0, 1.0, points)
    places = np.array([(x, y, r) for x in line for y in line for r in (-1.0, 1.0)])
    return places, np.array([line[1] - line[0], line[1] - line[0], 0.0])


def test_minima_between_places_are_found_and_none_is_invented() -> None:
    places, spacing = grid_of(9)
    starts = grid_minima(two_valleys(places), (9, 9, 2))
    found, values = followed(two_valleys, places[starts], spacing)
    lifted = found[:, 2] < 0.0
    assert len(found) == 4 and lifted.sum() == 2  # both valleys at both values of what stays as it is
    np.testing.assert_allclose(found[~lifted, :2], BOTTOMS, atol=0.01)
    np.testing.assert_allclose(values[~lifted], DEPTHS, atol=1e-4)
    assert (np.diff(values) >= 0.0).all()


def test_what_cannot_fall_low_enough_is_not_followed() -> None:
    places, _ = grid_of(9)
    values = two_valleys(places)
    low = grid_minima(values, (9, 9, 2), below=-0.25)
    assert 0 < len(low) < len(grid_minima(values, (9, 9, 2)))
    assert any(np.abs(places[i, :2] - BOTTOMS[0]).max() < 0.2 for i in low)
    assert not len(grid_minima(values + 10.0, (9, 9, 2), below=0.0))
    assert APART < 0.25  # neighbours on the grids of exchange are never one minimum


def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    calls, solved = [0], exchanges.solve_sampled

    def one_more(*given: Any) -> Any:
        calls[0] += 1
        return solved(*given)

    replaced: Callable[..., Any] = one_more
    monkeypatch.setattr(exchanges, "solve_sampled", replaced)
    return calls


def observed(C: Any, degree: int) -> Any:
    """At p = -1 the second state is hidden, and decays little faster than is asked for."""
    model = small_model(
        [[-1 + q, 1 + p], [-2, p / 4]], C, (parameter("p"), parameter("q")), E=[[1, 0], [p / 3, 0]], F=[[0, 1]]
    )
    wanted = ObserverDesign((Channel(("d1", "d2"), ("x1", "x2")),), degree=degree, decay_rate=0.2)
    return design_observer(model, wanted)


def test_a_plant_whose_inequalities_have_narrow_valleys(monkeypatch: pytest.MonkeyPatch) -> None:
    """33 x 33 points with all rates, solved by Clarabel in 21 s, give gamma^2 = 84.6996; 9 x 9 points give 84.22."""
    calls = counted(monkeypatch)
    found = observed([[1, 0]], 2)
    assert found.verdict is Verdict.CERTIFIED
    assert found.optimum.objective == pytest.approx(84.6996, rel=1e-4)
    assert found.gamma_lower is not None
    assert found.gamma_lower * 1.01 <= found.gamma <= found.gamma_lower * 1.011
    assert calls[0] <= 35  # more than 200 where only the places of the grid joined


def test_what_has_no_answer_is_refused_after_few_solves(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = counted(monkeypatch)
    with pytest.raises(ProblemError, match="no solution"):
        observed([[1, q / 2]], 1)
    assert calls[0] <= 30
