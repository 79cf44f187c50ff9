"""Time-varying Kalman filter of a corner's relative velocity from its normalised force, P2 (19)-(23).

Predictor form: correct with mu_k, then predict with u_k, which is (21)-(22) term by term. Q is one number in the paper;
here it drives the model through its input, Q = q B B': errors of the acceleration move V_r (and with it z'), nothing
else. `process = "identity"` takes q I, the other reading: z then absorbs the correction and leaves V_r to open-loop
integration (P2 notes 10).
In high slip friction hides the slip velocity: there q and r change to values that follow the kinematics.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, entries, mask, quiet, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError, unknown
from estimators.faults import Flag, raise_flag
from estimators.memory import Renewable
from estimators.velocity.ltv_filter import LtvFilter
from estimators.velocity.ltv_model import BristleTire

NORMAL = (2.5e-3, 1e-3)
"""q in (m/s)^2 a sample and r, P2 section IV."""
PROCESSES = ("input", "identity")
HIGH_SLIP = (3.3e-4, 2.1e-1)
_LARGEST = 1e6  # of u, w and dw/dt: more is not a reading


class LtvStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch."""

    estimate: FloatArray  # (..., n) states at the end of the sample; [..., 1] is V_r
    relative_velocity: FloatArray  # (...) V_r at the end of the sample, m/s
    innovation: FloatArray  # (...) mu - C x at its start; NaN where mu is missing
    innovation_variance: FloatArray  # (...)
    gain: FloatArray  # (..., n) predictor gain K_k of (21)
    used: BoolArray
    flags: FlagArray


class LtvKalmanObserver(Renewable):
    """Bristle deflection and relative velocity of every corner.

    Args:
        tire: constants of the bristle model.
        sample_time: T_s, s.
        batch_shape: shape of every argument of `step`.
        states: 3 as published, or 2, the same without its redundant state (`ltv_model`).
        normal: (q, r) in normal driving.
        high_slip: (q, r) where `step` is told so.
        spread: initial standard deviation of V_r, m/s.
        process: "input", Q = q B B', or "identity", Q = q I.

    Raises:
        EstimatorError: a value that is not above zero, another number of states, another process.

    >>> import numpy as np
    >>> from estimators.velocity.ltv_model import BristleTire
    >>> observer = LtvKalmanObserver(BristleTire(), sample_time=0.005)
    >>> step = observer.step(np.zeros(4), np.zeros(4), np.full(4, 60.0))
    >>> len(step.flags)  # four wheels
    4
    """

    memory = ("seen", "renewed")
    parts = ("filter",)

    def __init__(
        self,
        tire: BristleTire,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        states: Literal[2, 3] = 3,
        normal: tuple[float, float] = NORMAL,
        high_slip: tuple[float, float] = HIGH_SLIP,
        spread: float = 1.0,
        process: str = "input",
    ) -> None:
        if process not in PROCESSES:
            raise EstimatorError(unknown("process", process, PROCESSES))
        if states not in (2, 3):
            raise EstimatorError(f"states = {states!r}; use 3, as published, or 2")
        super().__init__(batch(batch_shape))
        self.tire, self.states = tire, states
        self.sample_time = setting(sample_time, "sample_time", "s")
        pairs = [
            [setting(q, f"process noise of {name}", "(m/s)^2"), setting(r, f"measurement noise of {name}", "(no unit)")]
            for name, (q, r) in (("normal", normal), ("high_slip", high_slip))
        ]
        self._noise = np.array(pairs)
        wide = setting(spread, "spread", "m/s") ** 2
        # z follows V_r within a hundredth of a metre; z' is V_r while z is unknown
        self._initial = np.diag([1e-4, wide, wide][:states])
        self.filter = LtvFilter(self._initial, self.batch_shape, tire, self.sample_time, process == "identity")
        self.seen: FloatArray = np.zeros((3, *self.batch_shape))  # last finite u, w, w'

    def step(
        self,
        relative_acceleration: npt.ArrayLike,
        normalised_force: npt.ArrayLike,
        wheel_speed: npt.ArrayLike,
        wheel_acceleration: npt.ArrayLike = 0.0,
        high_slip: npt.ArrayLike | bool = False,
    ) -> LtvStep:
        """u = R_e w' - v_xt' in m/s^2, mu, w in rad/s and w' in rad/s^2, each (...) or one number for all.

        A missing mu is not used; a missing u, w or w' is held at its last value; both are flagged.

        Raises:
            EstimatorError: another shape.
        """
        shape = self.batch_shape
        given: FloatArray = np.empty((3, *shape))
        given[0] = entries(relative_acceleration, shape, "relative_acceleration")
        given[1] = entries(wheel_speed, shape, "wheel_speed")
        given[2] = entries(wheel_acceleration, shape, "wheel_acceleration")
        mu = entries(normalised_force, shape, "normalised_force")
        high = np.asarray(high_slip, dtype=np.bool_)
        if high.shape != shape:
            high = np.broadcast_to(high, shape)
        flags: FlagArray = np.zeros(shape, dtype=np.int32)
        if np.vdot(given, given) < _LARGEST**2:  # False for NaN
            self.seen = given
        else:
            good: BoolArray = np.absolute(given) < _LARGEST
            raise_flag(flags, ~good[0], Flag.MISSING_INPUT)
            raise_flag(flags, ~(good[1] & good[2]), Flag.MISSING_PARAMETER)
            self.seen = np.where(good, given, self.seen)
        if not quiet(mu):
            raise_flag(flags, ~np.isfinite(mu), Flag.MISSING_MEASUREMENT)
        self._flag_renewed(flags)
        noise = self._noise[high.astype(np.intp)]
        outputs, used = self.filter.step(self.seen, mu, noise)
        state = self.filter.state
        return LtvStep(state, state[..., 1], outputs[..., 0], outputs[..., 1], outputs[..., 2:], used, flags)

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state` (n,) with the initial covariance.

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        self.filter.reset(chosen, state=np.broadcast_to(np.asarray(state, dtype=np.float64), (self.states,)))
        self.seen[:, chosen] = 0.0
        self._renew(chosen)
