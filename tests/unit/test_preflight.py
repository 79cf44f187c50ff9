"""What cannot work is refused before any solver runs: one line, with place and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from estimators.errors import GainsmithError
from studies.cli import main
from studies.preflight import check_before_design
from studies.spec import example_specs, load_spec, shipped_specs

TEMPLATES = Path(__file__).parents[2] / "studies" / "templates"
MODEL, SPEC = ((TEMPLATES / name).read_text() for name in ("model.toml", "observer.toml"))
RATE = 'unit_rate = { value = 1.0, unit = "1/s", source = "test" }\n[definitions]'


def check(folder: Path, model: str = MODEL, spec: str = SPEC) -> None:
    (folder / "my-plant.toml").write_text(model)
    (folder / "my-plant-observer.toml").write_text(spec)
    found, place = load_spec(folder / "my-plant-observer.toml")
    check_before_design(found, found.plant(place).model)


@pytest.mark.parametrize("name", [*example_specs(), *shipped_specs()])
def test_what_is_shipped_passes(name: str) -> None:
    found, place = load_spec(name)
    check_before_design(found, found.plant(place).model)


SPECS = {
    "unknown disturbance": ('["gust", "position', '["gst", "position', "unknown disturbance 'gst'; did you mean gust"),
    "unknown error": ('["velocity"]', '["velocty"]', "unknown state 'velocty'; did you mean velocity"),
    "weights": ("[1.0, 0.002]", "[1.0]", "1 weights for 2 disturbances"),
    "weight of zero": ("[1.0, 0.002]", "[1.0, 0.0]", "give positive sizes"),
    "twice": ('["gust", "position_noise"]', '["gust", "gust"]', "the disturbance 'gust' twice"),
    "singular": (
        '["gust", "position_noise"]\nerrors = ["velocity"]\nweights = [1.0, 0.002]', '["gust"]\nerrors = ["velocity"]',
        "no channel has noise on measured_position.*put measurement noise into a channel, or give fastest_pole",
    ),
    "no model": ('file = "my-plant.toml"', 'id = "corner-velocity-lateral"', "parameters is missing; add it, or name a model"),
    "two models": ('file = "my-plant.toml"', 'file = "my-plant.toml"\nid = "x"', "id stands beside file"),
    "no file": ('file = "my-plant.toml"', 'file = "plant.toml"', "plant.toml: cannot be read"),
    "no TOML name": ('file = "my-plant.toml"', 'file = "my-plant"', "is not a .toml file"),
    "is a specification": ('file = "my-plant.toml"', 'file = "my-plant-observer.toml"', "is a specification, not a model"),
}  # fmt: skip


@pytest.mark.parametrize("case", SPECS)
def test_specifications_are_refused(case: str, tmp_path: Path) -> None:
    old, new, words = SPECS[case]
    spec = SPEC.replace(old, new)
    assert spec != SPEC
    if case == "singular":
        spec = spec.replace('"sampled"', '"held"')
        check(tmp_path, spec=spec.replace("degree = 1", "degree = 1\nfastest_pole = 50.0"))  # then it is bounded
    with pytest.raises(GainsmithError, match=words) as caught:
        check(tmp_path, spec=spec)
    assert "\n" not in str(caught.value)


MODELS = {
    "undetectable": (
        [("C = [[1, 0]]", 'C = [[0, "1/unit_rate"]]'), ('"-stiffness/mass"', '"-stiffness*air_speed/(mass*top)"'),
         ("[definitions]", 'top = { value = 30.0, unit = "m/s", source = "test" }\n' + RATE)],
        r"not detectable: the mode at 0 1/s \(position\) at air_speed = 0 m/s does not decay.*measure it, or shrink the range",
    ),
    "idle disturbance": ([("F = [[0, 1]] ", "F = [[0, 0]] ")], "'position_noise' acts on no state and no output"),
    "too high a power": (
        [("still_damping + damping_slope*air_speed", "still_damping + damping_slope*air_speed*(air_speed/top)**16"),
         ("[definitions]", 'top = { value = 30.0, unit = "m/s", source = "test" }\n[definitions]')],
        "cannot be exported: .*at most 17 are read",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MODELS)
def test_models_are_refused(case: str, tmp_path: Path) -> None:
    changes, words = MODELS[case]
    text = MODEL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(GainsmithError, match=words) as caught:
        check(tmp_path, model=text)
    assert "\n" not in str(caught.value)


def test_the_command_refuses_without_solving(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 2, whatever a solver would say: none is called. A model file is no specification, and is told so."""
    monkeypatch.setattr("synthesis.lmi.solve.solve_with_clarabel", lambda *_: pytest.fail("a solver was called"))
    (tmp_path / "my-plant.toml").write_text(MODEL)
    (tmp_path / "o.toml").write_text(SPEC.replace('["gust", "position', '["gst", "position'))
    assert main(["schedules", str(tmp_path / "o.toml"), "--out", str(tmp_path)]) == 2
    assert main(["schedules", str(tmp_path / "my-plant.toml"), "--out", str(tmp_path)]) == 2
