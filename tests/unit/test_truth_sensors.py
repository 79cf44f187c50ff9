"""Sensor errors: their statistics, their seeds, and what a pipeline is handed."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.pipeline import EstimationPipeline
from studies.truth import PERFECT, Channel, Drops, Sensors, Ticks, Truth, draw, simulate
from studies.truth.sensors import SOURCES
from synthesis.errors import SpecError
from tests.support.truth_cases import course, ramp, suv

RNG = np.random.SeedSequence(7)


@pytest.fixture(scope="module")
def truth() -> Truth:
    courses = [
        course(speed=10.0, duration=1.0, steer=ramp(0.1, 0.3, 0.05), name="turn"),
        course(speed=12.0, duration=1.0, drive_torque=ramp(0.1, 0.3, 2000.0), name="pull"),
    ]
    return simulate(courses, [suv(), suv()], record_time=0.001)


def rng(k: int = 0) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence((k, 99)))


def test_perfect_sensors_read_the_truth(truth: Truth) -> None:
    measured = draw(truth, PERFECT, [0, 1])
    for name, source in SOURCES.items():
        assert measured.signals[name][1] == pytest.approx(truth.every(5)[source], abs=0.0)
    assert measured.batch_shape == (2, 2) and measured.time[1] == pytest.approx(0.005)


def test_noise_bias_scale_and_resolution() -> None:
    true = np.tile(np.array([0.0, 10.0]), (4000, 1))
    noisy = Channel(noise=0.3).read(true, rng(), 0.005)
    assert (noisy - true).std(axis=0) == pytest.approx([0.3, 0.3], rel=0.05)
    many = np.array([Channel(bias=0.5, scale=0.1).read(true[:2], rng(k), 0.005)[0] for k in range(2000)])
    assert many.mean(axis=0) == pytest.approx([0.0, 10.0], abs=0.1)
    assert many.std(axis=0) == pytest.approx([0.5, np.hypot(0.5, 1.0)], rel=0.06)
    steps = Channel(resolution=0.25).read(np.linspace(0, 1, 101), rng(), 0.005)
    assert set(np.round(steps / 0.25, 12) % 1.0) == {0.0}


def test_late_and_slow_sensors() -> None:
    true = np.arange(100.0)
    late = Channel(delay=0.02).read(true, rng(), 0.005)
    assert late[10] == 6.0 and late[0] == 0.0
    slow = Channel(period=0.02).read(true, rng(), 0.005)
    assert slow[8:13].tolist() == [8.0, 8.0, 8.0, 8.0, 12.0]


def test_independent_drops() -> None:
    lost = Drops(0.2).lost(rng(), 20000, (3,))
    assert lost.mean(axis=0) == pytest.approx([0.2] * 3, abs=0.012)
    after = lost[1:][lost[:-1]].mean()
    assert after == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize(("share", "burst"), [(0.1, 5.0), (0.3, 12.0), (0.45, 1.05)])
def test_bursts_are_gilberts_chain(share: float, burst: float) -> None:
    """Long-run share, mean length of a burst and of a gap between bursts."""
    lost = Drops(share, burst).lost(rng(3), 60000, ())
    assert lost.mean() == pytest.approx(share, rel=0.08)
    assert lost[1:][lost[:-1]].mean() == pytest.approx(1.0 - 1.0 / burst, abs=0.015)
    enter = share / ((1.0 - share) * burst)
    assert lost[1:][~lost[:-1]].mean() == pytest.approx(enter, rel=0.08)


def test_elliotts_bad_state_lets_some_through() -> None:
    lost = Drops(0.2, 10.0, received_in_bad=0.4).lost(rng(), 60000, ())
    assert lost.mean() == pytest.approx(0.2, rel=0.1)
    assert lost[1:][lost[:-1]].mean() == pytest.approx(0.9 * 0.6, abs=0.04)


def test_dropped_samples_are_missing_or_held() -> None:
    true = np.arange(2000.0)
    drops = Drops(0.3)
    gone = Channel(drops=drops).read(true, rng(), 0.005)
    held = Channel(drops=drops, dropped="hold").read(true, rng(), 0.005)
    lost = np.isnan(gone)
    assert lost.mean() == pytest.approx(0.3, abs=0.04)
    assert (held[~lost] == true[~lost]).all()
    assert (held[1:][lost[1:]] == held[:-1][lost[1:]]).all()


def test_errors_belong_to_seed_manoeuvre_and_signal_alone(truth: Truth) -> None:
    every = draw(truth, Sensors(), [3, 4, 5])
    alone = draw(truth.only("pull"), Sensors(), [5])
    for name in SOURCES:
        assert (every.signals[name][2, 1] == alone.signals[name][0, 0]).all()
    error = every.signals["ax"] - truth.every(5)["ax"]
    assert np.abs(np.corrcoef(error.reshape(6, -1) - error.reshape(6, -1).mean(axis=1, keepdims=True))
                  - np.eye(6)).max() < 0.35  # fmt: skip


def test_equal_manoeuvres_of_a_batch_have_errors_of_their_own() -> None:
    same = course(speed=10.0, duration=0.1)
    measured = draw(simulate([same, same], [suv(), suv()]), Sensors(), [0])
    assert (measured.signals["ax"][0, 0] != measured.signals["ax"][0, 1]).all()


def test_wheel_ticks(truth: Truth) -> None:
    measured = draw(truth, Sensors(ticks=Ticks(teeth=96)), range(4))
    speed, true = measured.signals["wheel_speed"], measured.truth["wheel_speed"]
    # the counter averages over its window and is right to a tick: 8 ticks of 96 are 0.52 rad, 20 ms at 30 rad/s
    settled = slice(40, None)
    assert np.abs(speed - true)[:, :, settled].max() < 2 * np.pi / 96 / 0.015 + 0.8
    assert len(np.unique(speed[0, 0, settled, 0])) < 60 < len(np.unique(true[0, settled, 0]))
    assert (speed[0] != speed[1]).any()  # teeth stand elsewhere


def test_the_pipeline_takes_what_is_measured(truth: Truth) -> None:
    measured = draw(truth, Sensors(), range(3))
    pipeline = EstimationPipeline(suv().parameters, measured.sample_time, measured.batch_shape)
    steps = [pipeline.step(signals) for signals in measured]
    speed = np.stack([step.vx for step in steps], axis=-1)
    assert speed.shape == (3, 2, measured.time.size)
    assert np.abs(speed - measured.truth["vx"])[..., 20:].max() < 0.4


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Drops(1.2), "share in"),
        (lambda: Drops(0.9, 2.0), "cannot be so frequent"),
        (lambda: Drops(0.5, 5.0, received_in_bad=0.6), "below 1 - received_in_bad"),
        (lambda: Channel(noise=-1.0), "sensor.noise"),
        (lambda: Channel(dropped="gone"), "write missing or hold"),
        (lambda: Ticks(0), "at least 1"),
    ],
)
def test_sensors_that_cannot_be(make: object, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        make()  # type: ignore[operator]


def test_what_cannot_be_drawn(truth: Truth) -> None:
    with pytest.raises(SpecError, match="not a multiple"):
        draw(truth, PERFECT, [0], sample_time=0.0017)
    with pytest.raises(SpecError, match="no seeds"):
        draw(truth, PERFECT, [])
    few = simulate([course(duration=0.1)], [suv()], record=("vx", "vy"))
    with pytest.raises(SpecError, match="unknown signal 'wheel_speed'"):
        draw(few, PERFECT, [0])
