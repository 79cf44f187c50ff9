"""Critical probabilities of ill-posed pairs: exact fractions, and intervals that hold for every pair within rounding."""

from __future__ import annotations

from itertools import pairwise
from math import inf, isnan

import numpy as np
import pytest

from analysis import (
    critical_drop_interval,
    critical_drop_probability,
    critical_recovery_interval,
    critical_recovery_probability,
    drop_radius,
    drop_regions,
    drop_verdict,
    gilbert_elliott,
    mean_square_stable_intervals,
    recovery_regions,
    stable_recovery_intervals,
)
from analysis.drops import regions
from analysis.drops.crossing import largest_real
from analysis.drops.planar import critical_planar
from analysis.drops.rational import exact_critical_drop, exact_critical_recovery
from analysis.errors import AnalysisError
from analysis.exact import radius_below_one
from analysis.markov.enclosure import DATA
from analysis.markov.regular import regular_cells
from synthesis.lmi.result import Verdict

T = np.array([[1.0, 2.0, 0.0, 1.0], [0.0, 1.0, 3.0, 0.0], [0.0, 0.0, 1.0, 2.0], [1.0, 2.0, 0.0, 2.0]])
BACK = np.round(np.linalg.inv(T))  # whole numbers, det T = 1: no rounding in T J T^-1


def defective(size: int) -> tuple[np.ndarray, np.ndarray]:
    """A Jordan block of eigenvalue 5/4 in coordinates that hide it, and I/4; the critical probability is exactly 5/8."""
    assert np.array_equal(T @ BACK, np.eye(4)) or size != 4
    J = 1.25 * np.eye(size) + np.diag(np.ones(size - 1), 1)
    if size == 4:
        return T @ J @ BACK, 0.25 * np.eye(4)
    S, R = np.array([[2.0, 1.0], [1.0, 1.0]]), np.array([[1.0, -1.0], [-1.0, 2.0]])
    return S @ J @ R, 0.25 * np.eye(2)


@pytest.mark.parametrize("size", [2, 4])
def test_a_hidden_jordan_block_has_an_exact_answer_and_an_interval(size: int) -> None:
    """radius of M(p) = p (5/4)^2 + (1 - p) (1/4)^2, which is 1 at p = 5/8."""
    A0, A1 = defective(size)
    assert critical_drop_probability(A0, A1) == 0.625
    found = critical_drop_interval(A0, A1)
    assert found.exact == 0.625 and found.lower < 0.625 < found.upper
    assert 1e-9 < found.upper - found.lower < (1e-3 if size == 2 else 0.05)
    regions = drop_regions(A0, A1)
    assert len(regions.stable) == len(regions.unstable) == len(regions.undecided) == 1
    assert regions.stable[0][1] > 0.3 and regions.unstable[0][0] < 0.95
    for answer, p in ((Verdict.CERTIFIED, 0.3), (Verdict.INCONCLUSIVE, 0.625), (Verdict.REFUTED, 0.95)):
        assert drop_verdict(A0, A1, p) is answer


@pytest.mark.parametrize("relative", [DATA, 1e-6])
def test_the_interval_holds_for_every_pair_within_the_error(relative: float) -> None:
    A0, A1 = defective(2)
    draw, second_pair = np.random.default_rng(0), ([[1.2, 0.3], [0.0, 0.5]], [[0.4, 0.1], [0.2, 0.3]])
    # S(J) of a Jordan block of two has one of three, which moves by the cube root of an error at most.
    for pair, power in (((A0, A1), 1.0 / 3.0), (second_pair, 1.0)):
        first, second = np.array(pair[0]), np.array(pair[1])
        found = critical_drop_interval(first, second, relative)
        moved = [
            exact_critical_drop(*(X * (1.0 + relative * draw.choice([-1.0, 1.0], (2, 2))) for X in (first, second)))
            for _ in range(40)
        ]
        assert found.lower <= min(moved) and max(moved) <= found.upper
        assert found.upper - found.lower <= 500.0 * relative**power
    if relative > DATA:  # the control: the interval of rounding alone does not hold what a larger error does
        narrow = critical_drop_interval(first, second)
        assert min(moved) < narrow.lower or max(moved) > narrow.upper


