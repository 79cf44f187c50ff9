"""The vehicle-level fusion on courses whose truth is known: what it learns, and how it drives on."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.faults import DRIVING, Flag
from estimators.velocity import VelocityFusion
from estimators.velocity.longitudinal_fusion import RADIUS
from tests.support.fusion_course import CAR, STEP, Signals, course, driven, phases, sensed

LAUNCH = phases((1.0, 0.0), (4.0, 3.0), (3.0, 0.0))


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def test_a_plain_drive_is_followed() -> None:
    drive = course(phases((1.0, 0.0), (4.0, 3.0), (2.0, 0.0), (2.0, -4.0)))
    steps, vx = driven(sensed(drive, bias=0.15))
    assert rms(vx - drive.speed) < 0.1  # 0.8 % of the top speed
    assert np.abs([step.vy for step in steps]).max() < 0.1
    final = steps[-1]
    assert np.abs(vx[-1] - drive.speed[-1]) < 3 * final.vx_deviation


def test_slip_is_positive_when_driving() -> None:
    drive = course(phases((1.0, 0.0), (4.0, 3.0)))
    steps, _ = driven(sensed(drive))
    np.testing.assert_allclose(steps[-1].slip, 0.04 * 3.0 / 9.80665, atol=0.008)


def test_standstill_gives_the_bias() -> None:
    drive = course(phases((5.0, 0.0)))
    signals = sensed(drive, bias=0.3)._replace(yaw_rate=0.01 + sensed(drive).yaw_rate)
    steps, vx = driven(signals)
    assert steps[-1].standing
    assert abs(vx[-1]) < 0.01
    assert steps[-1].sensor_bias[0] + steps[-1].gravity[0] == pytest.approx(0.3, abs=0.02)
    assert steps[-1].sensor_bias[2] == pytest.approx(0.01, abs=1e-3)
    assert steps[-1].yaw_rate == pytest.approx(0.0, abs=0.01)


def test_a_single_wrong_radius_is_learned_in_free_rolling() -> None:
    drive = course(phases((30.0, 0.0)), start=20.0)
    signals = sensed(drive)
    signals.wheel_speed[:, 2] *= 1.012  # rear left 1.2 % smaller than its catalogue says
    steps, _ = driven(signals)
    relative = steps[-1].radius / CAR.radius
    assert relative[2] / np.mean(relative[[0, 1, 3]]) == pytest.approx(1 / 1.012, abs=0.002)


def test_a_common_wrong_radius_is_learned_from_standstill() -> None:
    """The inertial unit, its bias known from standstill, tells the speed but for its scale and the grade."""
    drive = course(phases((2.0, 0.0), (3.0, 7.0), (3.0, 0.0)))
    signals = sensed(drive)
    signals.wheel_speed[:] *= 1.02
    _, vx = driven(signals)
    rolling = drive.speed > 20.9
    wheels = (CAR.radius * signals.wheel_speed).mean(axis=1)
    assert rms((vx - drive.speed)[rolling]) < 0.7 * rms((wheels - drive.speed)[rolling])


def test_no_radius_is_learned_from_wheels_that_pull() -> None:
    drive = course(phases((1.0, 0.0), (6.0, 3.0)))
    fusion = VelocityFusion(CAR, STEP)
    signals = sensed(drive)
    driven(Signals(*(value[:200] for value in signals)), fusion)
    before = fusion.longitudinal_filter.state[0, RADIUS:]
    steps, _ = driven(Signals(*(value[210:] for value in signals)), fusion)
    np.testing.assert_allclose(fusion.longitudinal_filter.state[0, RADIUS:], before, rtol=1e-3, atol=1e-9)
    assert steps[-1].used.all()


@pytest.mark.parametrize("wheels", [[0], [0, 1], [1, 3], [0, 1, 2, 3]])
def test_spinning_wheels_are_left_out(wheels: list[int]) -> None:
    """One wheel, an axle, one side on ice, all: 0.8 s up to twice the speed."""
    drive = course(LAUNCH)
    signals = sensed(drive, bias=0.1)
    spin = slice(500, 660)
    extra = np.sin(np.linspace(0, np.pi, 160))[:, None]
    signals.wheel_speed[spin, wheels] *= 1.0 + extra
    steps, vx = driven(signals)
    assert rms(vx - drive.speed) < 0.12
    middle = steps[580]
    assert not middle.used[wheels].any()
    assert (middle.gated | middle.high_slip)[wheels].all()
    mean = (CAR.radius * signals.wheel_speed).mean(axis=1)
    assert rms((vx - drive.speed)[spin]) < 0.2 * rms((mean - drive.speed)[spin])


def test_locked_wheels_are_not_standstill() -> None:
    """All four locked on ice from 15 m/s: silent wheels, but a sliding car decelerates."""
    drive = course(phases((2.0, 0.0), (3.0, -2.0)), start=15.0)
    signals = sensed(drive)
    signals.wheel_speed[420:] = 0.0
    steps, vx = driven(signals)
    assert not any(step.standing for step in steps)
    assert np.abs(vx - drive.speed).max() < 0.6
    assert not steps[-1].used.any()


def test_braking_to_a_stop_ends_in_standstill() -> None:
    drive = course(phases((1.0, 0.0), (2.5, -4.0), (1.0, 0.0)), start=10.0)
    steps, vx = driven(sensed(drive))
    assert steps[-1].standing
    assert abs(vx[-1]) < 0.05


def test_backwards() -> None:
    drive = course(phases((1.0, 0.0), (3.0, -1.5), (2.0, 0.0), (2.0, 1.5)))
    steps, vx = driven(sensed(drive))
    assert drive.speed.min() < -4.0
    assert rms(vx - drive.speed) < 0.08
    assert steps[700].slip.mean() < 0.01  # pulled backwards: negative slip, or hardly any
    assert np.abs([step.vy for step in steps]).max() < 0.1


def test_jitter_and_gaps_are_harmless_if_told() -> None:
    drive = course(LAUNCH)
    signals = sensed(drive)
    rng = np.random.default_rng(1)
    kept = np.sort(rng.choice(drive.speed.size, drive.speed.size // 2, replace=False))
    kept = kept[(kept < 700) | (kept > 760)]  # and 0.3 s without anything
    elapsed = STEP * np.diff(kept, prepend=kept[0] - 1)
    mean_ax = np.array([drive.ax[a + 1 : b + 1].mean() for a, b in pairwise(kept)])
    thinned = Signals(*(value[kept] for value in signals))
    thinned.ax[1:] = mean_ax
    _, vx = driven(thinned, elapsed=elapsed)
    assert rms(vx - drive.speed[kept]) < 0.12


def test_quantised_ticks() -> None:
    drive = course(LAUNCH)
    signals = sensed(drive)
    signals.wheel_speed[:] = np.round(drive.wheel_speed / 0.5) * 0.5
    _, vx = driven(signals)
    assert rms(vx - drive.speed) < 0.12


def test_no_torque_means_shared_force() -> None:
    drive = course(LAUNCH)
    signals = sensed(drive)
    _, with_force = driven(signals)
    _, without = driven(signals._replace(force=np.full_like(signals.force, np.nan)))
    assert rms(without - drive.speed) < rms(with_force - drive.speed) + 0.02


def test_batches_are_runs() -> None:
    drive = course(LAUNCH[:600])
    runs = [sensed(drive, seed, bias=0.1 * seed) for seed in range(3)]
    together = VelocityFusion(CAR, STEP, (3, 1))
    alone = [VelocityFusion(CAR, STEP) for _ in runs]
    for k in range(600):
        stacked = [np.stack([np.asarray(run[i][k]) for run in runs])[:, None] for i in range(6)]
        batch = together.step(*stacked)
        for row, (run, fusion) in enumerate(zip(runs, alone, strict=True)):
            single = fusion.step(*(signal[k] for signal in run))
            assert batch.vx[row, 0] == pytest.approx(float(single.vx), rel=1e-9, abs=1e-9)
            assert batch.vy[row, 0] == pytest.approx(float(single.vy), rel=1e-7, abs=1e-9)


def test_saved_and_restored() -> None:
    drive = course(LAUNCH[:500])
    signals = sensed(drive)
    one, two = VelocityFusion(CAR, STEP), VelocityFusion(CAR, STEP)
    driven(Signals(*(value[:300] for value in signals)), one)
    two.restore(one.save())
    rest = Signals(*(value[300:] for value in signals))
    for a, b in zip(driven(rest, one)[0], driven(rest, two)[0], strict=True):
        for mine, yours in zip(a, b, strict=True):
            np.testing.assert_array_equal(mine, yours)
    with pytest.raises(EstimatorError, match="another estimator"):
        VelocityFusion(CAR, STEP, (2,)).restore(one.save())


def test_reset() -> None:
    fusion = VelocityFusion(CAR, STEP, (2,))
    arguments = (np.full((2, 4), 30.0), np.zeros((2, 4)), np.zeros(2), np.zeros(2), np.zeros(2))
    fusion.step(*arguments)
    fusion.reset(np.array([True, False]), vx=12.0, vy=0.3)
    step = fusion.step(*arguments)
    np.testing.assert_array_equal(step.flags & ~DRIVING, [Flag.RESET, 0])
    assert step.vx[1] == pytest.approx(30.0 * 0.33, abs=0.05)
    assert 9.5 < step.vx[0] < 12.1
    assert not (fusion.step(*arguments).flags & ~DRIVING).any()


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(EstimatorError, match="above 1 s"):
        VelocityFusion(CAR, 5.0)
    with pytest.raises(EstimatorError, match="sample_time"):
        VelocityFusion(CAR, float("nan"))
    with pytest.raises(EstimatorError, match="no entries"):
        VelocityFusion(CAR, STEP, (0,))
    fusion = VelocityFusion(CAR, STEP)
    with pytest.raises(EstimatorError, match="wheel_speed"):
        fusion.step(np.zeros(3), np.zeros(4), 0.0, 0.0, 0.0)
    with pytest.raises(EstimatorError, match="where"):
        fusion.reset(np.ones(3, dtype=np.bool_))
