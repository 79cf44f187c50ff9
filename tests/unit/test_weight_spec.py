"""Dynamic weights of specifications: three forms of one weight, designs against products of frequency responses, refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest

from estimators import GainSchedule, LpvController, LpvObserver
from estimators.arrays import FloatArray
from estimators.errors import GainsmithError
from studies.preflight import check_before_design
from studies.spec import load_spec
from studies.weight_spec import WeightSpec
from synthesis.certificate.proof import prove
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.law_table import refuse_beyond_limits
from synthesis.design.output_feedback import OutputFeedback
from synthesis.design.weighted_state_feedback import WeightedStateFeedback
from synthesis.errors import ProblemError
from synthesis.models.discretise import zero_order_hold
from synthesis.models.weights import first_order_weight

EXAMPLES = Path(__file__).parents[2] / "studies" / "examples"
OSCILLATOR = """
name = "oscillator"
source = "Newton"
states = [{ name = "position", unit = "m" }, { name = "velocity", unit = "m/s" }]
inputs = [{ name = "force", unit = "N" }]
outputs = [{ name = "measured_position", unit = "m" }]
disturbances = [{ name = "push", unit = "N" }, { name = "noise", unit = "m" }]
[[parameters]]
name = "stiffness"
unit = "N/m"
min = 2.0
max = 2.2
rate = 0.0
[constants]
mass = { value = 2.0, unit = "kg", source = "scale" }
damping = { value = 0.4, unit = "N*s/m", source = "data sheet" }
[matrices]
A = [[0, 1], ["-stiffness/mass", "-damping/mass"]]
B = [[0], ["1/mass"]]
C = [[1, 0]]
E = [[0, 0], ["1/mass", 0]]
F = [[0, 1]]
"""
LAW = """
name = "law"
description = "Slow pushes leave the position alone"
[model]
file = "oscillator.toml"
[design]
law = "output feedback"
degree = 0
fastest_pole = 20.0
measured = ["measured_position"]
[[design.dynamic_weights]]
signal = "position"
low_gain = 10.0
high_gain = 0.5
crossover = 0.8
[[design.channels]]
disturbances = ["push", "noise"]
weights = [1.0, 0.01]
performance = ["position_weighted", "force"]
sizes = [0.5, 2.0]
[deploy]
sample_time = 0.02
"""


def loaded(folder: Path, text: str = LAW) -> Any:
    (folder / "oscillator.toml").write_text(OSCILLATOR)
    (folder / "law.toml").write_text(text)
    spec, place = load_spec(folder / "law.toml")
    model = spec.plant(place).model
    check_before_design(spec, model)
    return spec, model


def test_three_forms_of_one_weight() -> None:
    """|W| is 10 at rest, 0.5 far beyond, and 1 at the crossover."""
    first = first_order_weight(10.0, 0.5, 0.8)
    assert [abs(first(1j * w)) for w in (0.0, 0.8, 1e6)] == pytest.approx([10.0, 1.0, 0.5], rel=1e-6)
    assert abs(first_order_weight(0.0, 30.0, 5.0)(5j)) == pytest.approx(1.0)
    above, below = first.num[0][0].tolist(), first.den[0][0].tolist()
    forms: list[dict[str, Any]] = [
        {"low_gain": 10.0, "high_gain": 0.5, "crossover": 0.8},
        {"numerator": above, "denominator": below},
        {"A": [[-below[1]]], "B": [[1.0]], "C": [[above[1] - above[0] * below[1]]], "D": [[above[0]]]},
    ]
    for form in forms:
        found = WeightSpec(signal="x", **form).system()
        assert found(0.3j) == pytest.approx(first(0.3j), rel=1e-9)


def test_a_weighted_law_keeps_the_product_of_frequency_responses(tmp_path: Path) -> None:
    """The law closes the plant that has no weight: W times position, and the force, stay below the level at every frequency."""
    spec, model = loaded(tmp_path)
    assert [s.unit for s in model.states] == ["m", "m/s", "m"] and model.outputs[1].unit == "m"
    gains = spec.design(model)
    assert isinstance(gains, OutputFeedback) and gains.order == 3
    (Ak,), (Bk,), (Ck,), (Dk,) = gains.controller(np.array([2.0]))
    assert not Bk[:, 1].any() and not Dk[:, 1].any()
    A, B = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0], [0.5]])
    plant = control.ss(A, np.hstack([B, np.zeros((2, 1)), B]), [[1, 0], [1, 0]], [[0, 0, 0], [0, 1, 0]])
    law = control.ss(Ak, Bk[:, :1], Ck, Dk[:, :1])
    weight, levels = first_order_weight(10.0, 0.5, 0.8), []
    for frequency in np.concatenate([[0.0], np.geomspace(1e-3, 100.0, 400)]):
        G, K, W = plant(1j * frequency), law(1j * frequency), weight(1j * frequency)
        u = K * np.array([G[1, 0], G[1, 1]]) / (1.0 - K * G[1, 2])
        x = G[0, :2] + G[0, 2] * u
        levels.append(np.linalg.norm(np.array([W * x / 0.5, u / 2.0]) * np.array([1.0, 0.01]), 2))
    assert 0.9 * gains.gamma < max(levels) <= gains.gamma
    free = 10.0 / 0.5  # of a push at rest without the law
    assert levels[0] < 0.5 * free


def test_a_coloured_disturbance_is_a_state_of_the_observer() -> None:
    """From the example's file to the proof and the run: the runtime finds a slope that lasts; a lower level is not proved."""
    spec, folder = load_spec("cruise-observer")
    model = spec.plant(folder).model
    check_before_design(spec, model)
    content = schedule_content(deploy(spec.design(model), spec.deploy_settings()), spec.name)
    proofs = prove(content)
    assert all(proof.proved for proof in proofs)
    level = next(proof for proof in proofs if proof.kind == "sampled gain")
    assert level.unit == "N" and level.claim.endswith("-> road_force_weight_1")
    assert any("weight_rate" in entry for row in content["model"]["matrices"]["A"] for entry in row)
    T, speed = spec.deploy.sample_time, 20.0
    at = model.on(np.array([speed]))
    A, B, E = at.A[0][:3, :3], at.B[0][:3], np.array([[-1.0 / 1600.0], [0.0], [0.0]])
    Phi, Gamma = zero_order_hold(A, np.hstack([B, E]), T)
    observer, x = LpvObserver(GainSchedule.from_content(content)), np.zeros(3)
    for _ in range(400):
        estimate = observer.step(np.zeros(1), x[:2], speed).estimate
        x = Phi @ x + Gamma @ np.array([0.0, 600.0])
    # All but what the lag of the weight leaks
    assert estimate[3] == pytest.approx(600.0, rel=0.2) and estimate[0] == pytest.approx(x[0], abs=0.1)
    place = next(i for i, claim in enumerate(content["claims"]) if claim["kind"] == "sampled gain")
    content["claims"][place]["level"] *= 0.5
    assert not prove(content)[place].proved


