"""Certificates: the shipped schedules prove, and every way of spoiling one is refused with the place named."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.schedule import read_content, write_content
from studies.certify import certify
from studies.spec import shipped_specs

FOLDER = Path(__file__).parents[2] / "estimators" / "schedules"
NAMES = sorted(shipped_specs())


def content(name: str) -> dict[str, Any]:
    return copy.deepcopy(read_content(FOLDER / f"{name}.json"))


def closed_loop(data: dict[str, Any], speed: float) -> tuple[np.ndarray, np.ndarray]:
    """A_e and B_e at one wheel speed, written out independently of the code under test."""
    plant = {
        key: sum(np.array(c) * speed ** m[0] for m, c in zip(entry["monomials"], entry["coefficients"], strict=True))
        for key, entry in data["plant"].items()
        if key != "abs"
    }
    table, points = np.array(data["gain"]["table"]), data["scheduling"][0]["breakpoints"]
    gain = np.array([[np.interp(speed, points, table[:, i, j]) for j in range(table.shape[2])] for i in range(2)])
    return plant["A"] - gain @ plant["C"], plant["E"] - gain @ plant["F"]


def refusal(data: dict[str, Any], tmp_path: Path) -> str:
    path = tmp_path / "spoiled.json"
    write_content(path, data)
    result = certify(path)
    assert not result.certified
    return result.message


@pytest.mark.parametrize("name", NAMES)
def test_shipped_schedules_are_proved(name: str) -> None:
    result = certify(FOLDER / f"{name}.json")
    assert result.certified, result.message
    assert {p.claim for p in result.proofs} >= {"decay rate", "fastest pole", "sampled decay rate"}


@pytest.mark.parametrize("name", NAMES)
def test_claims_hold_by_an_independent_road(name: str) -> None:
    """Dense sampling with numpy: frozen poles, frozen L2 gains and the sampled update stay inside what is claimed."""
    data = content(name)
    levels = data["guarantee"]["claims"]
    for speed in np.linspace(0.0, 140.0, 97):
        A_e, B_e = closed_loop(data, speed)
        poles = np.linalg.eigvals(A_e)
        assert poles.real.max() < -levels["decay rate"]
        assert poles.real.min() > -levels["fastest pole"]
        for claim in data["certificate"]["claims"]:
            if claim["kind"] == "gain":
                for omega in (0.0, 1.0, 10.0, 100.0, 1000.0):
                    response = np.linalg.solve(1j * omega * np.eye(2) - A_e, B_e @ np.array(claim["disturbances"]))
                    assert np.linalg.norm(np.array(claim["errors"]) @ response, 2) <= claim["level"]


@pytest.mark.parametrize("name", NAMES)
def test_sampled_update_contracts_along_random_drives(name: str) -> None:
    """e+ = exp(A_e(w_k) T) e with w moving within its rate: V = e'P(w)e falls as fast as the certificate says."""
    data = content(name)
    claim = next(c for c in data["certificate"]["claims"] if c["kind"] == "sampled")
    period = data["sample_time"]
    factor = np.exp(-2 * claim["level"] * period)
    P = [np.array(c) for c in claim["P"]["coefficients"]]
    rng = np.random.default_rng(7)
    for _ in range(5):
        speed, error = rng.uniform(0, 140), rng.normal(size=2) * [1e-3, 1.0]
        energy = error @ sum(c * speed**k for k, c in enumerate(P)) @ error
        for _ in range(60):
            error = expm(closed_loop(data, speed)[0] * period) @ error
            speed = float(np.clip(speed + rng.choice([-1, 1]) * 800 * period, 0, 140))
            after = error @ sum(c * speed**k for k, c in enumerate(P)) @ error
            assert after <= factor * energy * (1 + 1e-9)
            energy = after


