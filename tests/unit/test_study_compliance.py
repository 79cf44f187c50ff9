"""With and without the suspension compliance: the tire model against its closed form, and a car that gives beside a rigid one."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.velocity import SuspensionParameters
from studies.papers.resilient_velocity.compliance import (
    INSIDE,
    PRINTED_WAY,
    TESTS,
    WITHOUT,
    ComplianceTrial,
    hard_traction,
    model_force,
    residual_history,
    residual_table,
    run_trial,
)
from studies.papers.resilient_velocity.inputs import DIRECTIONS, PRINTED
from studies.papers.resilient_velocity.vehicle import steady
from studies.study import PartResult
from studies.truth import Measured, Truth, draw, load_manoeuvre, load_vehicle, simulate_manoeuvres
from studies.truth.sensors import PERFECT
from tests.support.study_checks import check_result

GRIPPING = [1, 3]  # the right wheels of the launch stand on dry road
RIGID = SuspensionParameters(
    stiffness_x=3e7, stiffness_y=7e7, damping_x=3.7e4, damping_y=3.7e4
)  # a hundred times as stiff


def test_the_calculated_force_settles_at_that_of_the_steady_tire() -> None:
    slip, speed, road = 0.4, 40.0, 0.6
    shape = (1, 1, 200, 4)
    time = np.asarray(0.005 * np.arange(shape[2]), dtype=np.float64)
    truth = Truth(
        time,
        {"friction": np.full(shape[1:], road)},
        ("still",),
        time[-1:],
        (load_vehicle("resilient-velocity"),),
        ("",),
    )
    drawn = Measured(time, {"wheel_speed": np.full(shape, speed)}, (0,), truth, (1, 1))
    found = model_force(drawn, np.full((*shape, 2), slip))[0, 0, -1, 0]
    closed = [float(steady(PRINTED, d, slip, road, speed)[0]) for d in DIRECTIONS]
    assert found == pytest.approx(closed, rel=1e-6)
    icy = [float(steady(PRINTED, d, slip, 0.2, speed)[0]) for d in DIRECTIONS]
    assert np.all(np.abs(found - icy) > 0.02)


@pytest.fixture(scope="module")
def trial() -> ComplianceTrial:
    """The first 1.8 s of a launch: run 0 with the suspension of P3, run 1 with a rigid one, as the observers do not know."""
    launch = load_manoeuvre(TESTS[0].manoeuvre)
    launch = launch.model_copy(update={"duration": 1.8})
    car = launch.truth_vehicle()
    truth = simulate_manoeuvres([launch, launch], [car, car.changed(suspension=RIGID)])
    return run_trial(draw(truth, PERFECT, range(2)))


def test_the_wheels_of_the_car_that_gives_move_as_the_model_says_and_those_of_the_rigid_one_do_not(
    trial: ComplianceTrial,
) -> None:
    _, hard = hard_traction(trial, TESTS[0])
    wrong, true = (
        np.sqrt(np.mean(np.square(value[:, hard][:, :, GRIPPING, 0]), axis=(1, 2)))
        for value in (trial.compliance[0] - trial.true_compliance, trial.true_compliance)
    )
    assert wrong[0] < 0.2 * true[0]
    assert true[1] < 0.05 * true[0] and wrong[1] > 10.0 * true[1]


def test_compliance_in_the_input_helps_where_suspensions_give_and_harms_where_they_do_not(
    trial: ComplianceTrial,
) -> None:
    _, hard = hard_traction(trial, TESTS[0])
    error = {
        way: np.sqrt(np.mean(np.square(value[0][:, hard][:, :, GRIPPING, 0]), axis=(1, 2)))
        for way, value in trial.residual.items()
    }
    assert error[INSIDE][0] < error[WITHOUT][0] < error[PRINTED_WAY][0]
    assert error[INSIDE][1] > error[WITHOUT][1]


def test_table_and_figure_say_which_way_is_better(trial: ComplianceTrial) -> None:
    table, measures = residual_table("forces", trial, TESTS[:1])
    check_result(PartResult(tables=[table], figures=[residual_history("history", trial, TESTS[0])]))
    worse, better = (table.columns.index(f"smaller by {way}") for way in ("(15)", "the input"))
    assert [(table.rows[k][worse], table.rows[k][better]) for k in GRIPPING] == [(False, True)] * 2
    assert measures["p3-launch-split fr without"] > measures["p3-launch-split fr in the observer's input"]
