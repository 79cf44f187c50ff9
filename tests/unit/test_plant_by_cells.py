"""Plants by cells (tables): designs against closed forms, proofs of what is deployed, files that were changed, the runtime."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from scipy.interpolate import RegularGridInterpolator
from scipy.linalg import expm

from estimators import LpvObserver
from estimators.errors import ScheduleError
from estimators.schedule import GainSchedule
from estimators.schedule.plant_cells import plant_by_cells
from synthesis.certificate.claims import ClaimChannel
from synthesis.certificate.proof import prove
from synthesis.certificate.search import Search, Wish
from synthesis.certificate.verify import Names
from synthesis.design.deploy import Deployment, deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import _plant, schedule_content
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, design_observer
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.design.pole_regions import PoleRegions
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.sampled_state_feedback import design_sampled_state_feedback
from synthesis.design.stability import affine_quadratic_stability
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback
from synthesis.design.static_feedback import design_static_feedback
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.errors import ModelError, ProblemError
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.models.table import LookupTable

NOISE, PERIOD = 0.5, 0.02
ERROR = (Channel(("w", "n"), ("x",)),)
LAW = (FeedbackChannel(("w",), ("x", "u")),)
NOISY_LAW = (FeedbackChannel(("w", "n"), ("x", "u")),)
p, q, a, b = sp.symbols("p q a b")


def moving(rate: float = 1.0, name: str = "p") -> SchedulingParameter:
    return SchedulingParameter(name, "1", 0.0, 2.0, -rate, rate)


STEADY = moving()


def table(points: Any, values: Any, over: tuple[str, ...] = ("p",)) -> LookupTable:
    return LookupTable("1", "test", over, points if len(over) > 1 else (points,), values)


def plant(A: Any, tables: dict[str, LookupTable], parameters: Any = (STEADY,), B: Any = 1) -> LpvModel:
    """x' = A x + B u + w, y = x + n / 2."""
    one: dict[str, Any] = {
        key: (Signal(name, "1"),) for key, name in (("states", "x"), ("outputs", "y"), ("inputs", "u"))
    }
    return LpvModel(
        "by cells", "test", **one, parameters=parameters, disturbances=(Signal("w", "1"), Signal("n", "1")),
        A=sp.Matrix([[A]]), B=sp.Matrix([[B]]), C=sp.eye(1), E=sp.Matrix([[1, 0]]), F=sp.Matrix([[0, sp.Rational(1, 2)]]),
        tables=tables,
    )  # fmt: skip


KINK = table((0.0, 0.7, 2.0), [3.0, 1.0, 2.5])
KINK_LINE = ([0.0, 0.7, 2.0], [3.0, 1.0, 2.5])
JUMP = table((0.0, 0.7, 0.7, 2.0), [3.0, 2.0, 1.0, 2.5])


@pytest.mark.parametrize("dip", [KINK, JUMP, table((0.0, 0.7, 2.0), [3.0, 1.4, 2.5])])
def test_an_observer_attains_the_closed_form_at_the_kink_and_at_one_side_of_a_jump(dip: LookupTable) -> None:
    """x' = -a x + w, y = x + f n under any motion: the least gain to the error is f / sqrt(1 + f^2 a^2), at the least a."""
    least = NOISE / math.sqrt(1.0 + NOISE**2 * dip.values.min() ** 2)
    gains = design_observer(plant(-a, {"a": dip}, (moving(math.inf),)), ObserverDesign(ERROR, fastest_pole=50.0))
    assert gains.gamma_lower == pytest.approx(least, rel=1e-4)
    assert least < gains.gamma < 1.012 * least