def test_unstable_only_between_two_breakpoints_is_refuted(tmp_path: Path) -> None:
    """At 60 rad/s the spoiled entry is harmless, and so is every other breakpoint; between 40 and 60 the loop is unstable."""
    data = content("corner-estimation-lateral")
    points = data["scheduling"][0]["breakpoints"]
    data["gain"]["table"][points.index(60.0)][0][0] = -100.0
    assert all(np.linalg.eigvals(closed_loop(data, w)[0]).real.max() < 0 for w in points)
    assert np.linalg.eigvals(closed_loop(data, 50.0)[0]).real.max() > 0
    message = refusal(data, tmp_path)
    assert "between breakpoints 40 and 60" in message
    assert "refuted: the closed loop is unstable" in message
    speed = float(message.split("wheel_speed = ")[1].split()[0])
    assert np.linalg.eigvals(closed_loop(data, speed)[0]).real.max() > 0


def test_flipped_sign_is_refuted(tmp_path: Path) -> None:
    data = content("corner-estimation-longitudinal")
    data["gain"]["table"][3][1][0] *= -1.0
    message = refusal(data, tmp_path)
    assert "between breakpoints 40 and 60" in message
    assert "wheel_speed" in message


def test_widened_range_is_refused(tmp_path: Path) -> None:
    data = content("corner-estimation-lateral")
    data["scheduling"][0]["max"] = data["scheduling"][0]["breakpoints"][-1] = 400.0
    assert "max is 400, but the certificate was made for 140" in refusal(data, tmp_path)
    data["certificate"]["box"]["max"] = 400.0
    assert "between breakpoints 120 and 400" in refusal(data, tmp_path)


def test_wider_rate_than_proved_is_refused(tmp_path: Path) -> None:
    data = content("corner-estimation-lateral")
    data["scheduling"][0]["rate_max"] = 1e6
    assert "rate_max is 1e+06, but the certificate was made for 800" in refusal(data, tmp_path)
    data["certificate"]["box"]["rate_max"] = 1e6
    message = refusal(data, tmp_path)
    assert "not proved" in message
    assert "wheel_speed = " in message


def test_edited_byte_names_the_section(tmp_path: Path) -> None:
    text = (FOLDER / "longitudinal-speed.json").read_text()
    gains = content("longitudinal-speed")["gain"]["table"]
    digit = repr(gains[2][1][0])
    edited = text.replace(digit, digit[:-1] + str((int(digit[-1]) + 1) % 10))
    assert edited != text
    path = tmp_path / "edited.json"
    path.write_text(edited)
    result = certify(path)
    assert not result.certified
    assert "gain" in result.message
    assert "edited" in result.message


def test_overstated_levels_are_refused(tmp_path: Path) -> None:
    data = content("corner-estimation-longitudinal")
    for claim in data["certificate"]["claims"]:
        if claim["name"] == "decay rate":
            claim["level"] = 120.0
    assert "guarantee states 80" in refusal(data, tmp_path)
    data["guarantee"]["claims"]["decay rate"] = data["guarantee"]["decay_rate"] = 120.0
    assert "'decay rate' at 120 1/s fails at wheel_speed" in refusal(data, tmp_path)


def test_sampled_claim_needs_growth_below_decay(tmp_path: Path) -> None:
    data = content("corner-estimation-longitudinal")
    claim = next(c for c in data["certificate"]["claims"] if c["kind"] == "sampled")
    claim["growth"] = claim["frozen_decay"]
    assert "growth" in refusal(data, tmp_path)
    data["certificate"]["claims"].remove(claim)
    data["guarantee"]["claims"].pop(claim["name"])
    assert "update that the runtime performs" in refusal(data, tmp_path)


