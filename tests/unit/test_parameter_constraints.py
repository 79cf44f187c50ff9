"""Sets of parameters that are no box, end to end: what a cut-off corner allows, what may not be cut off, and bad sets.

The plant is unstable (or its unstable mode unseen) in a corner of the box, by a closed form: see `rotor` and `sensor`.
"""

from __future__ import annotations

import copy
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from flint import fmpq

from analysis import lpv_decay_rate, random_trajectories
from analysis.errors import AnalysisError
from analysis.uncertainty.margin import robust_stability_margin
from analysis.uncertainty.worst_gain import worst_case_gain
from estimators import Flag, GainSchedule, LpvObserver
from estimators.errors import RangeError, ScheduleError
from synthesis.certificate.proof import prove
from synthesis.design.deploy import Deployment, deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.design.stability import affine_quadratic_stability
from synthesis.errors import ModelError, ProblemError, SpecError
from synthesis.exchange.model_file import load_model
from synthesis.exchange.model_text import save_model
from synthesis.lmi.result import Verdict
from synthesis.models.constraint import ParameterConstraint
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")
HALF = sp.Rational(1, 2)


def below(most: float, **coefficients: float) -> ParameterConstraint:
    return ParameterConstraint(coefficients or {"p": 1.0, "q": 1.0}, most)


def rotor(*constraints: ParameterConstraint) -> LpvModel:
    """Poles p + q - 1/2 +- j over [-1, 1]^2: stable exactly where p + q < 1/2; decay rate 1/2 - max(p + q)."""
    A = [[p + q - HALF, 1], [-1, p + q - HALF]]
    model = small_model(A, [[1, 0]], [parameter("p"), parameter("q")])
    return replaced(model, constraints)


def sensor(*constraints: ParameterConstraint) -> LpvModel:
    """An unstable mode seen with the strength 1 - p - q: not at all where p + q = 1."""
    model = small_model(
        [[HALF, 1], [-HALF / 5, -1]], [[1 - p - q, 0]], [parameter("p"), parameter("q")], E=[[1, 0], [1, 0]], F=[[0, 1]]
    )
    return replaced(model, constraints)


def replaced(model: LpvModel, constraints: tuple[ParameterConstraint, ...]) -> LpvModel:
    keys = ("name", "source", "states", "outputs", "parameters", "A", "C", "disturbances", "E", "F")
    return LpvModel(**{key: getattr(model, key) for key in keys}, constraints=constraints)


CHANNEL = Channel(("d1", "d2"), ("x1",))
DESIGN = ObserverDesign((CHANNEL,), degree=1, fastest_pole=40.0, backoff=0.1)
SAMPLED = ObserverDesign((CHANNEL,), degree=1, backoff=0.1)


@pytest.fixture(scope="module")
def deployment() -> Deployment:
    return deploy(design_sampled_observer(sensor(below(0.25)), SAMPLED, 0.02), DeploySettings(sample_time=0.02))


@pytest.fixture(scope="module")
def content(deployment: Deployment) -> dict:  # type: ignore[type-arg]
    return schedule_content(deployment, "cut")


def test_a_cut_corner_is_not_asked_for_and_one_that_is_left_is_found() -> None:
    """Box: refuted. Cut enough: certified. Cut too little: refuted, at a place inside the set."""
    gain = np.zeros((2, 1))
    whole = affine_quadratic_stability(rotor(), gain)
    enough = affine_quadratic_stability(rotor(below(0.4)), gain)
    little = affine_quadratic_stability(rotor(below(0.6)), gain)
    assert (whole.verdict, enough.verdict, little.verdict) == (Verdict.REFUTED, Verdict.CERTIFIED, Verdict.REFUTED)
    values = [float(part.split()[0]) for part in little.message.split(" = ")[1:3]]
    assert 0.5 <= sum(values) <= 0.6


def test_bounds_of_the_decay_rate_are_those_of_the_set() -> None:
    found = lpv_decay_rate(rotor(below(0.4)), degree=0)
    assert found.lower <= 0.1 <= found.upper * (1 + 1e-9)  # 1/2 - 0.4
    assert found.upper - found.lower < 0.01
    assert found.witness is not None
    assert found.witness.start.sum(axis=1).max() <= 0.4
    assert lpv_decay_rate(rotor(below(0.6)), degree=0).upper == 0.0