def test_state_feedback_attains_the_common_lyapunov_function_of_the_pieces() -> None:
    """x' = -a x + b u + w, z = (x, u) under any motion: q^2/g^2 - 2 a q + 1 - b^2 g^2 < 0 for one q, at every p of its own."""
    model = plant(-a, {"a": table((0.0, 1.2, 2.0), [1.0, 2.0, 0.8]), "b": KINK}, (moving(math.inf),), B=b)
    places = np.linspace(0.0, 2.0, 81)
    rates, inputs = (
        np.interp(places, [0.0, 1.2, 2.0], [1.0, 2.0, 0.8]),
        np.interp(places, [0.0, 0.7, 2.0], [3.0, 1.0, 2.5]),
    )
    s, low, high = np.geomspace(1e-2, 10.0, 4001)[:, None], 0.1, 10.0
    for _ in range(16):
        g = math.sqrt(low * high)
        holds = ((s**2 / g**2 - 2.0 * rates * s + 1.0 - inputs**2 * g**2).max(axis=1) < 0.0).any()
        low, high = (low, g) if holds else (g, high)
    gains = design_state_feedback(model, StateFeedbackDesign(LAW))
    assert gains.gamma_lower == pytest.approx(high, rel=2e-3)
    assert gains.gamma < 1.015 * high


def test_gains_bend_where_the_plant_does() -> None:
    """x' = -a x + u + w with its pole between -4.1 and -3.9: k must be a - 4 within 0.1, which no straight gain is."""
    gains = design_state_feedback(plant(-a, {"a": KINK}), StateFeedbackDesign(LAW, decay_rate=3.9, fastest_pole=4.1))
    places = np.linspace(0.0, 2.0, 41)
    wanted = np.interp(places, [0.0, 0.7, 2.0], [3.0, 1.0, 2.5]) - 4.0
    assert np.abs(gains.gain(places)[:, 0, 0] - wanted).max() < 0.1
    with pytest.raises(ProblemError):
        design_state_feedback(
            plant(-a, {"a": KINK}), StateFeedbackDesign(LAW, degree=0, decay_rate=3.9, fastest_pole=4.1)
        )


@pytest.mark.parametrize("law", ["held", "sampled", "feedback", "sampled feedback", "output feedback", "static"])
def test_a_polynomial_plant_that_is_cut_keeps_its_level(law: str) -> None:
    cut = plant(-1 - a**2, {"a": table((0.0, 0.3, 1.1, 2.0), [0.0, 0.3, 1.1, 2.0])})
    levels = []
    for model in (plant(-1 - p**2, {}), cut):
        if law == "held":
            levels.append(design_observer(model, ObserverDesign(ERROR, degree=0, fastest_pole=50.0)).gamma_lower)
        elif law == "sampled":
            levels.append(design_sampled_observer(model, ObserverDesign(ERROR, degree=0), PERIOD).gamma_lower)
        elif law == "feedback":
            levels.append(design_state_feedback(model, StateFeedbackDesign(LAW, degree=0)).gamma_lower)
        elif law == "static":
            asked = StaticFeedbackDesign(LAW, degree=0, backoff=0.1, start=((-2.0,),), steps=1)
            levels.append(design_static_feedback(model, asked).levels[0])  # of the start, before any step
        elif law == "output feedback":
            levels.append(design_output_feedback(model, OutputFeedbackDesign(NOISY_LAW, degree=0)).gamma_lower)
        else:
            levels.append(design_sampled_state_feedback(model, StateFeedbackDesign(LAW, degree=0), PERIOD).gamma_lower)
    assert len(cut.pieces) == 3
    assert isinstance(levels[0], float) and levels[0] == pytest.approx(levels[1], rel=1e-4)


