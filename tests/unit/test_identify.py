"""What `gainsmith identify` writes and refuses, and the pieces of the fit against closed forms."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimators.errors import GainsmithError
from studies.commands.identify import run_identify
from studies.errors import IdentifyError, LogError
from studies.identify.autocorrelation import correlation_time, effective_stretches
from studies.identify.estimate import Rules, Unknown, estimate
from studies.identify.identify import identify_drive
from studies.identify.parameters import tire_parameters
from studies.identify.prefilter import Prefilter, first_order_lag, pitched
from studies.identify.settings import IdentifySettings
from studies.spec import load_spec
from synthesis.design.deploy import deploy
from synthesis.design.hinf_observer import design_observer
from synthesis.models.parameter_set import load_parameter_set
from tests.support.synthetic_drive import DRIVE, KAPPA, SIGMA0, SLIP, TORQUES, columns, write_drive, write_log
from tests.support.turning_drive import TURNING, turning, write_table

WITH_TORQUE = DRIVE.replace("[reference]", TORQUES + "\n[reference]")


def rolling(seconds: float = 4.0) -> dict[str, np.ndarray[Any, Any]]:
    """The closed-form log, first as it is, then rolling free at constant speed: two levels of force."""
    pushed = columns(seconds / 2)
    free = {name: np.full_like(value, value[-1]) for name, value in pushed.items()}
    free |= {name: 0.0 * value for name, value in free.items() if name.startswith("T_") or name == "ax"}
    free |= {name: value / (1 + SLIP) for name, value in free.items() if name.startswith("w_")}
    free["t"] = pushed["t"] + pushed["t"][-1] + 0.005
    # a jump of the force would excite relaxation and pitch, which the closed form has not: 0.2 s of no record between
    free["t"] += 0.2
    return {name: np.concatenate([pushed[name], free[name]]) for name in pushed}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("identify")
    log = write_log(folder / "log.csv", rolling())
    assert run_identify([log], write_drive(folder, WITH_TORQUE), folder / "out", as_json=True) == 0
    return folder / "out"


def test_every_file_is_there_and_nothing_else(written: Path) -> None:
    pictures = {f"residual_longitudinal.{suffix}" for suffix in ("svg", "png")}
    assert {path.name for path in written.iterdir()} == {"identified.toml", "identification.json", *pictures}
    content = json.loads((written / "identification.json").read_text())
    assert content["schema"] == "gainsmith.identification/1"
    assert content["velocity_reference"] == "vx: column 'v' of log 'log'"
    assert any(line.startswith("lateral: not fitted: reference.vy") for line in content["warnings"])
    entry = content["parameters"]["longitudinal"]["kappa"]
    assert set(entry) == {"value", "unit", "interval", "excited", "samples", "source", "half_width"}


def test_closed_form_of_a_linear_tire_gives_the_slip_stiffness(tmp_path: Path) -> None:
    linear = IdentifySettings(bend=1e-6, bend_spread=1e-2, curvature=1e-2)
    log, drive = write_log(tmp_path / "log.csv", rolling()), write_drive(tmp_path, WITH_TORQUE)
    stiffness = tire_parameters(identify_drive([log], drive, settings=linear), "longitudinal")["slip_stiffness"]
    assert stiffness.interval is not None
    assert stiffness.value == pytest.approx(SIGMA0 / KAPPA, rel=0.03)
    assert stiffness.interval[0] < SIGMA0 / KAPPA < stiffness.interval[1]


def test_one_level_of_high_force_does_not_tell_the_slope_at_the_origin(written: Path) -> None:
    """At mu = 0.6 curves of tires differ by a third: a secant is all that this log has."""
    content = json.loads((written / "identification.json").read_text())
    stiffness = content["parameters"]["longitudinal"]["slip_stiffness"]
    assert not stiffness["excited"]
    assert stiffness["half_width"] > 0.2
    assert any(line.startswith("longitudinal slip_stiffness: not excited") for line in content["warnings"])


def test_parameter_file_feeds_the_schedules(written: Path) -> None:
    parameters = load_parameter_set(written / "identified.toml")
    tire = parameters.tire["longitudinal"]
    assert "log.csv" in parameters.citation
    assert "lateral" in parameters.tire
    assert "prior: corner-estimation" in parameters.tire["lateral"].sigma0.source
    assert "not excited by log.csv" in tire.kappa.source
    assert tire.kappa.value == KAPPA
    spec, _ = load_spec("corner-estimation-longitudinal")
    own = spec.model_copy(
        update={"model": spec.model.model_copy(update={"parameters": str(written / "identified.toml")})}
    )
    found = own.parameter_set(written)
    deployed = deploy(design_observer(own.build_model(found), own.observer_design()), own.deploy_settings())
    assert deployed.claims


@pytest.mark.parametrize(
    ("text", "table", "message"),
    [
        (DRIVE.split("[reference]")[0], columns(2.0), "reference.vx is missing"),
        (DRIVE.replace('"w_fl"', '"wheel"'), columns(2.0), "unknown column 'wheel'"),
        (DRIVE, columns(0.5), "needed 1 s; give a longer log"),
        (DRIVE, {n: v if n == "t" else 0.0 * v for n, v in columns(2.0).items()}, "standstill"),
        (DRIVE, {**columns(2.0), "v": np.nan * columns(2.0)["v"]}, "no instant has all signals"),
    ],
    ids=["no reference", "unknown column", "short", "standstill", "empty reference"],
)
def test_bad_input_is_one_line_and_nothing_is_written(
    tmp_path: Path, text: str, table: dict[str, Any], message: str
) -> None:
    log = write_log(tmp_path / "log.csv", table)
    with pytest.raises(GainsmithError, match=message) as caught:
        run_identify([log], write_drive(tmp_path, text), tmp_path / "out", as_json=False)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_unknown_base_set_is_refused(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log.csv", columns(2.0))
    with pytest.raises(GainsmithError, match="unknown parameter set"):
        identify_drive([log], write_drive(tmp_path), base="corner")


def test_settings_that_mean_nothing_are_refused() -> None:
    with pytest.raises(IdentifyError, match=r"filter_lag, slip_limits\[0\]"):
        IdentifySettings(filter_lag=math.nan, slip_limits=(0.0,))
    with pytest.raises(IdentifyError, match="must fall"):
        IdentifySettings(slip_limits=(0.02, 0.03))


def test_filters_commute_with_the_differential_equation() -> None:
    """y' + a y = u filtered is D[y] + a F[y] = F[u]."""
    t = np.arange(0.0, 4.0, 0.005)
    y, slope = np.sin(6 * t) ** 2, 6 * np.sin(12 * t)
    f = Prefilter(np.ones(t.size, dtype=bool), 0.005, 0.02, 8.0)
    error = f.rate(y) + 3 * f.smooth(y) - f.smooth(slope + 3 * y)
    assert np.abs(error[f.memory :]).max() < 2e-2
    bad = np.zeros(t.size, dtype=bool)
    bad[100] = True
    settled = f.settled(bad)
    assert not settled[100 : 100 + f.memory].any()
    assert settled[100 + f.memory]


