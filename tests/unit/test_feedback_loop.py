"""A feedback law in closed loop: against numpy, closed forms, frequency responses, and laws that must be refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from scipy.linalg import expm, solve_continuous_are, solve_discrete_are

from analysis import hinf_norm
from estimators.arrays import FloatArray
from synthesis.certificate.claims import Claim, ClaimChannel, claim_name, claim_unit
from synthesis.certificate.frozen import frozen_gain
from synthesis.certificate.levels import feedback_claims
from synthesis.certificate.refute import refuting_place
from synthesis.certificate.search import Search, Wish
from synthesis.certificate.verify import Names, Verifier
from synthesis.errors import ProblemError
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.from_model import plant_of
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.polynomials.boxes import orders
from synthesis.polynomials.enclosure import PolynomialMatrix, constant
from synthesis.polynomials.rational import decimal, rational
from tests.support.lmi_cases import small_model

p, q = sp.symbols("p q")
PAIR = (SchedulingParameter("p", "1", -1.0, 3.0, -2.0, 2.0), SchedulingParameter("q", "1", 100.0, 101.0, -0.5, 0.5))
LINES = ((-1.0, 0.5, 3.0), (100.0, 101.0))
PERIOD = 0.05
Table = dict[tuple[int, ...], fmpq_mat]
ALL = ("x1", "x2", "y1", "y2", "u1")


def two_outputs() -> LpvModel:
    """Two parameters; the input acts on the second output at once."""
    shift = q - sp.Rational(201, 2)
    A = [[-2 + p / 4 * shift, 1 + p], [-2 + shift, -3 + p / 2]]
    return small_model(
        A, [[1, shift / 2], [p / 3, 1]], PAIR, B=[[0], [1 + p / 3]], D=[[0], [shift + 1]], E=[[1, 0], [0, 0]],
        F=[[0, 1], [0, 0]],
    )  # fmt: skip


def exact(matrix: FloatArray) -> fmpq_mat:
    return fmpq_mat(*matrix.shape, [decimal(float(x)) for x in matrix.ravel()])


def values(matrix: PolynomialMatrix, point: tuple[float, ...]) -> FloatArray:
    entries = matrix.at([rational(x) for x in point])
    return np.array([float(x.mid()) for x in entries.entries()]).reshape(matrix.shape)


def constant_model(A: FloatArray, B: FloatArray, E: FloatArray, C: FloatArray | None = None) -> LpvModel:
    """Without parameters; every state is an output unless C is given."""
    shown = np.eye(len(A)) if C is None else C
    signals: Any = {
        kind: tuple(Signal(f"{letter}{i + 1}", "1") for i in range(size))
        for kind, letter, size in (
            ("states", "x", len(A)), ("inputs", "u", B.shape[1]), ("outputs", "y", len(shown)), ("disturbances", "d", E.shape[1])
        )
    }  # fmt: skip
    matrices = {"A": A, "B": B, "C": shown, "E": E}
    return LpvModel(
        "constant", "made for a test", parameters=(), **signals, **{key: sp.Matrix(m) for key, m in matrices.items()}
    )


def search_of(loop: FeedbackLoop, model: LpvModel) -> Search:
    names = Names(
        tuple(s.name for s in model.states),
        tuple(d.name for d in model.disturbances),
        tuple(s.name for signals in (model.states, model.outputs, model.inputs) for s in signals),
    )
    return Search(loop, names, model.parameters, 1)


@pytest.mark.parametrize(
    ("order", "measured", "sampled"),
    [(0, "states", True), (0, "outputs", True), (2, "outputs", True), (1, "states", False), (3, "outputs", False)],
)
def test_the_loop_is_the_one_written_out_with_numpy(order: int, measured: str, sampled: bool) -> None:
    rng, model = np.random.default_rng(order), two_outputs()
    gains = np.round(rng.uniform(-1.0, 1.0, (3, 2, order + 1, order + 2)), 3)
    if measured == "outputs":
        gains[..., order, order + 1] = 0.0  # the second output is not fed through
    table = {index: exact(gains[index]) for index in np.ndindex(3, 2)}
    lines = tuple(tuple(decimal(x) for x in line) for line in LINES)
    loop = FeedbackLoop(plant_of(model), lines, table, measured, order, decimal(PERIOD) if sampled else None)  # type: ignore[arg-type]
    cells = list(loop.cells())
    at_once = loop.on_boxes(loop.time, cells)
    assert at_once is not None
    powers = np.array(orders(2, at_once.A.highest).powers)
    for number, cell in enumerate(cells):
        system, local = loop.system(cell, loop.time), (0.4, -0.7)
        assert system is not None
        u = np.array([float(o.p) / float(o.q) + float(f.p) / float(f.q) * t
                      for o, f, t in zip(cell.offset, cell.factor, local, strict=False)])  # fmt: skip
        middle, half = (np.array([getattr(a, key) for a in PAIR]) for key in ("middle", "half_width"))
        point = middle + half * u
        m = model.on(point[None])
        A, B, C, D, E, F = (getattr(m, key)[0] for key in "ABCDEF")
        w = (1 + np.array(local)) / 2
        K = (
            gains[number, 0] * (1 - w[0]) * (1 - w[1]) + gains[number, 1] * (1 - w[0]) * w[1]
            + gains[number + 1, 0] * w[0] * (1 - w[1]) + gains[number + 1, 1] * w[0] * w[1]
        )  # fmt: skip
        Ak, Bk, Ck, Dk = K[:order, :order], K[:order, order:], K[order:, :order], K[order:, order:]
        if sampled:
            whole = expm(np.block([[A, B, E], [np.zeros((3, 5))]]) * PERIOD)
            A, B, E = whole[:2, :2], whole[:2, 2:3], whole[:2, 3:]
        V, N = (np.eye(2), np.zeros((2, 2))) if measured == "states" else (C, F)
        u_x, u_d = np.hstack([Dk @ V, Ck]), Dk @ N
        y_x, y_d = np.hstack([C, np.zeros((2, order))]) + D @ u_x, F + D @ u_d
        v_x, v_d = (np.hstack([V, np.zeros((2, order))]), N) if measured == "states" else (y_x, y_d)
        wanted = {
            "A": np.vstack([np.hstack([A, np.zeros((2, order))]) + B @ u_x,
                            np.hstack([np.zeros((order, 2)), Ak]) + Bk @ v_x]),
            "B": np.vstack([E + B @ u_d, Bk @ v_d]),
            "C": np.vstack([np.eye(2, 2 + order), y_x, u_x]),
            "D": np.vstack([np.zeros((2, 2)), y_d, u_d]),
        }  # fmt: skip
        for key, matrix in wanted.items():
            one, many = (getattr(s, key) for s in (system, at_once))
            one, many = (part if key in "AC" else part["disturbances"] for part in (one, many))
            np.testing.assert_allclose(values(one, (*local, 0.0, 0.0)), matrix, atol=1e-9)
            row = many.middle[number if len(many.middle) > 1 else 0]
            np.testing.assert_allclose(np.einsum("k,kij->ij", np.prod(local**powers, axis=1), row), matrix, atol=1e-8)


def test_pole_of_a_scalar_plant_in_closed_form() -> None:
    """x' = x + u, u = -3 x once a sample: x+ = (e^T - 3 (e^T - 1)) x; exactly that decay is proved, and no more."""
    model = constant_model(np.eye(1), np.eye(1), np.eye(1))
    loop = FeedbackLoop.constant_gain(plant_of(model), fmpq_mat([[-3]]), sample_time=fmpq(1, 10))
    search = search_of(loop, model)
    decay = -np.log(3.0 - 2.0 * np.exp(0.1)) / 0.1
    assert search.prove(Wish("sampled error", decay * 0.9999))[0] is not None
    assert search.prove(Wish("sampled error", decay * 1.0001))[0] is None
    P = constant(fmpq_mat([[1]]), 0)
    assert refuting_place(search.verifier, Claim("sampled error", decay * 1.0001, P)) is not None
    assert refuting_place(search.verifier, Claim("sampled error", decay * 0.9999, P)) is None


