"""The controller of any size: against the law and the loop written out, limits, starts, every fault, saved and restored."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from estimators import GainSchedule, LpvController
from estimators.arrays import FloatArray
from estimators.errors import EstimatorError, RangeError, ScheduleError
from estimators.faults import Flag
from tests.support.any_size import PERIOD, any_schedule

Limits = tuple[tuple[float, float] | None, ...]


def law_schedule(
    order: int = 2, measured: str = "outputs", parameters: int = 1, limits: Limits = (), seed: int = 0, **more: Any
) -> GainSchedule:
    """Three states, two inputs, two outputs of which the inputs act on the second at once."""
    rng = np.random.default_rng(seed + 100)
    nv = 3 if measured == "states" else 2
    table = 0.4 * rng.normal(size=((3,) * parameters + (order + 2, order + nv)))
    if measured == "outputs" and order:
        table[..., order:, order + 1] = 0.0
    plain = any_schedule((3, 2, 2), parameters, seed, speed=5.0)
    D = np.array(plain.plant["D"].coefficients)
    D[..., 0, :] = 0.0
    plant = {**plain.plant, "D": plain.plant["D"]._replace(coefficients=D)}
    values = {
        "table": table,
        "update": "feedback",
        "measured": measured,
        "order": order,
        "limits": limits,
        "plant": plant,
    }
    return any_schedule((3, 2, 2), parameters, seed, speed=5.0, **(values | more))


def parts(schedule: GainSchedule, p: FloatArray) -> tuple[FloatArray, ...]:
    K, k = schedule.gain(p if len(schedule.parameters) > 1 else p[0]), schedule.order
    return K[:k, :k], K[:k, k:], K[k:, :k], K[k:, k:]


@pytest.mark.parametrize(("order", "measured", "parameters"), [(0, "states", 1), (2, "outputs", 2), (1, "states", 3)])
def test_a_step_is_the_law(order: int, measured: str, parameters: int) -> None:
    schedule = law_schedule(order, measured, parameters)
    rng, controller = np.random.default_rng(1), LpvController(schedule)
    many = LpvController(schedule, (2, 3))
    x, before = np.zeros(order), np.zeros(2)
    for k in range(6):
        p = np.arange(parameters) + rng.uniform(0.9, 0.94, parameters)
        v = rng.normal(size=3 if measured == "states" else 2)
        step = controller.step(v, p)
        together = many.step(np.broadcast_to(v, (2, 3, len(v))), np.broadcast_to(p, (2, 3, parameters)))
        Ak, Bk, Ck, Dk = parts(schedule, p)
        u = Ck @ x + Dk @ v
        D = schedule.plant_at(p if parameters > 1 else p[0]).D
        x = Ak @ x + Bk @ (v if measured == "states" else v + D @ (u - before))
        before = u
        np.testing.assert_allclose(step.command, u, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(controller.state, x, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(together.command, np.broadcast_to(u, (2, 3, 2)), rtol=1e-12, atol=1e-13)
        assert step.used and step.flags == 0 and not step.limited.any() and k < 6


def test_what_runs_is_the_loop_that_is_proved() -> None:
    """Plant and controller, sample by sample with measurements taken before the command acts, are the matrix of the proof."""
    schedule = law_schedule()
    plant = schedule.plant_at(0.8)
    controller, (Ak, Bk, Ck, Dk) = LpvController(schedule), parts(schedule, np.array([0.8]))
    whole = expm(np.block([[plant.A, plant.B], [np.zeros((2, 5))]]) * PERIOD)
    Phi, Gamma = whole[:3, :3], whole[:3, 3:]
    of_u = np.hstack([Dk @ plant.C, Ck])
    of_y = np.hstack([plant.C, np.zeros((2, 2))]) + plant.D @ of_u
    loop = np.vstack([np.hstack([Phi, np.zeros((3, 2))]) + Gamma @ of_u, np.hstack([np.zeros((2, 3)), Ak]) + Bk @ of_y])
    x, u, both = np.array([1.0, -0.5, 0.3]), np.zeros(2), np.array([1.0, -0.5, 0.3, 0.0, 0.0])
    for _ in range(30):
        u = controller.step(plant.C @ x + plant.D @ u, 0.8).command
        x, both = Phi @ x + Gamma @ u, loop @ both
        np.testing.assert_allclose(np.concatenate([x, controller.state]), both, rtol=1e-9, atol=1e-12)


def integrator(limit: float) -> GainSchedule:
    """A PI law u = 4 I - 2 y, I+ = I - T y, of y = x - 1 on the plant x' = -x + u: constant gains."""
    gain = np.array([[1.0, -PERIOD], [4.0, -2.0]])
    one = any_schedule((1, 1, 1), 1)
    plant = {key: part._replace(coefficients=0.0 * part.coefficients[:1]) for key, part in one.plant.items()}
    return any_schedule(
        (1, 1, 1), 1, table=np.broadcast_to(gain, (3, 2, 2)).copy(), update="feedback", measured="outputs", order=1,
        limits=((-limit, limit),), plant=plant,
    )  # fmt: skip


