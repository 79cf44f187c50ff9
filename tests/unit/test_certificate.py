"""Certificates: the shipped schedules prove, and every way of spoiling one is refused with the place named."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimators.schedule import read_content, sealed, write_content
from studies.certification import Certification, certify
from studies.spec import shipped_specs
from tests.support.stored_loop import closed_loop, picked, polynomial, update, values

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "estimators" / "schedules"
DATA = Path(__file__).parent / "data"
NAMES = sorted(shipped_specs())
FILES = {name: FOLDER / f"{name}.json" for name in NAMES}
FILES |= {name: DATA / f"{name}.json" for name in ("sampled-longitudinal", "heated-spring")}
OMEGA = (0.0, 1.0, 10.0, 100.0, 1000.0)


def content(name: str) -> dict[str, Any]:
    return copy.deepcopy(read_content(FILES[name]))


def claims(data: dict[str, Any], *kinds: str) -> list[dict[str, Any]]:
    return [claim for claim in data["claims"] if claim["kind"] in kinds]


def certified(data: dict[str, Any], tmp_path: Path) -> Certification:
    path = tmp_path / "spoiled.json"
    write_content(path, data)
    return certify(path)


def refusal(data: dict[str, Any], tmp_path: Path) -> str:
    result = certified(data, tmp_path)
    assert not result.certified
    return result.message


@pytest.mark.parametrize("name", FILES)
def test_stored_schedules_are_proved(name: str) -> None:
    result = certify(FILES[name])
    assert result.certified, result.message
    sampled = content(name)["update"]["kind"] == "sampled"
    wanted = {"sampled error"} if sampled else {"decay rate", "fastest pole", "internal update", "motion gain"}
    assert {p.kind for p in result.proofs} >= wanted | {"sampled gain", "drop probability"}


@pytest.mark.parametrize("name", FILES)
def test_claims_of_the_error_equation_hold_by_an_independent_road(name: str) -> None:
    """Dense sampling with numpy: frozen poles and frozen L2 gains stay inside what is claimed."""
    data = content(name)
    for value in values(data, 97):
        A_e, B_e = closed_loop(data, value)
        poles = np.linalg.eigvals(A_e)
        for claim in claims(data, "decay rate"):
            assert poles.real.max() < -claim["level"]
        for claim in claims(data, "fastest pole"):
            assert poles.real.min() > -claim["level"]
        for claim in claims(data, "gain"):
            W, Z = picked(data, claim)
            for omega in OMEGA:
                response = Z @ np.linalg.solve(1j * omega * np.eye(len(A_e)) - A_e, B_e @ W)
                assert np.linalg.norm(response, 2) <= claim["level"]


@pytest.mark.parametrize("name", FILES)
def test_gains_of_the_update_hold_at_every_frequency(name: str) -> None:
    """Frequency response of the exact discrete system: disturbances held over a sample, and the plant's own motion."""
    data = content(name)
    gains = claims(data, "sampled gain", "motion gain")
    assert len(gains) >= 2
    for value in values(data, 41):
        loop = update(data, value)
        for angle in (0.0, *np.geomspace(1e-4, np.pi, 24)):
            resolvent = np.exp(1j * angle) * np.eye(len(loop["A"])) - loop["A"]
            for claim in gains:
                W, Z = picked(data, claim)
                B = loop["motion" if claim["kind"] == "motion gain" else "B"]
                assert np.linalg.norm(Z @ np.linalg.solve(resolvent, B @ W), 2) <= claim["level"]


@pytest.mark.parametrize("name", FILES)
def test_a_claimed_gain_is_not_far_from_what_is_reached(name: str) -> None:
    """Negative control of the test above: half of the friction gain would be exceeded at rest already."""
    data = content(name)
    claim = claims(data, "sampled gain")[0]
    W, Z = picked(data, claim)
    responses = []
    for value in values(data, 41):
        loop = update(data, value)
        for angle in (0.0, *np.geomspace(1e-3, np.pi, 24)):
            resolvent = np.exp(1j * angle) * np.eye(len(loop["A"])) - loop["A"]
            responses.append(np.linalg.norm(Z @ np.linalg.solve(resolvent, loop["B"] @ W), 2))
    assert 0.5 * claim["level"] < max(responses) <= claim["level"]