def test_poles_of_sampled_designs_lie_in_their_region_on_every_cell() -> None:
    """Slower than 12 1/s and faster than 7 1/s, with the exact update of the plant at places of both cells."""
    regions, places = PoleRegions(vertical_strip=(7.0, 12.0)), np.linspace(0.0, 2.0, 21)
    rate = np.interp(places, *KINK_LINE)
    observer = design_sampled_observer(plant(-a, {"a": KINK}), ObserverDesign(ERROR, regions=regions), PERIOD)
    law = design_sampled_state_feedback(plant(-a, {"a": KINK}), StateFeedbackDesign(LAW, regions=regions), PERIOD)
    coast, driven = np.exp(-rate * PERIOD), (1.0 - np.exp(-rate * PERIOD)) / rate
    for z in (coast - observer.gain(places)[:, 0, 0], coast + driven * law.gain(places)[:, 0, 0]):
        assert np.exp(-12.0 * PERIOD) < z.min() and z.max() < np.exp(-7.0 * PERIOD)
    free = design_sampled_observer(plant(-a, {"a": KINK}), ObserverDesign(ERROR), PERIOD).gain(places)[:, 0, 0]
    assert (coast - free).max() > np.exp(-7.0 * PERIOD)  # the control


@pytest.mark.parametrize("read", [list, dict, len, lambda matrices: matrices["A"], lambda matrices: "A" in matrices])
def test_what_takes_one_polynomial_is_refused_and_finds_no_empty_plant(read: Any) -> None:
    assert len(plant_of(plant(-a, {"a": table((0.0, 2.0), [1.0, 2.0])})).matrices) == 6  # one cell
    with pytest.raises(ProblemError, match=r"plant by cells \(tables\) is not supported here"):
        read(plant_of(plant(-a, {"a": KINK})).matrices)


def test_output_feedback_of_a_kink_lies_between_its_frozen_loops_and_is_proved() -> None:
    """The controller is worked out on each piece; every frozen closed loop stays below the level, the worst one near it."""
    model = plant(a, {"a": KINK})
    found = design_output_feedback(model, OutputFeedbackDesign(NOISY_LAW))
    places, frequencies, worst = np.linspace(0.0, 2.0, 21), 1j * np.geomspace(1e-2, 1e2, 60), 0.0
    for rate, Ak, Bk, Ck, Dk in zip(
        np.interp(places, *KINK_LINE), *(m[:, 0, 0] for m in found.controller(places)), strict=True
    ):
        A, C = np.array([[rate + Dk, Ck], [Bk, Ak]]), np.array([[1.0, 0.0], [Dk, Ck]])
        B, D = np.array([[1.0, NOISE * Dk], [0.0, NOISE * Bk]]), np.array([[0.0, 0.0], [0.0, NOISE * Dk]])
        assert np.linalg.eigvals(A).real.max() < 0.0
        answers = C @ np.linalg.solve(frequencies[:, None, None] * np.eye(2) - A, B[None].astype(complex)) + D
        worst = max(worst, float(np.linalg.norm(answers, 2, axis=(1, 2)).max()))
    assert 0.8 * found.gamma < worst <= found.gamma


@pytest.fixture(scope="module")
def deployed() -> Deployment:
    """An observer of the plant with a kink."""
    gains = design_observer(plant(-a, {"a": KINK}), ObserverDesign(ERROR, degree=0, fastest_pole=50.0))
    return deploy(gains, DeploySettings(sample_time=PERIOD))


@pytest.fixture
def content(deployed: Deployment) -> dict[str, Any]:
    return schedule_content(deployed, "by-cells")


def test_what_is_deployed_is_proved_between_all_breakpoints(content: dict[str, Any]) -> None:
    assert content["plant"]["breakpoints"] == [[0.0, 0.7, 2.0]]
    assert 0.7 in content["scheduling"][0]["breakpoints"]
    assert all(proof.proved for proof in prove(content, "file"))
    content["scheduling"][0]["breakpoints"] = [
        0.0,
        2.0,
    ]  # constant gains need none there: the proof cuts at the kink itself
    content["gain"]["table"] = content["gain"]["table"][:1] * 2
    assert all(proof.proved for proof in prove(content, "file"))