def test_continuous_loop_of_a_static_gain() -> None:
    """The same without sampling: the pole is -2, the gain from d to x 1/2, to u 3/2."""
    model = constant_model(np.eye(1), np.eye(1), np.eye(1))
    loop = FeedbackLoop.constant_gain(plant_of(model), fmpq_mat([[-3]]))
    search = search_of(loop, model)
    assert search.prove(Wish("decay rate", 1.999))[0] is not None
    assert search.prove(Wish("decay rate", 2.001))[0] is None
    for name, gain in (("x1", 0.5), ("u1", 1.5)):
        channel = ClaimChannel({"d1": 1.0}, (name,))
        assert search.least_gain(Wish("gain", None, channel)) == pytest.approx(gain, rel=1e-3)
        assert search.prove(Wish("gain", gain * 1.002, channel))[0] is not None
        assert search.prove(Wish("gain", gain * 0.998, channel))[0] is None


def test_gain_of_a_lqr_loop_is_the_norm_of_its_discretisation() -> None:
    A, B = np.array([[0.0, 1.0], [2.0, -0.5]]), np.array([[0.0], [1.0]])
    E = np.array([[0.0], [1.0]])
    whole = expm(np.block([[A, B, E], [np.zeros((2, 4))]]) * PERIOD)
    Phi, Gamma, Push = whole[:2, :2], whole[:2, 2:3], whole[:2, 3:]
    S = solve_discrete_are(Phi, Gamma, np.eye(2), np.eye(1))
    K = np.round(-np.linalg.solve(np.eye(1) + Gamma.T @ S @ Gamma, Gamma.T @ S @ Phi), 4)
    model = constant_model(A, B, E)
    loop = FeedbackLoop.constant_gain(plant_of(model), exact(K), sample_time=decimal(PERIOD))
    search = search_of(loop, model)
    sizes = (0.5, 4.0)
    channel = ClaimChannel({"d1": 1.0}, ("x1", "u1"), sizes)
    out = np.vstack([np.eye(2)[:1], K]) / np.array(sizes)[:, None]
    norm = float(hinf_norm(Phi + Gamma @ K, Push, out, discrete=True).norm)
    assert search.least_gain(Wish("sampled gain", None, channel)) == pytest.approx(norm, rel=2e-3)
    claim, _ = search.prove(Wish("sampled gain", norm * 1.003, channel))
    assert claim is not None
    assert search.prove(Wish("sampled gain", norm * 0.997, channel))[0] is None
    # In floats over a grid of frequencies, a bound from below that is nearly met.
    Z = np.eye(5)[[0, 4]] / np.array(sizes)[:, None]
    assert 0.99 * norm < frozen_gain(loop, np.eye(1), Z) <= norm * (1 + 1e-9)
    # A smaller size of a signal counts for more: the very P that proves the claim does not prove this one.
    stricter = Claim("sampled gain", claim.level, claim.P, ClaimChannel({"d1": 1.0}, ("x1", "u1"), (0.45, 4.0)))
    assert search.verifier.prove(claim).proved
    assert not search.verifier.prove(stricter).proved


