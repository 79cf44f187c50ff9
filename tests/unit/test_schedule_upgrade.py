"""Files of format 1, pinned: they load as format 2 with the same gains and plant, or are refused in one line."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimators import GainSchedule, LpvVelocityObserver, ScheduleError
from estimators.schedule import FIRST_FORMAT, SCHEMA, read_content, sealed, upgraded, write_content
from estimators.schedule.check import SHAPES
from estimators.schedule.plant import plant_polynomial
from synthesis.certificate.content import subject_of

PINNED = Path(__file__).parent / "data" / "corner-estimation-lateral.format-1.json"
OLD: dict[str, Any] = json.loads(PINNED.read_text())
SPEEDS = np.concatenate([np.linspace(0.0, 140.0, 1001), [1e-9, 0.1, 139.999, 19.999999, 20.000001]])


def old() -> dict[str, Any]:
    """The pinned content, unsealed."""
    return {key: value for key, value in json.loads(json.dumps(OLD)).items() if "sha256" not in key}


def power_sum(stored: dict[str, Any], p: float) -> np.ndarray:
    """sum of coefficient times power in exact rationals, from the decimals of the file."""
    at = Fraction(p)
    total: Any = 0
    for (power,), matrix in zip(stored["monomials"], stored["coefficients"], strict=True):
        total = total + np.array([[Fraction(repr(float(x))) for x in row] for row in matrix]) * at**power
    return np.array(total).astype(float)


def test_the_pinned_file_is_one_of_format_1() -> None:
    assert OLD["schema"] == FIRST_FORMAT != SCHEMA
    assert "guarantee" in OLD
    assert "update" not in OLD


def test_it_loads_as_format_2_with_nothing_lost_and_nothing_believed(tmp_path: Path) -> None:
    content = read_content(PINNED)
    assert content["schema"] == SCHEMA
    assert content["update"] == {"kind": "held", "sample_time": 0.005}
    for key in ("name", "description", "scheduling", "provenance"):
        assert content[key] == OLD[key]
    assert content["gain"] == {key: OLD["gain"][key] for key in ("dtype", "interpolation", "table")}
    assert (
        content["model"]["source"] == f"format 1, constants and units not tied to the plant: {OLD['model']['source']}"
    )
    for key in ("id", "states", "inputs", "outputs", "disturbances", "constants"):
        assert content["model"][key] == OLD["model"][key]
    write_content(tmp_path / "new.json", content)
    assert read_content(tmp_path / "new.json") == sealed(content)
    assert GainSchedule.load(tmp_path / "new.json").sha256 == GainSchedule.load(PINNED).sha256
    assert GainSchedule.from_content(OLD).sha256 == GainSchedule.load(PINNED).sha256


def test_gains_and_plant_are_those_of_the_old_formulas() -> None:
    schedule = GainSchedule.load(PINNED)
    table = np.array(OLD["gain"]["table"])
    points = OLD["scheduling"][0]["breakpoints"]
    for row in (0, 1):
        expected = np.interp(SPEEDS, points, table[:, row, 0])
        np.testing.assert_allclose(schedule.gain(SPEEDS)[:, row, 0], expected, rtol=1e-13)
    for key in SHAPES:
        expected = np.array([power_sum(OLD["plant"][key], p) for p in SPEEDS])
        np.testing.assert_allclose(
            schedule.plant[key].at(SPEEDS), expected, rtol=1e-13, atol=1e-13 * np.abs(expected).max()
        )
    assert [signal.name for signal in schedule.states] == ["bristle_deflection", "relative_velocity"]
    step = LpvVelocityObserver(schedule).step(np.zeros(4), np.full(4, 0.1), np.full(4, 40.0))
    assert step.used.all()


def test_formulas_say_what_the_plant_is() -> None:
    """Rebuilt from the formulas by the verifier, which compares every coefficient; and told apart from what is tied."""
    content = read_content(PINNED)
    assert not subject_of(content, "old").tied
    content["model"]["matrices"]["A"][0][0] = "(-4.2373)*wheel_speed**1"
    with pytest.raises(ScheduleError, match=r"plant\.A: entry \[0\]\[0\] of order \[0\] is -296\.6"):
        subject_of(content, "old")


def test_claims_go_by_the_names_of_what_they_say() -> None:
    claims, before = read_content(PINNED)["claims"], OLD["certificate"]["claims"]
    names = {"decay": "decay rate", "sampled": "internal update", "drops": "drop probability"}
    assert [claim["kind"] for claim in claims] == [names.get(claim["kind"], claim["kind"]) for claim in before]
    assert [claim["level"] for claim in claims] == [claim["level"] for claim in before]
    assert [claim.get("channel") for claim in claims] == [
        {"inputs": {claim["name"].split()[1]: 1.0}, "errors": ["relative_velocity"]}
        if claim["kind"] == "gain"
        else None
        for claim in before
    ]
    for claim, stored in zip(claims, before, strict=True):
        P = plant_polynomial(claim["P"], 0.0, 140.0, (2, 2))
        expected = np.array([power_sum(stored["P"], p) for p in SPEEDS])
        scale = np.abs(expected).max(axis=0)  # of an entry: those of P differ by many decades
        np.testing.assert_allclose(P.at(SPEEDS) / scale, expected / scale, atol=1e-13)


def test_weights_of_inputs_are_kept() -> None:
    content = old()
    claim = next(claim for claim in content["certificate"]["claims"] if claim["kind"] == "gain")
    claim["disturbances"] = [[0.5, 0.0], [0.0, 0.0], [0.0, 0.2]]
    found = next(claim for claim in upgraded(content, "old")["claims"] if claim["kind"] == "gain")
    assert found["channel"]["inputs"] == {"friction": 0.5, "force_noise": 0.2}


def test_a_range_far_from_zero_and_high_powers_are_converted_exactly() -> None:
    """(p - 635)^2 in powers of p on [634.65, 635.65]: evaluated in powers it keeps ten digits less."""
    content = old()
    content["scheduling"][0] |= {"min": 634.65, "max": 635.65, "breakpoints": [634.65, 635.0, 635.65]}
    content["gain"]["table"] = content["gain"]["table"][:3]
    matrices = [[[1.0, 0.0], [0.0, 1.0]], [[403225.0, 1.0], [0.0, 0.0]], [[-1270.0, 0.0], [0.0, 0.0]]]
    powers = {"monomials": [[2], [0], [1]], "coefficients": matrices}
    content["plant"]["A"] = powers
    content["certificate"] = {}
    schedule = GainSchedule.from_content(content)
    at = np.linspace(634.65, 635.65, 201)
    found = schedule.plant["A"].at(at)
    np.testing.assert_allclose(found[:, 0, 0], (at - 635.0) ** 2, atol=1e-12)
    np.testing.assert_allclose(found, [power_sum(powers, p) for p in at], rtol=1e-12, atol=1e-12)
    assert len(schedule.plant["A"].coefficients) == 3
    subject_of(upgraded(content, "old"), "old")


def test_an_edited_file_is_refused_and_so_is_edited_content(tmp_path: Path) -> None:
    file = tmp_path / "old.json"
    file.write_text(PINNED.read_text().replace("-4.2372", "-4.2373"))
    with pytest.raises(ScheduleError, match=r"old\.json: plant: this section does not match its sha256"):
        GainSchedule.load(file)
    content = json.loads(PINNED.read_text())
    content["gain"]["table"][0][0][0] = 1.2
    with pytest.raises(ScheduleError, match="here: gain: this section does not match its sha256"):
        GainSchedule.from_content(content, "here")


CLAIM = ("certificate", "claims", 2)
REMOVED = object()
ENTRY = (*CLAIM, "P", "coefficients", 0, 0, 0)
MALFORMED: list[tuple[tuple[Any, ...], Any, str]] = [
    (
        (*CLAIM, "P", "coefficients"),
        [[[1.0]], [[1.0]]],
        "certificate.claims[2].P.coefficients[0]: has 1 entries, expected 2",
    ),
    (
        (*CLAIM, "P", "coefficients", 1),
        [[1.0, 0.0]],
        "certificate.claims[2].P.coefficients[1]: has 1 entries, expected 2",
    ),
    ((*CLAIM, "P", "coefficients"), [], "certificate.claims[2].P.coefficients: has 0 entries, expected 2"),
    ((*CLAIM, "P"), {"monomials": [], "coefficients": []}, "certificate.claims[2].P.monomials: needs at least one"),
    ((*CLAIM, "P"), {}, "certificate.claims[2].P.monomials: missing"),
    ((*CLAIM, "P"), [], "certificate.claims[2].P: expected an object, got a list"),
    ((*CLAIM, "P"), REMOVED, "certificate.claims[2].P: missing"),
    (ENTRY, "nan", "certificate.claims[2].P.coefficients[0][0][0]: expected a number, got 'nan'"),
    (ENTRY, True, "certificate.claims[2].P.coefficients[0][0][0]: expected a number"),
    (ENTRY, 1e101, "certificate.claims[2].P.coefficients[0][0][0]: 1e+101 is beyond"),
    (
        (*CLAIM, "P", "monomials", 1),
        [1.0],
        "certificate.claims[2].P.monomials[1]: powers are integers from 0 to 16, got 1.0",
    ),
    (
        (*CLAIM, "P", "monomials", 1),
        [-1],
        "certificate.claims[2].P.monomials[1]: powers are integers from 0 to 16, got -1",
    ),
    (
        (*CLAIM, "P", "monomials", 1),
        [20_000],
        "certificate.claims[2].P.monomials[1]: powers are integers from 0 to 16, got",
    ),
    ((*CLAIM, "P", "monomials", 1), [0], "certificate.claims[2].P.monomials[1]: the power 0 appears twice"),
    ((*CLAIM, "P", "monomials", 1), [1, 0], "certificate.claims[2].P.monomials[1]: has 2 entries, expected 1"),
    ((*CLAIM, "P", "monomials", 1), ["x" * 140_000], "certificate.claims[2].P.monomials[1]: powers are integers"),
    ((*CLAIM, "disturbances"), [[1.0], [0.0]], "certificate.claims[2].disturbances: has 2 entries, expected 3"),
    ((*CLAIM, "disturbances"), [[1.0], [1.0], [0.0]], "certificate.claims[2].disturbances: mixes signals in one"),
    ((*CLAIM, "disturbances"), [[0.0], [0.0], [0.0]], "certificate.claims[2].disturbances: mixes signals in one"),
    (
        (*CLAIM, "disturbances"),
        [[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]],
        "certificate.claims[2].disturbances: names one signal",
    ),
    (
        (*CLAIM, "disturbances"),
        [["nan"], [0.0], [0.0]],
        "certificate.claims[2].disturbances: expected a number, got 'nan'",
    ),
    ((*CLAIM, "disturbances"), [[-1.0], [0.0], [0.0]], "claims[2].channel.inputs.friction: -1.0 must be positive"),
    ((*CLAIM, "disturbances"), [], "certificate.claims[2].disturbances: has 0 entries, expected 3"),
    ((*CLAIM, "disturbances"), [[], [], []], "claims[2].channel: needs at least one input and one error"),
    ((*CLAIM, "disturbances"), [[1.0], [0.0, 0.0], [0.0]], "not a whole file of format 1 (ValueError"),
    ((*CLAIM, "disturbances"), "friction", "certificate.claims[2].disturbances: expected a list, got 'friction'"),
    ((*CLAIM, "disturbances"), REMOVED, "certificate.claims[2].disturbances: missing"),
    ((*CLAIM, "errors"), [[0.0, 2.0]], "certificate.claims[2].errors: weighs its errors"),
    ((*CLAIM, "errors"), [[0.0]], "certificate.claims[2].errors: has 1 entries, expected 2"),
    ((*CLAIM, "errors"), [], "claims[2].channel: needs at least one input and one error"),
    ((*CLAIM, "errors"), REMOVED, "certificate.claims[2].errors: missing"),
    ((*CLAIM, "kind"), "wish", "certificate.claims[2].kind: 'wish' is not known; expected decay, fastest pole, gain"),
    ((*CLAIM, "kind"), [[]], "certificate.claims[2].kind: a list is not known"),
    ((*CLAIM, "kind"), REMOVED, "certificate.claims[2].kind: missing"),
    ((*CLAIM, "level"), "high", "claims[2].level: expected a number, got 'high'"),
    ((*CLAIM, "level"), REMOVED, "certificate.claims[2].level: missing"),
    (CLAIM, None, "certificate.claims[2]: expected an object, got None"),
    (("certificate", "claims"), [{}] * 257, "certificate.claims: has 257 entries; at most 256 are read"),
    (("certificate", "claims"), {"a": 1}, "certificate.claims: expected a list, got an object"),
    (("certificate",), [], "certificate: expected an object, got a list"),
    (("certificate",), REMOVED, "certificate: missing"),
    (("guarantee",), REMOVED, "guarantee: missing"),
    (("surplus",), 1, "surplus: unknown key"),
    (("plant", "A", "monomials"), [], "plant.A.monomials: needs at least one"),
    (("plant", "A", "monomials", 1), [0.5], "plant.A.monomials[1]: powers are integers from 0 to 16, got 0.5"),
    (("plant", "A", "monomials", 1), [-1], "plant.A.monomials[1]: powers are integers from 0 to 16, got -1"),
    (("plant", "A", "monomials", 1), [20_000], "plant.A.monomials[1]: powers are integers from 0 to 16, got 20000"),
    (("plant", "A", "monomials", 1), [True], "plant.A.monomials[1]: powers are integers from 0 to 16, got True"),
    (("plant", "A", "monomials"), [[k] for k in range(18)], "plant.A.monomials: has 18 entries; at most 17 are read"),
    (("plant", "A", "coefficients", 0), [[1.0, 0.0]], "plant.A.coefficients[0]: has 1 entries, expected 2"),
    (
        ("plant", "A", "coefficients", 0, 0, 0),
        2**53 + 1,
        "plant.A.coefficients[0][0][0]: 9007199254740993 is not a finite",
    ),
    (("plant", "A", "coefficients", 0, 0, 0), None, "plant.A.coefficients[0][0][0]: expected a number, got None"),
    (("plant", "F"), REMOVED, "plant.F: missing"),
    (("plant", "G"), {}, "plant.G: unknown key"),
    (("plant", "abs"), [], "plant.abs: does not agree with scheduling[0].absolute"),
    (("plant", "abs"), REMOVED, "plant.abs: missing"),
    (("plant",), None, "plant: expected an object, got None"),
    (
        ("model", "states"),
        [{"name": f"s{k}", "unit": "m"} for k in range(1000)],
        "model.states: has 1000 entries; at most 32",
    ),
    (("model", "states", 0, "name"), "a b", "model.states[0].name: 'a b' is not a name"),
    (("model", "states", 0), {"name": "z"}, "model.states[0].unit: missing"),
    (("model", "source"), ["x"], "model.source: expected a non-empty text, got a list"),
    (("model", "source"), "\x1b[31m", "model.source: '?[31m' holds control characters"),
    (("model", "constants", "sigma0", "value"), "nan", "model.constants.sigma0.value: expected a number, got 'nan'"),
    (("model", "constants", "sigma0", "source"), 3, "model.constants.sigma0.source: expected a text, got 3"),
    (("model", "constants", "sigma0", "unit"), REMOVED, "model.constants.sigma0.unit: missing"),
    (("model", "constants", "a b"), {"value": 1.0, "unit": "1"}, "model.constants: 'a b' is not a name"),
    (("model", "constants"), [], "model.constants: expected an object, got a list"),
    (("model",), REMOVED, "model: missing"),
    (("scheduling",), [], "scheduling: has 0 entries, expected 1"),
    (("scheduling", 0, "name"), "wheel speed", "scheduling[0].name: 'wheel speed' is not a name"),
    (("scheduling", 0, "min"), "0", "scheduling[0].min: expected a number, got '0'"),
    (("scheduling", 0, "min"), 140.0, "scheduling[0].max: range [140.0, 140.0] is empty or reversed"),
    (("scheduling", 0, "max"), REMOVED, "scheduling[0].max: missing"),
    (("scheduling", 0, "rate_max"), REMOVED, "scheduling[0].rate_max: missing"),
    (("scheduling", 0, "breakpoints"), [0.0, 50.0], "scheduling[0].breakpoints: must start at min"),
    (("sample_time",), "fast", "update.sample_time: expected a number, got 'fast'"),
    (("sample_time",), -0.005, "update.sample_time: -0.005 s must be positive"),
    (("sample_time",), REMOVED, "sample_time: missing"),
    (("gain", "table", 0), [[1.0]], "gain.table[0]: has 1 entries, expected 2"),
    (("gain", "unit"), REMOVED, "gain.unit: missing"),
    (("gain",), {}, "gain.unit: missing"),
    (("provenance",), [[]], "provenance: expected an object, got a list"),
]


@pytest.mark.parametrize(("path", "value", "message"), MALFORMED, ids=[entry[2][:60] for entry in MALFORMED])
def test_malformed_content_is_refused_in_one_line(
    path: tuple[Any, ...], value: Any, message: str, tmp_path: Path
) -> None:
    content = old()
    place: Any = content
    for key in path[:-1]:
        place = place[key]
    if value is REMOVED:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    file = tmp_path / "old.json"
    file.write_text(json.dumps(sealed(content)))
    for attempt in (
        lambda: upgraded(content, "old.json"),
        lambda: GainSchedule.from_content(content, "old.json"),
        lambda: read_content(file),
    ):
        with pytest.raises(ScheduleError) as caught:
            attempt()
        words = str(caught.value).replace(str(file), "old.json")
        assert words.startswith(f"old.json: {message}")
        assert words.isprintable()
        assert len(words) <= 300


def test_many_claims_with_large_matrices_are_refused_before_they_are_converted() -> None:
    """Exact conversion takes its time: a file that no first version could have written is not given any."""
    content = old()
    content["model"]["states"] = [{"name": f"s{k}", "unit": "m"} for k in range(32)]
    eye = [[float(i == j) for j in range(32)] for i in range(32)]
    shapes = {"A": (32, 32), "B": (32, 1), "C": (1, 32), "E": (32, 3)}
    for key, (rows, columns) in shapes.items():
        content["plant"][key] = {"monomials": [[0]], "coefficients": [[[0.1] * columns] * rows]}
    P = {"monomials": [[k] for k in range(17)], "coefficients": [eye] * 17}
    content["certificate"] = {"claims": [{"kind": "decay", "level": 1.0, "P": P}] * 256}
    with pytest.raises(
        ScheduleError, match=r"^old: certificate\.claims\[0\]\.P: plant and claims hold more than 5000 numbers"
    ):
        upgraded(content, "old")


def test_nesting_is_refused() -> None:
    content = old()
    deep: Any = 1.0
    for _ in range(100_000):
        deep = [deep]
    content["certificate"]["claims"][0]["P"] = deep
    with pytest.raises(ScheduleError, match=r"^old: certificate: lists and objects are nested too deeply"):
        upgraded(content, "old")