def test_the_proved_gain_holds_in_floats_from_the_numbers_of_the_file(content: dict[str, Any]) -> None:
    """dV/dt + e^2 < g^2 |d|^2 with V = P e^2 at many places and both rates, the plant by `np.interp` of the table."""
    (claim,) = (c for c in content["claims"] if c["kind"] == "gain")
    places, stored = np.linspace(0.0, 2.0, 401), content["model"]["tables"]["a"]
    rate = np.interp(places, stored["breakpoints"][0], stored["values"])
    L = np.interp(places, content["scheduling"][0]["breakpoints"], np.ravel(content["gain"]["table"]))
    coefficients = np.zeros(2)
    coefficients[[order for (order,) in claim["P"]["orders"]]] = np.ravel(claim["P"]["coefficients"])
    P = coefficients[0] + coefficients[1] * (places - 1.0)

    def most(level: float) -> float:
        """The largest left side over all e and d, for e = 1."""
        still = -2.0 * (rate + L) * P + 1.0 + P**2 * (1.0 + NOISE**2 * L**2) / level**2
        return float((still + abs(coefficients[1])).max())

    assert P.min() > 0.0 and most(claim["level"]) < 0.0
    assert most(0.99 * claim["level"]) > 0.0  # the level is no loose one


def swapped(content: dict[str, Any]) -> None:
    content["plant"]["cells"].reverse()


def one_value(content: dict[str, Any]) -> None:
    content["model"]["tables"]["a"]["values"][1] = 0.99


def one_cell(content: dict[str, Any]) -> None:
    content["plant"]["cells"][1]["A"]["coefficients"][0][0][0] *= 1.0 + 1e-12


def moved(content: dict[str, Any]) -> None:
    content["model"]["tables"]["a"]["breakpoints"][0][1] = 0.8


def no_cells(content: dict[str, Any]) -> None:
    content["plant"] = content["plant"]["cells"][0]


def without_table(content: dict[str, Any]) -> None:
    del content["model"]["tables"]


def idle(content: dict[str, Any]) -> None:
    content["model"]["tables"]["c"] = deepcopy(content["model"]["tables"]["a"])


def short(content: dict[str, Any]) -> None:
    content["model"]["tables"]["a"]["breakpoints"][0][2] = 1.9


def bomb(content: dict[str, Any]) -> None:
    """A file of a few megabytes that would be gigabytes in memory."""
    names = [f"p{k}" for k in range(3)]
    content["scheduling"] += [content["scheduling"][0] | {"name": name, "breakpoints": [0.0, 2.0]} for name in names]
    line = np.linspace(0.0, 2.0, 17).tolist()
    content["plant"]["breakpoints"] = [line, line, [0.0, 1.0, 2.0], [0.0, 2.0]]
    cell = {
        key: {"orders": [[0] * 4], "coefficients": m["coefficients"][:1]}
        for key, m in content["plant"]["cells"][0].items()
    }
    content["plant"]["cells"] = [cell] * 511 + [cell | {"A": {"orders": [[16] * 4], "coefficients": [[[1.0]]]}}]


def thrice(content: dict[str, Any]) -> None:
    content["model"]["tables"]["a"] |= {"breakpoints": [[0.0, 0.7, 0.7, 0.7, 2.0]], "values": [3.0, 1.0, 1.0, 1.0, 2.5]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (swapped, r"plant.cells\[0\].A: entry \[0\]\[0\]"), (one_value, r"plant.cells\[0\].A"), (one_cell, r"plant.cells\[1\].A"),
        (moved, r"plant.breakpoints\[0\]"), (no_cells, "plant: is one polynomial"), (without_table, "'a' is neither"),
        (idle, "model.tables.c: appears in no formula"), (short, "do not cover the range of p"), (thrice, "twice is a jump"),
        (bomb, r"plant\.cells: make \d{9} numbers"),
    ],
)  # fmt: skip
def test_a_file_whose_table_or_plant_was_changed_is_refused(content: dict[str, Any], change: Any, words: str) -> None:
    change(content)
    with pytest.raises(ScheduleError, match=words):
        prove(content, "file")


