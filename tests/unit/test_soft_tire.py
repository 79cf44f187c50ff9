"""A tire that gets soft is named, wherever the car drives; a healthy one is not, whatever slip and load do to its speed."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity import SoftTires, VelocityFusion, soft_tires

CAR = VehicleParameters.published_suv()
STEP = 0.05
X, Y = CAR.corner_x, CAR.corner_y
SIDE = 0.09  # rad per unit of F_y/F_z
LOAD = 0.008  # radius per g sideways, of the wheel that is unloaded
REAR_LEFT = 2
FREE = np.zeros(4)


class Drive:
    """Cars (b,) at constant `speed`, m/s, with `side` acceleration, m/s^2; their fusion goes on from call to call."""

    def __init__(self, speed: FloatArray, side: float = 0.0, seed: int = 0) -> None:
        self.speed, self.rng = speed, np.random.default_rng(seed)
        self.fusion = VelocityFusion(CAR, STEP, speed.shape)
        turn = side / speed
        vy = CAR.rear_axle_distance * turn - speed * SIDE * side / GRAVITY
        steer = (vy + CAR.front_axle_distance * turn + speed * SIDE * side / GRAVITY) / speed
        self.steer = np.stack((steer, steer, 0.0 * steer, 0.0 * steer), axis=-1)
        ahead, left = speed[:, None] - turn[:, None] * Y, vy[:, None] + turn[:, None] * X
        self.along = ahead * np.cos(self.steer) + left * np.sin(self.steer)
        self.pull, self.side, self.turn = -turn * vy, side, turn
        self.lifted = LOAD * side / GRAVITY * np.sign(Y)

    def on(self, seconds: float, radius: FloatArray, mu: FloatArray = FREE, compliance: float = 0.03) -> SoftTires:
        """`radius` relative errors (b, 4) or (4,); `mu` F_x/F_z of the wheels, which slip by it."""
        shape = self.along.shape
        rolling = self.along * (1.0 + compliance * mu) / (CAR.radii * (1.0 + radius + self.lifted))
        force = np.broadcast_to(mu, shape)
        for _ in range(round(seconds / STEP)):
            noise = self.rng.normal(size=(*self.speed.shape, 7)) * ([0.05] * 6 + [0.002])
            self.fusion.step(
                rolling + noise[:, :4], self.steer, self.pull + noise[:, 4], self.side + noise[:, 5],
                self.turn + noise[:, 6], force,
            )  # fmt: skip
        return soft_tires(self.fusion)


def contrast(radius: FloatArray) -> FloatArray:
    """Of every wheel to the mean of the others."""
    return np.asarray((4.0 * radius - radius.sum(axis=-1, keepdims=True)) / 3.0)


@pytest.mark.parametrize("side", [0.0, 3.0])
def test_a_tire_that_gets_soft_is_named_within_a_minute_alone_and_by_how_much(side: float) -> None:
    lost = np.array([0.0, 0.03, 0.05, 0.1] * 3)
    drive = Drive(np.repeat([8.0, 25.0, 45.0], 4), side)
    drive.on(10.0, FREE)
    radius = np.zeros((12, 4))
    radius[:, REAR_LEFT] = -lost
    found = drive.on(50.0, radius)
    assert found.soft[:, REAR_LEFT].tolist() == (lost > 0.0).tolist()
    assert not np.delete(found.soft, REAR_LEFT, axis=1).any()
    # what is left of the beginning, exp(-50/15), is the rest
    off = np.abs(found.change - contrast(radius)) - 0.04 * np.abs(contrast(radius))
    assert (off < 3.0 * found.deviation).all()
    assert (found.deviation.max(axis=1) < np.where(lost == 0.1, 0.05, 0.01)).all()


def test_healthy_tires_are_not_named_in_bends_nor_where_an_axle_pulls() -> None:
    speed = np.repeat([10.0, 30.0], 20)
    radius = 0.004 * np.clip(np.random.default_rng(3).normal(size=(40, 4)), -2.0, 2.0)
    for side, mu, compliance in (
        (0.0, 0.0, 0.03),
        (3.5, 0.0, 0.03),
        (-3.5, 0.0, 0.03),
        (0.0, 0.15, 0.06),
        (0.0, -0.15, 0.06),
    ):
        found = Drive(speed, side).on(15.0, radius, np.array([0.0, 0.0, mu, mu]), compliance)
        assert not found.soft.any(), (side, mu)
        assert (np.abs(found.change - contrast(radius)) < 4.0 * found.deviation).all(), (side, mu)


def test_what_slip_and_load_leave_open_is_in_the_deviation() -> None:
    speed = np.array([25.0, 25.0])
    free = Drive(speed).on(10.0, FREE).deviation.max()
    driven = Drive(speed).on(10.0, FREE, np.array([0.0, 0.0, 0.2, 0.2]))
    assert driven.deviation.min() > 2.4 * free
    assert np.abs(driven.change).max() < 0.0005  # slip as it is expected is taken off: 0.0016
    assert Drive(speed, 3.0).on(10.0, FREE).deviation.min() > 1.3 * free


def test_a_wheel_that_spins_now_and_then_is_not_soft_and_a_soft_tire_stays_so_while_the_car_stands() -> None:
    speed = np.array([15.0, 15.0])
    spinning, soft = np.array([0.0, 0.0, -0.1, 0.0]), np.array([0.0, 0.0, -0.05, 0.0])
    drive = Drive(speed)
    for _ in range(4):
        drive.on(6.0, FREE)
        found = drive.on(0.5, spinning, np.array([0.0, 0.0, 0.4, 0.0]))
        assert not found.soft.any()
    before = drive.on(40.0, soft)
    assert before.soft[:, REAR_LEFT].all()
    along = drive.along
    drive.pull = np.array([-3.0, -3.0])
    for left in np.linspace(1.0, 0.0, 100):  # 5 s
        drive.along = left * along
        drive.on(STEP, soft, np.full(4, -0.3))
    drive.pull = np.zeros(2)
    standing = drive.on(60.0, FREE)
    assert standing.soft[:, REAR_LEFT].all()
    assert standing.change[:, REAR_LEFT] == pytest.approx(before.change[:, REAR_LEFT], abs=0.005)


def test_one_car_and_many_find_the_same_and_a_reset_forgets() -> None:
    soft = np.array([-0.05, 0.0, 0.0, 0.0])
    one, two = Drive(np.array([20.0])), Drive(np.array([20.0, 20.0]))
    alone = one.on(5.0, soft)
    together = two.on(5.0, soft)
    assert alone.change[0] == pytest.approx(together.change[0], abs=0.002)
    saved = one.fusion.save()
    other = VelocityFusion(CAR, STEP, (1,))
    other.restore(saved)
    assert soft_tires(other).change == pytest.approx(alone.change, abs=0.0)
    two.fusion.reset(np.array([True, False]))
    left = soft_tires(two.fusion)
    assert left.soft[:, 0].tolist() == [False, True]
    assert left.deviation[0].min() > 10.0 * left.deviation[1].max()
