"""How load follows acceleration: the body rolls and pitches on its springs before the wheels feel the whole transfer."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from estimators.arguments import LIMIT, batch, entries, mask, setting
from estimators.arithmetic import Number, Signals, arithmetic
from estimators.arrays import FloatArray
from estimators.errors import EstimatorError
from estimators.memory import Memory
from estimators.phi import phi_of

PITCH = (1.4, 0.4)
"""Hz, damping ratio."""
ROLL = (1.7, 0.3)
"""Hz, damping ratio."""

_Mode = tuple[float, float, float, float, float, float, float, float]


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

    memory = ("input", "deflection", "speed", "starts")

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
        self._modes = [_mode(float(k), float(c), time) for k, c in zip(w * w, 2.0 * zeta * w, strict=True)]
        self._kit = kit = arithmetic(self.batch_shape)
        nothing = kit.stacked([kit.full(0.0)] * len(modes))
        self.input: Signals = nothing  # the last known accelerations
        self.deflection: Signals = nothing
        self.speed: Signals = nothing
        self.starts: Number = kit.full(True)

    def step(self, acceleration: npt.ArrayLike) -> FloatArray:
        """The accelerations (..., modes) that the wheel loads answer to; the first sample is taken as settled.

        A missing acceleration is held.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        kit, shape, count = self._kit, self.batch_shape, len(self._modes)
        given = kit.rows(entries(acceleration, (*shape, count), "acceleration"), count)
        held = [kit.where(abs(new) <= LIMIT, new, old) for new, old in zip(given, self.input, strict=True)]
        return kit.table((self.follow(held),), shape)

    def follow(self, acceleration: Sequence[Number]) -> list[Number]:
        """`step` on finite numbers."""
        kit, before, x, speed = self._kit, self.input, self.deflection, self.speed
        if kit.some(self.starts):
            first = self.starts
            before = [kit.where(first, new, old) for new, old in zip(acceleration, before, strict=True)]
            rest = [new / mode[6] for new, mode in zip(acceleration, self._modes, strict=True)]
            x = [kit.where(first, new, old) for new, old in zip(rest, x, strict=True)]
            speed = [kit.where(first, 0.0, old) for old in speed]
            self.starts = kit.full(False)
        x, speed, out = zip(*map(_moved, self._modes, x, speed, before), strict=True)
        self.input = kit.stacked(list(acceleration))
        self.deflection, self.speed = kit.stacked(list(x)), kit.stacked(list(speed))
        return list(out)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask; None: all) afresh: the next sample is taken as settled."""
        here = self._kit.own(mask(where, self.batch_shape, "where"))
        self.input = self._kit.replaced(here, 0.0, self.input)
        self.starts = self.starts | here


def _moved(mode: _Mode, x: Number, speed: Number, force: Number) -> tuple[Number, Number, Number]:
    """x and x' at the end of the sample, and K x + C x' there."""
    a, b, c, d, e, f, stiffness, damping = mode
    x, speed = a * x + b * speed + e * force, c * x + d * speed + f * force
    return x, speed, stiffness * x + damping * speed


def _mode(stiffness: float, damping: float, time: float) -> _Mode:
    """e^(A Ts) by rows, int e^(A t) dt (0, 1)', K and C of x'' = a - C x' - K x, from e^M = 1 + M phi(M)."""
    M = time * np.array([[0.0, 1.0], [-stiffness, -damping]])
    integral = phi_of(M)
    a, b, c, d = (np.eye(2) + M @ integral).reshape(-1).tolist()
    e, f = (time * integral[:, 1]).tolist()
    return a, b, c, d, e, f, stiffness, damping
