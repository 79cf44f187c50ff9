"""V_y that a slide has left wrong: found again from unloaded axles, and from nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.faults import Flag
from estimators.velocity import FusionSettings, VelocityFusion
from estimators.velocity.consistency_reset import LateralReset
from estimators.velocity.lateral_fusion import AxleUpdate
from tests.support.fusion_course import CAR, STEP, Signals, course, driven, phases, sensed
from tests.support.turning_course import resets, turn

SETTINGS = FusionSettings()
BEFORE, AFTER = 400, 600


def misled(batch: tuple[int, ...] = (), where: object = True) -> tuple[VelocityFusion, Signals]:
    """A fusion that has driven straight for 2 s at 20 m/s and is then sure of a V_y of 1.5 m/s; what follows."""
    signals = sensed(course(phases((5.0, 0.0)), start=20.0))
    fusion = VelocityFusion(CAR, STEP, batch)
    first, rest = (Signals(*(value[part] for value in signals)) for part in (slice(BEFORE), slice(BEFORE, None)))
    tiled = [Signals(*(np.broadcast_to(v[:, *(None,) * len(batch)], (len(v), *batch, *v.shape[1:])) for v in each))
             for each in (first, rest)]  # fmt: skip
    driven(tiled[0], fusion)
    fusion.lateral_filter.restart(where, 1.5, 0.01**2)
    return fusion, tiled[1]


def test_unloaded_axles_bring_it_back_and_sensors_stay_known() -> None:
    fusion, rest = misled()
    known = fusion.lateral_filter.state[0, 1:]
    steps, _ = driven(rest, fusion)
    vy = np.array([step.vy for step in steps])
    flagged = np.flatnonzero([step.flags & Flag.RESET for step in steps])
    assert flagged.size == 1 and flagged[0] * STEP == pytest.approx(SETTINGS.lost_time, abs=2 * STEP)
    assert vy[: flagged[0]].min() > 1.0  # it does not come back by itself
    assert np.abs(vy[flagged[0] + 1 :]).max() < 0.1
    bias = np.abs(fusion.lateral_filter.state[0, 1:] - known)
    assert (bias < 3.0 * np.sqrt(np.diag(fusion.lateral_filter.covariance[0])[1:])).all()


def test_only_the_lost_car_of_a_batch_starts_again() -> None:
    fusion, rest = misled((3,), np.array([False, True, False]))
    steps, _ = driven(rest, fusion)
    flagged = np.array([step.flags & Flag.RESET for step in steps]) != 0
    assert flagged.sum(axis=0).tolist() == [0, 1, 0]
    assert np.abs(steps[-1].vy).max() < 0.1
    alone, _ = driven(*reversed(misled()))
    np.testing.assert_allclose([s.vy[1] for s in steps], [s.vy for s in alone], rtol=1e-7, atol=1e-9)


CALM = AxleUpdate((-1.5, -1.45), (False, False), (0.01, -0.02), False)
CASES = {
    "lost": (CALM, (True, True), True),
    "one axle carries a side force": (CALM._replace(friction=(0.01, 0.2)), (True, True), False),
    "both would slip less than their force takes": (CALM._replace(friction=(0.3, 0.25)), (True, True), True),
    "both slide, as on ice": (CALM._replace(friction=(-0.3, -0.25)), (True, True), False),
    "the axles contradict each other": (CALM._replace(innovation=(-1.5, 1.5)), (True, True), False),
    "one axle is believed": (CALM._replace(used=(True, False)), (True, True), False),
    "the wheels of one axle slip": (CALM, (True, False), False),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("count", [1, 2])
def test_what_is_evidence(case: str, count: int) -> None:
    verdict, usable, expected = CASES[case]
    fusion = VelocityFusion(CAR, STEP, () if count == 1 else (count,))
    if count > 1:
        pairs = [[np.full(count, value) for value in pair] for pair in (*verdict[:3], usable)]
        verdict, usable = AxleUpdate(*pairs[:3], np.full(count, False)), tuple(pairs[3])
    clock: LateralReset = fusion.lateral_reset
    found = [bool(np.all(clock(STEP, 20.0, verdict, usable))) for _ in range(AFTER)]
    assert any(found) is expected


@pytest.mark.parametrize("wrong", [3.0, -3.0])
def test_tires_of_a_turn_slip_as_far_as_they_pull_or_further(wrong: float) -> None:
    """One side of V_y is impossible on any road; on the other the car would slide, as it does on ice."""
    steady = turn(1.5, np.full(300, 0.25))
    fusion = VelocityFusion(CAR, STEP)
    fusion.reset(vx=20.0, vy=steady.vy[0] + wrong)
    steps, _ = driven(steady.signals, fusion)
    assert resets(steps) == (2 if wrong > 0.0 else 1)  # the one that was asked for, too
    if wrong > 0.0:
        assert abs(steps[-1].vy - steady.vy[-1]) < 2.0 * steps[-1].vy_deviation


def test_an_axle_that_was_off_still_bounds_v_y() -> None:
    """Of late the axles were 0.5 m/s off, as on ice: that the car slides they do not tell, that it cannot slide less they do."""
    steady = turn(2.0, np.full(400, 0.25))
    back = []
    for wrong in (0.15, -0.15):
        fusion = VelocityFusion(CAR, STEP)
        first, rest = (Signals(*(value[part] for value in steady.signals)) for part in (slice(300), slice(300, 380)))
        said = driven(first, fusion)[0][-1].vy
        fusion.lateral_filter.restart(True, said + wrong, 0.1**2)
        fusion._across.axle_error = 0.5
        steps, _ = driven(rest, fusion)
        back.append(1.0 - (steps[-1].vy - said) / wrong)
    assert back[0] > 0.1
    assert back[1] < 0.0


def test_a_bound_leads_v_y_back_and_does_not_make_it_sure() -> None:
    """1 m/s beyond the bound and no surer than 1 m/s: within 0.1 s two axles, each as sure as V_y, take off a third of it."""
    steady = turn(2.0, np.full(400, 0.25))
    fusion = VelocityFusion(CAR, STEP)
    first, rest = (Signals(*(value[part] for value in steady.signals)) for part in (slice(300), slice(300, 320)))
    said = driven(first, fusion)[0][-1].vy
    fusion.lateral_filter.restart(True, said + 1.0, 1.0)
    steps, _ = driven(rest, fusion)
    assert steps[-1].vy - said < 0.5
    assert 0.5 < steps[-1].vy_deviation < 0.8  # 0.24 if a bound counts as what V_y is


def test_evidence_with_a_gap_starts_over() -> None:
    clock = VelocityFusion(CAR, STEP).lateral_reset
    for _ in range(3):
        assert not any(clock(STEP, 20.0, CALM, (True, True)) for _ in range(int(0.9 * SETTINGS.lost_time / STEP)))
        assert not clock(STEP, 20.0, CALM._replace(used=(True, True)), (True, True))
    saved = VelocityFusion(CAR, STEP)
    for _ in range(150):
        clock(STEP, 20.0, CALM, (True, True))
    saved.lateral_reset.restore(clock.save())
    assert saved.lateral_reset.contradicted == clock.contradicted > 0.7