def test_lag_of_a_ramp_is_late_by_the_lag() -> None:
    ramp = np.arange(0.0, 3.0, 0.005)[:, None]
    late = first_order_lag(ramp, 0.005, 0.1, [slice(0, len(ramp))])
    np.testing.assert_allclose(ramp[-1] - late[-1], 0.1, atol=1e-6)


def test_pitching_follows_its_differential_equation() -> None:
    """Step response of (2 z w s + w^2)/(s^2 + 2 z w s + w^2): 1 - exp(-z w t)(cos w_d t - z w/w_d sin w_d t)."""
    t, w, z = np.arange(0.0, 3.0, 0.005), 2 * np.pi * 1.5, 0.4
    damped = w * math.sqrt(1 - z**2)
    exact = 1 - np.exp(-z * w * t) * (np.cos(damped * t) - z * w / damped * np.sin(damped * t))
    step = np.concatenate([[0.0], np.ones(t.size)])[:, None]  # trapezoidal: the jump is half a sample before t = 0
    moved = pitched(step, 0.005, 1.5, z, [slice(0, len(step))])[1:, 0]
    assert np.abs(moved - np.interp(t + 0.0025, t, exact)).max() < 5e-3


def test_stretches_count_experiments_and_not_samples() -> None:
    even = np.ones((1000, 1))
    jump = np.zeros((1000, 1))
    jump[500:510] = 1.0
    rows = np.arange(1000)
    both = effective_stretches(np.hstack([even, jump]), rows, 50)
    np.testing.assert_allclose(both, [20.0, 1.0])


def test_correlation_time_of_white_and_of_autoregressive_noise() -> None:
    rng = np.random.default_rng(1)
    white = rng.standard_normal((40_000, 1))
    red = np.zeros_like(white)
    for k in range(1, len(red)):
        red[k] = 0.8 * red[k - 1] + white[k]
    assert correlation_time(white, 1) == pytest.approx(1.0, abs=0.1)
    assert correlation_time(red, 1) == pytest.approx(9.0, rel=0.15)  # (1 + rho)/(1 - rho)


def test_mean_of_correlated_noise_has_an_honest_interval() -> None:
    """95 % nominal over 200 seeds; the interval of independent rows would hold 50 %."""
    unknown = Unknown("mean", 0.0, 10.0, 10.0, (-100.0, 100.0), positive=False, informed=False)
    inside = 0
    for seed in range(200):
        noise = np.random.default_rng(seed).standard_normal(600)
        red = np.zeros((600, 1))
        for k in range(1, 600):
            red[k] = 0.8 * red[k - 1] + noise[k]

        def residual(p: Mapping[str, float], red: Any = red) -> Any:
            return red - p["mean"]

        fit = estimate(residual, np.ones((600, 1), dtype=bool), [unknown], Rules(0.95, 1e-9, 1, 2.0))
        inside += abs(fit.value("mean")) <= fit.half["mean"]
    assert inside >= 180


def test_nothing_to_fit_leaves_the_prior() -> None:
    unknown = Unknown("gain", 2.0, 0.5, 0.1, (-3.0, 3.0), informed=False)
    fit = estimate(
        lambda p: np.ones((5, 1)) * p["gain"], np.zeros((5, 1), dtype=bool), [unknown], Rules(0.95, 1.0, 1, 2.0)
    )
    assert (fit.value("gain"), fit.excited["gain"], fit.samples) == (2.0, False, 0)


def test_signals_that_contradict_one_another_are_refused_before_the_fit(tmp_path: Path) -> None:
    """Negative control: without the check the same log gets as far as the reference that it lacks."""
    table = turning(8.0)
    log = write_table(tmp_path / "log.csv", table | {"r": -table["r"]})
    drive = write_drive(tmp_path, TURNING.split("[reference]")[0])
    with pytest.raises(LogError, match=r'likely sign = "negative" for signals.yaw_rate'):
        identify_drive([log], drive)
    with pytest.raises(IdentifyError, match=r"reference\.vx is missing"):
        identify_drive([log], drive, check=False)