def test_regions_fill_the_line_and_agree_with_the_radius() -> None:
    draw = np.random.default_rng(4)
    for n in (2, 3):
        A0, A1 = draw.normal(size=(n, n)) * 1.4 / np.sqrt(n), draw.normal(size=(n, n)) * 0.5 / np.sqrt(n)
        found = drop_regions(A0, A1)
        pieces = sorted((*found.stable, *found.unstable, *found.undecided))
        assert pieces[0][0] == 0.0 and pieces[-1][1] == 1.0
        assert all(a[1] == b[0] for a, b in pairwise(pieces))
        for low, high in found.stable:
            assert (drop_radius(A0, A1, np.linspace(low + 1e-9, high - 1e-9, 30)) < 1.0).all()
        for low, high in found.unstable:
            assert (drop_radius(A0, A1, np.linspace(low + 1e-9, high - 1e-9, 30)) > 1.0).all()
        assert sum(high - low for low, high in found.undecided) < 1e-10
        assert len(mean_square_stable_intervals(A0, A1)) == len(found.stable)


def test_cells_that_touch_are_one_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    eye, none = np.eye(2), np.zeros((2, 2))
    assert regions.singular_cells(eye, eye, none, none) == ((0.0, 1.0),)  # singular everywhere: no cell stands alone
    assert regions.regions(eye, eye, none, none) == regions.Regions((), (), ((0.0, 1.0),))
    # eigenvalues 1.5 - 2 x and 0.5 + 2 x / 3 pass 1 at 1/4 and 3/4, the first an edge of cells on both sides
    F, G = np.diag([1.5, 0.5]), np.diag([-0.5, 7.0 / 6.0])
    (first, second) = regions.singular_cells(F, G, none, none)
    assert first[0] < 0.25 < first[1] < first[0] + 1e-10 and second[0] < 0.75 < second[1] < second[0] + 1e-10
    found = regions.regions(F, G, none, none)
    assert found.undecided == (first, second) and found.stable == ((first[1], second[0]),)
    assert found.unstable == ((0.0, first[0]), (second[1], 1.0))
    monkeypatch.setattr(regions, "_status", lambda *_: "undecided")  # what lies between is joined as well
    assert regions.regions(F, G, none, none) == regions.Regions((), (), ((0.0, 1.0),))


def test_intervals_of_simple_pairs() -> None:
    found = critical_drop_interval(0.5 * np.eye(2), 0.1 * np.eye(2))
    assert (found.lower, found.upper, found.exact) == (1.0, 1.0, 1.0)
    found = critical_drop_interval(2.0 * np.eye(2), 1.5 * np.eye(2))
    assert (found.lower, found.upper, found.exact) == (0.0, 0.0, 0.0)
    found = critical_drop_interval([[1.0, 0.1], [0.0, 1.0]], np.eye(2) * 0.5)  # an integrator: marginal at p = 1
    assert 1.0 - 1e-4 < found.lower < found.upper == found.exact == 1.0
    found = critical_drop_interval(2.0 * np.eye(2), np.eye(2))  # a marginal received loop
    assert found.lower == 0.0 < found.upper < 1e-10


NEARLY_MARGINAL = [  # n0 of the planar closed form cancels to 1e-8 .. 1e-14 here
    ([[0.9, -1.3], [0.7, 0.2]], 1e-8),
    ([[-0.5, 1.9], [0.3, 0.8]], 1e-12),
    ([[1.4, 0.2], [-0.6, -1.1]], 1e-13),
]


