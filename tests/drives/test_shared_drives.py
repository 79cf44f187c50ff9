"""The recorded and simulated drives beside the checkout: how the corner observers compare, in numbers that may not drift.

What is to be seen here: alone, the observers gain little over the mean wheel speed where wheels slip much (P1 6.2), and
seconds after a known start an unbiased accelerometer beats both. The bounds leave room for other gains, not for errors.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.drives.csv_log import read_columns
from studies.drives.evaluation import DriveData, evaluate
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
    return data, evaluate(data)


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


def test_rolling_wheels_leave_nothing_to_gain_and_planar_dead_reckoning_turns_with_the_car(steer: Drive) -> None:
    assert nrms(steer, "corner_observers") < 0.1
    assert nrms(steer, "mean_wheel_speed") < 0.1
    assert nrms(steer, "integrated_acceleration") < 0.05  # more than 3 without r V_y; simulated sensors have no bias
    for corner in CORNERS:
        assert nrms(steer, f"corner_{corner}") < 0.5


def test_reference_slip_of_steered_wheels_is_that_of_the_simulation(steer: Drive) -> None:
    """The tire's own slip, a column that no estimate sees; 0.0035 at its peak, and off by that much with V_y = 0."""
    columns = {f"kappa_{corner}": "slip of the tire" for corner in CORNERS}
    table = read_columns(DATA / "ocd_suv_step_steer_22mps_200hz.csv", columns).values
    slip = steer[0].reference_slip
    assert slip is not None
    settled = steer[0].log.time > 1.5  # the tire's slip comes late, and is read as its steady value
    for k, corner in enumerate(CORNERS):
        np.testing.assert_allclose(slip[settled, k], table[f"kappa_{corner}"][settled], atol=1e-4)
    wrong = replace(steer[0], log=replace(steer[0].log, reference={**steer[0].log.reference, "vy": np.zeros(1600)}))
    assert wrong.reference_slip is not None
    assert np.abs(wrong.reference_slip[settled, 0] - table["kappa_fl"][settled]).max() > 3e-3


def test_a_schedule_of_another_radius_is_said(bmw: Drive, steer: Drive) -> None:
    for drive, percent in ((bmw, "+7.2 %"), (steer, "+9.1 %")):
        (line,) = (line for line in drive[1]["assumptions"] if "schedule" in line)
        assert percent in line


@pytest.mark.parametrize(("name", "bound"), [("launch", 4.0), ("brake", 9.0), ("steer", 4.0)])
def test_forces_from_wheel_dynamics(name: str, bound: float, request: pytest.FixtureRequest) -> None:
    drive: Drive = request.getfixturevalue(name)
    for corner in CORNERS:
        assert nrms(drive, f"force_x_{corner}", "force") < bound
        assert nrms(drive, f"force_z_{corner}", "force") < 10.0
