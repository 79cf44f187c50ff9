"""Specifications of output feedback: what is refused before any solver runs, and PI gains from the file to the proof."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from estimators.errors import GainsmithError
from studies.law_spec import form_of
from studies.preflight import check_before_design
from studies.spec import load_spec
from synthesis.certificate.proof import prove
from synthesis.design.deploy import deploy
from synthesis.design.export import schedule_content
from synthesis.design.output_feedback import OutputFeedbackDesign
from synthesis.design.static_feedback import StaticFeedback

EXAMPLES = Path(__file__).parents[2] / "studies" / "examples"
LAW, PI = "quarter-car-output-feedback", "pmsm-pi-feedback"


def check(folder: Path, name: str, old: str = "", new: str = "") -> None:
    """A shipped specification with one change, as far as the design."""
    text = (EXAMPLES / f"{name}.toml").read_text()
    assert old in text
    for model in EXAMPLES.glob("*.toml"):
        (folder / model.name).write_text(model.read_text())
    (folder / "law.toml").write_text(text.replace(old, new, 1) if old else text)
    found, place = load_spec(folder / "law.toml")
    check_before_design(found, found.plant(place).model)


def test_the_shipped_law_is_of_full_order(tmp_path: Path) -> None:
    check(tmp_path, LAW)
    spec, folder = load_spec(LAW)
    design = spec.feedback_design()
    assert isinstance(design, OutputFeedbackDesign) and form_of(spec.plant(folder).model, design) == ("outputs", 4)


def test_pi_gains_from_the_file_to_the_proof() -> None:
    """Steps lower the level of the start many times; the stored table is proved from itself, and mirrored it is refuted."""
    spec, folder = load_spec(PI)
    model = spec.plant(folder).model
    check_before_design(spec, model)
    gains = spec.design(model)
    assert isinstance(gains, StaticFeedback)
    K = gains.gain(np.array([-471.0, 471.0]))
    assert not K[:, 0, 3].any() and not K[:, 1, 2].any()  # each axis has its own integral
    assert (
        np.sign(K[0, 0, 1]) == -np.sign(K[1, 0, 1]) == 1.0
    )  # the other axis is cancelled, whichever way the shaft turns
    content = schedule_content(deploy(gains, spec.deploy_settings()), spec.name)
    proofs = prove(content)
    assert [proof.proved for proof in proofs] == [True, True]
    assert content["update"]["order"] == 0 and content["update"]["measured"] == "outputs"
    assert proofs[1].level < 0.3
    turned = copy.deepcopy(content)
    turned["gain"]["table"] = (-np.array(content["gain"]["table"])).tolist()
    assert not any(proof.proved for proof in prove(turned))


CASES = {
    "damping": (LAW, "degree = 1", "degree = 1\ndamping = 0.5", "design.damping is not for the law 'output feedback'"),
    "start": (LAW, "degree = 1", "degree = 1\nstart = [[1.0]]", 'name another law: law = "static output feedback"'),
    "measured": (LAW, "degree = 1", 'degree = 1\nmeasured = ["measured_deflecton"]', "did you mean measured_deflection"),
    "errors": (LAW, "performance = [", "errors = [", "errors is not for the law 'output feedback'; give performance"),
    "norm": (
        LAW, "weights = [", 'norm = "generalised H2"\nweights = [', "acts on 'measured_body_acceleration' at once",
    ),
    "noise": (
        LAW, 'fastest_pole = 400.0 # 1/s, imaginary parts counted\n\n[[design.channels]]\ndisturbances = ["road_velocity", '
        '"deflection_noise", "acceleration_noise"]\nweights = [0.5, 0.001, 0.1]',
        '[[design.channels]]\ndisturbances = ["road_velocity"]\nweights = [0.5]', "no channel has noise on measured_deflection",
    ),
    "feedthrough": (PI, "degree = 1", "degree = 1\nfeedthrough = false", "design.feedthrough is not for the law 'static"),
    "pairs": (PI, '["d_voltage", "d_error"]', '["d_voltage"]', "uses"),
    "observer": (PI, 'law = "static output feedback"\n', "", "is not for an observer"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_keys_and_names_that_do_not_fit_are_refused(tmp_path: Path, case: str) -> None:
    name, old, new, words = CASES[case]
    with pytest.raises(GainsmithError, match=words):
        check(tmp_path, name, old, new)
