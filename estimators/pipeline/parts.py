"""The parts of a pipeline: what each must be able to do, and whether it fits.

A part with `reset`, `save` and `restore` takes part in these of the pipeline; one without counts as stateless. A part with
`like(batch_shape)`, the same with another batch and without what it has learned, can be divided: see `divides`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.forces import AttitudeStep, LateralForceStep, LoadStep, WheelForceStep
from estimators.pipeline.corner_set import CornerSetStep


class LongitudinalForcePart(Protocol):
    """F_x of the wheels: `UnknownInputForceObserver`, `WheelForceFilter`, `DifferentiatedPid`; of shape (..., 4)."""

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        torque: npt.ArrayLike,
        vertical_load: npt.ArrayLike | None = None,
        fresh: npt.ArrayLike | None = None,
    ) -> WheelForceStep:
        """One sample: rad/s, N m, N; `fresh` marks new wheel speeds, None: all."""


class LoadPart(Protocol):
    """F_z of the wheels: `VerticalLoads`."""

    def step(
        self,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        az: npt.ArrayLike | None = None,
        pitch: npt.ArrayLike | None = None,
        roll: npt.ArrayLike | None = None,
    ) -> LoadStep:
        """One sample: m/s^2, rad."""


class AttitudePart(Protocol):
    """Roll and pitch: `AttitudeObserver`."""

    def step(
        self,
        rate_x: npt.ArrayLike,
        rate_y: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        motion_x: npt.ArrayLike | None = None,
        motion_y: npt.ArrayLike | None = None,
        yaw_rate: npt.ArrayLike = 0.0,
        grade: npt.ArrayLike = 0.0,
        bank: npt.ArrayLike = 0.0,
    ) -> AttitudeStep:
        """One sample: rad/s, m/s^2, rad; as `AttitudeObserver.step` takes it."""


class LateralForcePart(Protocol):
    """F_y of the axles: `LateralForceEstimator`."""

    def step(
        self,
        acceleration_x: npt.ArrayLike,
        acceleration_y: npt.ArrayLike,
        yaw_acceleration: npt.ArrayLike,
        steer: npt.ArrayLike,
        longitudinal_force: npt.ArrayLike,
        vertical_load: npt.ArrayLike | None = None,
    ) -> LateralForceStep:
        """One sample: m/s^2, rad/s^2, rad, N."""


class VelocityResult(Protocol):
    """What the pipeline reads of the step of a velocity part; see `FusionStep` for units and shapes."""

    @property
    def vx(self) -> FloatArray:
        """(...) m/s at the centre of gravity."""

    @property
    def vy(self) -> FloatArray:
        """(...) m/s, to the left."""

    @property
    def vx_deviation(self) -> FloatArray:
        """(...) m/s."""

    @property
    def vy_deviation(self) -> FloatArray:
        """(...) m/s."""

    @property
    def yaw_rate(self) -> FloatArray:
        """(...) rad/s."""

    @property
    def sensor_bias(self) -> FloatArray:
        """(..., 3) of a_x, a_y and r."""

    @property
    def slip(self) -> FloatArray:
        """(..., 4) slip ratios."""

    @property
    def slip_angle(self) -> FloatArray:
        """(..., 4) rad."""

    @property
    def used(self) -> BoolArray:
        """(..., 4) wheels that support V_x."""

    @property
    def standing(self) -> BoolArray:
        """(...) standstill was recognised."""

    @property
    def flags(self) -> FlagArray:
        """(...) sums of `Flag`."""

    @property
    def wheel_flags(self) -> FlagArray:
        """(..., 4)."""


class VelocityPart(Protocol):
    """V_x, V_y and slips: `VelocityFusion`, or `CornerVelocity`, which has `uses_lateral_force` and takes `lateral_use`, too."""

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        steer: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        normalised_force: npt.ArrayLike,
        elapsed: npt.ArrayLike | None = None,
    ) -> VelocityResult:
        """One sample: rad/s, rad, m/s^2, rad/s, F_x/F_z, s."""


class CornerPart(Protocol):
    """Observers beside the chain: `CornerObservers`."""

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        steer: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        longitudinal_use: npt.ArrayLike,
        lateral_use: npt.ArrayLike,
        vy: npt.ArrayLike = 0.0,
    ) -> CornerSetStep:
        """One sample: rad/s, rad, m/s^2, rad/s, F_x/F_z and F_y/F_z, m/s; with `uses_forces`, `forces` in N, too."""


class SideslipPart(Protocol):
    """A sideslip observer of P4 or P5: `FourWheelSideslip`, `StiffnessSideslip`."""

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
    ) -> SideslipResult:
        """One sample: rad of the front wheels, rad/s, m/s, m/s^2, (..., 4) N, (..., 4) N, (..., 2) N."""


class SideslipResult(Protocol):
    """What all sideslip parts return, among other things."""

    @property
    def sideslip(self) -> FloatArray:
        """(...) rad."""

    @property
    def flags(self) -> FlagArray:
        """(...) sums of `Flag`."""


class Parts(NamedTuple):
    """What a pipeline is composed of; None: the default part of forces, loads and velocity, none of the others."""

    longitudinal_force: LongitudinalForcePart | None
    loads: LoadPart | None
    attitude: AttitudePart | None
    lateral_force: LateralForcePart | None
    velocity: VelocityPart | None
    corner_observers: CornerPart | None
    sideslip: SideslipPart | None


CORNER_PARTS = ("longitudinal_force", "readings")
"""Parts whose batch has the corners on a last axis."""


def check_parts(
    parts: Mapping[str, Any], shape: tuple[int, ...], sample_time: float, with_corners: tuple[str, ...]
) -> None:
    """Compares `batch_shape` and `sample_time` of the parts, where they have them, with those of the pipeline.

    Raises:
        EstimatorError: names the part that differs.
    """
    for name, part in parts.items():
        own = getattr(part, "batch_shape", None)
        wanted = (*shape, 4) if name in with_corners else shape
        if own is not None and tuple(own) != wanted:
            raise EstimatorError(f"{name} has batch_shape {tuple(own)}, expected {wanted}; build it for that batch")
        time = getattr(part, "sample_time", None)
        if time is not None and abs(time - sample_time) > 1e-9 * sample_time:
            raise EstimatorError(
                f"{name} is for sample_time = {time:g} s, the pipeline runs at {sample_time:g} s; build both for one"
            )


def divides(part: Any, batch_shape: tuple[int, ...]) -> bool:
    """Whether a part of several cars may be replaced by one for each: its own class has `like`, and it has not begun; or None."""
    if part is None or "like" not in vars(type(part)):  # a subclass may do more than what it inherits can build
        return part is None
    own, new = (one.save() if hasattr(one, "save") else {} for one in (part, part.like(batch_shape)))
    return all(np.array_equal(own[name], new[name], equal_nan=True) for name in new)
