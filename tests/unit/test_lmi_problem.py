"""Problems before any solver: scaling, unknowns, rates, boxes, margins, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from synthesis.errors import ProblemError
from synthesis.lmi.problem import MARGIN, LmiProblem
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.matrix import variable
from tests.support.lmi_cases import parameter

SPEED = SchedulingParameter("speed", "m/s", 10.0, 50.0, -2.0, 6.0)
LOAD = SchedulingParameter("load", "kg", 1.0, 3.0, 0.0, 0.0)
BOTH = (SPEED, LOAD)


def test_known_matrices_are_rewritten_on_the_unit_box() -> None:
    coefficients = np.zeros((2, 3, 1, 1))
    coefficients[0, 0], coefficients[1, 0], coefficients[0, 2] = 5.0, 2.0, -1.0  # 5 + 2 speed - load^2
    known = LmiProblem(BOTH).known(coefficients)
    assert known.variables == 4  # two parameters, two rates
    for u, speed in ((-1.0, 10.0), (0.25, 35.0)):
        for w, load in ((1.0, 3.0), (-0.5, 1.5)):
            value = known.at(np.array([[u, w, 0.3, -0.9]]))[0, 0, 0, 0]
            assert value == pytest.approx(5.0 + 2.0 * speed - load**2)


def test_known_matrices_of_a_wrong_rank_are_refused() -> None:
    with pytest.raises(ProblemError, match="known matrix has 3 axes; 2 parameters need 4"):
        LmiProblem(BOTH).known(np.zeros((2, 1, 1)))


def test_unknowns_have_as_many_decisions_as_entries_times_basis_functions() -> None:
    problem = LmiProblem(BOTH)
    problem.symmetric("P", 3, 2)
    assert problem.decisions == 6 * 6  # 6 entries; 1, x, y, xx, xy, yy
    problem.matrix("X", 3, 2, (1, 0))
    assert problem.decisions == 36 + 6 * 2
    problem.scalar("g")
    assert problem.decisions == 36 + 12 + 1
    x = np.random.default_rng(1).standard_normal(problem.decisions)
    values = problem.unknowns["P"].substitute(x).at(np.array([[0.3, -0.2, 0.0, 0.0]]))[0, ..., 0]
    np.testing.assert_allclose(values, values.T)
    assert problem.unknowns["X"].degrees == (1, 0, 0, 0)
    assert problem.unknowns["g"].substitute(x).at(np.zeros((1, 4)))[0, 0, 0, 0] == x[-1]


def test_names_are_used_once_and_objectives_are_numbers() -> None:
    problem = LmiProblem(BOTH)
    problem.symmetric("P", 2)
    with pytest.raises(ProblemError, match="'P' exists already"):
        problem.scalar("P")
    with pytest.raises(ProblemError, match="'P' is not an unknown number"):
        problem.minimise("P")
    with pytest.raises(ProblemError, match="'missing' is not an unknown number"):
        problem.maximise("missing")
    with pytest.raises(ProblemError, match=r"inequality 'flat' has the shape \(2, 3\)"):
        problem.require("flat", problem.constant(np.zeros((2, 3))))


def test_time_derivative_is_the_derivative_along_a_path() -> None:
    """d/dt of P(speed(t), load(t)) by differences, with a rate inside its unsymmetric bounds."""
    first, second = parameter("a", 10.0, 50.0, 1.0), parameter("b", 1.0, 3.0, 1.0)
    first = SchedulingParameter("a", "1", 10.0, 50.0, -2.0, 6.0)
    problem = LmiProblem((first, second))
    P = problem.symmetric("P", 2, 3)
    x = np.random.default_rng(2).standard_normal(problem.decisions)
    known, motion = P.substitute(x), problem.time_derivative(P).substitute(x)

    def scaled(a: float, b: float) -> np.ndarray:
        return np.array([[(a - 30.0) / 20.0, b - 2.0, 0.0, 0.0]])

    for rate_a, rate_b in ((5.0, 0.7), (-2.0, -1.0), (0.0, 0.0)):
        step = 1e-6
        ahead = known.at(scaled(20.0 + step * rate_a, 2.5 + step * rate_b))
        behind = known.at(scaled(20.0 - step * rate_a, 2.5 - step * rate_b))
        place = scaled(20.0, 2.5)
        place[0, 2:] = (rate_a - 2.0) / 4.0, rate_b  # local rates run over [-1, 1]
        np.testing.assert_allclose(motion.at(place)[..., 0], (ahead - behind)[..., 0] / (2 * step), atol=1e-7)


def test_a_parameter_that_may_jump_must_not_enter_an_unknown() -> None:
    problem = LmiProblem((parameter("p", rate=np.inf), parameter("q")))
    fine = problem.symmetric("P", 2, (0, 2))
    problem.time_derivative(fine)
    with pytest.raises(ProblemError, match=r"'p' has unbounded rate .* use degree 0 for it or bound its rate"):
        problem.time_derivative(problem.symmetric("Q", 2, 1))


BOX = (np.array([-0.25, 0.0]), np.array([0.25, 1.0]))  # speeds from 20 to 30, all rates


def test_a_part_of_the_range_has_local_variables() -> None:
    problem = LmiProblem((SPEED,))
    u = variable(0, 2)  # scaled speed: (speed - 30) / 20
    problem.require_on("part", u.affine(*BOX), *BOX)
    (entry,) = problem.inequalities
    np.testing.assert_allclose(entry.matrix.at(np.array([[-1.0, 0.0], [1.0, 0.0]]))[:, 0, 0, 0], [-0.5, 0.0])
    assert problem.place(entry, np.array([-1.0, 0.0])) == "speed = 20 m/s"
    with pytest.raises(ProblemError, match="its box reaches beyond the range"):
        problem.require_on("part", u, np.array([0.9, 0.0]), np.array([0.2, 1.0]))


def test_places_are_named_in_physical_units() -> None:
    problem = LmiProblem(BOTH)
    problem.require("still", variable(0, 4))
    problem.require("moving", variable(2, 4))
    point = np.array([0.5, -1.0, 1.0, 0.0])
    assert problem.place(problem.inequalities[0], point) == "speed = 40 m/s, load = 1 kg"
    assert problem.place(problem.inequalities[1], point) == "speed = 40 m/s, rate = 6 (m/s)/s, load = 1 kg"


def test_the_common_margin_enters_strict_inequalities_only() -> None:
    problem = LmiProblem((SPEED,), maximise_margin=True)
    assert problem.cost.tolist() == [-1.0]
    one = problem.constant(np.eye(2))
    problem.require("strict", one)
    problem.require("normal", one, strict=False)
    x = np.array([0.25])
    values = [entry.matrix.substitute(x).at(np.zeros((1, 2)))[0, 0, 0, 0] for entry in problem.inequalities]
    assert values == [0.75, 1.0]
    assert problem.without_margin(x).tolist() == [0.0]
    assert problem.unknowns[MARGIN].shape == (1, 1)


def test_objectives_have_a_sense() -> None:
    problem = LmiProblem((SPEED,))
    problem.symmetric("P", 2)
    problem.scalar("g")
    assert not problem.cost.any()
    problem.minimise("g")
    assert problem.cost.tolist() == [0.0, 0.0, 0.0, 1.0]
    problem.maximise("g")
    assert problem.cost.tolist() == [0.0, 0.0, 0.0, -1.0]