STATES = LAW.replace('"output feedback"', '"state feedback"').replace('measured = ["measured_position"]\n', "")


def test_state_feedback_works_out_the_states_of_its_weights(tmp_path: Path) -> None:
    """The law carries a copy of them, so that the plant without a weight keeps the level; from the file to the run."""
    spec, model = loaded(tmp_path, STATES.replace("fastest_pole = 20.0", "fastest_pole = 8.0"))
    gains = spec.design(model)
    assert isinstance(gains, WeightedStateFeedback) and gains.order == 1
    (Ak,), (Bk,), (Ck,), (Dk,) = gains.controller(np.array([2.0]))
    assert not Bk[:, 2:].any() and not Dk[:, 2:].any()
    A, B = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0], [0.5]])
    loop = np.block([[A + B @ Dk[:, :2], B @ Ck], [Bk[:, :2], Ak]])
    weight, levels = first_order_weight(10.0, 0.5, 0.8), []
    for frequency in np.concatenate([[0.0], np.geomspace(1e-3, 100.0, 200)]):
        x = np.linalg.solve(1j * frequency * np.eye(3) - loop, np.array([0.0, 0.5, 0.0]))
        u = Dk[:, :2] @ x[:2] + Ck @ x[2:]
        levels.append(np.linalg.norm([weight(1j * frequency) * x[0] / 0.5, u[0] / 2.0]))
    assert 0.9 * gains.gamma < max(levels) <= gains.gamma
    content = schedule_content(deploy(gains, spec.deploy_settings()), spec.name)
    assert all(proof.proved for proof in prove(content))
    controller, x, T = LpvController(GainSchedule.from_content(content)), np.zeros(2), spec.deploy.sample_time
    Phi, Gamma = zero_order_hold(A, B, T)
    for _ in range(2000):
        step = controller.step([*x, np.nan, np.nan], 2.0)
        x = Phi @ x + Gamma @ (step.command + 1.0)
    u = Dk[:, :2] @ [0.0, 0.0] + Ck @ np.linalg.solve(-Ak, Bk[:, 0])  # at rest, for a position of one
    assert step.used and x[0] == pytest.approx(0.5 / (1.0 - 0.5 * (Dk[0, 0] + u[0])), rel=0.02)