@pytest.mark.parametrize("values", [[3.0, 0.9, 2.5], [3.0, 0.9, 1.0, 2.5]])
def test_gains_of_another_table_are_refuted_where_it_dips(deployed: Deployment, values: list[float]) -> None:
    """The claims of a dip to 1 do not hold for one to 0.9: at the kink, and where a jump ends at it from below."""
    points = KINK.breakpoints[0] if len(values) == 3 else JUMP.breakpoints[0]
    assert isinstance(deployed.gains, ObserverGains)
    other = replace(deployed.gains, model=plant(-a, {"a": table(points, values)}))
    wrong = schedule_content(replace(deployed, gains=other), "by-cells")
    proofs = [proof for proof in prove(wrong, "file") if "gain 1 1 w" in proof.claim]
    assert proofs and not any(proof.proved for proof in proofs)
    assert all(proof.refuted and "p = 0.7 1" in proof.place for proof in proofs if proof.kind == "gain")


def test_the_runtime_runs_the_plant_of_the_table(content: dict[str, Any]) -> None:
    schedule = GainSchedule.from_content(content)
    places = np.linspace(0.0, 2.0, 41)
    rates = np.interp(places, [0.0, 0.7, 2.0], [3.0, 1.0, 2.5])
    np.testing.assert_allclose(schedule.plant_at(places).A[:, 0, 0], -rates, rtol=1e-14)
    observer, many = LpvObserver(schedule), LpvObserver(schedule, (len(places),))
    many.reset(state=np.ones((len(places), 1)))
    found = many.step(np.full((len(places), 1), 0.3), np.full((len(places), 1), 0.8), places).estimate
    for k in (0, 13, 14, 15, 40):
        L = schedule.gain(places[k])[0, 0]
        whole = PERIOD * np.array([[-rates[k] - L, 0.3 + L * 0.8], [0.0, 0.0]])
        observer.reset(state=np.ones(1))
        one = observer.step(np.array([0.3]), np.array([0.8]), places[k]).estimate
        assert one[0] == pytest.approx((expm(whole) @ [1.0, 1.0])[0], rel=1e-13)
        assert found[k, 0] == pytest.approx(one[0], rel=1e-14)
    with pytest.raises(ScheduleError, match=r"by cells .* take LpvObserver"):
        _ = schedule.polynomials


def test_several_parameters_and_tables_make_the_cells_of_all() -> None:
    """Products of tables and parameters on a grid of 3 x 2 cells, against the sum over corners."""
    over_both = table(((0.0, 0.7, 2.0), (-1.0, 3.0)), [[1.0, 2.0], [0.5, 4.0], [2.0, 1.0]], ("p", "q"))
    model = plant(
        -a * b - p * q, {"a": over_both, "b": table((0.0, 1.5, 2.0), [1.0, 2.0, 1.5])}, (moving(), moving(1.0, "q"))
    )
    assert model.cells.lines == ((0.0, 0.7, 1.5, 2.0), (0.0, 2.0))
    draw = np.random.default_rng(0).uniform(0.0, 2.0, (50, 2))
    share = (draw[:, 1] + 1.0) / 4.0
    ends = [np.interp(draw[:, 0], [0.0, 0.7, 2.0], column) for column in ([1.0, 0.5, 2.0], [2.0, 4.0, 1.0])]
    wanted = -((1 - share) * ends[0] + share * ends[1]) * np.interp(draw[:, 0], [0.0, 1.5, 2.0], [1.0, 2.0, 1.5])
    np.testing.assert_allclose(model.on(draw).A[:, 0, 0], wanted - draw[:, 0] * draw[:, 1], rtol=1e-12)
    assert plant_of(model).is_continuous
    stored = plant_by_cells(_plant(model), {"A": (1, 1)})["A"]
    np.testing.assert_allclose(stored.at(draw)[:, 0, 0], wanted - draw[:, 0] * draw[:, 1], rtol=1e-12)