def test_conditioning_keeps_an_integrator_from_winding_up() -> None:
    """A step of the reference with a weak actuator: without limits, with conditioning, and as it would be without it."""

    def overshoot(limit: float, condition: bool) -> tuple[float, float]:
        controller, x, peak, largest = LpvController(integrator(limit)), -3.0, -3.0, 0.0
        memory = 0.0
        for _ in range(2000):
            y = x - 1.0
            if condition:
                u = float(controller.step([y], 0.5).command[0])
                largest = max(largest, abs(float(controller.state[0])))
            else:
                u, memory = float(np.clip(4.0 * memory - 2.0 * y, -limit, limit)), memory - PERIOD * y
            x = x * np.exp(-PERIOD) + u * (1.0 - np.exp(-PERIOD))
            peak = max(peak, x)
        return peak - 1.0, largest

    conditioned, largest = overshoot(1.2, True)
    wound, _ = overshoot(1.2, False)
    assert conditioned < 0.05 and wound > 0.15
    assert largest < 3.0  # u = 4 I - 2 y stays consistent with |u| <= 1.2 and |y| <= 4


def test_a_cut_command_is_what_the_conditioned_state_commands() -> None:
    schedule = law_schedule(limits=((-0.1, 0.1), None))
    controller, rng = LpvController(schedule, (50,)), np.random.default_rng(3)
    state = rng.normal(size=(50, 2))
    controller._state[:] = state
    v, p = rng.normal(size=(50, 2)), rng.uniform(0.9, 1.1, (50, 1))
    step = controller.step(v, p)
    assert step.limited[:, 0].any() and not step.limited[:, 1].any() and np.abs(step.command[:, 0]).max() <= 0.1
    for k in np.flatnonzero(step.limited[:, 0]):
        Ak, Bk, Ck, Dk = parts(schedule, p[k])
        nearest = state[k] + np.linalg.lstsq(Ck, step.command[k] - Ck @ state[k] - Dk @ v[k])[0]
        np.testing.assert_allclose(Ck @ nearest + Dk @ v[k], step.command[k], atol=1e-9)
        D = schedule.plant_at(p[k, 0]).D
        np.testing.assert_allclose(controller.state[k], Ak @ nearest + Bk @ (v[k] + D @ step.command[k]), atol=1e-9)


def test_a_start_is_without_a_bump() -> None:
    controller = LpvController(integrator(10.0), (3,))
    u, y = np.array([[0.7], [2.0], [-30.0]]), np.array([[0.0], [0.4], [0.0]])
    controller.start(u, y, np.full((3, 1), 0.5))
    step = controller.step(y, np.full((3, 1), 0.5))
    np.testing.assert_allclose(step.command, [[0.7], [2.0], [-10.0]], rtol=1e-12)
    assert (step.flags == Flag.RESET).all()
    np.testing.assert_allclose(controller.step(y[:1].repeat(3, 0), np.full((3, 1), 0.5)).command[0], 0.7, rtol=1e-12)
    # Two states, two inputs: the command is met exactly; of one input the state that rests is chosen.
    several = LpvController(law_schedule(parameters=2))
    several.start([0.3, -0.2], [0.1, 0.5], [0.8, 1.9])
    np.testing.assert_allclose(several.step([0.1, 0.5], [0.8, 1.9]).command, [0.3, -0.2], rtol=1e-9)
    # Three states for two inputs: of all that command it, the one that moves least (conditions of Lagrange).
    schedule = law_schedule(3)
    resting, (u, y) = LpvController(schedule), (np.array([0.3, -0.2]), np.array([0.1, 0.5]))
    resting.start(u, y, 0.8)
    Ak, Bk, Ck, Dk = parts(schedule, np.array([0.8]))
    drift = np.eye(3) - Ak
    kkt = np.block([[drift.T @ drift, Ck.T], [Ck, np.zeros((2, 2))]])
    nearest = np.linalg.solve(kkt, np.concatenate([drift.T @ Bk @ y, u - Dk @ y]))[:3]
    np.testing.assert_allclose(resting.state, nearest, rtol=1e-6)
    # Without measurements the law waits: state and command are kept.
    kept = resting.step([np.nan, 0.5], 0.8)
    np.testing.assert_array_equal(kept.command, u)
    np.testing.assert_allclose(resting.state, nearest, rtol=1e-6)
    with pytest.raises(RangeError, match="outside the certified range"):
        several.start([0.3, -0.2], [0.1, 0.5], [0.8, 9.0])
    with pytest.raises(EstimatorError, match="not finite"):
        several.start([np.nan, 0.0], [0.1, 0.5], [0.8, 1.9])


