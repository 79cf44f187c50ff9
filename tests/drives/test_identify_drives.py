"""Identification on the shared simulated drives: a tire that nobody here wrote, and each fit judged on other drives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from studies.identify.evaluate import tire_residual
from studies.identify.identify import Identification, identify_drive
from studies.identify.parameters import tire_parameters, vehicle_parameters
from studies.identify.result import identified_tire

HERE = Path(__file__).parent
DATA = HERE.parents[2] / "shared" / "data"
pytestmark = [
    pytest.mark.shared,
    pytest.mark.skipif(not DATA.is_dir(), reason="the recorded drives (shared/data beside the checkout) are absent"),
]
NAMES = ("launch_lowmu_patch", "brake_abs_like_mu08", "step_steer_22mps")


@pytest.fixture(scope="module")
def found() -> dict[str, Identification]:
    return {name: identify_drive([DATA], HERE / f"ocd_suv_{name}.toml") for name in NAMES}


def origin_slope(name: str, slip: str, force: str) -> float:
    """Force over slip of the axles below 0.02, from the tire columns that no fit sees."""
    table = pl.read_csv(DATA / f"ocd_suv_{name}_200hz.csv", infer_schema_length=None)
    slopes = []
    for axle in (("fl", "fr"), ("rl", "rr")):
        x = sum(table[f"{slip}_{c}"].to_numpy() for c in axle) / 2
        y = sum(table[f"{force}_{c}"].to_numpy() for c in axle) / sum(table[f"Fz_{c}"].to_numpy() for c in axle)
        low = (np.abs(x) < 0.02) & (np.abs(x) > 0.004)
        slopes.append(float(x[low] @ y[low] / (x[low] @ x[low])))
    return sum(slopes) / 2


def test_launch_finds_the_longitudinal_stiffness_of_the_simulated_tire(found: dict[str, Identification]) -> None:
    stiffness = tire_parameters(found["launch_lowmu_patch"], "longitudinal")["slip_stiffness"]
    assert stiffness.excited
    assert stiffness.interval is not None
    assert stiffness.interval[0] < origin_slope("launch_lowmu_patch", "kappa", "Fx") < stiffness.interval[1]
    assert stiffness.interval[0] < 22.0 < stiffness.interval[1]


def test_braking_finds_it_as_well_on_another_road(found: dict[str, Identification]) -> None:
    stiffness = tire_parameters(found["brake_abs_like_mu08"], "longitudinal")["slip_stiffness"]
    assert stiffness.excited
    assert 17.5 < stiffness.value < 23.0  # 22 times the friction scale of 0.8, or 22


def test_step_steer_finds_the_lateral_stiffness_and_the_yaw_inertia(found: dict[str, Identification]) -> None:
    """The tire columns say 10.3 per rad, not the 25 of the data sheet, which is a shape factor."""
    stiffness = tire_parameters(found["step_steer_22mps"], "lateral")["slip_stiffness"]
    assert stiffness.excited
    assert stiffness.value == pytest.approx(origin_slope("step_steer_22mps", "alpha", "Fy"), rel=0.2)
    yaw = vehicle_parameters(found["step_steer_22mps"])["yaw_inertia"]
    assert yaw.excited
    assert yaw.value == pytest.approx(3900.0, rel=0.1)


def test_slipping_wheels_tell_their_inertia_and_rolling_ones_do_not(found: dict[str, Identification]) -> None:
    for name in NAMES[:2]:
        inertia = vehicle_parameters(found[name])["wheel_inertia"]
        assert inertia.excited
        assert inertia.value == pytest.approx(1.6, rel=0.05)
    assert not vehicle_parameters(found["step_steer_22mps"])["wheel_inertia"].excited


def test_what_a_drive_does_not_excite_is_flagged(found: dict[str, Identification]) -> None:
    for name, direction in ((NAMES[0], "lateral"), (NAMES[1], "lateral"), (NAMES[2], "longitudinal")):
        named = tire_parameters(found[name], direction)
        assert not any(entry.excited for entry in named.values())
        assert named["sigma0"].value == found[name].base.tire[direction].sigma0.value


@pytest.mark.parametrize("fitted", NAMES[:2])
@pytest.mark.parametrize("judged", NAMES[:2])
def test_a_tire_of_one_drive_beats_that_of_the_papers_on_the_others(
    fitted: str, judged: str, found: dict[str, Identification]
) -> None:
    tire = identified_tire(found[fitted], "longitudinal")
    own = tire_residual(found[judged], "longitudinal", tire)
    papers = tire_residual(found[judged], "longitudinal", found[judged].base.tire["longitudinal"])
    assert own is not None
    assert papers is not None
    assert own.velocity < 0.6 * papers.velocity
    assert own.force < 0.6 * papers.force


def test_lateral_tire_beats_that_of_the_papers(found: dict[str, Identification]) -> None:
    drive = found["step_steer_22mps"]
    own = tire_residual(drive, "lateral", identified_tire(drive, "lateral"), 0.045)
    papers = tire_residual(drive, "lateral", drive.base.tire["lateral"], 0.045)
    assert own is not None
    assert papers is not None
    assert own.velocity < papers.velocity
    assert own.force < papers.force
