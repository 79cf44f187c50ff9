"""Specifications of feedback laws: from the file to a proved schedule, and what is refused before any solver runs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from estimators import GainSchedule, LpvController
from estimators.errors import GainsmithError
from studies.cli import main
from studies.preflight import check_before_design
from studies.spec import load_spec

EXAMPLES = Path(__file__).parents[2] / "studies" / "examples"
MODEL, SPEC = ((EXAMPLES / f"quarter-car{end}.toml").read_text() for end in ("", "-feedback"))


def check(folder: Path, model: str = MODEL, spec: str = SPEC) -> None:
    (folder / "quarter-car.toml").write_text(model)
    (folder / "law.toml").write_text(spec)
    found, place = load_spec(folder / "law.toml")
    check_before_design(found, found.plant(place).model)


def test_the_shipped_law_is_designed_proved_checked_and_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A worse claim in the stored file is drift, a gain of the other sign is refuted."""
    arguments = ["schedules", "quarter-car-feedback", "--out", str(tmp_path)]
    assert main([*arguments, "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["good"] and [proof["proved"] for proof in row["proofs"]] == [True, True]
    gain = row["proofs"][1]["level"]
    assert row["lower_bounds"][0] <= gain < 1.1 * row["lower_bounds"][0]  # frozen parameters do little better
    path = tmp_path / "quarter-car-feedback.json"
    assert main(["certify", str(path)]) == 0
    assert "moves body_velocity by at most" in capsys.readouterr().out
    assert main([*arguments, "--check"]) == 0
    controller = LpvController(GainSchedule.load(path))
    assert (
        controller.step([-1.0, 0.0, 0.0, 0.0], 1500.0).command == 3000.0
    )  # limited: the strut pushes a body up that sank
    content = json.loads(path.read_text())
    content["gain"]["table"] = [[[-x for x in row] for row in table] for table in content["gain"]["table"]]
    for key in ("sha256", "section_sha256"):
        del content[key]
    from estimators.schedule import write_content

    write_content(path, content)
    assert main(["certify", str(path)]) == 1
    assert "refuted: the loop itself breaks it" in capsys.readouterr().out


PERFORMANCE = '["measured_body_acceleration", "suspension_deflection", "tire_deflection", "strut_force"]'
SPECS = {
    "unknown law": ('"state feedback"', '"state fedback"', "design.law"),
    "errors": ("performance = [", "errors = [", r"channels\[0\]: errors is not for the law 'state feedback'; give performance"),
    "both": ("weights = [0.5]", 'errors = ["body_velocity"]\nweights = [0.5]', "errors is not for the law"),
    "observer": ('law = "state feedback"\n', "", "performance is not for an observer; give errors"),
    "update": ("sample_time", 'update = "sampled"\nsample_time', "update is not for the law 'state feedback', which runs once"),
    "unknown signal": ('"strut_force"]', '"strut_fore"]', "unknown performance signal 'strut_fore'; did you mean strut_force"),
    "sizes": ("500.0] #", "500.0, 1.0] #", r"5 sizes for 4 performance signal\(s\)"),
    "size of zero": ("0.02, 500.0]", "0.0, 500.0]", "give positive numbers"),
    "half a limit": ("degree = 1", "degree = 1\ninput_limits = { strut_force = 1.0 }", "belong together"),
    "sizes of states": (
        "degree = 1", "degree = 1\ninput_limits = { strut_force = 1.0 }\nstate_sizes = { body_velocity = 1.0 }",
        r"the state\(s\) suspension_deflection, tire_deflection, wheel_velocity have no size",
    ),
    "limits": ("strut_force = [-3000.0", "strut = [-3000.0", "'strut' is no input of model 'quarter-car'; inputs: strut_force"),
    "reversed": ("[-3000.0, 3000.0]", "[3000.0, -3000.0]", "empty, reversed or not finite"),
    "damping": ("degree = 1", "degree = 1\ndamping = 1.5", "damping ratio between 0 and 1"),
    "norm": ("weights = [0.5]", 'weights = [0.5]\nnorm = "H3"', r"design\.channels\[0\]\.norm"),
    "feedthrough": (
        'disturbances = ["road_velocity"]|weights = [0.5]|"suspension_deflection"',
        'disturbances = ["acceleration_noise"]|norm = "generalised H2"|"measured_deflection"',
        r"'acceleration_noise' acts on 'measured_body_acceleration' at once \(F\), so its generalised H2 norm is infinite",
    ),
    "singular": (
        f"fastest_pole|{PERFORMANCE}|0.5, 0.1, 0.02, 500.0",
        '# fastest_pole|["suspension_deflection", "tire_deflection"]|0.1, 0.02',
        "no channel sees the input strut_force, so its gains have no bound; put it into the performance",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", SPECS)
def test_specifications_are_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synthesis.lmi.solve.solve_with_clarabel", lambda *_: pytest.fail("a solver was called"))
    before, after, words = SPECS[case]
    spec = SPEC
    for old, new in zip(before.split("|"), after.split("|"), strict=True):
        assert old in spec
        spec = spec.replace(old, new)
    with pytest.raises(GainsmithError, match=words) as caught:
        check(tmp_path, spec=spec)
    assert "\n" not in str(caught.value)


def test_an_observer_takes_no_key_of_a_law(tmp_path: Path) -> None:
    observer = (EXAMPLES / "quarter-car-observer.toml").read_text()
    for old, new, words in (
        ("degree = 1", "degree = 1\ndamping = 0.5", "design.damping is not for an observer"),
        ("weights", "sizes = [1.0]\nweights", r"channels\[0\]: sizes are not for an observer"),
        ("sample_time", "limits = { strut_force = [0.0, 1.0] }\nsample_time", "deploy.limits are not for an observer"),
    ):
        with pytest.raises(GainsmithError, match=words):
            check(tmp_path, spec=observer.replace(old, new, 1))


def test_a_model_with_a_mode_that_no_input_moves_is_refused(tmp_path: Path) -> None:
    """A tire without stiffness drifts at any damping, and nothing that the strut does moves the sum."""
    drifting = MODEL.replace('"-tire/wheel_mass"', "0").replace(
        'tire = { value = 190000.0, unit = "N/m", source = "MathWorks, Robust Control of Active Suspension, kt" }\n', ""
    )
    with pytest.raises(
        GainsmithError, match=r"not stabilisable: the mode at .* none of the input\(s\) strut_force; give it"
    ):
        check(tmp_path, model=drifting)