def test_dynamic_law_of_outputs_is_proved_and_a_destabilising_one_refuted() -> None:
    """An observer-based law of a double integrator, written as a dynamic law once a sample; its poles are known."""
    A, B, C, E = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.eye(1, 2), np.array([[0.0], [1.0]])
    Phi, Gamma = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]])
    K, L = np.array([[-9.0, -5.0]]), np.array([[0.9], [2.0]])
    model = constant_model(A, B, E, C)
    law = np.block([[Phi + Gamma @ K - L @ C, L], [K, np.zeros((1, 1))]])
    poles = np.concatenate([np.linalg.eigvals(Phi + Gamma @ K), np.linalg.eigvals(Phi - L @ C)])
    decay = -np.log(np.abs(poles).max()) / 0.1
    assert decay > 0.5

    def judged(sign: float, level: float) -> tuple[Claim | None, Search]:
        table: Table = {(): exact(np.round(law * np.array([[1.0], [1.0], [sign]]), 12))}
        loop = FeedbackLoop(plant_of(model), (), table, "outputs", 2, fmpq(1, 10))
        search = search_of(loop, model)
        return search.prove(Wish("sampled error", level))[0], search

    assert judged(1.0, 0.99 * decay)[0] is not None
    assert judged(1.0, 1.01 * decay)[0] is None
    claim, search = judged(-1.0, 0.01)
    assert claim is None
    P = constant(fmpq_mat([[int(i == j) for j in range(4)] for i in range(4)]), 0)
    assert refuting_place(search.verifier, Claim("sampled error", 0.01, P)) == ()


def test_claims_over_two_parameters_and_what_they_are_called() -> None:
    model = two_outputs()
    table: Table = {(i, j): exact(np.array([[-0.3, -0.2 * i - 0.2]])) for i, j in np.ndindex(3, 2)}
    lines = tuple(tuple(decimal(x) for x in line) for line in LINES)
    loop = FeedbackLoop(plant_of(model), lines, table, sample_time=decimal(PERIOD))
    search = search_of(loop, model)
    channel = ClaimChannel({"d1": 0.5}, ("x1", "u1"), (0.2, 3.0))
    claims = feedback_claims(search, [Wish("gain", None, channel)], 0.01)
    assert claims is not None and [claim.kind for claim in claims] == ["sampled error", "sampled gain"]
    for claim in claims:
        assert Verifier(loop, search.names).prove(claim).proved
        better = Claim(
            claim.kind, claim.level * (3.0 if claim.kind == "sampled error" else 0.5), claim.P, claim.channel
        )
        assert not Verifier(loop, search.names).prove(better).proved
    units = dict.fromkeys(ALL, "m") | {"u1": "N", "d1": "m/s"}
    assert claim_name("sampled gain", channel, units) == "update: gain 0.5 m/s d1 -> 0.2 m x1 + 3 N u1"
    assert claim_unit("sampled gain", channel, units) == "1"
    assert claim_unit("sampled gain", ClaimChannel({"d1": 1.0}, ("x1",), (0.2,)), units) == "1/(m/s)"