def test_what_is_about_boxes_says_so() -> None:
    with pytest.raises(AnalysisError, match=r"p \+ q <= 0.4.*about boxes"):
        robust_stability_margin(rotor(below(0.4)))


def test_the_worst_gain_is_that_of_the_set() -> None:
    """x' = -(2 - p - q) x + d, z = x: 1/(2 - max(p + q)), infinite on the box; one set misses its middle."""
    A = [[p + q - 2]]
    model = small_model(A, [[1]], [parameter("p"), parameter("q")], E=[[1]], F=[[0]])
    assert worst_case_gain(model, ("d1",)).lower == np.inf
    for most in (1.0, -0.5):
        found = worst_case_gain(replaced(model, (below(most),)), ("d1",))
        assert found.lower <= 1.0 / (2.0 - most) <= found.upper
        assert found.upper < 1.002 * found.lower
        assert sum(found.witness.values()) <= most
    unstable = worst_case_gain(replaced(small_model(A, [[1]], [parameter("p", -1.5, 1.5), parameter("q", -1.5, 1.5)], E=[[1]],
                                                    F=[[0]]), (below(2.1),)), ("d1",))  # fmt: skip
    assert unstable.lower == np.inf and 2.0 <= sum(unstable.witness.values()) <= 2.1


def test_designs_keep_to_the_set_and_undetectable_places_in_it_are_refused() -> None:
    for model in (sensor(), sensor(below(1.2))):
        with pytest.raises(ProblemError, match="undetectable at"):
            design_observer(model, DESIGN)


def test_the_file_holds_the_set_and_is_proved_from_it_alone(content: dict) -> None:  # type: ignore[type-arg]
    assert content["constraints"]["inequalities"] == [{"coefficients": {"p": 1.0, "q": 1.0}, "max": 0.25, "unit": "1"}]
    assert all(proof.proved for proof in prove(content))


def test_a_set_that_was_tampered_with_is_seen(content: dict) -> None:  # type: ignore[type-arg]
    """More than was proved is refuted at a place of that set; no set at all, at one of the box; a wrong one is refused."""
    content = copy.deepcopy(content)
    content["claims"] = [claim for claim in content["claims"] if claim["kind"] == "sampled error"]
    wider = copy.deepcopy(content)
    wider["constraints"]["inequalities"][0]["max"] = 1.1
    bad = next(proof for proof in prove(wider) if proof.kind == "sampled error")
    values = [float(part.split()[0]) for part in bad.place.split(" = ")[1:3]]
    assert bad.refuted
    assert sum(values) <= 1.1
    without = {key: value for key, value in content.items() if key != "constraints"}
    assert any(proof.refuted for proof in prove(without))
    for change, words in (
        ({"max": -3.0}, "the centre of the set gives"),
        ({"coefficients": {"p": 1.0}}, "fewer than two parameters"),
        ({"coefficients": {"p": 1.0, "s": 1.0}}, "none of the scheduling parameters"),
        ({"max": 2.5}, "cuts nothing off the ranges"),
    ):
        wrong = copy.deepcopy(content)
        wrong["constraints"]["inequalities"][0] |= change
        with pytest.raises(ScheduleError, match=words):
            prove(wrong)


def test_the_runtime_flags_and_draws_in_what_leaves_the_set(content: dict) -> None:  # type: ignore[type-arg]
    schedule = GainSchedule.from_content(content)
    observer = LpvObserver(schedule, batch_shape=(3,))
    step = observer.step(np.zeros((3, 0)), np.zeros(3), [[0.1, 0.15], [0.5, 0.5], [-1.0, 0.9]])
    assert [bool(flag & Flag.PARAMETER_OUT_OF_RANGE) for flag in step.flags] == [False, True, False]
    centre = schedule.constraints.centre  # type: ignore[union-attr]
    share = (0.25 - centre.sum()) / (1.0 - centre.sum())  # by hand: along the line from the centre to (1/2, 1/2)
    drawn = schedule.constraints.drawn_in(np.array([[0.5, 0.5]]))  # type: ignore[union-attr]
    assert drawn[0] == pytest.approx(centre + share * (0.5 - centre))
    refusing = LpvObserver(schedule, outside="refuse")
    with pytest.raises(RangeError, match=r"p = 0.5, q = 0.5 breaks p \+ q <= 0.25"):
        refusing.step([], 0.0, [0.5, 0.5])
    with pytest.raises(RangeError, match=r"breaks p \+ q <= 0.25.*sample 1"):
        schedule.gain([[0.0, 0.0], [0.9, 0.9]])


