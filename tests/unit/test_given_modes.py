"""What the doors of jump systems, drops and switching are given: objects with A and dt, and what must be refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import sympy as sp
from scipy import signal

from analysis import (
    LabelledArray,
    MarkovJumpProcess,
    MarkovJumpSystem,
    common_growth,
    common_quadratic_lyapunov,
    critical_drop_probability,
    critical_recovery_probability,
    error_measure,
    exact_pair_test,
    independent,
    joint_spectral_radius,
    load_labelled,
    pair_margin,
    runtime_drop_modes,
    sample_paths,
    similarity_bound,
    static_critical_arrival,
    static_gain_radius,
    stationary_distribution,
    symmetric_growth,
)
from analysis.checks import as_stack, positive, whole
from analysis.errors import AnalysisError
from analysis.labelled import Axis
from analysis.markov.chain import distribution
from analysis.perturbed import PerturbedModel
from estimators.whole_files import UNFINISHED, whole_file, write_bytes
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, SchedulingParameter, Signal

A0, A1 = np.array([[1.2, 0.3], [0.0, 0.5]]), np.array([[0.4, 0.1], [0.2, 0.3]])
C = np.array([[1.0, 0.5]])
P = np.array([[0.9, 0.1], [0.4, 0.6]])
Q = np.array([[-1.0, 1.0], [2.0, -2.0]])


def discrete(A: np.ndarray, time: Any = 0.1) -> control.StateSpace:
    return control.ss(A, np.zeros((2, 1)), C, 0.0, time)


def continuous(A: np.ndarray) -> signal.StateSpace:
    return signal.StateSpace(A, np.zeros((2, 1)), C, np.zeros((1, 1)))


def test_objects_give_their_matrices() -> None:
    first, second = discrete(A0), discrete(A1)
    radius = MarkovJumpSystem([A0, A1], P).second_moment_radius()
    assert MarkovJumpSystem([first, second], P).second_moment_radius() == radius
    assert independent([first, second], [0.3, 0.7]).second_moment_radius() != radius
    abscissa = MarkovJumpProcess([A0, A1], Q).second_moment_abscissa()
    assert MarkovJumpProcess([continuous(A0), continuous(A1)], Q).second_moment_abscissa() == abscissa
    assert critical_drop_probability(first, second) == critical_drop_probability(A0, A1)
    assert critical_recovery_probability(first, second, 0.2) == critical_recovery_probability(A0, A1, 0.2)
    assert static_critical_arrival(first).lower == static_critical_arrival(A0, C).lower
    gain = np.array([[0.5], [0.1]])
    assert static_gain_radius(first, None, gain, 0.5) == static_gain_radius(A0, C, gain, 0.5)
    assert joint_spectral_radius([first, second]).upper == joint_spectral_radius([A0, A1]).upper
    modes, same = (runtime_drop_modes(*given, gain, 0.1) for given in ((continuous(A0), None), (A0, C)))
    np.testing.assert_array_equal(modes.received, same.received)
    assert symmetric_growth(continuous(A0)) == symmetric_growth(A0)
    assert common_growth([continuous(A0), continuous(A1)], np.eye(2)) == common_growth([A0, A1], np.eye(2))


def test_time_comes_from_the_objects() -> None:
    B0, B1 = np.diag([0.5, -0.4]), np.diag([-0.3, 0.6])  # unstable in continuous time, stable in discrete time
    pair = discrete(B0), discrete(B1)
    assert pair_margin(*pair) == pair_margin(B0, B1, True) > 0.0 > pair_margin(B0, B1)
    assert exact_pair_test(*pair) == exact_pair_test(B0, B1, True) != exact_pair_test(B0, B1)
    assert common_quadratic_lyapunov(pair).verdict == common_quadratic_lyapunov([B0, B1], True).verdict
    with pytest.raises(AnalysisError, match="contradicts discrete=False"):
        common_quadratic_lyapunov(pair, discrete=False)
    with pytest.raises(AnalysisError, match="contradicts discrete=True"):
        MarkovJumpSystem([continuous(A0), continuous(A1)], P)
    with pytest.raises(AnalysisError, match="contradicts discrete=False"):
        MarkovJumpProcess([discrete(A0), discrete(A1)], Q)
    with pytest.raises(AnalysisError, match="continuous and discrete together"):
        common_quadratic_lyapunov([discrete(A0), continuous(A1)])
    with pytest.raises(AnalysisError, match="one mode is continuous and one discrete"):
        pair_margin(discrete(A0), continuous(A1))
    with pytest.raises(AnalysisError, match="objects and arrays together"):
        joint_spectral_radius([discrete(A0), A1])
    with pytest.raises(AnalysisError, match=r"sample times 0\.1, 0\.2 s"):
        MarkovJumpSystem([discrete(A0), discrete(A1, 0.2)], P)
    with pytest.raises(AnalysisError, match="C is missing"):
        static_critical_arrival(A0)
    for door in (pair_margin, exact_pair_test):
        with pytest.raises(AnalysisError, match="discrete = 'continuous' is not a truth value"):
            door(A0, A1, discrete="continuous")


MASKED = np.ma.masked_array(np.stack([A0, A1]), mask=np.zeros((2, 2, 2), bool))
MASKED[0, 0, 1] = np.ma.masked


@pytest.mark.parametrize(
    "bad", [MASKED, [MASKED[0], A1], np.stack([A0, A1]) + 1e-30j], ids=["masked", "in a list", "complex"]
)
def test_no_part_of_an_array_is_dropped_without_a_word(bad: Any) -> None:
    doors = (
        lambda: MarkovJumpSystem(bad, P),
        lambda: MarkovJumpProcess(bad, Q),
        lambda: common_quadratic_lyapunov(bad),
        lambda: joint_spectral_radius(bad),
        lambda: common_growth(bad, np.eye(2)),
        lambda: critical_drop_probability(bad[0], A1),
        lambda: pair_margin(bad[0], A1),
        lambda: as_stack("x", bad),
    )
    for door in doors:
        with pytest.raises(AnalysisError, match=r"has masked entries|is complex"):
            door()
    shown = np.ma.masked_array(A0, mask=False)
    assert critical_drop_probability(shown, A1) == critical_drop_probability(A0, A1)


@pytest.mark.parametrize("bad", [np.array([1.0 + 1e-9j, 2.0]), np.ma.masked_array([1.0, 2.0], mask=[True, False])])
def test_values_that_would_lose_a_part_are_not_stored(bad: Any, tmp_path: Path) -> None:
    with pytest.raises(AnalysisError, match=r"has (complex|masked) values"):
        LabelledArray("gain", bad, (Axis("p", np.array([0.0, 1.0])),))
    whole_numbers = LabelledArray("gain", np.array([1, 2]), (Axis("p", np.array([0.0, 1.0])),))
    whole_numbers.save(tmp_path / "a")
    assert load_labelled(tmp_path / "a").values.dtype == float


def test_measures_read_their_samples_as_other_doors_do() -> None:
    p, k = sp.symbols("p k")
    signals = (Signal("x", "1"),), (Signal("y", "1"),)
    parameter = SchedulingParameter("p", "1", -1.0, 1.0, -1.0, 1.0)
    constants = {"k": Constant(2.0, "1", "a test")}
    model = LpvModel(
        "m", "a test", *signals, (parameter,), sp.Matrix([[-k * p]]), sp.Matrix([[1]]), constants=constants
    )
    measure = error_measure(PerturbedModel(model), [[3.0]], lambda A, B: A[..., 0, 0], p=[0.0, 0.5])
    np.testing.assert_allclose(measure({"k": [2.0, 4.0]}), [[-3.0, -4.0], [-3.0, -5.0]])
    for bad in ([2.0 + 1j], np.ma.masked_array([2.0], mask=[True])):
        with pytest.raises(AnalysisError, match=r"k (is complex|has masked entries)"):
            measure({"k": bad})  # type: ignore[dict-item]


def test_empty_batches_are_empty_answers_and_the_worst_of_none_is_refused() -> None:
    none = np.zeros((0, 2, 2))
    assert critical_drop_probability(none, none).shape == (0,)
    assert critical_drop_probability(np.zeros((0, 3, 3)), np.zeros((0, 3, 3))).shape == (0,)
    assert critical_recovery_probability(none, none, 0.5).shape == (0,)
    empty = MarkovJumpSystem(np.zeros((0, 2, 2, 2)), P)
    assert empty.second_moment_radius().shape == empty.is_mean_square_stable().shape == (0,)
    assert pair_margin(none, none).shape == symmetric_growth(none).shape == (0,)
    for question in (lambda: common_growth(none, np.eye(2)), lambda: similarity_bound(none, A0, np.eye(2), 1.0)):
        with pytest.raises(AnalysisError, match=r"has the shape \(0, 2, 2\); give at least one matrix"):
            question()
    for door in (joint_spectral_radius, common_quadratic_lyapunov):
        with pytest.raises(AnalysisError, match="at least one mode"):
            door(none)


def test_growth_in_common_coordinates_is_twice_the_largest_eigenvalue() -> None:
    """V' <= growth V for V = |T e|^2: diagonal modes, and T A T^-1 = [[-1, 2], [0, -1]], whose symmetric part reaches 0."""
    assert common_growth([np.diag([-1.0, -3.0]), np.diag([-2.0, -0.5])], np.eye(2)) == pytest.approx(-1.0, abs=1e-15)
    assert common_growth([[[-1.0, 1.0], [0.0, -1.0]]], np.diag([2.0, 1.0])) == pytest.approx(0.0, abs=1e-14)
    assert common_growth([[[-1.0, 1.0], [0.0, -1.0]]], np.diag([1.0, 1.0])) == pytest.approx(-1.0, abs=1e-14)