@pytest.mark.parametrize("name", FILES)
def test_update_contracts_along_random_drives(name: str) -> None:
    """The parameter moves within its rate: V = e'P(p)e falls in every sample as fast as the certificate says."""
    data = content(name)
    (claim,) = claims(data, "internal update", "sampled error")
    entry, period = data["scheduling"][0], data["update"]["sample_time"]
    factor = np.exp(-2 * claim["level"] * period)
    rng = np.random.default_rng(7)
    for _ in range(5):
        value, error = rng.uniform(entry["min"], entry["max"]), rng.normal(size=2) * [1e-3, 1.0]
        energy = error @ polynomial(data, claim["P"], value) @ error
        for _ in range(60):
            error = update(data, value)["A"] @ error
            step = rng.choice([entry["rate_min"], entry["rate_max"]]) * period
            value = float(np.clip(value + step, entry["min"], entry["max"]))
            after = error @ polynomial(data, claim["P"], value) @ error
            assert after <= factor * energy * (1 + 1e-9)
            energy = after


@pytest.mark.parametrize("name", FILES)
def test_drop_claim_agrees_with_the_second_moment(name: str) -> None:
    """Frozen parameters are admissible: the second-moment radius at the proved drop probability is below one."""
    data = content(name)
    (claim,) = claims(data, "drop probability")
    q = claim["level"]
    for value in values(data, 29):
        loop = update(data, value)
        used, lost = loop["A"], loop["coasting"]
        for share in (q, 0.5 * q):
            operator = (1 - share) * np.kron(used, used) + share * np.kron(lost, lost)
            assert np.abs(np.linalg.eigvals(operator)).max() < 1.0


@pytest.mark.parametrize("name", FILES)
def test_second_moment_falls_along_random_drives_with_drops(name: str) -> None:
    """E[e'P e] of independently lost measurements, from random starts and along random motions of the parameter."""
    data = content(name)
    (claim,) = claims(data, "drop probability")
    q, entry, rng = claim["level"], data["scheduling"][0], np.random.default_rng(11)
    for _ in range(4):
        value = rng.uniform(entry["min"], entry["max"])
        start = rng.normal(size=(2, 2)) * [[1e-3], [1.0]]
        moment = start @ start.T
        energy = np.trace(polynomial(data, claim["P"], value) @ moment)
        for _ in range(60):
            loop = update(data, value)
            moment = (1 - q) * loop["A"] @ moment @ loop["A"].T + q * loop["coasting"] @ moment @ loop["coasting"].T
            step = rng.uniform(entry["rate_min"], entry["rate_max"]) * data["update"]["sample_time"]
            value = float(np.clip(value + step, entry["min"], entry["max"]))
            after = np.trace(polynomial(data, claim["P"], value) @ moment)
            assert after <= energy * (1 + 1e-9)
            energy = after


def test_unstable_only_between_two_breakpoints_is_refuted(tmp_path: Path) -> None:
    """At 60 rad/s the spoiled entry is harmless, and so is every other breakpoint; between 40 and 60 the loop is unstable."""
    data = content("corner-estimation-lateral")
    points = data["scheduling"][0]["breakpoints"]
    data["gain"]["table"][points.index(60.0)][0][0] = -100.0
    assert all(np.linalg.eigvals(closed_loop(data, w)[0]).real.max() < 0 for w in points)
    assert np.linalg.eigvals(closed_loop(data, 50.0)[0]).real.max() > 0
    message = refusal(data, tmp_path)
    assert message.startswith("refuted: the loop itself breaks it: 'error equation: decay rate' at 8 1/s")
    speed = float(message.split("wheel_speed = ")[1].split()[0])
    assert 40.0 < speed <= 60.0
    assert np.linalg.eigvals(closed_loop(data, speed)[0]).real.max() > -8.0


def test_flipped_sign_is_refuted(tmp_path: Path) -> None:
    data = content("corner-estimation-longitudinal")
    data["gain"]["table"][3][1][0] *= -1.0
    message = refusal(data, tmp_path)
    assert message.startswith("refuted: the loop itself breaks it")
    speed = float(message.split("wheel_speed = ")[1].split()[0])
    assert 40.0 <= speed <= 80.0
    assert np.linalg.eigvals(closed_loop(data, speed)[0]).real.max() > -80.0


def test_widened_range_is_refused(tmp_path: Path) -> None:
    data = content("corner-estimation-lateral")
    data["scheduling"][0]["max"] = 400.0
    data["scheduling"][0]["breakpoints"][-1] = 400.0
    assert "plant.A: entry [0][0] of order [0]" in refusal(
        data, tmp_path
    )  # u is another one now: so is the stored plant
    loop = {key: [[0], [1]] for key in "AC"}
    slope = 12.84 * 0.33
    data["plant"]["A"] = {
        "orders": loop["A"],
        "coefficients": [[[-slope * 200, 1], [0, 0]], [[-slope * 200, 0], [0, 0]]],
    }
    data["plant"]["C"]["coefficients"] = [[[181.5 - 0.81 * slope * 200, 0.811]], [[-0.81 * slope * 200, 0.0]]]
    message = refusal(data, tmp_path)
    assert message.startswith("not proved") or message.startswith("refuted")
    assert 120.0 <= float(message.split("wheel_speed = ")[1].split()[0]) <= 400.0