def test_overstated_drop_probability_is_refused(tmp_path: Path) -> None:
    data = content("corner-estimation-longitudinal")
    claim = next(c for c in data["certificate"]["claims"] if c["kind"] == "drops")
    for level, words in ((0.9, "do not make V fall"), (1.5, "do not make V fall")):
        claim["level"] = data["guarantee"]["claims"][claim["name"]] = level
        assert words in refusal(data, tmp_path)
    claim["level"] = data["guarantee"]["claims"][claim["name"]] = 0.45
    claim["open_growth"] = 20.0  # the arithmetic of the rates is right, the rates themselves are not
    assert "'drop probability' at 0.45 1 fails at wheel_speed" in refusal(data, tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_drop_claim_agrees_with_the_second_moment(name: str) -> None:
    """Frozen speeds are admissible: the second-moment radius at the proved drop probability is below one."""
    data = content(name)
    p, period = data["guarantee"]["claims"]["drop probability"], data["sample_time"]
    coefficients = [np.array(c) for c in data["plant"]["A"]["coefficients"]]
    for speed in np.linspace(0.0, 140.0, 29):
        used = expm(closed_loop(data, speed)[0] * period)
        lost = expm(sum(c * speed**k for k, c in enumerate(coefficients)) * period)
        operator = (1 - p) * np.kron(used, used) + p * np.kron(lost, lost)
        assert np.abs(np.linalg.eigvals(operator)).max() < 1.0


def test_unsymmetric_lyapunov_matrix_is_refused(tmp_path: Path) -> None:
    """P = -A_e^-1 gives P A_e + (P A_e)' = -2 I for every invertible A_e; only its lack of symmetry gives it away."""
    data = content("corner-estimation-longitudinal")
    for gain in data["gain"]["table"]:
        gain[0][0], gain[1][0] = -1.0, 10.0
    matrix = -np.linalg.inv(closed_loop(data, 0.0)[0])
    for claim in data["certificate"]["claims"]:
        claim["P"] = {"monomials": [[0]], "coefficients": [matrix.tolist()]}
    assert "not symmetric" in refusal(data, tmp_path)


def test_gain_claim_must_be_about_what_it_says(tmp_path: Path) -> None:
    data = content("corner-estimation-longitudinal")
    claim = next(c for c in data["certificate"]["claims"] if c["name"] == "gain friction -> relative_velocity")
    claim["errors"] = [[0.0, 0.0]]
    assert "is about nothing" in refusal(data, tmp_path)
    claim["errors"] = [[1.0, 0.0]]
    assert "is about bristle_deflection" in refusal(data, tmp_path)


@pytest.mark.parametrize("key", ["decay_rate", "fastest_pole", "sampled_decay_rate"])
def test_guarantee_repeats_only_what_is_proved(tmp_path: Path, key: str) -> None:
    data = content("corner-estimation-longitudinal")
    data["guarantee"][key] *= 1.5
    assert key in refusal(data, tmp_path)
    data = content("corner-estimation-longitudinal")
    data["guarantee"]["channels"][0]["gamma_certified"] = 0.5
    assert "guarantee.channels" in refusal(data, tmp_path)


def test_float32_table_is_stored_as_such() -> None:
    data = content("longitudinal-speed")
    table = np.array(data["gain"]["table"])
    assert data["gain"]["dtype"] == "float32"
    assert (table.astype(np.float32).astype(np.float64) == table).all()


def test_certify_loads_no_solver() -> None:
    code = (
        "import sys; from studies.cli import main; code = main(['certify', *sys.argv[1:]]);"
        "bad = {'clarabel', 'cvxpy', 'scipy', 'sympy', 'matplotlib'} & set(sys.modules); print(sorted(bad)); sys.exit(code)"
    )
    files = [str(FOLDER / f"{name}.json") for name in NAMES]
    done = subprocess.run([sys.executable, "-c", code, *files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.strip().splitlines()[-1] == "[]"


def test_json_numbers_are_not_evaluated(tmp_path: Path) -> None:
    data = content("longitudinal-speed")
    path = tmp_path / "code.json"
    path.write_text(json.dumps(data).replace('"float32"', "\"__import__('os')\""))
    assert not certify(path).certified
