"""What `proved` means of hidden directions, and what random points may and may not decide."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from analysis import generic_rank
from analysis.observability.lie_rank import LieRankTest
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.param import Signal

x0, x1, x2, u = sp.symbols("x0 x1 x2 u")
UNIT = {"x0": (-1.0, 1.0), "x1": (-1.0, 1.0)}


def model(f: list[object], h: list[object], inputs: tuple[str, ...] = ()) -> NonlinearModel:
    """States x0, x1, ... without units."""
    states = tuple(Signal(f"x{i}", "1") for i in range(len(f)))
    outputs = tuple(Signal(f"y{i}", "1") for i in range(len(h)))
    driven = tuple(Signal(name, "1") for name in inputs)
    return NonlinearModel("test", "made up", states, outputs, sp.Matrix(f), sp.Matrix(h), inputs=driven)


def test_a_direction_that_the_motion_brings_into_the_output_is_not_proved_hidden() -> None:
    """x0' = x1, y = x0: without derivatives the points miss x1, and the formulas do not."""
    chain = model([x1, 0], [x0])
    short = generic_rank(chain, UNIT, order=0)
    assert (short.rank, short.structure.basis.cols, short.structure.proved) == (1, 1, False)
    assert generic_rank(chain, UNIT).rank == 2


def test_a_direction_that_shows_elsewhere_is_not_proved_hidden() -> None:
    """y = x0 + max(x1 - 10, 0): no point with x1 < 1 sees x1."""
    found = generic_rank(model([0, 0], [x0 + sp.Max(x1 - 10, 0)]), UNIT)
    assert found.rank == 1 and found.structure.basis == sp.Matrix([0, 1]) and not found.structure.proved
    moved = generic_rank(model([sp.Max(x1 - 10, 0), 0], [x0]), UNIT)  # the same through the motion
    assert moved.rank == 1 and moved.structure.basis == sp.Matrix([0, 1]) and not moved.structure.proved


def test_inputs_of_no_width_keep_their_value_in_the_proof() -> None:
    driven = model([(u - 2) * x1, -3 * x1], [x0], ("u",))
    still = generic_rank(driven, {**UNIT, "u": (2.0, 2.0)})
    assert still.rank == 1 and still.structure.proved and still.structure.describe() == ("x1",)
    assert still.structure.dynamics == sp.Matrix([[-3]])
    assert generic_rank(driven, {**UNIT, "u": (2.0, 2.5)}).rank == 2


def test_the_rank_is_the_best_of_the_points() -> None:
    """y = (x0, max(x0, 0) x1): two where x0 > 0, one elsewhere."""
    half, firsts = model([0, 0], [x0, sp.Max(x0, 0) * x1]), set()
    for seed in range(6):
        found = generic_rank(half, UNIT, seed=seed)
        ranks = [sample.rank for sample in found.samples]
        assert found.rank == max(ranks)
        firsts.add((ranks[0], max(ranks), min(ranks)))
    assert {(1, 2, 1), (2, 2, 1)} <= firsts  # both orders were seen


def test_inputs_are_held_if_that_is_asked_for() -> None:
    mixed = model([0, 0], [x0 + u * x1], ("u",))
    ranges = {**UNIT, "u": (-1.0, 1.0)}
    assert generic_rank(mixed, ranges).rank == 2
    assert generic_rank(mixed, ranges, moving_inputs=False).rank == 1


def test_points_lie_in_their_ranges() -> None:
    """log(x - 5) and sqrt(6 - x) have derivatives between 5 and 6 only."""
    narrow = model([0], [sp.log(x0 - 5) + sp.sqrt(6 - x0)])
    assert generic_rank(narrow, {"x0": (5.01, 5.99)}, samples=20, order=0).rank == 1


@pytest.mark.parametrize(
    ("seen", "basis", "words"),
    [
        (x0 + x1 / 3, [-sp.Rational(1, 3), 1], "- 1/3 x0 + x1"),
        (7 * x0 - 3 * x1, [sp.Rational(3, 7), 1], "3/7 x0 + x1"),
        (x1 - sp.Rational(999983, 7) * x0, [sp.Rational(7, 999983), 1], "7/999983 x0 + x1"),
    ],
)
def test_directions_are_small_fractions(seen: sp.Expr, basis: list[object], words: str) -> None:
    found = generic_rank(model([-2 * x0, -2 * x1], [sp.sin(seen)]), UNIT).structure
    wanted = sp.Matrix(basis)
    assert found.proved and sp.simplify(found.basis * wanted[1] - wanted * found.basis[1]) == sp.zeros(2, 1)
    assert found.dynamics == sp.Matrix([[-2]])
    if found.basis[1] == 1:
        assert found.describe() == (words,)


def test_directions_that_are_no_fractions_are_not_guessed() -> None:
    found = generic_rank(model([0, 0], [x0 + sp.sqrt(2) * x1]), UNIT)
    assert found.rank == 1 and found.structure.basis.cols == 0 and not found.structure.proved


def test_unseen_directions_are_orthonormal_in_any_units() -> None:
    for unit in (1e-9, 1.0, 1e9):
        found = LieRankTest(model([0, 0, 0], [sp.sin(x0 + 2 * x1 + sp.Rational(unit) * x2)])).at(
            {"x0": 1, "x1": 2, "x2": 0}
        )
        gradient = np.cos(5.0) * np.array([1.0, 2.0, unit])
        assert found.rank == 1 and found.unseen.shape == (3, 2)
        np.testing.assert_allclose(found.unseen.T @ found.unseen, np.eye(2), atol=1e-12)
        np.testing.assert_allclose(gradient / np.linalg.norm(gradient) @ found.unseen, 0.0, atol=1e-12)


def test_what_is_left_over_is_rounding_of_many_digits() -> None:
    found = LieRankTest(model([0, 0], [sp.sin(x0 + x1), sp.cos(x0 + x1)])).at({"x0": 1, "x1": 2})
    assert found.by_order == (1, 1, 1, 1) and 0.0 < found.residual < 1e-80
    nearly = LieRankTest(model([0, 0], [sp.sin(x0 + x1), x0 + (1 + sp.Rational(1, 10**60)) * x1]))
    assert nearly.at({"x0": 1, "x1": 2}).rank == 2  # a pivot of 1e-60 is one
