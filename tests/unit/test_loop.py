"""The closed loop of plant and law: any number of parameters, multilinear gains, both updates, and what moves inside a sample."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from scipy.integrate import solve_ivp
from scipy.interpolate import RegularGridInterpolator
from scipy.linalg import expm

from estimators.arrays import FloatArray
from synthesis.certificate.claims import Claim, ClaimChannel
from synthesis.certificate.inside_sample import inside_sample
from synthesis.certificate.refute import refuting_place, undetectable_place
from synthesis.certificate.search import Search, Wish
from synthesis.certificate.verify import Names
from synthesis.errors import ProblemError
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import decimal, rational
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")
PAIR = (SchedulingParameter("p", "1", -1.0, 3.0, -2.0, 2.0), SchedulingParameter("q", "1", 100.0, 101.0, -0.5, 0.5))
LINES = ((-1.0, 0.5, 3.0), (100.0, 101.0))
PERIOD = 0.05


def two_parameters(fastest: float = -2.0) -> LpvModel:
    """Poles move with p; q is far from zero, as a temperature or a pressure is."""
    shift = q - sp.Rational(201, 2)
    A = [[fastest + p / 4 * shift, 1 + p], [-2 + shift, -3 + p / 2]]
    return small_model(A, [[1, shift / 2]], PAIR, B=[[0], [1 + p / 3]], E=[[1, 0], [0, 0]], F=[[0, 1]])


def table(rng: np.random.Generator) -> FloatArray:
    return np.round(rng.uniform(0.2, 1.5, (3, 2, 2, 1)), 3)


def loop_of(model: LpvModel, gains: FloatArray, update: str = "held") -> ObserverLoop:
    entries = {
        i: fmpq_mat([[decimal(float(x)) for x in row] for row in gains[i]]) for i in np.ndindex(gains.shape[:-2])
    }
    lines = tuple(tuple(decimal(x) for x in line) for line in LINES)
    return ObserverLoop(plant_of(model), lines, entries, update, decimal(PERIOD))  # type: ignore[arg-type]


def search_of(loop: ObserverLoop, model: LpvModel, degree: int = 1) -> Search:
    names = Names(tuple(s.name for s in model.states), tuple(d.name for d in model.disturbances))
    return Search(loop, names, model.parameters, degree)


def values(matrix: PolynomialMatrix, point: tuple[float, ...]) -> FloatArray:
    entries = matrix.at([rational(x) for x in point])
    return np.array([float(x.mid()) for x in entries.entries()]).reshape(matrix.shape)


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_cells_hold_the_loop_that_is_written_out_with_numpy(update: str) -> None:
    rng, model = np.random.default_rng(4), two_parameters()
    gains = table(rng)
    loop = loop_of(model, gains, update)
    between = RegularGridInterpolator(LINES, gains.reshape(3, 2, -1))
    cells = list(loop.cells())
    assert len(cells) == 2
    for cell in cells:
        continuous, discrete = loop.system(cell, "continuous"), loop.system(cell, "discrete")
        assert continuous is not None and discrete is not None
        for _ in range(6):
            local = tuple(rng.uniform(-1.0, 1.0, 2))
            u = [float(x.p) / float(x.q) for x in cell.offset[:2]] + np.array(local) * [
                float(x.p) / float(x.q) for x in cell.factor[:2]
            ]
            place = np.array([[1.0 + 2.0 * u[0], 100.5 + 0.5 * u[1]]])
            plant = model.on(place)
            A, C, E, F, L = plant.A[0], plant.C[0], plant.E[0], plant.F[0], between(place).reshape(2, 1)
            point = (*local, 0.0, 0.0)
            np.testing.assert_allclose(values(continuous.A, point), A - L @ C, rtol=1e-10, atol=1e-12)
            np.testing.assert_allclose(values(continuous.B["disturbances"], point), E - L @ F, rtol=1e-10, atol=1e-12)
            whole = expm(PERIOD * np.block([[A, E], [np.zeros((2, 4))]]))
            np.testing.assert_allclose(values(discrete.coasting, point), whole[:2, :2], rtol=1e-7)
            if update == "sampled":
                np.testing.assert_allclose(values(discrete.A, point), whole[:2, :2] - L @ C, rtol=1e-7, atol=1e-9)
                assert set(discrete.B) == {"disturbances"}
            else:
                np.testing.assert_allclose(values(discrete.A, point), expm(PERIOD * (A - L @ C)), rtol=1e-7, atol=1e-9)
                # One step of plant and observer, the plant driven by its own motion x': e+ = A e + B_motion x'.
                x, estimate, push = rng.normal(size=2), rng.normal(size=2), rng.normal()
                B = plant.B[0]
                driven = expm(PERIOD * np.block([[A, B * push], [np.zeros((1, 3))]])) @ [*x, 1.0]
                inner = np.block([[A - L @ C, B * push + L * (C @ x)], [np.zeros((1, 3))]])
                after = expm(PERIOD * inner) @ [*estimate, 1.0]
                motion = A @ x + (B * push)[:, 0]
                said = values(discrete.A, point) @ (x - estimate) + values(discrete.B["motion"], point) @ motion
                np.testing.assert_allclose(driven[:2] - after[:2], said, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize(
    ("update", "kind"), [("held", "decay rate"), ("held", "internal update"), ("sampled", "sampled error")]
)
def test_two_parameters_are_proved_by_cells(update: str, kind: str) -> None:
    rng, model = np.random.default_rng(2), two_parameters()
    gains = np.round(0.02 * table(rng), 4) if update == "sampled" else table(rng)
    loop = loop_of(model, gains, update)
    search = search_of(loop, model)
    claim, outcome = search.prove(Wish(kind, 0.3))
    assert claim is not None, outcome
    # An independent way: poles of the frozen loop on a dense grid stay behind the level, and V falls along random walks.
    between = RegularGridInterpolator(LINES, gains.reshape(3, 2, -1))
    for place in product(np.linspace(-1.0, 3.0, 9), np.linspace(100.0, 101.0, 5)):
        plant = model.on(np.array([place]))
        L = between([place]).reshape(2, 1)
        if kind == "decay rate":
            assert np.linalg.eigvals(plant.A[0] - L @ plant.C[0]).real.max() < -0.3
        else:
            closed = expm(PERIOD * (plant.A[0] - L @ plant.C[0]))
            received = expm(PERIOD * plant.A[0]) - L @ plant.C[0] if update == "sampled" else closed
            assert np.abs(np.linalg.eigvals(received)).max() < np.exp(-0.3 * PERIOD)
    for level in (3.0, 50.0):  # faster than the poles: refused, and refuted where they stand
        bad = Claim(kind, level, claim.P)
        failed = search.verifier.prove(bad)
        assert not failed.proved and len(failed.place) == 4
    assert refuting_place(search.verifier, Claim(kind, 50.0, claim.P), [failed.place]) is not None
    assert refuting_place(search.verifier, claim) is None


def test_gains_of_motion_and_of_disturbances_with_two_parameters() -> None:
    model = two_parameters()
    search = search_of(loop_of(model, table(np.random.default_rng(2))), model)
    for kind, name in (("sampled gain", "d1"), ("motion gain", "x2"), ("gain", "d1")):
        wish = Wish(kind, None, ClaimChannel({name: 1.0}, ("x1",)))
        least = search.least_gain(wish)
        assert search.prove(Wish(kind, 1.05 * least, wish.channel))[0] is not None
        assert search.prove(Wish(kind, 0.8 * least, wish.channel))[0] is None


def test_a_parameter_that_may_jump_needs_a_constant_lyapunov_function() -> None:
    jumping = small_model([[-2 - p, 1], [0, -3]], [[1, 0]], (parameter("p", 0.0, 1.0, np.inf),))
    loop = ObserverLoop.constant_gain(plant_of(jumping), fmpq_mat([[fmpq(1)], [fmpq(0)]]))
    search = search_of(loop, jumping)
    claim, _ = search.prove(Wish("decay rate", 1.5))
    assert claim is not None and not any(claim.P.degrees)
    bent = PolynomialMatrix({**claim.P.terms, (1,): claim.P.terms[0,] * fmpq(1, 1000)}, (2, 2), 1)
    with pytest.raises(ProblemError, match="'p' may jump"):
        search.verifier.prove(Claim("decay rate", 1.5, bent))


def test_what_moves_inside_a_sample_is_bounded() -> None:
    """x' = A(p(t)) x + B u with p at its largest rate, integrated finely, against p held: inside the bound, not far inside."""
    model = two_parameters()
    loop = loop_of(model, table(np.random.default_rng(1)))
    bounds = inside_sample(loop)
    assert bounds is not None
    rng, tightest = np.random.default_rng(3), 0.0
    for _ in range(40):
        start = np.array([rng.uniform(-1.0, 2.8), rng.uniform(100.0, 100.9)])
        rate = np.array([rng.choice([-2.0, 2.0]), rng.choice([-0.5, 0.5])])
        rate = np.where((start + PERIOD * rate < [-1.0, 100.0]) | (start + PERIOD * rate > [3.0, 101.0]), -rate, rate)
        x, push = rng.normal(size=2), rng.normal()

        def moving(
            t: float, state: FloatArray, start: FloatArray = start, rate: FloatArray = rate, push: float = push
        ) -> FloatArray:
            plant = model.on(np.array([np.clip(start + rate * t, [-1.0, 100.0], [3.0, 101.0])]))
            return np.asarray(plant.A[0] @ state + plant.B[0][:, 0] * push)

        true = solve_ivp(moving, (0.0, PERIOD), x, rtol=1e-10, atol=1e-12).y[:, -1]
        plant = model.on(np.array([start]))
        block = np.block([[plant.A[0], plant.B[0] * push], [np.zeros((1, 3))]])
        frozen = (expm(PERIOD * block) @ [*x, 1.0])[:2]
        allowed = np.array(bounds.of_states) @ np.abs(x) + np.array(bounds.of_inputs)[:, 0] * abs(push)
        assert (np.abs(true - frozen) <= allowed * (1.0 + 1e-6) + 1e-10).all()
        tightest = max(tightest, float((np.abs(true - frozen) / allowed).max()))
    assert tightest > 0.1  # a bound, not a platitude
    still = loop_of(two_parameters(), table(np.random.default_rng(1)))
    assert (
        inside_sample(ObserverLoop(still.plant, still.breakpoints, still.table)) is None
    )  # no sample time, no statement