def test_the_constants_of_a_similarity_bound() -> None:
    """eta1 = 2 (growth + eps/2), eta2 = |T B|^2 rho^2 / (2 eps): A = -I, B = 2 I, |rho| <= 3, eps = 1/2; doubled by T = 2 I."""
    plain = similarity_bound(-np.eye(2), 2.0 * np.eye(2), np.eye(2), 3.0, 0.5)
    assert (plain.eta1, plain.eta2, plain.growth) == pytest.approx((-1.5, 36.0, -1.0))
    assert similarity_bound(-np.eye(2), 2.0 * np.eye(2), 2.0 * np.eye(2), 3.0, 0.5).eta2 == pytest.approx(144.0)
    assert similarity_bound(-np.eye(2), 2.0 * np.eye(2), np.eye(2), 3.0).eta2 == pytest.approx(18.0)  # eps = |growth|
    assert plain.energy(100.0, 1.0) == pytest.approx(24.0)  # -eta2 / eta1


def test_a_growing_rotation_has_no_common_lyapunov_function() -> None:
    """|eigenvalue|^2 = det = 1.21 with trace zero: Jury's second condition alone refuses it."""
    turn = 1.1 * np.array([[0.0, 1.0], [-1.0, 0.0]])
    assert str(exact_pair_test(turn, 0.5 * np.eye(2), True)) == "refuted"
    assert str(exact_pair_test(0.8 * turn, 0.5 * np.eye(2), True)) == "certified"