def test_faults_are_flagged_and_commands_stay_finite_and_within_limits() -> None:
    schedule = law_schedule(0, "states", limits=((-1.0, 1.0), (0.2, 2.0)))
    controller, v = LpvController(schedule, (4,), stale_after=3, hold=2), np.array([1.0, -2.0, 0.5])
    assert (LpvController(schedule)._command == [0.0, 0.2]).all()  # rest: nearest to zero within limits
    first = controller.step(np.tile(v, (4, 1)), np.full((4, 1), 0.5))
    measured = np.tile(v, (4, 1))
    measured[0, 1] = np.nan
    parameter = np.array([[0.5], [np.nan], [9.0], [0.5]])
    for k in range(6):
        measured[1:3] += 0.01
        step = controller.step(measured, parameter)
        assert step.flags[0] == Flag.MISSING_MEASUREMENT and not step.used[0]
        factor = 0.5 ** max(0, k + 1 - 2)
        rest = np.array([0.0, 0.2])
        np.testing.assert_allclose(step.command[0], rest + factor * (first.command[0] - rest), rtol=1e-12)
        assert step.flags[1] & Flag.MISSING_PARAMETER and step.flags[2] & Flag.PARAMETER_OUT_OF_RANGE
        assert step.parameter[:, 0].tolist() == [0.5, 0.5, 2.0, 0.5]
        assert bool(step.flags[3] & Flag.STALE_MEASUREMENT) == (k >= 2) == (not step.used[3])
        assert (
            np.isfinite(step.command).all()
            and (step.command <= [1.0, 2.0]).all()
            and (step.command >= [-1.0, 0.2]).all()
        )
    with pytest.raises(RangeError, match="outside the certified range"):
        LpvController(schedule, outside="refuse").step(v, 9.0)
    wild = law_schedule(table=np.full((3, 4, 4), 1e30))
    grown = LpvController(wild)
    grown.start([1e60, 1e60], [1e60, 0.0], 0.5)
    for _ in range(5):
        assert np.isfinite(grown.step([1e90, 0.0], 0.5).command).all()


def test_saved_and_restored_bit_for_bit() -> None:
    schedule, rng = law_schedule(limits=((-0.3, 0.3), None)), np.random.default_rng(7)
    one, other = LpvController(schedule, (5,)), LpvController(schedule, (5,))
    feed = [(rng.normal(size=(5, 2)), rng.uniform(0.9, 0.94, (5, 1))) for _ in range(6)]
    feed[2][0][1] = np.nan
    for v, p in feed[:3]:
        one.step(v, p)
    other.restore(one.save())
    for v, p in feed[3:]:
        left, right = one.step(v, p), other.step(v, p)
        assert (left.command == right.command).all() and (left.flags == right.flags).all()
    with pytest.raises(EstimatorError, match="saved with another schedule"):
        LpvController(law_schedule(sha256="1" * 64), (5,)).restore(one.save())
    mask = np.array([True, False, True, False, False])
    one.reset(mask)
    assert (one.state[mask] == 0.0).all() and (one.state[~mask] != 0.0).any()
    assert (one.step(*feed[0]).flags != 0).tolist() == mask.tolist()


def test_what_is_no_controller_is_refused() -> None:
    with pytest.raises(ScheduleError, match="that of an observer; take LpvObserver"):
        LpvController(any_schedule())
    schedule = law_schedule()
    for option, words in (
        ({"outside": "clip"}, "outside"),
        ({"stale_after": 0}, "stale_after"),
        ({"hold": -1}, "hold"),
    ):
        with pytest.raises(EstimatorError, match=words):
            LpvController(schedule, **option)
    with pytest.raises(EstimatorError, match=r"measurement has shape \(3,\), expected \(2,\)"):
        LpvController(schedule).step(np.zeros(3), 0.5)
    with pytest.raises(ScheduleError, match="overflow float64"):
        LpvController(law_schedule(table=np.full((3, 4, 4), 1e60)))


def test_what_no_gain_uses_needs_no_value() -> None:
    """An output that only weighs in the design: NaN in its place is no lost sample, in the place of the other it is."""
    schedule = law_schedule()
    table = schedule.table.copy()
    table[..., 3] = 0.0  # of two own states and two outputs
    controllers = [LpvController(law_schedule(table=table)) for _ in range(2)]
    for value in (0.4, -0.2):
        steps = [one.step([value, other], 0.9) for one, other in zip(controllers, (np.nan, 7.0), strict=True)]
        assert steps[0].used and steps[0].flags == steps[1].flags
        np.testing.assert_array_equal(steps[0].command, steps[1].command)
    controllers[0].start([0.1, 0.1], [0.3, np.nan], 0.9)
    assert not controllers[0].step([np.nan, 0.0], 0.9).used
    assert not LpvController(schedule).step([0.4, np.nan], 0.9).used
