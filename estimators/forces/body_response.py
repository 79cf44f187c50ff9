"""How load follows acceleration: the body rolls and pitches on its springs before the wheels feel the whole transfer."""

from __future__ import annotations

import math
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, mask, setting
from estimators.errors import EstimatorError
from estimators.interpolate import FloatArray
from estimators.memory import Memory
from estimators.phi import phi_of
from estimators.signals.held import Held

PITCH = (1.4, 0.4)
"""Hz, damping ratio."""
ROLL = (1.7, 0.3)
"""Hz, damping ratio."""

Number = TypeVar("Number", float, FloatArray)
_Mode = tuple[Number, Number, Number, Number, Number, Number, Number, Number]


class BodyResponse(Memory):
    """M/(m h a) = (2 zeta w s + w^2)/(s^2 + 2 zeta w s + w^2): the moment of the wheel loads about the centre of gravity.

    I theta'' = m h a - M with M = K theta + C theta': the springs and dampers pass on what the inertia of the body does
    not take up. After a step of a the transfer overshoots m h a by about a third, and settles there within a second.
    Integrated exactly for an acceleration that is held over the sample; without it the load follows at once, as in the
    papers (P1 (15), (17)).

    The constants are those of passenger cars: ride frequencies near 1.25 Hz on springs with K = m L_f L_r w_ride^2 give,
    with I_y = 0.7 to 0.9 m L_f L_r, pitch at 1.3 to 1.5 Hz; anti-roll bars put roll at 1.5 to 2 Hz; dampers are laid out
    for zeta of 0.3 to 0.4. Leaves out anti-dive and anti-squat geometry, unsprung masses and heave.

    Args:
        sample_time: s.
        batch_shape: one entry a car; the accelerations have one axis more, of the `modes`.
        modes: (w/(2 pi) in Hz, zeta) of each acceleration, a_x (pitch) and a_y (roll) by default.

    Raises:
        EstimatorError: a number that is not positive, no modes.
    """

    memory = ("deflection", "speed", "starts")
    parts = ("input",)

    def __init__(
        self,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        modes: tuple[tuple[float, float], ...] = (PITCH, ROLL),
    ) -> None:
        time = setting(sample_time, "sample_time", "s")
        self.batch_shape = batch(batch_shape)
        if not modes:
            raise EstimatorError("modes is empty: give frequency and damping of each acceleration")
        w = 2.0 * math.pi * np.array([setting(f, "frequency", "Hz") for f, _ in modes])
        zeta = np.array([setting(z, "damping", "(no unit)") for _, z in modes])
        self._stiffness, self._damping = w * w, 2.0 * zeta * w
        self._modes = [_mode(float(k), float(c), time) for k, c in zip(self._stiffness, self._damping, strict=True)]
        self._all: _Mode[Any] = tuple(np.array(self._modes).T)
        self._single = math.prod(self.batch_shape) == 1
        shape = (*self.batch_shape, len(modes))
        self.input = Held(shape, "acceleration")
        self.deflection: FloatArray = np.zeros(shape)
        self.speed: FloatArray = np.zeros(shape)
        self.starts = np.ones(self.batch_shape, dtype=np.bool_)
        self._any_start = True

    def step(self, acceleration: npt.ArrayLike) -> FloatArray:
        """The accelerations (..., modes) that the wheel loads answer to; the first sample is taken as settled.

        A missing acceleration is held.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        before = self.input.last
        value, _ = self.input(acceleration)
        if self._any_start:
            fresh = self.starts[..., None]
            before = np.where(fresh, value, before)
            self.deflection = np.where(fresh, value / self._stiffness, self.deflection)
            self.speed = np.where(fresh, 0.0, self.speed)
            self.starts, self._any_start = np.zeros(self.batch_shape, dtype=np.bool_), False
        if self._single:
            return np.array(self._advance(before.reshape(-1).tolist())).reshape(value.shape)
        self.deflection, self.speed, out = _moved(self._all, self.deflection, self.speed, before)
        return out

    def one(self, acceleration: list[float]) -> list[float]:
        """`step` for a single car, on finite plain numbers."""
        if self._any_start:
            return self.step(np.reshape(acceleration, self.input.shape)).reshape(-1).tolist()
        before = self.input.last.reshape(-1).tolist()
        self.input.last = np.array(acceleration).reshape(self.input.shape)
        return self._advance(before)

    def _advance(self, before: list[float]) -> list[float]:
        columns = (self._modes, self.deflection.reshape(-1).tolist(), self.speed.reshape(-1).tolist(), before)
        x, v, out = zip(*map(_moved, *columns), strict=True)
        self.deflection, self.speed = np.array(x).reshape(self.input.shape), np.array(v).reshape(self.input.shape)
        return list(out)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask; None: all) afresh: the next sample is taken as settled."""
        chosen = mask(where, self.batch_shape, "where")
        self.input.forget(chosen[..., None])
        self.starts = self.starts | chosen
        self._any_start = bool(self.starts.any())

    def _recall(self) -> None:
        self._any_start = bool(self.starts.any())


def _moved(mode: _Mode[Number], x: Number, speed: Number, force: Number) -> tuple[Number, Number, Number]:
    """x and x' at the end of the sample, and K x + C x' there; of numbers or of arrays."""
    a, b, c, d, e, f, stiffness, damping = mode
    x, speed = a * x + b * speed + e * force, c * x + d * speed + f * force
    return x, speed, stiffness * x + damping * speed


def _mode(stiffness: float, damping: float, time: float) -> _Mode[float]:
    """e^(A Ts) by rows, int e^(A t) dt (0, 1)', K and C of x'' = a - C x' - K x, from e^M = 1 + M phi(M)."""
    M = time * np.array([[0.0, 1.0], [-stiffness, -damping]])
    integral = phi_of(M)
    a, b, c, d = (np.eye(2) + M @ integral).reshape(-1).tolist()
    e, f = (time * integral[:, 1]).tolist()
    return a, b, c, d, e, f, stiffness, damping