@pytest.mark.parametrize(("open_loop", "gap"), NEARLY_MARGINAL)
@pytest.mark.parametrize("turn", [0.3, 1.1, 2.5])
def test_a_nearly_marginal_received_loop(open_loop: list[list[float]], gap: float, turn: float) -> None:
    """The closed form lost all digits here, without a word; det(I - M(p)) in exact fractions changes sign at the answer."""
    from fractions import Fraction

    import sympy as sp

    U = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    A1 = U @ np.diag([1.0 - gap, 0.3]) @ U.T
    p = float(critical_drop_probability(open_loop, A1))

    def det(at: float) -> Fraction:
        M = sp.zeros(4)
        for weight, A in ((Fraction(at), np.array(open_loop)), (1 - Fraction(at), A1)):
            rows = sp.Matrix(2, 2, [sp.Rational(*Fraction(float(x)).as_integer_ratio()) for x in A.ravel()])
            M += sp.Rational(weight.numerator, weight.denominator) * sp.kronecker_product(rows, rows)
        return (sp.eye(4) - M).det()

    assert 0.0 < p < 1.0
    assert det(p * (1.0 - 1e-6)) > 0 > det(p * (1.0 + 1e-6))
    smaller = np.linspace(0.0, p * (1.0 - 1e-4), 40)[1:]
    assert (drop_radius(open_loop, A1, smaller) < 1.0 + 1e-12).all()


def test_a_burst_channel_in_closed_form() -> None:
    """A1 = I/4 and a hidden Jordan block of 5/4 behave as scalars: r = (1 - (1-f) c^2)(a^2 - 1) / (a^2 (1 - c^2)) = 0.366."""
    A0, A1 = defective(2)
    assert critical_recovery_probability(A0, A1, 0.25) == pytest.approx(0.366, abs=1e-15)
    found = critical_recovery_interval(A0, A1, 0.25)
    assert found.exact == pytest.approx(0.366, abs=1e-15) and found.lower < 0.366 < found.upper < found.lower + 1e-2
    ((low, high),) = stable_recovery_intervals(A0, A1, 0.25)
    assert high == 1.0 and found.lower <= low <= found.upper
    regions = recovery_regions(A0, A1, 0.25)
    for (low, high), below in ((regions.stable[0], True), (regions.unstable[-1], False)):
        middle = gilbert_elliott(A0, A1, 0.25, 0.5 * (low + high)).second_moment_radius()
        assert (middle < 1.0) is np.bool_(below)
    never = critical_recovery_interval(2.0 * np.eye(2), 0.9 * np.eye(2), 0.9)
    assert never.lower == never.upper == never.exact == inf
    always = critical_recovery_interval(0.9 * np.eye(2), 0.5 * np.eye(2), 0.9)
    assert (always.lower, always.upper, always.exact) == (0.0, 0.0, 0.0)


def test_recovery_does_not_need_a_received_loop_that_is_stable_alone() -> None:
    """A good channel that grows and a bad one that shrinks: stable at r = 1 where their product is."""
    A0, A1 = 0.5 * np.eye(2), 1.1 * np.eye(2)
    found = float(critical_recovery_probability(A0, A1, 0.9))
    assert found == pytest.approx(exact_critical_recovery(A0, A1, 0.9), abs=1e-15)
    radii = gilbert_elliott(A0, A1, 0.9, np.array([1.0, max(found, 1e-3) * 1.001])).second_moment_radius()
    assert (radii < 1.0).all()


def test_fractions_and_floats_agree_where_nothing_is_ill_posed() -> None:
    draw = np.random.default_rng(11)
    for n in (2, 3, 4):
        A0, A1 = draw.normal(size=(5, n, n)) * 1.3 / np.sqrt(n), draw.normal(size=(5, n, n)) * 0.5 / np.sqrt(n)
        floats = critical_drop_probability(A0, A1)
        assert floats == pytest.approx([exact_critical_drop(a, b) for a, b in zip(A0, A1, strict=True)], rel=1e-12)
        assert (floats < 1.0).any()
        bursts = critical_recovery_probability(A0, A1, 0.3)
        exact = [exact_critical_recovery(a, b, 0.3) for a, b in zip(A0, A1, strict=True)]
        np.testing.assert_allclose(bursts, exact, rtol=1e-11, atol=1e-13)