def test_random_trajectories_stay_in_the_set_exactly() -> None:
    found = random_trajectories(rotor(below(0.4), below(1.2, p=1.0, q=-1.0)), 150, 12, 0.05, seed=1)
    worst = [fmpq(*float(a).as_integer_ratio()) + fmpq(*float(b).as_integer_ratio()) for a, b in found.reshape(-1, 2)]
    assert max(worst) <= fmpq(*(0.4).as_integer_ratio())
    assert (found[..., 0] - found[..., 1]).max() <= 1.2
    assert (found.sum(axis=-1) > 0.399).mean() > 0.02  # they do go to the border, and along it
    assert all(np.abs(b - a).max() <= 0.05 for a, b in pairwise(np.swapaxes(found, 0, 1)))


@pytest.mark.parametrize(
    ("constraints", "words"),
    [
        ([below(-2.5)], "the set is empty"),
        ([below(0.5), below(-0.5, p=-1.0, q=-1.0)], "no interior"),
        ([below(2.0)], "cuts nothing off the ranges"),
        ([below(0.5), below(0.9)], "cuts nothing off the ranges and the other constraints"),
        ([below(0.5, p=1.0, s=1.0)], "'s'"),
    ],
)
def test_sets_that_cannot_be_are_refused_before_anything_is_solved(
    constraints: list[ParameterConstraint], words: str
) -> None:
    with pytest.raises(ModelError, match=words):
        rotor(*constraints)


def test_one_parameter_alone_has_a_range() -> None:
    with pytest.raises(ModelError, match="write it as its range"):
        below(0.5, p=2.0)


FILE = """
name = "mixer"
source = "a test"
states = [{ name = "level", unit = "m" }]
outputs = [{ name = "seen", unit = "m" }]
[[parameters]]
name = "flow"
unit = "m/s"
min = 0.0
max = 2.0
rate = 1.0
[[parameters]]
name = "load"
unit = "kg"
min = 0.0
max = 4.0
rate = 1.0
[[constraints]]
formula = "FORMULA"
max = 3.0
unit = "m/s"
[constants]
slope = { value = 0.5, unit = "m/s/kg", source = "drawing" }
length = { value = 1.0, unit = "m", source = "drawing" }
mass = { value = 1.0, unit = "kg", source = "drawing" }
second = { value = 1.0, unit = "s", source = "drawing" }
[matrices]
A = [["-flow/length - load/mass/second"]]
C = [[1]]
"""


def test_model_files_state_constraints_with_their_units(tmp_path: Path) -> None:
    path = tmp_path / "mixer.toml"
    path.write_text(FILE.replace("FORMULA", "2*flow + slope*load - 0.5*flow"))
    model = load_model(path)
    assert model.constraints[0].words == "1.5 flow + 0.5 load <= 3 m/s"
    assert "slope" not in model.constants  # worked out
    save_model(model, tmp_path / "copy.toml")
    assert load_model(tmp_path / "copy.toml").constraints == model.constraints
    assert model.with_range("flow", 0.0, 0.5).constraints == ()
    for formula, words in (
        ("flow + load", r"constraints\[0\].*adds"),
        ("load*mass", "has the unit"),
        ("flow*load/mass + slope*load", "not linear in the parameters flow, load"),
        ("slope*load", "names load only"),
        ("0.1*flow + slope*load", "cuts nothing off"),
        ("flow + slop*load", "slope"),
    ):
        path.write_text(FILE.replace("FORMULA", formula))
        with pytest.raises((ModelError, SpecError), match=words) as caught:
            load_model(path)
        assert "mixer.toml:" in str(caught.value)