def test_what_makes_no_loop_is_refused() -> None:
    plant, sampled = plant_of(two_outputs()), decimal(PERIOD)
    with pytest.raises(ProblemError, match=r"shape \(1, 3\); this plant and law need \(1, 2\)"):
        FeedbackLoop.constant_gain(plant, exact(np.ones((1, 3))))
    with pytest.raises(ProblemError, match="output 2 straight to the input, which acts on it at once"):
        FeedbackLoop.constant_gain(plant, exact(np.array([[0.0, 1.0]])), "outputs", sampled)
    FeedbackLoop.constant_gain(plant, exact(np.array([[1.0, 0.0]])), "outputs", sampled)
    loop = FeedbackLoop.constant_gain(plant, exact(np.ones((1, 2))), sample_time=sampled)
    with pytest.raises(ProblemError, match="makes no claims about continuous time"):
        loop.system(next(iter(loop.cells())), "continuous")


def test_rational_plant_by_state_feedback() -> None:
    """x' = x/p + u + d, u = -(3/2) x: proved with its denominator, poles between -1 and -1/2."""
    parameter = SchedulingParameter("p", "1", 1.0, 2.0, 0.0, 0.0)
    model = small_model([[1 / p]], [[1]], (parameter,), B=[[1]], E=[[1]], F=[[0]])
    loop = FeedbackLoop.constant_gain(plant_of(model), fmpq_mat([[fmpq(-3, 2)]]))
    search = search_of(loop, model)
    assert search.prove(Wish("decay rate", 0.499))[0] is not None
    assert search.prove(Wish("decay rate", 0.51))[0] is None
    for name, gain in (("x1", 2.0), ("y1", 2.0), ("u1", 3.0)):
        channel = ClaimChannel({"d1": 1.0}, (name,))
        assert search.prove(Wish("gain", gain * 1.01, channel))[0] is not None
        assert search.prove(Wish("gain", gain * 0.99, channel))[0] is None
    # Once a sample x+ = e^(T/p) x + p (e^(T/p) - 1) (u + d); at frequency zero it is the same loop.
    sampled = search_of(
        FeedbackLoop.constant_gain(plant_of(model), fmpq_mat([[fmpq(-3, 2)]]), "outputs", decimal(PERIOD)), model
    )
    at = np.linspace(1.0, 2.0, 101)
    kept = np.exp(PERIOD / at) - 1.5 * at * (np.exp(PERIOD / at) - 1.0)
    slowest = -np.log(np.abs(kept).max()) / PERIOD
    assert sampled.prove(Wish("sampled error", 0.999 * slowest))[0] is not None
    assert sampled.prove(Wish("sampled error", 1.001 * slowest))[0] is None
    for name, gain in (("x1", 2.0), ("u1", 3.0)):
        channel = ClaimChannel({"d1": 1.0}, (name,))
        assert sampled.prove(Wish("sampled gain", gain * 1.01, channel))[0] is not None
        assert sampled.prove(Wish("sampled gain", gain * 0.99, channel))[0] is None


def test_care_gain_of_a_continuous_loop() -> None:
    """u = -B'S x with S of the Riccati equation: the frequency response of the closed loop is the second calculation."""
    A, B = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, -1.0, 0.5]]), np.array([[0.0], [0.0], [1.0]])
    K = np.round(-B.T @ solve_continuous_are(A, B, np.eye(3), np.eye(1)), 3)
    model = constant_model(A, B, B)
    search = search_of(FeedbackLoop.constant_gain(plant_of(model), exact(K)), model)
    channel = ClaimChannel({"d1": 1.0}, ("x1", "x2", "x3", "u1"))
    norm = float(hinf_norm(A + B @ K, B, np.vstack([np.eye(3), K])).norm)
    assert search.least_gain(Wish("gain", None, channel)) == pytest.approx(norm, rel=2e-3)