def test_which_answers_are_left_open() -> None:
    """Ordinary pairs keep the closed form; a double eigenvalue 1, and one that is nearly so, do not look alike."""
    draw = np.random.default_rng(2)
    _, open_ = critical_planar(draw.normal(size=(500, 2, 2)), 0.4 * draw.normal(size=(500, 2, 2)))
    assert not open_.any()
    shown = np.array([[1.0, 0.1], [0.0, 1.0]])
    p, open_ = critical_planar(shown, 0.3 * np.eye(2))
    assert p == 1.0 and not open_
    hidden = (
        np.array([[2.0, 1.0], [1.0, 1.0]]) @ np.array([[1.0, 1e-7], [1e-9, 1.0]]) @ np.array([[1.0, -1.0], [-1.0, 2.0]])
    )
    assert critical_planar(hidden, 0.3 * np.eye(2))[1]
    assert critical_drop_probability(hidden, 0.3 * np.eye(2)) < 1.0 - 1e-9
    K = np.array([[3.0, 1.0], [0.0, 2.0]])
    assert largest_real(K, np.array(1.0)) == (3.0, False)
    assert largest_real(np.array([[3.0, 1.0], [-1e-17, 3.0]]), np.array(1.0))[1]
    assert largest_real(K, np.array(1e12))[1]
    assert largest_real(np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array(1.0)) == (0.0, False)


def test_regular_families() -> None:
    """(1 - x) 0 + x 2: the eigenvalue 1 is met at x = 1/2 only."""
    none, two, sure = np.zeros((2, 2)), 2.0 * np.eye(2), np.zeros((2, 2))
    low, high = np.array([0.0, 0.4, 0.5, 0.51, 0.45]), np.array([0.49, 0.499, 0.5, 1.0, 0.55])
    assert list(regular_cells(none, two, sure, sure, low, high)) == [True, True, False, True, False]
    assert list(regular_cells(none, two, sure, 0.3 * np.ones((2, 2)), low, high)) == [False] * 5
    assert radius_below_one(0.5 * np.eye(2)) is True and radius_below_one(1.5 * np.eye(2)) is False
    assert radius_below_one(np.array([[0.0, 1.0], [-1.0, 0.0]])) is None


def test_questions_that_are_refused() -> None:
    A0, A1 = np.eye(9) + np.diag(np.ones(8), 1), 0.5 * np.eye(9)
    assert isnan(critical_drop_interval(A0, A1).exact)
    with pytest.raises(
        AnalysisError, match=r"45 unknowns are too many for exact fractions; bracket it with critical_drop_interval"
    ):
        exact_critical_drop(A0, A1)
    with pytest.raises(AnalysisError, match=r"42 unknowns .* critical_recovery_interval"):
        exact_critical_recovery(np.eye(6), np.eye(6), 0.5)
    with pytest.raises(AnalysisError, match=r"relative = 0\.5 must lie between 0 and 0\.01"):
        drop_regions(np.eye(2), np.eye(2), 0.5)
    with pytest.raises(AnalysisError, match="one pair of matrices, not stacks"):
        critical_drop_interval(np.zeros((3, 2, 2)), np.zeros((3, 2, 2)))
    with pytest.raises(AnalysisError, match="one failure probability"):
        recovery_regions(np.eye(2), np.eye(2), np.array([0.1, 0.2]))
    with pytest.raises(AnalysisError, match="do not broadcast"):
        drop_verdict(np.zeros((3, 2, 2)), np.zeros((3, 2, 2)), np.zeros(2))
