"""Observability of models as users write them: decimals, pi, kinks, any elementary function; rank loss beyond polynomials."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from analysis import (
    LieRankTest,
    detectable,
    frozen_modes,
    generic_rank,
    hautus_test,
    observability_gramian,
    observability_of,
    rank_loss,
    stochastic_observability,
)
from analysis.errors import AnalysisError
from analysis.observability.exact_expression import exact
from analysis.observability.lie_series import FUNCTIONS, Evaluator, series_arithmetic
from analysis.observability.rank_loss import RankLoss
from analysis.observability.real_roots import real_roots
from synthesis import NonlinearModel, Signal

x, y, p, rate = sp.symbols("x y p p_rate")


def nonlinear(f: list[Any], h: list[Any]) -> NonlinearModel:
    signals = tuple(Signal(name, "1") for name in ("x", "y"))
    outputs = tuple(Signal(f"h{i}", "1") for i in range(len(h)))
    return NonlinearModel("m", "a test", signals, outputs, sp.Matrix(f), sp.Matrix(h))


def rank(f: list[Any], h: Any, low: float = 0.5, high: float = 1.5) -> tuple[int, bool]:
    found = generic_rank(nonlinear(f, [h]), {"x": (low, high), "y": (low, high)})
    return found.rank, found.structure.proved


def loss(condition: Any) -> RankLoss:
    return rank_loss(observability_of(sp.zeros(1), sp.Matrix([[condition]]), {p: rate}, 1))


@pytest.mark.parametrize("function", list(FUNCTIONS))
def test_every_function_has_the_taylor_series_of_sympy(function: Any) -> None:
    """Value and two derivatives at 0.3 (acosh: at 1.3), by sympy to 30 digits."""
    at = sp.Rational(13 if function is sp.acosh else 3, 10)
    with series_arithmetic(3, 200):
        from flint import arb, arb_series

        (found,) = Evaluator([function(x)])({"x": arb_series([arb(at.p) / arb(at.q), 1])})
        coefficients = [float(found[k].mid()) for k in range(3)]
    wanted = [float(sp.N(function(x).diff(x, k).subs(x, at), 30)) / (1, 1, 2)[k] for k in range(3)]
    np.testing.assert_allclose(coefficients, wanted, rtol=1e-13)


@pytest.mark.parametrize(
    "h",
    [
        sp.tanh(x), sp.Abs(x - 5), sp.Max(x, -5), sp.Min(x, 5), x**2.0, x**0.5, x**0.3, x**y, 2**x, sp.sin(sp.pi * x),
        0.1 * x, sp.Abs(sp.Symbol("x", real=True)), sp.erf(x), sp.sqrt(x**2 + y**2), sp.cosh(x) + sp.E,
    ],
)  # fmt: skip
def test_a_position_sensor_of_any_law_sees_position_and_speed(h: Any) -> None:
    assert rank([0.1 * y, 0], h) == (2, True)
    assert rank([0, 0], h)[0] == 1  # the negative control: without motion one value says one thing


def test_kinks_are_cases_with_their_own_rank() -> None:
    """max(x, 0) sees nothing for x < 0; sign and step see nothing anywhere; on the kink itself there is no answer."""
    assert rank([y, 0], sp.Max(x, 0)) == (2, True)
    assert rank([y, 0], sp.Max(x, 0), -1.5, -0.5) == (0, False)  # other pieces see
    assert rank([y, 0], sp.sign(x)) == rank([y, 0], sp.Heaviside(x)) == (0, True)
    assert rank([y, 0], sp.Min(x, -x)) == (2, True)
    with pytest.raises(AnalysisError, match="switching surface"):
        LieRankTest(nonlinear([y, 0], [sp.Abs(x)])).at({"x": 0, "y": 1})


def test_decimals_are_the_fractions_they_say() -> None:
    """0.1 x + 0.2 y hides 2 x - y exactly; 0.1 + 0.2 is not 0.3 to a computer and stays so."""
    found = generic_rank(nonlinear([0, 0], [0.1 * x + 0.2 * y]), {"x": (0, 1), "y": (0, 1)})
    assert (found.rank, found.structure.proved) == (1, True) and found.structure.basis in (
        sp.Matrix([-2, 1]), sp.Matrix([1, -sp.Rational(1, 2)]),
    )  # fmt: skip
    assert exact("A", [[0.1, sp.Float("0.1000000000000000000001", 30)]])[0] == sp.Rational(1, 10)
    assert exact("A", [[0.1 + 0.2]])[0] == sp.Rational("0.30000000000000004")
    assert exact("A", [[sp.Float("0.1000000000000000000001", 30)]])[0] != sp.Rational(1, 10)


def test_a_direction_that_only_the_samples_hide_is_not_proved() -> None:
    """Too few derivatives, one point instead of a box, an irrational direction: rank 1 in the samples, and no proof."""
    box = {"x": (0.5, 1.5), "y": (0.5, 1.5)}
    short = generic_rank(nonlinear([y, 0], [x]), box, order=0)
    assert (short.rank, short.structure.basis.cols, short.structure.proved) == (1, 1, False)
    point = generic_rank(nonlinear([0, 0], [x**2 + y**2]), {"x": (1, 1), "y": (1, 1)})
    assert (point.rank, point.structure.basis.cols, point.structure.proved) == (1, 1, False)
    slanted = generic_rank(nonlinear([0, 0], [x + sp.sqrt(2) * y]), box)
    assert (slanted.rank, slanted.structure.basis.cols, slanted.structure.proved) == (1, 0, False)
    tiny = [x + y, x + y + y / sp.Integer(10) ** 30]  # two outputs that differ by a hair, and by nothing
    assert generic_rank(nonlinear([0, 0], tiny), box).rank == 2
    assert generic_rank(nonlinear([0, 0], [x + y, 2 * x + 2 * y]), box).rank == 1
    flat = generic_rank(nonlinear([0, 0], [x + y]), box, order=0)
    assert (flat.rank, flat.structure.proved) == (1, True)


@pytest.mark.parametrize(("entry", "word"), [(sp.I, "complex"), (sp.nan, "not a finite"), (sp.oo, "not a finite")])
def test_entries_that_are_no_real_numbers_are_refused(entry: Any, word: str) -> None:
    for call in (
        lambda: observability_of(sp.Matrix([[entry]]), sp.eye(1), {}, 1),
        lambda: frozen_modes(sp.eye(1), sp.Matrix([[entry]])),
        lambda: rank([y, 0], x + entry),
    ):
        with pytest.raises(AnalysisError, match=word):
            call()


@pytest.mark.parametrize("ends", [None, (0.0,), (0.0, np.inf), (np.nan, 1.0), (0.0, 1j)])
def test_ranges_need_two_finite_ends(ends: Any) -> None:
    with pytest.raises(AnalysisError, match=r"two real ends|not a finite number"):
        generic_rank(nonlinear([y, 0], [x]), {"x": ends, "y": (0, 1)})


@pytest.mark.parametrize(
    ("condition", "roots"),
    [
        ((p - 1) * sp.sin(p), (0, 1)),
        (sp.exp(p) - 2, (sp.log(2),)),
        (sp.tanh(p) - 0.5, (float(np.arctanh(0.5)),)),
        (sp.cos(p) ** 2 - 1, (0,)),
        (sp.sin(p) - p / 2, (-1.8954942670339809, 0, 1.8954942670339809)),
        (p * sp.exp(p) - 1, (sp.LambertW(1),)),
        (sp.Abs(p) - 1, (-1, 1)),
        (sp.atan(p) - 1, (sp.tan(1),)),
        (sp.exp(p) + 1, ()),
        (p**2 - sp.sqrt(2) * p, (0, sp.sqrt(2))),
        (p**2 - sp.pi, (-sp.sqrt(sp.pi), sp.sqrt(sp.pi))),
        (p**2 - 2 * sp.sqrt(2) * p + 2, (sp.sqrt(2),)),
        ((p - 1) / (p + 3), (1,)),
        ((p**2 - 1) / (p - 1), (-1,)),
        (sp.sin(p) / p, ()),
        ((p - 2) ** 2, (2,)),
        (0.1 * p - 0.03, (sp.Rational(3, 10),)),
    ],
)
def test_roots_inside_a_range(condition: Any, roots: tuple[Any, ...]) -> None:
    found = real_roots(exact("c", [[condition]])[0], p, (sp.Integer(-2), sp.Integer(2)))
    assert len(found) == len(roots)
    np.testing.assert_allclose([float(root) for root in found], [float(root) for root in roots], atol=1e-15, rtol=1e-14)


def test_a_root_at_the_end_of_a_range_belongs_to_it() -> None:
    found = real_roots(sp.sin(p) - p / 2, p, (sp.Integer(0), sp.Integer(2)))
    np.testing.assert_allclose([float(root) for root in found], [0.0, 1.8954942670339809], atol=1e-20, rtol=1e-14)


def test_factors_and_roots_say_what_they_cannot() -> None:
    assert loss((p - 1) / (p + 3)).factors == (p - 1,)
    assert loss(sp.sin(p) * (p - 1)).factors == (p - 1, sp.sin(p))
    assert loss((p - 1) / (p + 3)).roots("p") == (1,)
    assert loss(1 / p).factors == ()
    with pytest.raises(AnalysisError, match=r"give the range to search \(roots_inside\)"):
        loss(sp.cos(p)).roots("p")
    q = sp.Symbol("q")
    with pytest.raises(AnalysisError, match="vanishes for every p"):
        loss(p * q).roots("p", {"q": 0})
    with pytest.raises(AnalysisError, match="does not depend on 'qq'"):
        loss(p * q - 1).roots("p", {"qq": 2})
    assert loss(p * q - 1).roots("p", {"q": 2}) == (sp.Rational(1, 2),)
    with pytest.raises(AnalysisError, match="cannot be told apart"):
        real_roots(sp.sin(1 / p) + p / 7, p, (sp.Integer(-1), sp.Integer(1)))


@pytest.mark.parametrize(
    ("condition", "intervals"),
    [
        (sp.sin(p) * (rate + 5), ((0, 0),)),
        ((sp.sin(p) - p / 2) * (rate + 5), tuple((v, v) for v in (-1.8954942670339809, 0.0, 1.8954942670339809))),
        (sp.sin(p) - rate / 2, ((-float(np.pi / 6), float(np.pi / 6)),)),
        (1 / p + rate, ((-2, -1), (1, 2))),
        ((p - sp.pi / 4) * (rate + 5), ((sp.pi / 4, sp.pi / 4),)),
        (p * (rate + p**2), ((-1, 1),)),
        (rate - 3 * (p**2 - 1), ((-sp.sqrt(sp.Rational(4, 3)), -sp.sqrt(sp.Rational(2, 3))),
                                 (sp.sqrt(sp.Rational(2, 3)), sp.sqrt(sp.Rational(4, 3))))),
        ((p - 2) * (rate + 5), ((2, 2),)),
        (rate - p**2 - 2, ()),
    ],
)  # fmt: skip
def test_intervals_over_rates_beyond_polynomials(condition: Any, intervals: tuple[Any, ...]) -> None:
    found = loss(condition).interval_over_rates("p", rates=(-1, 1), search=(-2, 2))
    assert len(found) == len(intervals)
    for have, want in zip(found, intervals, strict=True):
        np.testing.assert_allclose([float(v) for v in have], [float(v) for v in want], atol=1e-14)


def test_a_mode_that_is_hidden_on_a_smaller_set_says_so() -> None:
    """C v = (x, y) vanishes at x = y = 0 only; (x, x + 1) never does."""
    mode = next(m for m in frozen_modes(sp.diag(1, 2), sp.Matrix([[x, 1], [y, 0]])) if m.eigenvalue == 1)
    assert mode.hidden_if == 1 and set(mode.leftover) == {x, y}
    mode = next(m for m in frozen_modes(sp.diag(1, 2), sp.Matrix([[x, 1], [x, 0]])) if m.eigenvalue == 1)
    assert mode.hidden_if == x and mode.leftover == ()
    (mode, *_) = frozen_modes(sp.diag(1, 2), sp.Matrix([[x - 0.1, 1]]))
    assert sp.solve(mode.hidden_if, x) == [sp.Rational(1, 10)]


def test_masks_and_empty_batches() -> None:
    A, C = np.stack([np.eye(2)] * 3), np.ones((3, 1, 2))
    hole = np.ma.masked_array(A, mask=np.arange(12).reshape(3, 2, 2) == 5)
    for call in (
        lambda: hautus_test(hole, C), lambda: observability_gramian(hole, C), lambda: detectable(hole[1], C[1]),
        lambda: stochastic_observability(hole, C, np.eye(2), [[1.0]]), lambda: hautus_test(list(hole), C),
    ):  # fmt: skip
        with pytest.raises(AnalysisError, match="masked entries"):
            call()
    assert hautus_test(np.ma.masked_array(-A), C).frozen_detectable.all()
    assert hautus_test(np.zeros((0, 2, 2)), np.zeros((0, 1, 2))).frozen_observable.shape == (0,)
    with pytest.raises(AnalysisError, match="at least one row"):
        hautus_test(np.eye(2), np.zeros((0, 2)))
