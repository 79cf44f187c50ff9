"""The motion of the truth as the papers draw it: a car on a circle, whose accelerations are known."""

from __future__ import annotations

import numpy as np
import pytest

from studies.plots import Line
from studies.study import PartResult
from studies.trials.motion import COLUMNS, MotionTest, extremes, motion_drawings
from studies.truth import Truth, load_manoeuvre
from synthesis.errors import SpecError
from tests.support.study_checks import check_result

SPEED, TURN, STEER = 12.0, 0.25, 0.05  # m/s, rad/s, rad
ROW = MotionTest("p4-bends-dry", "Bends", course=True, rear=True)


@pytest.fixture
def circle() -> Truth:
    time = np.asarray(np.linspace(0.0, 5.0, 1001), dtype=np.float64)
    car = {
        "vx": np.full_like(time, SPEED), "yaw_rate": np.full_like(time, -TURN), "road_ax": np.zeros_like(time),
        "road_ay": np.full_like(time, -SPEED * TURN),
        "x": SPEED / TURN * np.sin(TURN * time), "y": SPEED / TURN * (np.cos(TURN * time) - 1.0),
    }  # fmt: skip
    wheels = {name: np.ones((1, time.size, 4)) for name in ("force_x", "torque", "wheel_speed")}
    wheels["steer"] = np.full((1, time.size, 4), -STEER)
    return Truth(
        time,
        {name: value[None] for name, value in car.items()} | wheels,
        (ROW.manoeuvre,),
        np.array([5.0]),
        (load_manoeuvre(ROW.manoeuvre).truth_vehicle(),),
        ("lugre",),
    )


def test_extremes_are_those_of_the_circle(circle: Truth) -> None:
    table = extremes("extremes", circle, (ROW,))
    row = dict(zip(COLUMNS, table.rows[0], strict=True))
    assert row["|a_y|, greatest [m/s^2]"] == SPEED * TURN and row["|a_x|, greatest [m/s^2]"] == 0.0
    assert row["|yaw rate|, greatest [deg/s]"] == round(float(np.degrees(TURN)), 2)
    assert row["steering at the wheels, greatest [deg]"] == round(float(np.degrees(STEER)), 2)
    assert "0.6 g" in str(row["the paper gives"])


def test_figures_stand_on_their_own_and_show_the_path(circle: Truth) -> None:
    drawings = motion_drawings("motion", circle, ROW)
    assert [d.name for d in drawings] == [
        "motion-p4-bends-dry", "motion-course-p4-bends-dry", "motion-rear-p4-bends-dry"
    ]  # fmt: skip
    check_result(PartResult(figures=drawings))
    line = drawings[1].rows[0][0].marks[0]  # type: ignore[union-attr]
    assert isinstance(line, Line)
    path = np.stack([line.x, line.y], axis=-1)
    centre = np.array([0.0, -SPEED / TURN])
    assert np.linalg.norm(path - centre, axis=1) == pytest.approx(SPEED / TURN)


def test_a_manoeuvre_that_was_not_driven_is_refused(circle: Truth) -> None:
    with pytest.raises(SpecError, match="was not driven"):
        extremes("extremes", circle, (MotionTest("p5-slalom", "Slalom"),))
