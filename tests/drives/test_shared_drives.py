"""The recorded and simulated drives beside the checkout: how the corner observers compare, in numbers that may not drift.

What is to be seen here: alone, the observers gain little over the mean wheel speed where wheels slip much (P1 6.2), and
seconds after a known start an unbiased accelerometer beats both. The bounds leave room for other gains, not for errors.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.drives.judge import DriveData, judge
from studies.drives.quantities import CORNERS
from studies.drives.run import replay_drive

HERE = Path(__file__).parent
DATA = HERE.parents[2] / "shared" / "data"
pytestmark = [
    pytest.mark.shared,
    pytest.mark.skipif(not DATA.is_dir(), reason="the recorded drives (shared/data beside the checkout) are absent"),
]
Drive = tuple[DriveData, dict[str, Any]]


def replayed(name: str) -> Drive:
    data = replay_drive([DATA], HERE / f"{name}.toml")
    return data, judge(data)


@pytest.fixture(scope="module")
def bmw() -> Drive:
    return replayed("bmw_m8_launch_brake")


@pytest.fixture(scope="module")
def launch() -> Drive:
    return replayed("ocd_suv_launch_lowmu_patch")


@pytest.fixture(scope="module")
def brake() -> Drive:
    return replayed("ocd_suv_brake_abs_like_mu08")


@pytest.fixture(scope="module")
def steer() -> Drive:
    return replayed("ocd_suv_step_steer_22mps")


def nrms(drive: Drive, name: str, kind: str = "velocity") -> float:
    value = drive[1][kind][name]["nrms_percent"]
    assert isinstance(value, float)
    return value


def test_real_logs_are_repaired_counted_and_aligned(bmw: Drive) -> None:
    logs = bmw[0].log.report["logs"]
    assert (logs["A"]["rows"], logs["A"]["duplicates"]) == (9001, 20)
    assert (logs["B"]["rows"], logs["B"]["duplicates"]) == (2049, 3)
    assert logs["B"]["largest_gap_s"] == pytest.approx(0.07, abs=1e-4)
    assert logs["A"]["alignment"]["correlation"] > 0.9998
    assert logs["A"]["alignment"]["slope"] == pytest.approx(1.0, abs=0.01)
    assert 0.0 < logs["A"]["clock_offset_s"] < 0.012


def test_real_drive_beats_the_mean_wheel_speed(bmw: Drive) -> None:
    assert nrms(bmw, "corner_observers") < nrms(bmw, "mean_wheel_speed") < 2.0
    assert bmw[1]["force_sources"] == dict.fromkeys(CORNERS, "m*a_x shared by load")
    assert bmw[1]["flagged_samples"] == {corner: {} for corner in CORNERS}


def test_spinning_front_wheels_fool_wheel_speed_and_observers_alike(launch: Drive) -> None:
    observers, wheels = nrms(launch, "corner_observers"), nrms(launch, "mean_wheel_speed")
    assert 0.9 * wheels < observers < wheels
    assert nrms(launch, "corner_fl") > 15.0  # full slip: the friction term hides v_r, P1 6.2
    assert nrms(launch, "corner_rl") < 1.5  # the rear wheels keep their grip: what a fusion has to find out
    assert nrms(launch, "integrated_acceleration") < 0.5


def test_locking_wheels(brake: Drive) -> None:
    observers, wheels = nrms(brake, "corner_observers"), nrms(brake, "mean_wheel_speed")
    assert 0.8 * wheels < observers < wheels
    flags = brake[1]["flagged_samples"]
    stopped = int(np.sum(np.abs(brake[0].inputs.wheel_speed[:, 0]) < 1.0))
    assert stopped < flags["fl"]["missing_measurement"] < 1.1 * stopped  # and one sample behind every stop
    assert flags["fl"]["rate_out_of_range"] > 0


def test_rolling_wheels_leave_nothing_to_gain_and_unknown_lateral_velocity_drifts(steer: Drive) -> None:
    assert nrms(steer, "corner_observers") < 0.1
    assert nrms(steer, "mean_wheel_speed") < 0.1
    assert nrms(steer, "integrated_acceleration") > 3.0  # r V_y is missing
    for corner in CORNERS:
        assert nrms(steer, f"corner_{corner}") < 0.5


@pytest.mark.parametrize(("name", "bound"), [("launch", 4.0), ("brake", 9.0), ("steer", 4.0)])
def test_forces_from_wheel_dynamics(name: str, bound: float, request: pytest.FixtureRequest) -> None:
    drive: Drive = request.getfixturevalue(name)
    for corner in CORNERS:
        assert nrms(drive, f"force_x_{corner}", "force") < bound
        assert nrms(drive, f"force_z_{corner}", "force") < 10.0