def test_wider_rate_than_proved_is_refused(tmp_path: Path) -> None:
    data = content("corner-estimation-lateral")
    data["scheduling"][0]["rate_max"] = 1e6
    message = refusal(data, tmp_path)
    assert message.startswith("not proved")
    assert "wheel_speed = " in message


def test_edited_byte_names_the_section(tmp_path: Path) -> None:
    text = (FOLDER / "longitudinal-speed.json").read_text()
    gains = content("longitudinal-speed")["gain"]["table"]
    digit = repr(gains[2][1][0])
    edited = text.replace(digit, digit[:4] + str((int(digit[4]) + 1) % 10) + digit[5:])
    assert edited != text
    path = tmp_path / "edited.json"
    path.write_text(edited)
    result = certify(path)
    assert not result.certified
    assert result.refusal.startswith("gain: ")
    assert "edited" in result.message


@pytest.mark.parametrize(
    ("name", "kind", "level"),
    [
        ("corner-estimation-longitudinal", "decay rate", 120.0),
        ("corner-estimation-longitudinal", "fastest pole", 400.0),
        ("corner-estimation-longitudinal", "gain", 0.9),
        ("corner-estimation-longitudinal", "internal update", 120.0),
        ("corner-estimation-longitudinal", "sampled gain", 0.9),
        ("corner-estimation-longitudinal", "motion gain", 0.1),
        ("corner-estimation-longitudinal", "drop probability", 0.9),
        ("sampled-longitudinal", "sampled error", 80.0),
        ("sampled-longitudinal", "sampled gain", 0.9),
        ("sampled-longitudinal", "drop probability", 0.9),
    ],
)
def test_overstated_levels_are_refuted_where_the_loop_breaks_them(
    tmp_path: Path, name: str, kind: str, level: float
) -> None:
    data = content(name)
    claims(data, kind)[0]["level"] = level
    result = certified(data, tmp_path)
    (failed,) = [proof for proof in result.proofs if not proof.proved]
    assert (failed.kind, failed.level, failed.refuted) == (kind, level, True)
    assert f"at {level:g} {failed.unit} fails at wheel_speed = " in result.message


def test_one_claim_about_the_update_is_needed(tmp_path: Path) -> None:
    for name, kind in (
        ("corner-estimation-longitudinal", "internal update"),
        ("sampled-longitudinal", "sampled error"),
    ):
        data = content(name)
        data["claims"].remove(claims(data, kind)[0])
        assert f"claims: none about the update that the runtime performs ('{kind}')" in refusal(data, tmp_path)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("corner-estimation-lateral", "sampled error"),
        *(("sampled-longitudinal", k) for k in ("internal update", "decay rate")),
    ],
)
def test_kinds_belong_to_an_update(tmp_path: Path, name: str, kind: str) -> None:
    """The held update has no error of its own, the sampled one no error equation between samples."""
    data = content(name)
    data["claims"].append(copy.deepcopy(claims(data, "internal update", "sampled error")[0]) | {"kind": kind})
    assert f"'{kind}' says nothing about the update" in refusal(data, tmp_path)
    data["claims"][-1]["kind"] = "stability"
    assert "'stability' is no kind of claim" in refusal(data, tmp_path)


def test_probability_of_one_is_no_claim(tmp_path: Path) -> None:
    data = content("corner-estimation-longitudinal")
    for level in (1.0, 1.5):
        claims(data, "drop probability")[0]["level"] = level
        assert "a probability lies below 1" in refusal(data, tmp_path)


def test_unsymmetric_lyapunov_matrix_is_refused(tmp_path: Path) -> None:
    """P = -A_e^-1 gives P A_e + (P A_e)' = -2 I for every invertible A_e; only its lack of symmetry gives it away."""
    data = content("corner-estimation-longitudinal")
    for gain in data["gain"]["table"]:
        gain[0][0], gain[1][0] = -1.0, 10.0
    matrix = -np.linalg.inv(closed_loop(data, 0.0)[0])
    for claim in data["claims"]:
        claim["P"] = {"orders": [[0]], "coefficients": [matrix.tolist()]}
    assert "not symmetric" in refusal(data, tmp_path)