def closed(law: WeightedStateFeedback, period: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Oscillator with weight and copy over a sample, from the equations of each: a push, to W position and force in their sizes.

    States: position, velocity, weight in continuous time, copy.
    """
    (Ak,), (Bk,), (Ck,), (Dk,) = law.over_sample(np.array([2.0]), period)
    W = control.ss(first_order_weight(10.0, 0.5, 0.8))
    A = np.array([[0.0, 1.0, 0.0], [-1.0, -0.2, 0.0], [1.0, 0.0, W.A[0, 0]]])
    Phi, moved = zero_order_hold(A, np.array([[0.0], [0.5], [0.0]]), period)
    u = np.hstack([Dk[:, :2], np.zeros((1, 1)), Ck])
    rows = np.vstack([np.hstack([Phi, np.zeros((3, 1))]) + moved @ u, np.hstack([Bk[:, :2], [[0.0]], Ak])])
    seen = np.vstack([np.array([W.D[0, 0], 0.0, W.C[0, 0] * W.B[0, 0], 0.0]) / 0.5, u / 2.0])
    return rows, np.vstack([moved, [[0.0]]]), seen


def level_of(law: WeightedStateFeedback, period: float, copied: float = 0.0) -> float:
    """The largest gain over frequencies; infinite of an unstable loop. `copied` times the copy: the weight's output."""
    A, B, C = closed(law, period)
    if copied:
        C[0, 2:] = 0.0, copied / 0.5
    if np.abs(np.linalg.eigvals(A)).max() >= 1.0:
        return float("inf")
    z = np.exp(1j * np.concatenate([[0.0], np.geomspace(1e-4, np.pi, 300)]))[:, None, None]
    return float(np.linalg.norm(C @ np.linalg.solve(z * np.eye(4) - A, B[None].astype(complex)), 2, (1, 2)).max())


def test_weights_of_a_law_that_is_designed_for_long_samples(tmp_path: Path) -> None:
    """The level of the design holds for the weight as the law runs it; a design in continuous time does worse on such samples."""
    T = 0.8
    text = STATES.replace('"state feedback"', '"sampled state feedback"')
    spec, model = loaded(
        tmp_path, text.replace("sample_time = 0.02", f"sample_time = {T}").replace("fastest_pole = 20.0\n", "")
    )
    law = spec.design(model)
    assert isinstance(law, WeightedStateFeedback) and law.sample_time == T
    (Ak,), (Bk,), _, _ = law.over_sample(np.array([2.0]), T)
    corner = 0.8 * np.sqrt(0.75 / 99.0)  # the position is held over a sample, and the force does not act on the weight
    np.testing.assert_allclose(Ak, np.exp(-corner * T), rtol=1e-9)
    np.testing.assert_allclose(Bk[0, :2], [(1.0 - np.exp(-corner * T)) / corner, 0.0], rtol=1e-9)
    copied = float(model.on([2.0]).C[0, -1, 2])
    assert 0.9 * law.gamma < level_of(law, T, copied) <= law.gamma
    spec, model = loaded(tmp_path, STATES.replace("fastest_pole = 20.0", "fastest_pole = 8.0"))
    assert level_of(spec.design(model), T) > 1.2 * level_of(law, T)
    content = schedule_content(deploy(law, DeploySettings(sample_time=T)), "long")
    proofs = prove(content)
    assert all(proof.proved for proof in proofs)
    place = next(i for i, proof in enumerate(proofs) if proof.kind == "sampled gain")
    assert level_of(law, T) < proofs[place].level < 1.05 * level_of(law, T)
    content["claims"][place]["level"] = 0.99 * level_of(law, T)
    assert not prove(content)[place].proved
    with pytest.raises(ProblemError, match=r"samples of 0.8 s has no law in continuous time"):
        law.controller(np.array([2.0]))


LIMIT = "degree = 0\ninput_limits = { force = 3.0 }\nstate_sizes = { position = 1.0, velocity = 1.0, position_weight_1 = 0.3 }"


@pytest.mark.parametrize("law", ["state feedback", "sampled state feedback"])
def test_limits_of_a_law_with_weights_hold_for_states_and_copies_of_a_size(law: str, tmp_path: Path) -> None:
    """|K S| of the deployed table; without the limit it is larger. A table beyond it is refused."""
    text = STATES.replace('"state feedback"', f'"{law}"').replace("fastest_pole = 20.0\n", "")
    S, commanded = np.array([0.3, 1.0, 1.0]), []  # of the copy, then of what is measured
    for given in (LIMIT, "degree = 0"):
        spec, model = loaded(tmp_path, text.replace("degree = 0", given))
        found = deploy(gains := spec.design(model), spec.deploy_settings())
        commanded.append(np.linalg.norm(found.table[:, 1, :3] * S, axis=-1).max())
        if given == LIMIT:
            refuse_beyond_limits(gains, found.table)
            with pytest.raises(ProblemError, match=r"the table commands up to 3\..* its limit is 3 N"):
                refuse_beyond_limits(gains, found.table * 3.1 / commanded[0])
    assert commanded[0] <= 3.0 < commanded[1]


def test_the_law_with_its_copy_of_the_weights_has_the_poles_of_the_design(tmp_path: Path) -> None:
    """Also of a weight that the law itself drives, at an input: plant and copy together are the weighted plant under u = K x."""
    drives = '[[design.dynamic_weights]]\nsignal = "force"\nlow_gain = 0.5\nhigh_gain = 4.0\ncrossover = 3.0\n'
    text = STATES.replace("[[design.channels]]", f"{drives}[[design.channels]]").replace(
        '"force"]', '"force_weighted"]'
    )
    spec, model = loaded(tmp_path, text)
    law = spec.design(model)
    (Ak,), (Bk,), (Ck,), (Dk,) = law.controller(np.array([2.0]))
    at, (K,) = model.on([2.0]), law.gains.gain(np.array([2.0]))
    A, B = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0], [0.5]])
    loop = np.block([[A + B @ Dk[:, :2], B @ Ck], [Bk[:, :2], Ak]])
    wanted = np.sort_complex(np.linalg.eigvals(at.A[0] + at.B[0] @ K))
    assert law.order == 2 and np.abs(at.B[0][2:]).max() > 0.1
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(loop)), wanted, rtol=1e-8)


