"""P5 on a truth drive: sliding-mode forces by believed mass, then rear sideslip by believed stiffness, adapted or fixed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from estimators.sideslip import (
    AdaptiveStiffnessObserver,
    FixedStiffnessObserver,
    SingleTrack,
    SlidingModeObserver,
    wheel_axes,
)
from estimators.vehicle import VehicleParameters
from studies.trials.first_block import counted, front_steer, rear_speed
from studies.trials.play import believed
from studies.trials.tire_curve import TireFacts, tire_facts
from studies.truth import Measured, Truth

Array = npt.NDArray[np.float64]
FORCES = ("F_y1", "F_y2", "F_x1", "yaw_rate")
"""Names of the quantities as the paper's tables have them."""
RIGHT = 0.0, 1.0
"""The setting without an error."""
_STATE = (1, 2, 3, 0)  # their places in the observer's state


Setting = tuple[float, float]
"""kg by which the believed mass is wrong, and factor on the believed stiffness."""


@dataclass(frozen=True)
class AxleRun:
    """S sensor draws of one run over n samples. Forces (S, n, 4) in the order of `FORCES`: N in body axes, rad/s.

    Forces by error of the mass; rear sideslip in rad and stiffness in N/rad by error of the mass and factor on the stiffness.
    """

    drawn: Measured
    car: VehicleParameters
    tire: TireFacts
    counted: npt.NDArray[np.bool_]  # (n,)
    true_forces: Array  # (n, 4)
    true_sideslip: Array  # (n,)
    forces: dict[float, Array]
    static: Array  # (S, n, 4), without an observer
    adaptive: dict[Setting, Array]  # (S, n)
    stiffness: dict[Setting, Array]  # (S, n, 2), adapted
    fixed: dict[Setting, Array]  # (S, n)


def true_axles(truth: Truth, run: int) -> Array:
    """F_y1, F_y2 and F_x1 of the axles in body axes, N, and the yaw rate, rad/s: (n, 4)."""
    steer, along, across = (truth[name][run] for name in ("steer", "force_x", "force_y"))
    forward, left = along * np.cos(steer) - across * np.sin(steer), along * np.sin(steer) + across * np.cos(steer)
    columns = (left[:, :2].sum(axis=1), left[:, 2:].sum(axis=1), forward[:, :2].sum(axis=1), truth["yaw_rate"][run])
    return np.stack(columns, axis=1)


def true_rear_sideslip(truth: Truth, run: int, rear: float) -> Array:
    """beta_2 (n,), rad, as P5 (11) counts it: positive where the rear axle's force is."""
    side = truth["vy"][run] - rear * truth["yaw_rate"][run]
    return np.asarray(np.arctan2(-side, np.maximum(np.absolute(truth["vx"][run]), 0.1)))


def single_track(car: VehicleParameters, tire: TireFacts, mass: float = 0.0, factor: float = 1.0) -> SingleTrack:
    """The truth's car with the secant stiffness of its axles, wrong by ``mass`` kg and by ``factor`` on the stiffness."""
    front, rear = (2.0 * factor * value for value in tire.secant)
    return SingleTrack(car.mass + mass, car.yaw_inertia, car.front_axle_distance, car.rear_axle_distance, front, rear)


def run_axles(drawn: Measured, settings: Sequence[Setting]) -> AxleRun:
    """Play the only run of ``drawn`` (at 100 Hz) with every setting; fixed stiffness with the right mass alone."""
    car, truth = believed(drawn), drawn.truth
    judged = counted(drawn, 0)
    speed = float(truth["vx"][0][judged].mean())
    tire = tire_facts(truth.vehicles[0], truth.tires[0], speed, float(truth["friction"][0].mean()))
    true = true_axles(truth, 0)
    start = true.max(axis=0)
    masses = dict.fromkeys(mass for mass, _ in settings)
    states = {mass: _forces(drawn, single_track(car, tire, mass), start) for mass in masses}
    adaptive, stiffness, fixed = {}, {}, {}
    for mass, factor in settings:
        assumed = single_track(car, tire, mass, factor)
        adaptive[mass, factor], stiffness[mass, factor] = _sideslip(drawn, assumed, states[mass], True)
        if mass == 0.0:
            fixed[mass, factor], _ = _sideslip(drawn, assumed, states[mass], False)
    return AxleRun(
        drawn, car, tire, judged, true, true_rear_sideslip(truth, 0, car.rear_axle_distance),
        {mass: state[..., _STATE] for mass, state in states.items()}, _static(drawn, car),
        adaptive, stiffness, fixed,
    )  # fmt: skip


def _forces(drawn: Measured, car: SingleTrack, start: Array) -> Array:
    """States (S, n, 4) of block 1, which starts at the greatest values of the drive as in the paper."""
    observer = SlidingModeObserver(car, drawn.batch_shape, drawn.sample_time)
    observer.reset(state=np.roll(start, 1))
    measured = np.stack([drawn.signals[name] for name in ("yaw_rate", "ay", "ax")], axis=-1)
    out = np.empty((*drawn.batch_shape, drawn.time.size, 4))
    for k in range(drawn.time.size):
        out[:, :, k] = observer.step(measured[:, :, k]).state
    return out[:, 0]


def _sideslip(drawn: Measured, car: SingleTrack, state: Array, adapt: bool) -> tuple[Array, Array]:
    """Rear sideslip (S, n) and stiffness (S, n, 2) of block 2, on the axes of the wheels, P5 (9)."""
    kind = AdaptiveStiffnessObserver if adapt else FixedStiffnessObserver
    seeds = drawn.batch_shape[0]
    observer = kind(car, (seeds,), drawn.sample_time)
    steer, speed = front_steer(drawn)[:, 0], rear_speed(drawn)[:, 0]
    yaw, ay = drawn.signals["yaw_rate"][:, 0], drawn.signals["ay"][:, 0]
    forces = wheel_axes(state, steer)
    rear, stiffness = np.empty(steer.shape), np.empty((*steer.shape, 2))
    for k in range(steer.shape[1]):
        measured = np.concatenate([forces[:, k, 1:], ay[:, k, None]], axis=1)
        step = observer.step(steer[:, k], yaw[:, k], speed[:, k], forces[:, k, 0], measured)
        rear[:, k], stiffness[:, k] = step.rear_sideslip, step.stiffness
    return rear, stiffness


def _static(drawn: Measured, car: VehicleParameters) -> Array:
    """Without an observer: m a_y on the axles as in a steady turn, m a_x in front, and the gyro."""
    s = drawn.signals
    side = car.mass / car.wheelbase * s["ay"][:, 0]
    columns = (
        side * car.rear_axle_distance,
        side * car.front_axle_distance,
        car.mass * s["ax"][:, 0],
        s["yaw_rate"][:, 0],
    )
    return np.stack(columns, axis=-1)
