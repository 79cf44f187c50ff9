"""Everything that goes wrong with a car's sensors: finite and flagged while it lasts, and forgotten after a stated time.

One drive, 2 m/s^2 for 2 s and -3 m/s^2 for 2 s from 10 m/s, once without and once with every fault between 1 and 1.5 s,
all of them as entries of one batch. While a fault lasts V_x may err by its `during` bound, from one second behind it by 0.1 m/s.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

from estimators import AttitudeObserver, Flag
from estimators.arrays import FloatArray
from estimators.faults import DRIVING
from estimators.pipeline import Check, EstimationPipeline, PipelineStep, VehicleSignals
from estimators.signals import TickSpeed
from estimators.vehicle import VehicleParameters
from tests.support.pipeline_truth import BIAS, CAR, TIME, Truth, finite, noisy, run, sample, straight

DRIVE = straight(np.repeat([2.0, -3.0], 400), 10.0)
N = DRIVE.ax.size
BEFORE, START, END, SETTLED = slice(0, 190), 200, 300, slice(500, N)
LOST = slice(START, END)
TOLERANCE = 0.1  # m/s, without faults and behind them


class Fault(NamedTuple):
    change: Callable[[Truth], None]  # in place, on copies
    during: float  # m/s
    flags: Flag = Flag.NONE
    wheel_flags: Flag = Flag.NONE
    check: Check = Check.NONE


def put(name: str, value: float, corner: int | None = None) -> Callable[[Truth], None]:
    def change(truth: Truth) -> None:
        signal = getattr(truth, name)
        signal[LOST if corner is None else (LOST, corner)] = value

    return change


def all_at_once(value: float) -> Callable[[Truth], None]:
    def change(truth: Truth) -> None:
        for name in ("wheel_speed", "torque", "steer", "ax", "ay", "yaw_rate"):
            getattr(truth, name)[LOST] = value

    return change


def frozen(name: str) -> Callable[[Truth], None]:
    def change(truth: Truth) -> None:
        signal = getattr(truth, name)
        signal[LOST] = signal[START]

    return change


def spun(truth: Truth) -> None:
    """Two wheels lose their grip: half of their force is left, and their surface is twice as fast as the car."""
    rise = np.interp(np.arange(END - START), [0, 15, 80, 99], [1.0, 2.0, 2.0, 1.0])[:, None]
    truth.wheel_speed[LOST, :2] *= rise
    spin = np.gradient(truth.wheel_speed[LOST, :2], TIME, axis=0)
    truth.torque[LOST, :2] = 0.5 * DRIVE.force_x[LOST, :2] * CAR.radius[:2] + CAR.wheel_inertia * spin
    truth.ax[LOST] -= 0.5 * DRIVE.force_x[LOST, :2].sum(axis=1) / CAR.mass


def locked(truth: Truth) -> None:
    """A brake holds one wheel still."""
    fall = np.interp(np.arange(END - START), [0, 10, 85, 99], [1.0, 0.0, 0.0, 1.0])
    truth.wheel_speed[LOST, 0] *= fall
    truth.torque[LOST, 0] = -4000.0


def split(truth: Truth) -> None:
    """The left wheels are on ice: hardly any force, and they spin; the car pulls to the right, where a driver holds it."""
    truth.wheel_speed[LOST, ::2] *= np.interp(np.arange(END - START), [0, 20, 90, 99], [1.0, 1.6, 1.6, 1.0])[:, None]
    spin = np.gradient(truth.wheel_speed[LOST, ::2], TIME, axis=0)
    truth.torque[LOST, ::2] = 0.1 * DRIVE.force_x[LOST, ::2] * CAR.radius[::2] + CAR.wheel_inertia * spin
    truth.ax[LOST] -= 0.9 * DRIVE.force_x[LOST, ::2].sum(axis=1) / CAR.mass


MISSING, LATE = Flag.MISSING_MEASUREMENT, Flag.STALE_MEASUREMENT
FAULTS = {
    "no acceleration": Fault(put("ax", np.nan), 0.2, Flag.MISSING_INPUT),
    "infinite acceleration": Fault(put("ax", np.inf), 0.2, Flag.MISSING_INPUT),
    "absurd acceleration": Fault(put("ax", 1e9), 0.2, Flag.PARAMETER_OUT_OF_RANGE),
    "no yaw rate": Fault(put("yaw_rate", np.nan), 0.2, Flag.MISSING_INPUT),
    "no steering": Fault(put("steer", np.nan), 0.2, Flag.MISSING_INPUT),
    "no wheel speeds": Fault(put("wheel_speed", np.nan), 0.2, wheel_flags=MISSING, check=Check.NO_WHEEL),
    "infinite wheel speeds": Fault(put("wheel_speed", -np.inf), 0.2, wheel_flags=MISSING, check=Check.NO_WHEEL),
    "loss of one wheel speed": Fault(put("wheel_speed", np.nan, 2), 0.1, wheel_flags=MISSING),
    "loss of torque": Fault(put("torque", np.nan), 0.1, wheel_flags=Flag.MISSING_INPUT, check=Check.UNKNOWN_FORCE),
    "nothing at all": Fault(all_at_once(np.nan), 1.2, Flag.MISSING_INPUT, MISSING, Check.NO_WHEEL),
    "nothing but infinities": Fault(all_at_once(np.inf), 1.2, Flag.MISSING_INPUT, MISSING, Check.NO_WHEEL),
    "stale acceleration": Fault(frozen("ax"), 0.2, Flag.STALE_MEASUREMENT),
    "stale wheel speeds": Fault(frozen("wheel_speed"), 0.4, wheel_flags=Flag.STALE_MEASUREMENT),
    "wheel spin": Fault(spun, 0.15),
    "wheel lock": Fault(locked, 0.15, check=Check.UNKNOWN_FORCE),
    "split friction": Fault(split, 0.15),
}


def copied(truth: Truth) -> Truth:
    return Truth(*(np.array(array) for array in truth))


class Faulted(NamedTuple):
    truth: Truth
    steps: list[PipelineStep]
    vx: FloatArray  # (n, faults + 1), the last without a fault
    true_vx: FloatArray


@pytest.fixture(scope="module")
def faulted() -> Faulted:
    runs, speeds = [], []
    for fault in (*FAULTS.values(), None):
        one, vx = copied(noisy(DRIVE, 7, BIAS)), DRIVE.vx
        if fault is not None:
            before = one.ax.copy()
            fault.change(one)
            if fault.change in (spun, split):  # less force, so the car gets less far, and all its wheels with it
                slower = TIME * np.cumsum(before - one.ax)
                vx = DRIVE.vx - slower
                one.wheel_speed[:] *= (vx / DRIVE.vx)[:, None]
        runs.append(one)
        speeds.append(vx)
    together = Truth(*(np.stack(column) for column in zip(*runs, strict=True)))
    steps = run(EstimationPipeline(CAR, TIME, (len(runs),)), together)
    return Faulted(together, steps, np.array([s.vx for s in steps]), np.stack(speeds, axis=1))


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_survived_flagged_and_forgotten(faulted: Faulted, name: str) -> None:
    entry, fault = list(FAULTS).index(name), FAULTS[name]
    error = np.abs(faulted.vx - faulted.true_vx)[:, entry]
    inside = faulted.steps[START + 60 : END - 20]  # a signal is stale after 40 equal samples
    for step in inside:
        assert int(fault.flags) & ~int(step.flags[entry]) == 0
        assert int(fault.check) & ~int(step.consistency.failed[entry]) == 0
    for flag in (Flag(bit) for bit in (1, 2, 4) if fault.wheel_flags & bit):
        assert np.mean([bool((step.wheel_flags[entry] & flag).any()) for step in inside]) > 0.8
    assert error[BEFORE].max() < TOLERANCE
    assert error[LOST].max() < fault.during
    assert error[SETTLED].max() < TOLERANCE


def test_an_accelerometer_that_fails_while_the_driver_brakes() -> None:
    """From 0.1 s before 2 m/s^2 turn into -3 to 0.9 s behind it: missing, frozen, of the wrong sign, and off by 5 m/s^2."""
    changes: list[Callable[[FloatArray], FloatArray]] = [
        lambda ax: np.full_like(ax, np.nan),
        lambda ax: np.full_like(ax, ax[0]),
        lambda ax: -ax,
        lambda ax: ax - 5.0,
        lambda ax: ax + 5.0,
    ]
    fails = slice(380, 580)
    runs = [copied(noisy(DRIVE, 7, BIAS)) for _ in changes]
    for truth, change in zip(runs, changes, strict=True):
        truth.ax[fails] = change(truth.ax[fails])
    together = Truth(*(np.stack(column) for column in zip(*runs, strict=True)))
    steps = run(EstimationPipeline(CAR, TIME, (len(runs),)), together)
    error = np.array([step.vx for step in steps]) - DRIVE.vx[:, None]
    wheels = np.abs((CAR.radius * DRIVE.wheel_speed).mean(axis=1) - DRIVE.vx)[fails].max()
    assert np.abs(error[fails]).max() < 0.6 + wheels
    assert np.abs(error[fails.stop + 100 :]).max() < 0.15
    deviation = np.array([step.vx_deviation for step in steps])
    assert (np.abs(error) < 0.1 + 3.0 * deviation)[fails.stop :].all()
    assert all(finite(step) for step in steps)


def test_everything_stays_finite(faulted: Faulted) -> None:
    assert all(finite(step) for step in faulted.steps)


def test_nothing_is_flagged_where_nothing_is_wrong(faulted: Faulted) -> None:
    assert not any(step.flags[-1] & ~DRIVING or step.wheel_flags[-1].any() for step in faulted.steps)
    balance = Check.FORCE_BALANCE | Check.LATERAL_BALANCE | Check.LOAD_SUM | Check.UNKNOWN_FORCE | Check.NO_WHEEL
    assert not any(step.consistency.failed[-1] & balance for step in faulted.steps[20:])


def test_forces_of_lost_wheels_are_a_share_of_what_accelerates_the_car(faulted: Faulted) -> None:
    """All wheels use the same share of their load here, so the guess is right, as far as a_x is: 0.1 m/s^2, 230 N in all."""
    for name in ("loss of torque", "loss of one wheel speed", "no wheel speeds"):
        entry = list(FAULTS).index(name)
        for k in range(START + 20, END):
            np.testing.assert_allclose(faulted.steps[k].force_x[entry], DRIVE.force_x[k], atol=350.0)


def test_the_locked_wheel_is_not_believed(faulted: Faulted) -> None:
    entry = list(FAULTS).index("wheel lock")
    locked_samples = faulted.steps[START + 15 : END - 20]
    assert not any(step.velocity.used[entry, 0] for step in locked_samples)
    assert all(step.slip[entry, 0] < -0.9 for step in locked_samples)


def test_uncertainty_grows_while_blind_and_returns() -> None:
    truth = copied(noisy(DRIVE, 3))
    truth.wheel_speed[LOST] = np.nan
    deviation = np.array([step.vx_deviation for step in run(EstimationPipeline(CAR, TIME), truth, 0, 500)])
    assert deviation[END - 1] > 1.15 * deviation[START - 1]
    assert deviation[-1] < 1.3 * deviation[START - 1]


def test_covariances_do_not_run_away_without_excitation() -> None:
    """Ten seconds blind: finite, bounded, and back at work one second after the wheels."""
    truth = copied(noisy(straight(np.zeros(2400), 15.0), 3))
    truth.wheel_speed[100:2100] = np.nan
    steps = run(EstimationPipeline(CAR, TIME), truth)
    assert all(finite(step) and step.vx_deviation < 40.0 for step in steps)
    assert all(np.all(step.lateral.deviation < 3e4) for step in steps)
    assert abs(steps[-1].vx - 15.0) < 0.2


def test_a_fifty_hertz_wheel_speed_makes_nothing_overconfident() -> None:
    """Every fourth wheel speed is new; forces see no spikes, and the filter does not count one reading four times."""
    slow, fast = copied(noisy(DRIVE, 5)), noisy(DRIVE, 5)
    slow.wheel_speed[:] = np.repeat(slow.wheel_speed[::4], 4, axis=0)
    repeated, every = (run(EstimationPipeline(CAR, TIME), truth) for truth in (slow, fast))
    assert all(a.vx_deviation >= b.vx_deviation - 1e-12 for a, b in zip(repeated[4:], every[4:], strict=True))
    vx = np.array([step.vx for step in repeated])
    assert np.abs(vx - DRIVE.vx)[100:].max() < 0.15
    forces = np.array([step.force_x for step in repeated])[60:380]
    assert np.abs(forces - DRIVE.force_x[60:380]).max() < 800.0
    assert np.mean([bool((s.wheel_flags & Flag.STALE_MEASUREMENT).any()) for s in repeated[4:]]) == pytest.approx(
        0.75, abs=0.05
    )


def test_jitter_and_late_samples() -> None:
    """Stamps off by up to 20 % of the sample time, and one sample that comes 60 ms late."""
    rng = np.random.default_rng(2)
    elapsed = TIME * (1.0 + rng.uniform(-0.2, 0.2, N))
    late = 300
    elapsed[late] = 0.06
    time = np.cumsum(elapsed)
    clock = TIME * np.arange(N + 40)
    long = straight(np.repeat([2.0, -3.0], 420), 10.0)
    signals = noisy(
        Truth(
            *(
                np.stack([np.interp(time, clock, column) for column in array.reshape(N + 40, -1).T], axis=-1).reshape(
                    N, *array.shape[1:]
                )
                for array in long
            )
        ),
        2,
    )
    pipeline = EstimationPipeline(CAR, TIME)
    steps = [pipeline.step(sample(signals, k)._replace(elapsed=elapsed[k])) for k in range(N)]
    failed = np.array([int(step.consistency.failed) & Check.LATE_SAMPLE for step in steps])
    assert np.flatnonzero(failed).tolist() == [late]
    assert steps[late].flags & Flag.STALE_MEASUREMENT
    assert all(finite(step) for step in steps)
    assert np.abs(np.array([step.vx for step in steps]) - signals.vx)[20:].max() < TOLERANCE
    forces = np.array([step.force_x for step in steps])
    assert np.abs(forces - signals.force_x)[late + 40 :].max() < 2500.0


@pytest.mark.parametrize("elapsed", [np.nan, np.inf, -1.0, 0.0])
def test_impossible_times_are_flagged_and_replaced(elapsed: float) -> None:
    pipeline = EstimationPipeline(CAR, TIME)
    run(pipeline, DRIVE, 0, 50)
    step = pipeline.step(sample(DRIVE, 50)._replace(elapsed=elapsed))
    assert step.flags & Flag.MISSING_INPUT
    assert finite(step)
    assert step.vx == pytest.approx(DRIVE.vx[50], abs=TOLERANCE)


def test_quantised_wheel_ticks() -> None:
    """A wheel of 96 teeth, read at 200 Hz: a tick a sample is 13 rad/s, 0.1 s of ticks 0.65 rad/s, 50 ms late."""
    truth = copied(noisy(DRIVE, 6))
    counts = np.floor(np.cumsum(DRIVE.wheel_speed * TIME, axis=0) * 96 / (2 * np.pi))
    ticks = TickSpeed(96, TIME, least_ticks=40)
    truth.wheel_speed[:] = np.array([ticks.step(count).speed for count in counts])
    truth.wheel_speed[: ticks.longest_window] = np.nan  # until its window is full, the counter reads too little
    steps = run(EstimationPipeline(CAR, TIME), truth)
    assert all(finite(step) for step in steps)
    vx = np.array([step.vx for step in steps])
    assert np.abs(vx - DRIVE.vx)[100:].max() < 0.4


def test_standstill_start_from_rest_and_what_it_teaches() -> None:
    """Two seconds at rest show the bias of a_x; the launch behind it starts at zero and is followed."""
    truth = noisy(straight(np.repeat([0.0, 2.5], 400), 0.0), 8, BIAS)
    rest = slice(0, 400)
    truth.wheel_speed[rest] = 0.0
    truth.torque[rest] = -2000.0  # the brake is on: it says nothing about the force
    steps = run(EstimationPipeline(CAR, TIME), truth)
    assert all(finite(step) for step in steps)
    assert np.abs([step.vx for step in steps[100:400]]).max() < 0.05
    assert np.abs([step.sideslip for step in steps[100:400]]).max() < 0.1
    assert np.abs([step.force_x for step in steps[200:400]]).max() < 150.0
    assert all(step.velocity.standing for step in steps[200:395])
    known = steps[395].velocity.sensor_bias[0] + steps[395].velocity.gravity[0]
    assert known == pytest.approx(BIAS[0], abs=0.03)
    error = np.abs(np.array([step.vx for step in steps]) - truth.vx)[400:]
    assert error.max() < 0.2


def test_reverse() -> None:
    drive = noisy(straight(np.full(300, -1.0), -3.0), 9)
    steps = run(EstimationPipeline(CAR, TIME), drive)
    vx = np.array([step.vx for step in steps])
    assert np.abs(vx - drive.vx)[50:].max() < TOLERANCE
    forces = np.array([step.force_x for step in steps])[50:-1]
    assert np.abs(forces.mean(axis=0) - drive.force_x[0]).max() < 80.0
    slips = np.array([step.slip for step in steps])[50:].mean(axis=0)
    assert (slips < 0).all()  # driven backwards: the force points backwards, and so does the slip velocity


def test_bias_of_the_accelerometer_is_learned_while_rolling() -> None:
    truth = noisy(straight(np.zeros(1600), 20.0), 10, (0.3, 0.0, 0.0))
    last = run(EstimationPipeline(CAR, TIME), truth)[-1]
    assert last.velocity.sensor_bias[0] + last.velocity.gravity[0] == pytest.approx(0.3, abs=0.06)
    assert last.vx == pytest.approx(20.0, abs=0.15)


READ = {
    "wheel_speed": 1e4, "steer": 3.0, "torque": 1e6, "ax": 150.0, "ay": -150.0, "az": 150.0, "yaw_rate": 30.0,
    "roll_rate": 30.0, "pitch_rate": -30.0, "grade": 2.0, "bank": -2.0,
}  # fmt: skip


def with_attitude(shape: tuple[int, ...]) -> EstimationPipeline:
    return EstimationPipeline(VehicleParameters.published_suv(), 0.005, shape, attitude=AttitudeObserver(0.005, shape))


def readings(shape: tuple[int, ...]) -> dict[str, FloatArray]:
    """What every sensor reads in a slow turn."""
    given = {"wheel_speed": np.full((*shape, 4), 50.0), "steer": np.full((*shape, 4), 0.02)}
    given["torque"] = np.full((*shape, 4), 50.0)
    for key, value in (("ax", 0.5), ("ay", 1.0), ("yaw_rate", 0.06), ("az", 9.8), ("grade", 0.01)):
        given[key] = np.full(shape, value)
    return given | {key: np.zeros(shape) for key in ("roll_rate", "pitch_rate", "bank")}


@cache
def settled(shape: tuple[int, ...]) -> dict[str, Any]:
    """The memory of a pipeline after 90 samples of that turn."""
    pipeline, given = with_attitude(shape), readings(shape)
    for _ in range(90):
        pipeline.step(VehicleSignals(**given))
    return pipeline.save()


@pytest.mark.parametrize(("shape", "factor"), [((), 1e28), ((3,), 1.0)], ids=["one car", "three cars"])
@pytest.mark.parametrize("name", READ)
def test_what_no_sensor_reads_is_estimated_as_if_it_were_missing(
    name: str, factor: float, shape: tuple[int, ...]
) -> None:
    """Whatever parts read a signal, an attitude among them: bit for bit the forces and velocities of a missing reading."""

    def last(bad: float) -> PipelineStep:
        pipeline, given = with_attitude(shape), readings(shape)
        pipeline.restore(settled(shape))
        given[name][(..., 0) if given[name].ndim > len(shape) else ...] = bad
        for _ in range(20):
            step = pipeline.step(VehicleSignals(**given))
        return step

    found, missing = last(READ[name] * factor), last(np.nan)
    for key in ("force_x", "force_z", "axle_force_y", "vx", "vy"):
        np.testing.assert_array_equal(getattr(found, key), getattr(missing, key), key)
    assert np.all(found.flags != 0)
