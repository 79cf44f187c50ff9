"""Four-wheel sideslip observer: one model, an extended or an unscented filter."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, broadcast, diagonal_noise, finite, mask, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.filters import ExtendedKalmanFilter, FilterStep, UnscentedKalmanFilter
from estimators.filters.affine import Affine
from estimators.filters.step import all_bounded, diagonal
from estimators.filters.workspace import Workspace
from estimators.memory import Renewable
from estimators.sideslip.dugoff import used_friction
from estimators.sideslip.four_wheel_model import AFFINE_FROM, FourWheelModel
from estimators.signals import limits
from estimators.signals.held import Clipped
from estimators.vehicle import FourWheel

# Not published; declared choices. Process noise per second: (rad/s)^2, (m/s)^2, rad^2, N^2 (tires), N^2 (drive).
PROCESS = (1e-4, 1e-2, 1e-4, 1e5, 1e5, 1e5, 1e5, 1e7)
MEASUREMENT = (4e-6, 4e-2, 2.5e-3, 2.5e-3)  # (rad/s)^2, (m/s)^2, (m/s^2)^2, (m/s^2)^2
INITIAL = (1e-2, 400.0, 1e-2, 1e6, 1e6, 1e6, 1e6, 1e6)
STEERING_LIMIT = 1.0  # rad, of the front wheels
_MOST = 100.0  # times its initial variance: an entry that knows so little starts again
_IMPOSSIBLE = np.array([limits.YAW_RATE, limits.SPEED, limits.ACCELERATION, limits.ACCELERATION])  # of the measurement
_CHUNK = 1000  # batch entries worked on at once: their sigma points stay in the cache


class FourWheelStep(NamedTuple):
    """What one sample returns; `...` are the batch axes, wheels in the order front left, front right, rear left, right.

    `filter` holds innovation (..., 4), its covariance, gain, used and gated channels for the log.
    """

    state: FloatArray  # (..., 8), see `four_wheel_model.STATES`
    sideslip: FloatArray  # (...) rad, positive to the left
    forces: FloatArray  # (..., 4) lateral, tire axes, N
    used_friction: FloatArray  # (..., 4) F_y / F_z, P4 (14)
    flags: FlagArray  # (...) sums of `Flag`
    at_rest: BoolArray  # (...) standstill or reverse: sideslip and lateral forces fade to zero
    filter: FilterStep


class FourWheelObserver(Renewable):
    """Yaw rate, speed, sideslip, four lateral forces and the front drive force from P4 (7)-(12).

    Normal forces are inputs, friction is known. Euler steps, T = 0.01 s in the source.

    Straight ahead (delta = 0) is not special while the car moves: the left-right difference in front, which no sensor
    sees there, relaxes with sigma / V, so that its covariance stays bounded; nothing is set to zero (P4 sets F_y and
    beta to zero, which fails when steering crosses zero). Below `standstill_speed` (and in reverse) the model is
    singular: the entry is `at_rest`, sideslip and lateral forces fade with 0.1 s to zero (with a_x and a_y at zero: what
    these still show, of a bank or a bias, is held by the forces) and their variance settles.
    Without measurements variances grow; an entry with one beyond 100 times its initial value starts again from zero and
    the initial covariance, flagged RESET, as does one whose prediction is not finite.

    Args:
        vehicle: parameters.
        kind: "unscented" or "extended".
        batch_shape: shape of the steering input; () for one car.
        sample_time: s.
        process_noise: eight variances per second; see `PROCESS`.
        measurement_noise: four variances of yaw rate, speed, a_x, a_y; see `MEASUREMENT`.
        initial_covariance: eight variances.
        gate: probability with which a good channel passes, or None.
        standstill_speed: m/s.

    Raises:
        EstimatorError: an option that means nothing.

    >>> import numpy as np
    >>> car = FourWheel(1500.0, 2500.0, 1.2, 1.4, 1.5, 50000.0, 50000.0, 0.4, 0.4)
    >>> step = FourWheelObserver(car, sample_time=0.005).step(0.0, np.full(4, 3700.0), [0.0, 20.0, 0.0, 0.0])
    >>> step.state.shape
    (8,)
    """

    parts = ("steering", "loads", "filters")

    def __init__(
        self,
        vehicle: FourWheel,
        kind: Literal["unscented", "extended"] = "unscented",
        batch_shape: tuple[int, ...] = (),
        sample_time: float = 0.01,
        process_noise: npt.ArrayLike | None = None,
        measurement_noise: npt.ArrayLike | None = None,
        initial_covariance: npt.ArrayLike | None = None,
        gate: float | None = None,
        standstill_speed: float = 1.0,
    ) -> None:
        if kind not in ("unscented", "extended"):
            raise EstimatorError(f"kind = {kind!r} is not known; use 'unscented' or 'extended'")
        super().__init__(batch(batch_shape))
        self.vehicle, self.gate = vehicle, gate
        self.sample_time = setting(sample_time, "sample_time", "s")
        self.standstill_speed = setting(standstill_speed, "standstill_speed", "m/s")
        self._count = math.prod(self.batch_shape)
        self._process = diagonal_noise(process_noise, PROCESS, "process_noise", True) * self.sample_time
        self._sensor = diagonal_noise(measurement_noise, MEASUREMENT, "measurement_noise", False)
        spread = diagonal_noise(initial_covariance, INITIAL, "initial_covariance", False)
        self._most = _MOST * np.diag(spread)
        build = UnscentedKalmanFilter if kind == "unscented" else ExtendedKalmanFilter
        starts = range(0, self._count, _CHUNK)
        self._parts = [slice(start, min(start + _CHUNK, self._count)) for start in starts]
        self.filters: list[UnscentedKalmanFilter | ExtendedKalmanFilter] = [
            build(np.zeros((part.stop - part.start, 8)), spread) for part in self._parts
        ]
        static = np.tile(vehicle.static_loads, (self._count, 1))
        self.steering = Clipped("steering", np.zeros(self._count), -STEERING_LIMIT, STEERING_LIMIT)
        self.loads = Clipped("loads", static, 0.0, limits.FORCE, axes=1)
        self._memory = Workspace()
        self._before: list[FourWheelModel] | None = None  # at the inputs of the previous sample

    @property
    def state(self) -> FloatArray:
        """A copy of the estimate, (..., 8)."""
        return np.concatenate([each.state for each in self.filters]).reshape(*self.batch_shape, 8)

    @property
    def covariance(self) -> FloatArray:
        """A copy of the covariance, (..., 8, 8)."""
        return np.concatenate([each.covariance for each in self.filters]).reshape(*self.batch_shape, 8, 8)

    def step(self, steering: npt.ArrayLike, loads: npt.ArrayLike, measurement: npt.ArrayLike) -> FourWheelStep:
        """Predicts with the inputs of the previous sample, then corrects with the measurement of this one.

        Args:
            steering: (...) rad, of the front wheels, at this sample.
            loads: (..., 4) N.
            measurement: (..., 4) yaw rate in rad/s, speed in m/s, a_x and a_y in m/s^2, gravity removed; a channel
                that is not finite, or beyond what cars do (`signals.limits`), is missing.

        Raises:
            EstimatorError: shapes that do not fit, not numbers.
        """
        shape, count = self.batch_shape, self._count
        flags: FlagArray = np.zeros(count, dtype=np.int32)
        before = self._before or self._models(self.steering.last, self.loads.last)
        measured = broadcast(measurement, (*shape, 4), "measurement").reshape(count, 4)
        if not (np.absolute(measured) <= _IMPOSSIBLE).all():  # False for NaN
            measured = np.where(np.absolute(measured) <= _IMPOSSIBLE, measured, np.nan)
        given = broadcast(steering, shape, "steering").reshape(count), broadcast(loads, (*shape, 4), "loads")
        angle, load = self.steering.within(given[0], flags), self.loads.within(given[1].reshape(count, 4), flags)
        rest = np.empty(count, dtype=np.bool_)
        found: list[FilterStep] = []
        now = self._before = self._models(angle, load)
        for part, each, model, new in zip(self._parts, self.filters, before, now, strict=True):
            rest[part] = ~(each.state[:, 1] >= self.standstill_speed)
            old = model._replace(at_rest=rest[part] if rest[part].any() else None)
            if isinstance(each, UnscentedKalmanFilter):
                affine = Affine(AFFINE_FROM, old.transition_slope)
                held = each.predict(old.transition_of_points, self._process, affine)
                affine = Affine(0, new.measurement_slope)
                result = each.correct(measured[part], new.measurement_of_points, self._sensor, self.gate, affine)
            else:
                held = each.predict(old.transition, old.transition_jacobian, self._process)
                result = each.correct(
                    measured[part], new.measurement, new.measurement_jacobian, self._sensor, self.gate
                )
            lost = held | np.asarray((diagonal(result.covariance) > self._most).any(axis=-1))
            if lost.any():
                each.reset(lost)
                where = np.zeros(count, dtype=np.bool_)
                where[part] = lost
                self._renew(where.reshape(shape))
                result = result._replace(state=each.state, covariance=each.covariance)
            found.append(result)
        joined = found[0] if len(found) == 1 else _joined(found)
        if not all_bounded(joined.innovation):
            raise_flag(flags, np.asarray(np.isnan(joined.innovation).any(axis=-1)), Flag.MISSING_MEASUREMENT)
        flags = flags.reshape(shape)
        self._flag_renewed(flags)
        forces = joined.state[:, 3:7]
        friction = used_friction(forces, load)
        shaped = _reshaped(joined, shape)
        return FourWheelStep(
            shaped.state,
            shaped.state[..., 2],
            shaped.state[..., 3:7],
            friction.reshape(*shape, 4),
            flags,
            rest.reshape(shape),
            shaped,
        )

    def _models(self, steering: FloatArray, loads: FloatArray) -> list[FourWheelModel]:
        """The model of every part at the inputs (b), (b, 4), as if no car stood still."""
        slow, memory = self.standstill_speed, self._memory
        return [
            FourWheelModel.at(self.vehicle, self.sample_time, steering[part], loads[part], slow, memory=memory)
            for part in self._parts
        ]

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state`, (..., 8) or what broadcasts to it,
        with the initial covariance, and forgets the inputs; flagged RESET at the next step.

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        where = mask(where, self.batch_shape, "where")
        full = finite(state, (*self.batch_shape, 8), "state").reshape(self._count, 8)
        chosen = where.reshape(-1)
        for part, each in zip(self._parts, self.filters, strict=True):
            each.reset(chosen[part], state=full[part])
        self.steering.forget(chosen)
        self.loads.forget(chosen[:, None])
        self._before = None
        self._renew(where)

    def _recall(self) -> None:
        super()._recall()
        self._before = None


def _joined(steps: list[FilterStep]) -> FilterStep:
    columns: list[Any] = [np.concatenate(arrays) for arrays in zip(*steps, strict=True)]
    return FilterStep(*columns)


def _reshaped(step: FilterStep, shape: tuple[int, ...]) -> FilterStep:
    columns: list[Any] = [array.reshape(*shape, *array.shape[1:]) for array in step]
    return FilterStep(*columns)