def test_an_empty_lyapunov_matrix_proves_nothing(tmp_path: Path) -> None:
    """Every inequality of P = 0 reads 0 > 0; written without any coefficient it must not be taken for nothing to check."""
    for empty in ({"orders": [], "coefficients": []}, {"orders": [[1]], "coefficients": [[[0.0, 0.0], [0.0, 0.0]]]}):
        data = content("corner-estimation-longitudinal")
        claims(data, "decay rate")[0] |= {"level": 1e6, "P": empty}
        claims(data, "internal update")[0] |= {"P": empty}
        result = certified(data, tmp_path)
        assert {proof.kind for proof in result.proofs if not proof.proved} == {"decay rate", "internal update"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"errors": []}, "needs at least one input and one error"),
        ({"inputs": {}}, "needs at least one input and one error"),
        ({"errors": ["friction"]}, "'friction' is none of bristle_deflection, relative_velocity"),
        (
            {"inputs": {"relative_velocity": 1.0}},
            "'relative_velocity' is none of friction, acceleration_error, force_noise",
        ),
        ({"inputs": {"friction": 0.0}}, "must be positive"),
    ],
)
def test_gain_claim_must_be_about_something(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    data = content("corner-estimation-longitudinal")
    claims(data, "gain")[0]["channel"] |= change
    path = tmp_path / "spoiled.json"
    write_unchecked(path, data)
    assert words in certify(path).refusal


def test_only_what_is_proved_is_said(tmp_path: Path) -> None:
    """Nothing else in a file can speak of levels: there is no place for it."""
    for key in ("guarantee", "certificate"):
        data = content("corner-estimation-longitudinal")
        data[key] = {"decay_rate": 1e6}
        path = tmp_path / "spoiled.json"
        write_unchecked(path, data)
        assert certify(path).refusal.startswith(f"{key}: unknown key")


def test_names_follow_what_is_proved() -> None:
    """Another error in a channel is another name; sizes that are not one stand in it."""
    said = {proof.claim: proof.unit for proof in certify(FILES["heated-spring"]).proofs}
    assert said["error equation: gain 0.5 N push + 0.002 m noise -> speed"] == "m/s"
    assert said["error equation: gain 0.01 m noise + 0.2 m/s^2 shake -> position + speed"].startswith("mixed")
    assert said["update: gain of motion position' -> position"] == "s"
    assert said["update: decay while the plant stands still"] == "1/s"
    sampled = {proof.claim: proof.unit for proof in certify(FILES["sampled-longitudinal"]).proofs}
    assert sampled["update: decay"] == "1/s"
    assert sampled["update: gain force_noise -> relative_velocity"] == "m/s"


def test_float32_table_is_stored_as_such() -> None:
    data = content("longitudinal-speed")
    table = np.array(data["gain"]["table"])
    assert data["gain"]["dtype"] == "float32"
    assert (table.astype(np.float32).astype(np.float64) == table).all()


def test_certify_loads_no_solver() -> None:
    code = (
        "import sys; from studies.cli import main; code = main(['certify', *sys.argv[1:]]);"
        "bad = {'clarabel', 'cvxpy', 'scipy.linalg', 'scipy.sparse', 'sympy', 'matplotlib'} & set(sys.modules);"
        "print(sorted(bad)); sys.exit(code)"  # pint imports scipy itself to see whether it is there
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, FILES.values())], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.strip().splitlines()[-1] == "[]"


def test_json_numbers_are_not_evaluated(tmp_path: Path) -> None:
    data = content("longitudinal-speed")
    path = tmp_path / "code.json"
    path.write_text(json.dumps(data).replace('"float32"', "\"__import__('os')\""))
    assert not certify(path).certified


@pytest.mark.parametrize("name", ["corner-estimation-lateral", "heated-spring"])
def test_every_lyapunov_matrix_belongs_to_its_claim(tmp_path: Path, name: str) -> None:
    """Two exchanged P: each claim is proved with what it has, or it is not; the others stay as they are."""
    data = content(name)
    before = [proof.claim for proof in certify(FILES[name]).proofs]
    for i, j in list(combinations(range(len(before)), 2))[::5]:
        exchanged = copy.deepcopy(data)
        exchanged["claims"][i]["P"], exchanged["claims"][j]["P"] = data["claims"][j]["P"], data["claims"][i]["P"]
        result = certified(exchanged, tmp_path)
        assert [proof.claim for proof in result.proofs] == before
        assert all(proof.proved for k, proof in enumerate(result.proofs) if k not in (i, j))
        assert not any(proof.refuted for proof in result.proofs)  # the levels are true, whatever P says


def write_unchecked(path: Path, data: dict[str, Any]) -> None:
    """Sealed, and otherwise as it is."""
    data = {key: value for key, value in data.items() if key not in ("sha256", "section_sha256")}
    path.write_text(json.dumps(sealed(data)), "utf-8")