def test_undetectable_places_are_found_exactly() -> None:
    hidden = small_model([[-1, 0], [0, 2]], [[1, p]])  # the unstable mode does not show where p = 0
    place = undetectable_place(plant_of(hidden))
    assert place is not None and place[0] == 0
    assert undetectable_place(plant_of(small_model([[-1, 0], [0, 2]], [[1, 2 + p]]))) is None
    assert undetectable_place(plant_of(small_model([[-1, 0], [0, -2]], [[1, p]]))) is None  # hidden, and stable
    always = small_model([[p - 2, 0], [1, 3]], [[1, 0]])  # the second state never reaches the output
    assert undetectable_place(plant_of(always)) is not None


def test_a_loop_without_parameters_has_one_cell() -> None:
    states, outputs = (Signal("x1", "1"), Signal("x2", "1")), (Signal("y1", "1"),)
    bare = LpvModel("still", "test", states, outputs, (), sp.Matrix([[0, 1], [-2, -1]]), sp.Matrix([[1, 0]]))
    loop = ObserverLoop.constant_gain(plant_of(bare), fmpq_mat([[fmpq(1)], [fmpq(0)]]))
    search = search_of(loop, bare, degree=0)
    assert search.prove(Wish("decay rate", 0.99))[0] is not None  # poles of [[-1, 1], [-2, -1]]: -1 +- i sqrt(2)
    assert search.prove(Wish("decay rate", 1.01))[0] is None