def test_printed_probabilities_are_made_to_sum_to_one() -> None:
    found = distribution("start", [[0.25, 0.75 + 4e-10], [0.5, 0.5]], 2)
    np.testing.assert_allclose(found.sum(axis=-1), 1.0, rtol=1e-15)
    np.testing.assert_array_equal(found[1], 0.5)
    assert found[0, 1] / found[0, 0] == pytest.approx((0.75 + 4e-10) / 0.25, rel=1e-15)


def test_public_chains_are_checked() -> None:
    np.testing.assert_allclose(stationary_distribution([[0.9, 0.1], [0.4, 0.6]]), [0.8, 0.2])
    with pytest.raises(AnalysisError, match=r"sums to 1\.1"):
        stationary_distribution([[0.9, 0.2], [0.4, 0.6]])
    generator = np.random.default_rng(0)
    assert sample_paths(P, [1.0, 0.0], 5, 7, generator).shape == (6, 7)
    with pytest.raises(AnalysisError, match=r"steps = 2\.5 must be a whole number"):
        sample_paths(P, [1.0, 0.0], 2.5, 7, generator)  # type: ignore[arg-type]
    with pytest.raises(AnalysisError, match="paths are of one chain"):
        sample_paths(np.stack([P, P]), [1.0, 0.0], 2, 7, generator)
    assert whole("n", np.int64(3)) == 3 and whole("n", 4.0) == 4
    for bad in (2.5, -1, [1, 2]):
        with pytest.raises(AnalysisError, match="must be a whole number of at least 0"):
            whole("n", bad)  # type: ignore[arg-type]
    with pytest.raises(AnalysisError, match="give one number"):
        positive("step", [1.0, 2.0])  # type: ignore[arg-type]


def test_files_are_whole_or_absent(tmp_path: Path) -> None:
    target = tmp_path / "a.json"
    write_bytes(target, b"first", sync=True)
    with pytest.raises(RuntimeError), whole_file(target) as beside:
        beside.write_bytes(b"half")
        assert beside.name.startswith(UNFINISHED) and beside.suffix == ".json"
        assert target.read_bytes() == b"first"
        raise RuntimeError
    assert target.read_bytes() == b"first" and list(tmp_path.iterdir()) == [target]
    write_bytes(target, b"second")
    assert target.read_bytes() == b"second" and list(tmp_path.iterdir()) == [target]
    with pytest.raises(AnalysisError, match="cannot be written"):
        LabelledArray("x", np.zeros(1), (Axis("p", np.zeros(1)),)).save(tmp_path / "absent" / "x")
    with pytest.raises(AnalysisError, match="notes hold what JSON has not"):
        LabelledArray("x", np.zeros(1), (Axis("p", np.zeros(1)),), notes={"f": object()}).save(tmp_path / "x")
    assert list(tmp_path.iterdir()) == [target]
