"""The papers' sideslip observers behind one interface, to run beside the fusion."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from estimators.arrays import FloatArray
from estimators.memory import Memory
from estimators.sideslip import (
    AdaptiveStiffnessObserver,
    FixedStiffnessObserver,
    FourWheel,
    FourWheelObserver,
    SingleTrack,
    SlidingModeObserver,
)
from estimators.sideslip.four_wheel import FourWheelStep
from estimators.sideslip.stiffness import StiffnessStep


class FourWheelSideslip(Memory):
    """`FourWheelObserver` (P4) with the loads of the pipeline.

    Args:
        vehicle: tires and lengths.
        sample_time: s.
        batch_shape: () for one car.
        method: "extended" or "unscented".
    """

    parts = ("observer",)

    def __init__(
        self,
        vehicle: FourWheel,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        method: Literal["extended", "unscented"] = "extended",
    ) -> None:
        self.batch_shape = batch_shape
        self.observer = FourWheelObserver(vehicle, method, batch_shape, sample_time)

    def step(
        self,
        steer: FloatArray,
        yaw_rate: FloatArray,
        vx: FloatArray,
        ax: FloatArray,
        ay: FloatArray,
        force_x: FloatArray,
        force_z: FloatArray,
        axle_force_y: FloatArray,
    ) -> FourWheelStep:
        """One sample."""
        measurement = np.stack([yaw_rate, vx, ax, ay], axis=-1)
        return self.observer.step(steer, force_z, measurement)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh."""
        self.observer.reset(where)


class StiffnessSideslip(Memory):
    """`AdaptiveStiffnessObserver` or `FixedStiffnessObserver` (P5) on axle forces.

    The forces are those of the pipeline, or, with `sliding`, of the paper's own sliding-mode observer: P5 as it stands.

    Args:
        vehicle: single track.
        sample_time: s.
        batch_shape: () for one car.
        adaptive: False keeps the stiffnesses given.
        sliding: forces from yaw rate and accelerations by `SlidingModeObserver`.
        noise_time: s, for which the covariances hold, as `AdaptiveStiffnessObserver`; None: per sample.
    """

    def __init__(
        self,
        vehicle: SingleTrack,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        adaptive: bool = True,
        sliding: bool = False,
        noise_time: float | None = None,
    ) -> None:
        self.batch_shape = batch_shape
        kind = AdaptiveStiffnessObserver if adaptive else FixedStiffnessObserver
        self.observer = kind(vehicle, batch_shape, sample_time=sample_time, noise_time=noise_time)
        self.sliding = SlidingModeObserver(vehicle, batch_shape, sample_time) if sliding else None
        self.parts = ("observer", "sliding") if sliding else ("observer",)

    def step(
        self,
        steer: FloatArray,
        yaw_rate: FloatArray,
        vx: FloatArray,
        ax: FloatArray,
        ay: FloatArray,
        force_x: FloatArray,
        force_z: FloatArray,
        axle_force_y: FloatArray,
    ) -> StiffnessStep:
        """One sample."""
        drive = force_x[..., :2].sum(axis=-1)
        if self.sliding is not None:
            found = self.sliding.step(np.stack([yaw_rate, ay, ax], axis=-1), steer).wheel_forces
            drive, axle_force_y = found[..., 0], found[..., 1:]
        measurement = np.concatenate([axle_force_y, np.asarray(ay)[..., None]], axis=-1)
        return self.observer.step(steer, yaw_rate, vx, drive, measurement)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh."""
        self.observer.reset(where)
        if self.sliding is not None:
            self.sliding.reset(where)
