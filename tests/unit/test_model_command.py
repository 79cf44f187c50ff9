"""`gainsmith model` and `gainsmith new`: published poles, rank over the range, pictures; what they write runs as it is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from analysis.observability.hidden_modes import undetectable_mode, unstabilisable_mode
from analysis.observability.matrix import controllability_matrix
from analysis.observability.range_rank import controllability_over_range, observability_over_range
from studies.cli import main
from studies.report.schedule_figures import curves_of
from studies.spec import any_model, shipped_examples
from synthesis.exchange.model_file import load_model
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, SchedulingParameter, Signal

p, rate = sp.symbols("p p_rate")


def model(A: sp.Matrix, C: sp.Matrix, B: sp.Matrix | None = None, low: float = 1.0) -> LpvModel:
    """Dimensionless, with p from `low` to 3 and rates within +-2."""
    return LpvModel(
        "own", "test", tuple(Signal(f"x{i}", "1") for i in range(A.rows)), (Signal("y", "1"),),
        (SchedulingParameter("p", "1", low, 3.0, -2.0, 2.0),), A, C,
        inputs=(Signal("u", "1"),) if B is not None else (), B=B,
    )  # fmt: skip


def test_poles_are_the_published_ones(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The tutorial of the University of Michigan prints the poles of its pendulum at 9.8 m/s^2; pictures are drawn."""
    assert main(["model", "inverted-pendulum", "--json", "--out", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    (row,) = [row for row in found["poles"] if row["at"]["effective_gravity"] == pytest.approx(9.8)]
    np.testing.assert_allclose(sorted(s[0] for s in row["poles"]), [-5.6041, -0.1428, 0.0, 5.5651], atol=6e-5)
    assert (tmp_path / "inverted-pendulum.svg").stat().st_size > 10_000
    assert found["observability"]["rank"] == found["controllability"]["rank"] == "full"


def test_the_printed_form_names_units_and_curves(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["model", "pmsm"]) == 0
    text = capsys.readouterr().out
    assert "electrical_speed from -471 to 471 rad/s, rate -2800 to 2800 (rad/s)/s" in text
    assert "resistance = 3.6 ohm (motulator" in text and "none faster than 478.4 1/s" in text
    # By hand: both currents have -(R/Ld + R/Lq)/2 as real part, so 85.29 1/s, where the speed is not small.
    assert "-85.29 + 470.8j" in text


def test_specifications_show_their_model_and_where_rank_is_lost(capsys: pytest.CaptureFixture[str]) -> None:
    """Ends of the interval of P3's lateral corner by the determinant of [C; C A + dC/dp p'] in floats, differences for d/dp."""
    assert main(["model", "resilient-velocity-lateral"]) == 0
    assert "wheel_speed 31.28 to 41.25 rad/s; detectable: yes" in capsys.readouterr().out
    own = any_model("resilient-velocity-lateral")
    for speed, rate_bound in ((31.28, -800.0), (41.25, 800.0)):
        signs = []
        for near in (speed - 0.02, speed + 0.02):
            at, later = own.on([near]), own.on([near + 1e-3])
            row = at.C[0] @ at.A[0] + (later.C[0] - at.C[0]) / 1e-3 * rate_bound
            signs.append(np.linalg.det(np.vstack([at.C[0], row])) > 0.0)
        assert signs[0] != signs[1]


def test_files_that_are_no_model_end_with_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "list.toml").write_text("name = 'x'\n")
    for name, words in (
        ("list.toml", "list.toml:1:1: source: missing"),
        ("absent.toml", "cannot be read"),
        ("quarter", "unknown model"),
    ):
        assert main(["model", str(tmp_path / name) if name.endswith("toml") else name]) == 2
        assert words in capsys.readouterr().err


@pytest.mark.parametrize("low", [1.0, 0.0])
def test_rank_over_the_range(low: float) -> None:
    """x1' = p x2, y = x1: rank is lost where p = 0, and nowhere else; p' does not matter."""
    found = observability_over_range(model(sp.Matrix([[0, p], [0, 0]]), sp.Matrix([[1, 0]]), low=low))
    assert found.verdict == ("full" if low else "lost")
    assert found.loss is not None and found.loss.factors == (p,)
    negative = observability_over_range(model(sp.Matrix([[0, p - 5], [0, 0]]), sp.Matrix([[1, 0]]), low=low))
    assert negative.verdict == "full"


def test_rates_make_a_frozen_loss_observable_and_the_other_way_round() -> None:
    """y = x1 + p x2 with A = 0: the determinant is p', zero in the box; with A = [[0, 0], [0, 1]] it is p + p'."""
    C = sp.Matrix([[1, p]])
    still = observability_over_range(model(sp.zeros(2), C))
    assert still.verdict == "lost" and still.loss is not None and still.loss.factors == (rate,)
    moving = observability_over_range(model(sp.Matrix([[0, 0], [0, 1]]), C))
    assert moving.loss is not None and moving.loss.factors == (p + rate,)
    assert moving.verdict == "lost"  # p = 1.5, p' = -1.5
    assert observability_over_range(model(sp.Matrix([[0, 0], [0, 3]]), C)).verdict == "full"  # 3 p + p' >= 1


def test_controllability_is_that_of_the_definition() -> None:
    """[B, A B - dB/dt] for B = [1, p]', A = diag(0, 1): determinant p - p'; up to sign and transpose."""
    own = model(sp.Matrix([[0, 0], [0, 1]]), sp.Matrix([[1, 1]]), sp.Matrix([1, p]))
    B = own.B
    assert B is not None
    by_hand = sp.Matrix.hstack(B, own.A * B - B.diff(p) * rate)
    found = controllability_matrix(own).matrix
    assert sp.simplify(found.det() ** 2 - by_hand.det() ** 2) == 0
    assert controllability_over_range(own).verdict == "lost"  # p = p' = 1.5
    assert controllability_over_range(model(sp.Matrix([[p]]), sp.Matrix([[1]]))).verdict == "never"


def test_hidden_modes_are_named_with_their_place() -> None:
    """x2' = 2 x2 shows through p - 2 alone: hidden at p = 2; the same pair transposed cannot be moved there."""
    A, C = sp.Matrix([[-1, p - 2], [0, 2]]), sp.Matrix([[1, 0]])
    hidden = undetectable_mode(model(A, C))
    assert hidden is not None and hidden.place == {"p": pytest.approx(2.0)}
    assert hidden.eigenvalue == pytest.approx(2.0) and hidden.states == ("x1",)
    assert "the mode at 2 1/s (x1) at p = 2 1" in hidden.words
    dual = unstabilisable_mode(model(A.T, C, C.T))
    assert dual is not None and dual.eigenvalue == pytest.approx(2.0)
    two = unstabilisable_mode(
        model(sp.diag(1, 2), sp.Matrix([[0, 1]]), sp.Matrix([1, p - 2]))
    )  # C hides the other mode
    assert two is not None and two.eigenvalue == pytest.approx(2.0) and two.states == ("x1",)
    assert undetectable_mode(model(A.subs(p, p + 4), C)) is None
    assert unstabilisable_mode(model(A.T.subs(p, p + 4), C, C.T)) is None


def test_new_model_runs_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """new, model, schedules, certify; and nothing of it is overwritten."""
    out = ["--out", str(tmp_path)]
    assert main(["new", "my-lift", *out, "--json"]) == 0
    written = json.loads(capsys.readouterr().out)
    assert load_model(written["model"]).name == "my-lift"
    assert main(["schedules", written["specification"], *out]) == 0
    assert "my-lift-observer" in capsys.readouterr().out
    assert main(["certify", str(tmp_path / "my-lift-observer.json")]) == 0
    assert "proved  update: gain 1 N gust + 0.002 m position_noise -> velocity" in capsys.readouterr().out
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert main(["new", "my-lift", *out]) == 2
    assert main(["new", "../lift", *out]) == 2
    assert "exists; choose another" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_two_outputs_are_designed_tabulated_and_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The machine at 12 kHz: a 2 x 2 table of gains, four panels, every claim proved from the file."""
    out = ["--out", str(tmp_path), "--figures", str(tmp_path)]
    assert main(["schedules", "pmsm-observer", *out, "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert len(row["gain_range"]) == 4 and all(proof["proved"] for proof in row["proofs"])
    # With the d axis alone a current that is measured at 0.05 A and driven by 5 V of error is hardly filtered: K_11 is near one.
    assert 0.9 < row["gain_range"][0][0] < 1.0
    assert main(["certify", str(tmp_path / "pmsm-observer.json")]) == 0
    assert (tmp_path / "pmsm-observer.svg").stat().st_size > 20_000


def test_gains_of_two_parameters_are_drawn_as_curves() -> None:
    """Ends and middle of the second parameter; the third in its middle."""
    table = np.arange(3 * 4 * 5, dtype=float).reshape(3, 4, 5, 1, 1)
    axes = [{"name": name, "unit": "1", "breakpoints": list(range(n))} for name, n in (("p", 3), ("q", 4), ("r", 5))]
    found = curves_of({"gain": {"table": table.tolist()}, "scheduling": axes})
    assert [label for label, _ in found] == ["q 0", "q 2", "q 3"]
    np.testing.assert_array_equal(found[1][1], table[:, 2, 2])


def test_examples_are_complete() -> None:
    """Every constant has a source, every example its specification, and no unit is left out."""
    names = {
        "battery",
        "cruise",
        "inverted-pendulum",
        "missile",
        "pmsm",
        "pmsm-pi",
        "quarter-car",
        "satellite",
        "single-track",
        "turbine-pitch",
        "vehicle-speed",
        "wind-turbine",
    }
    assert set(shipped_examples()) == names
    for path in shipped_examples().values():
        found = load_model(path)
        assert all(isinstance(c, Constant) and c.source for c in found.constants.values())
        units = [s.unit for kind in ("states", "inputs", "outputs", "disturbances") for s in getattr(found, kind)]
        assert "1" not in units
