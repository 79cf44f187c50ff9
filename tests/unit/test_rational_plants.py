"""Rational plants from formula to runtime: files, proofs, runs and refusals of single-track lateral dynamics over speed."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from analysis.simulation.amplification import amplification
from estimators import GainSchedule, LpvController, LpvObserver, LpvVelocityObserver, ScheduleError
from estimators.schedule import PlantPolynomial
from estimators.schedule.quotient import PlantQuotient, quotients
from synthesis.certificate.content import subject_of
from synthesis.certificate.inside_sample import inside_sample
from synthesis.certificate.proof import certificate
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import export, schedule_content
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.law_table import Gains
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback
from tests.support.any_size import any_schedule, signals
from tests.support.single_track import HIGH, LOW, numbers, single_track

PERIOD = 0.01
UPDATES = ("held", "sampled", "feedback")


def observer_design(update: str) -> ObserverDesign:
    channel = Channel(("wind", "gyro_noise", "noise"), ("side_velocity",), weights=(1.0, 0.01, 0.3))
    return ObserverDesign((channel,), decay_rate=1.0, fastest_pole=80.0 if update == "held" else None)


@pytest.fixture(scope="module")
def contents() -> dict[str, dict[str, Any]]:
    model, settings = single_track(), DeploySettings(sample_time=PERIOD)
    state = FeedbackChannel(("wind",), ("side_velocity", "yaw_rate", "steering"), sizes=(1.0, 0.2, 0.05))
    gains: dict[str, Gains] = {
        "held": design_observer(model, observer_design("held")),
        "sampled": design_sampled_observer(model, observer_design("sampled"), PERIOD),
        "feedback": design_state_feedback(model, StateFeedbackDesign((state,), decay_rate=1.0, fastest_pole=60.0)),
    }
    return {
        update: schedule_content(deploy(found, settings), f"single-track-{update}") for update, found in gains.items()
    }


def changed(content: dict[str, Any], change: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    other = copy.deepcopy(content)
    change(other)
    return other


def test_the_file_says_what_its_plant_is_divided_by(contents: dict[str, dict[str, Any]], tmp_path: Path) -> None:
    content = contents["sampled"]
    assert content["plant"]["denominator"] == {"orders": [[0], [1]], "coefficients": [[[1.0]], [[17.5 / 22.5]]]}
    export(tmp_path / "file.json", content)
    found = certificate(json.loads((tmp_path / "file.json").read_text()))
    assert all(proof.proved for proof in found.proofs) and found.inside_sample


@pytest.mark.parametrize("update", UPDATES)
def test_runs_stay_below_the_levels_and_near_them(update: str, contents: dict[str, dict[str, Any]]) -> None:
    """Claims proved from the content alone, beside frozen places and moving trajectories that know nothing of the proof."""
    found = amplification(contents[update], runs=2, samples=60)
    assert all(one.proved and not one.beaten for one in found)
    assert max(one.share for one in found if not one.is_decay) > 0.4
    assert min(one.worst / one.level for one in found if one.is_decay) < 1.05


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_the_runtime_performs_the_exact_update(update: str, contents: dict[str, dict[str, Any]]) -> None:
    schedule = GainSchedule.from_content(contents[update])
    rng, observer = np.random.default_rng(3), LpvObserver(schedule, (5,))
    x, u, y = rng.normal(size=(5, 2)), rng.normal(size=(5, 1)), rng.normal(size=(5, 2))
    V = np.array([LOW, 6.3, 17.0, 31.4, HIGH])
    observer.reset(state=x)
    found = observer.step(u, y, V[:, None]).estimate
    for k, speed in enumerate(V):
        A, B, C, D = numbers(speed)
        for key, matrix in zip("ABCD", (A, B, C, D), strict=True):
            np.testing.assert_allclose(schedule.plant[key].at(np.array(speed)), matrix, rtol=1e-13, atol=1e-13)
            assert (np.abs(matrix) <= schedule.plant[key].largest).all()
        L, innovation = schedule.gain(speed), y[k] - C @ x[k] - D @ u[k]
        whole = np.zeros((3, 3))
        whole[:2, :2] = A if update == "sampled" else A - L @ C
        whole[:2, 2] = B @ u[k] + (0.0 if update == "sampled" else L @ (y[k] - D @ u[k]))
        after = (expm(PERIOD * whole) @ [*x[k], 1.0])[:2] + (L @ innovation if update == "sampled" else 0.0)
        np.testing.assert_allclose(found[k], after, rtol=1e-12, atol=1e-13)


def test_sizes_on_the_whole_range_are_bounds() -> None:
    """Against a fine grid, for a numerator that is zero in the middle and a denominator that falls to a tenth."""
    below = PlantPolynomial(0.0, 1.0, np.array([1.0, 0.9])[:, None, None])
    u = np.linspace(-1.0, 1.0, 4001)
    for above in ([0.0, 1.0], [0.0, 0.0, 0.0, 1.0], [0.1, 0.3, -0.9, 0.2, 0.5]):
        numerator = PlantPolynomial(0.0, 1.0, np.array(above)[:, None, None])
        found = quotients({"A": numerator}, below, ["p"], "file")["A"]
        largest = np.abs(found.at(u)).max()
        assert largest <= found.largest[0, 0] <= 2.0 * largest
    flat = below._replace(coefficients=np.array([1.0, 1e-6])[:, None, None])  # one part: its middle says nothing
    odd = PlantPolynomial(0.0, 1.0, np.array([0.0, 1.0])[:, None, None])
    assert 1.0 <= quotients({"A": odd}, flat, ["p"], "file")["A"].largest[0, 0] < 1.001


def test_the_law_runs(contents: dict[str, dict[str, Any]]) -> None:
    schedule = GainSchedule.from_content(contents["feedback"])
    step = LpvController(schedule).step(np.array([0.5, -0.2]), 12.0)
    np.testing.assert_allclose(step.command, schedule.gain(12.0) @ [0.5, -0.2], rtol=1e-14)


@pytest.mark.parametrize("update", UPDATES)
def test_a_level_that_is_too_good_is_refuted(update: str, contents: dict[str, dict[str, Any]]) -> None:
    content = contents[update]
    gain, decay = (
        next(i for i, claim in enumerate(content["claims"]) if claim["kind"] in kinds)
        for kinds in (("sampled gain",), ("internal update", "sampled error"))
    )
    bad = copy.deepcopy(content)
    bad["claims"] = [bad["claims"][gain] | {"level": 0.5 * bad["claims"][gain]["level"]},
                     bad["claims"][decay] | {"level": 1.2 * bad["claims"][decay]["level"]}]  # fmt: skip
    proofs = certificate(bad).proofs
    assert [proof.proved or not proof.refuted for proof in proofs] == [False, False]
    assert all("speed = " in proof.place for proof in proofs)


def _formulas(data: dict[str, Any], old: str, new: str) -> None:
    for rows in data["model"]["matrices"].values():
        for row in rows:
            row[:] = [text.replace(old, new) for text in row]


def _scaled(data: dict[str, Any]) -> None:
    for stored in data["plant"].values():
        stored["coefficients"] = [[[2.0 * x for x in row] for row in m] for m in stored["coefficients"]]


EDITS: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "a coefficient": (
        lambda d: d["plant"]["denominator"]["coefficients"].__setitem__(1, [[0.7777777]]),
        r"plant\.denominator: entry \[0\]\[0\] of order \[1\] is 0\.7777777",
    ),
    "left out": (lambda d: d["plant"].pop("denominator"), r"plant\.denominator: is missing"),
    "all over two": (_scaled, r"plant\.A: entry"),
    "another shape": (lambda d: d["plant"]["denominator"].update(coefficients=[[[1.0, 0.0]]] * 2), r"plant\.denominator"),
    "an unknown key": (lambda d: d["plant"]["denominator"].update(power=2), r"plant\.denominator.*power"),
    "a zero in the range": (
        lambda d: _formulas(d, "*speed)", "*(speed - 20))"),
        r"model\.matrices\.A\[0\]\[0\]: divides by zero inside the range, at or near speed = 2",
    ),
    "a double zero": (
        lambda d: _formulas(d, "*speed)", "*(speed - 20)**2)"),
        r"model\.matrices\.A\[0\]\[0\]: divides by zero inside the range, at or near speed = (20|19\.9|20\.0)",
    ),
    "a zero at the end": (
        lambda d: _formulas(d, "*speed)", "*(speed - 5))"),
        r"model\.matrices\.A\[0\]\[0\]: divides by zero inside the range, at or near speed = 5 m/s",
    ),
    "a high power": (
        lambda d: _formulas(d, "*speed)", "*speed**9*speed**9)"), r"model\.matrices\.A\[0\]\[1\]: has a power above 16",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", EDITS)
def test_edited_files_are_refused(name: str, contents: dict[str, dict[str, Any]]) -> None:
    change, words = EDITS[name]
    with pytest.raises(ScheduleError, match=words):
        certificate(changed(contents["held"], change))


def test_formulas_whose_quotient_is_a_polynomial_need_no_denominator(contents: dict[str, dict[str, Any]]) -> None:
    """(mass) (speed^2 - 1)/((speed - 1) (speed + 1)): common factors go, and one that is stored nevertheless is refused."""
    data = copy.deepcopy(contents["feedback"])
    data["model"]["matrices"] = {
        "A": [["-2", "(speed**2 - 9)/(speed + 3)"], ["0/speed", "-1/(speed/speed)"]], "B": [["1"], ["1"]],
        "C": [["1", "0"]] * 2, "D": [["0"]] * 2, "E": [["1", "0", "0"]] * 2, "F": [["0", "0", "0"]] * 2,
    }  # fmt: skip
    for listed in (
        *(data["model"][kind] for kind in ("states", "inputs", "outputs", "disturbances")),
        data["scheduling"],
    ):
        for signal in listed:
            signal["unit"] = "1"
    data["model"]["constants"] = {}
    stored = {key: {"orders": [[0]], "coefficients": [[[float(x) if "s" not in x else 0.0 for x in row] for row in rows]]}
              for key, rows in data["model"]["matrices"].items()}  # fmt: skip
    stored["A"] = {"orders": [[0], [1]], "coefficients": [[[-2.0, 19.5], [0.0, -1.0]], [[0.0, 17.5], [0.0, 0.0]]]}
    data["plant"] = stored
    assert subject_of(data, "file").loop.plant.is_polynomial
    data["plant"]["denominator"] = {"orders": [[0]], "coefficients": [[[1.0]]]}
    with pytest.raises(ScheduleError, match=r"plant\.denominator: the formulas divide by no scheduling parameter"):
        subject_of(data, "file")


def test_a_runtime_refuses_a_denominator_with_a_zero(contents: dict[str, dict[str, Any]]) -> None:
    """It reads files without proving them: what would divide by zero is not loaded."""
    bad = changed(contents["held"], lambda d: d["plant"]["denominator"]["coefficients"].__setitem__(1, [[1.25]]))
    with pytest.raises(ScheduleError, match=r"plant\.denominator: is not clearly positive .* near speed = "):
        GainSchedule.from_content(bad)
    schedule = GainSchedule.from_content(contents["held"])
    with pytest.raises(ScheduleError, match="takes polynomials; take LpvObserver"):
        _ = schedule.polynomials


def over_a_polynomial(schedule: GainSchedule) -> GainSchedule:
    """The same numerators over 1 + 0.6 u_1 (+ 0.2 u_1 u_2)."""
    first, count = schedule.plant["A"], len(schedule.parameters)
    series = np.array([1.0, 0.6]) if count == 1 else np.array([[1.0, 0.0], [0.6, 0.2]])
    assert not isinstance(first, PlantQuotient)
    below = first._replace(coefficients=series[..., None, None])
    return replace(schedule, plant=quotients(schedule.plant, below, ["p0", "p1"][:count], "file"))  # type: ignore[arg-type]


@pytest.mark.parametrize("update", ["held", "sampled"])
def test_the_runtime_divides_over_two_parameters(update: str) -> None:
    schedule = over_a_polynomial(any_schedule((3, 2, 2), 2, update=update))
    rng, observer = np.random.default_rng(4), LpvObserver(schedule, (6,))
    x, (u, y, p) = rng.normal(size=(6, 3)), signals(schedule, rng, (6,))
    observer.reset(state=x)
    found = observer.step(u, y, p).estimate
    for k in range(6):
        w = p[k] - [1.0, 2.0]
        d = 1.0 + 0.6 * w[0] + 0.2 * w[0] * w[1]
        A, B, C, D = (schedule.plant[key].numerator.at(p[k]) / d for key in "ABCD")  # type: ignore[union-attr]
        L, held = schedule.gain(p[k]), update == "held"
        whole = np.zeros((4, 4))
        whole[:3, :3] = A - L @ C if held else A
        whole[:3, 3] = B @ u[k] + (L @ (y[k] - D @ u[k]) if held else 0.0)
        after = (expm(PERIOD * whole) @ [*x[k], 1.0])[:3]
        after += 0.0 if held else L @ (y[k] - C @ x[k] - D @ u[k])
        np.testing.assert_allclose(found[k], after, rtol=1e-11, atol=1e-12)


def test_the_velocity_observer_refuses_what_it_cannot_unroll() -> None:
    plain = any_schedule((2, 1, 1), 1)
    LpvVelocityObserver(plain)
    with pytest.raises(ScheduleError, match="takes polynomials; take LpvObserver"):
        LpvVelocityObserver(over_a_polynomial(plain))


def test_what_a_moving_speed_adds_inside_a_sample(contents: dict[str, dict[str, Any]]) -> None:
    """Against N = q T^2/2 X |A'| X at single speeds in floats: never below, and not far above where the speed is lowest."""
    found = inside_sample(subject_of(contents["held"], "file").loop)
    assert found is not None
    bound, worst = np.array(found.of_states), np.zeros((2, 2))
    for V in np.linspace(LOW, HIGH, 50):
        slope = np.abs(numbers(V + 1e-4)[0] - numbers(V - 1e-4)[0]) / 2e-4
        A = numbers(V)[0]
        M = np.abs(A)
        np.fill_diagonal(M, np.maximum(np.diag(A), 0.0))
        X = expm(PERIOD * M)
        worst = np.maximum(worst, 8.0 * PERIOD**2 / 2 * X @ slope @ X)
    assert (bound >= worst * (1 - 1e-6)).all() and (bound[0] <= 6.0 * worst[0]).all()