def test_a_jump_is_stated_and_belongs_to_the_upper_cell_at_its_place() -> None:
    model = plant(-a, {"a": JUMP})
    assert model.summary()[-1].endswith("; 1 table, 2 cells: a [1] over p; jumps: a at p = 0.7 1")
    assert model.on([0.7 - 1e-9, 0.7, 0.7 + 1e-9]).A[:, 0, 0] == pytest.approx([-2.0, -1.0, -1.0], abs=1e-7)
    assert not plant_of(model).is_continuous
    assert "jumps" not in plant(-a, {"a": KINK}).summary()[-1]
    stored = plant_by_cells(_plant(model), {"A": (1, 1)})["A"]
    assert stored.at(np.array([0.7 - 1e-9, 0.7, 0.7 + 1e-9]))[:, 0, 0] == pytest.approx([-2.0, -1.0, -1.0], abs=1e-7)


def test_a_search_sees_both_sides_of_a_jump() -> None:
    """At the jump itself the upper side decides: a level that holds on both sides of it is found and proved, not one below."""
    table_of_gains: dict[tuple[int, ...], Any] = {(k,): fmpq_mat([[2]]) for k in range(2)}
    loop = ObserverLoop(
        plant_of(plant(-a, {"a": JUMP})), ((fmpq(0), fmpq(2)),), table_of_gains, sample_time=fmpq(1, 50)
    )
    search = Search(loop, Names(("x",), ("w", "n")), (STEADY,), 0)
    assert search.prove(Wish("decay rate", 2.999))[0] is not None  # 2 + 1 at the jump from above
    claim, outcome = search.prove(Wish("decay rate", 3.001))
    assert claim is None and (outcome is None or not outcome.proved)
    assert search.least_gain(Wish("gain", None, ClaimChannel({"w": 1.0}, ("x",)))) == pytest.approx(1.0 / 3.0, rel=1e-5)


def test_cells_at_once_are_those_one_by_one() -> None:
    """On a grid of two parameters the cells do not come in the order of the plant's."""
    both = table(((0.0, 0.7, 2.0), (0.0, 1.5, 2.0)), [[1.0, 2.0, 5.0], [0.5, 4.0, 0.1], [2.0, 1.0, 3.0]], ("p", "q"))
    gains = {index: fmpq_mat([[1 + sum(index)]]) for index in np.ndindex(3, 3)}
    lines = ((fmpq(0), fmpq(1), fmpq(2)), (fmpq(0), fmpq(1, 2), fmpq(2)))
    loop = ObserverLoop(plant_of(plant(-a - p, {"a": both}, (moving(), moving(1.0, "q")))), lines, gains)
    cells = list(loop.cells())[::-1]
    at_once = loop.on_boxes("continuous", cells)
    assert len(cells) == 9 and at_once is not None
    for number, cell in enumerate(cells):
        alone = loop.system(cell, "continuous")
        assert alone is not None
        middle = float(alone.A.terms[0, 0, 0, 0][0, 0].mid())
        assert at_once.A.middle[number, 0, 0, 0] == pytest.approx(middle, rel=1e-12)
        u = [int(x.p) / int(x.q) for x in cell.offset[:2]]
        wanted = RegularGridInterpolator(both.breakpoints, both.values)([[1.0 + x for x in u]])[0] + 1.0 + u[0]
        assert middle == pytest.approx(-wanted - sum(1.0 * np.interp(1.0 + x, line, [1.0, 2.0, 3.0]) - 1.0 for x, line in
                                                      zip(u, ([0.0, 1.0, 2.0], [0.0, 0.5, 2.0]), strict=True)) - 1.0)  # fmt: skip


def test_what_knows_no_cells_says_so_before_the_solve() -> None:
    model = plant(-a, {"a": KINK})
    with pytest.raises(ModelError, match=r"table\(s\) a: .* does not support a plant by cells"):
        affine_quadratic_stability(model, np.ones((1, 1)))
    with pytest.raises(ModelError, match="divides by a parameter or a table"):
        plant(-1 / a, {"a": KINK})