def test_weights_that_state_feedback_cannot_know_are_refused(tmp_path: Path) -> None:
    pushed = STATES.replace('signal = "position"', 'signal = "push"').replace("position_weighted", "position")
    noisy = STATES.replace('signal = "position"', 'signal = "measured_position"').replace(
        "position_w", "measured_position_w"
    )
    limited = STATES.replace("degree = 0", LIMIT.replace(", position_weight_1 = 0.3", ""))
    for text, words in (
        (pushed, "the state push_weight_1 of a weight is driven by 'push', which is not measured"),
        (noisy, "measured_position_weight_1 of a weight is driven by 'noise'"),
        (limited, r"the state\(s\) position_weight_1 have no size"),
    ):
        with pytest.raises(GainsmithError, match=words):
            loaded(tmp_path, text)


WEIGHT = "low_gain = 10.0\nhigh_gain = 0.5\ncrossover = 0.8"
REFUSED = {
    "improper": (WEIGHT, "numerator = [1.0, 0.0, 1.0]\ndenominator = [1.0, 2.0]", "numerator has the degree 2, .* improper"),
    "unstable": (WEIGHT, "numerator = [1.0]\ndenominator = [1.0, -2.0]", "not stable: its pole 2 1/s"),
    "integrator": (WEIGHT, "numerator = [1.0]\ndenominator = [1.0, 0.0]", "in the place of an integrator take a slow pole"),
    "matrices": (WEIGHT, "A = [[-1.0]]\nB = [[1.0, 2.0]]\nC = [[1.0]]\nD = [[0.0]]", r"B of a weight with 1 states has"),
    "rows": (WEIGHT, "A = [[-1.0], [1.0, 2.0]]\nB = [[1.0]]\nC = [[1.0]]\nD = [[0.0]]", "not equally long"),
    "gains": ("high_gain = 0.5", "high_gain = 2.0", "never crosses 1"),
    "half": ("high_gain = 0.5\n", "", "high_gain is missing"),
    "two forms": (WEIGHT, f"{WEIGHT}\nnumerator = [1.0]", "has 2 forms; give one"),
    "none": (WEIGHT, "", "has 0 forms; give one"),
    "key": ("low_gain", "low_gian", "low_gian"),
    "signal": ('signal = "position"', 'signal = "postion"', "unknown signal 'postion'; did you mean position"),
    "twice": (
        "[[design.channels]]", f'[[design.dynamic_weights]]\nsignal = "position"\n{WEIGHT}\n[[design.channels]]',
        "'position' has two weights",
    ),
    "measured": ('measured = ["measured_position"]\n', "", "design.measured is missing: beside dynamic_weights"),
    "weighted": ('["measured_position"]', '["measured_position", "position_weighted"]', "comes from a weight and is not"),
    "channel": ('"position_weighted", "force"', '"velocity_weighted", "force"', "unknown performance signal 'velocity_weighted'"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_weights_are_refused_before_the_solve(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synthesis.lmi.solve.solve_with_clarabel", lambda *_: pytest.fail("a solver was called"))
    old, new, words = REFUSED[case]
    assert old in LAW
    text = LAW.replace(old, new)
    with pytest.raises(GainsmithError, match=words) as caught:
        loaded(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_an_observer_takes_weights_of_its_disturbances_only(tmp_path: Path) -> None:
    observer = (EXAMPLES / "cruise-observer.toml").read_text().replace('signal = "road_force"', 'signal = "traction"')
    (tmp_path / "cruise.toml").write_text((EXAMPLES / "cruise.toml").read_text())
    (tmp_path / "observer.toml").write_text(observer)
    spec, folder = load_spec(tmp_path / "observer.toml")
    with pytest.raises(
        GainsmithError, match="'traction' is no disturbance; an observer's weights shape its disturbances"
    ):
        spec.plant(folder)
