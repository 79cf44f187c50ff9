"""The exact closed-loop update of a two-state observer over one sample with everything held.

    xhat' = A xhat + B u + L (y - C xhat - D u),   M = T (A - L C)
    xhat+ = e^M xhat + T phi(M) (B u + L (y - D u)) = xhat + T phi(M) (A xhat + B u + L innovation)

The second form needs phi(M) = int_0^1 e^(M s) ds alone. It is the update for which P1 section 9 gives the poles:
forward Euler and "predict, then correct with T L" are unstable with the published gains at 200 Hz.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.errors import ScheduleError
from estimators.faults import BoolArray
from estimators.interpolate import FloatArray, PiecewiseLinear
from estimators.phi import Phi
from estimators.schedule import GainSchedule

Factor = npt.NDArray[np.float64] | None  # an entry of a matrix: None where zero, 0-d where constant, else (n,)
_MOST_GROWTH = 50.0  # exponent of growth in one sample; from e^700 on float64 overflows


def plant_entries(schedule: GainSchedule) -> list[tuple[float, ...]]:
    """Coefficients, highest power first, of T A (4, by rows), T B (2), C (2) and D; () is zero, one is a constant."""
    found: list[tuple[float, ...]] = []
    for key, scale in (("A", schedule.sample_time), ("B", schedule.sample_time), ("C", 1.0), ("D", 1.0)):
        powers, coefficients = schedule.plant[key]
        for column in coefficients.reshape(len(powers), -1).T if len(powers) else np.zeros((4, 0)):
            ascending = [0.0] * (int(powers.max(initial=-1)) + 1)
            for power, value in zip(powers, column, strict=True):
                ascending[power] = scale * float(value)
            while ascending and ascending[-1] == 0:
                ascending.pop()
            found.append(tuple(reversed(ascending)))
    return found


def refuse_explosive(schedule: GainSchedule) -> None:
    """A proved schedule never comes here; a wrong sign or sample time must not end in an overflow."""
    plant = schedule.plant_at(schedule.breakpoints)
    for matrices in (plant.A, plant.A - schedule.table @ plant.C):
        growth = schedule.sample_time * np.linalg.eigvals(matrices).real.max(axis=-1)
        if not growth.max() <= _MOST_GROWTH:
            at = f"{schedule.parameter.name} = {schedule.breakpoints[growth.argmax()]:g} {schedule.parameter.unit}"
            raise ScheduleError(
                f"schedule '{schedule.name}': the error grows by e^{growth.max():.0f} in one sample at {at}; "
                "check the signs of the gains and the sample time"
            )


class _Scratch:
    """Memory and views for one chunk length; `A[row][column]`, `B[row]`, `C[column]`, `D` are factors."""

    def __init__(self, count: int, gains: PiecewiseLinear, entries: list[tuple[float, ...]]) -> None:
        self.lookup = gains.workspace(count)
        self.varying = [(entry, np.empty(count)) for entry in entries if len(entry) > 1]
        rows = iter(self.varying)
        a11, a12, a21, a22, *rest = [
            next(rows)[1] if len(entry) > 1 else np.array(entry[0]) if entry else None for entry in entries
        ]
        self.A: tuple[tuple[Factor, Factor], ...] = ((a11, a12), (a21, a22))
        self.B: list[Factor] = rest[:2]
        self.C: list[Factor] = rest[2:4]
        self.D: Factor = rest[4]
        self.gain, self.rate, self.correction = np.empty((3, 2, count))
        self.M = np.empty((2, 2, count))  # later its traceless part N
        self.mean, self.delta, self.alpha, self.beta, self.line = np.empty((5, count))
        self.phi = Phi(count)


class ExactUpdate:
    """Plant, gains and sample time of a schedule, ready for `advance` on chunks of entries."""

    def __init__(self, schedule: GainSchedule) -> None:
        self.entries = plant_entries(schedule)
        self.gains = PiecewiseLinear(schedule.breakpoints, schedule.sample_time * schedule.table[:, :, 0])  # T L
        self.scratches: dict[int, _Scratch] = {}

    def advance(
        self,
        state: FloatArray,
        held_input: FloatArray,
        measurement: FloatArray,
        parameter: FloatArray,
        coast: BoolArray | None,
        innovation: FloatArray,
    ) -> None:
        """Moves `state` (2, n) to the end of the sample and writes y - C xhat - D u to `innovation` (n,).

        The other arrays have shape (n,); entries in the mask `coast` move with L = 0.
        """
        w = self.scratches.get(parameter.size)
        if w is None:
            w = self.scratches[parameter.size] = _Scratch(parameter.size, self.gains, self.entries)
        self.gains.into(parameter, w.lookup, w.gain)
        if coast is not None:
            w.gain[:, coast] = 0.0
        for entry, out in w.varying:
            _horner(entry, parameter, out)
        _innovate(w, state, held_input, measurement, innovation)
        for row in (0, 1):
            _rate(w, row, state, held_input, innovation)
            for column in (0, 1):
                _error_matrix(w, row, column)
        _split(w)
        w.phi.into(w.mean, w.delta, w.alpha, w.beta)
        _correct(w, state)


def _horner(entry: tuple[float, ...], parameter: FloatArray, out: FloatArray) -> None:
    np.multiply(parameter, entry[0], out)
    for coefficient in entry[1:-1]:
        np.add(out, coefficient, out)
        np.multiply(out, parameter, out)
    if entry[-1]:
        np.add(out, entry[-1], out)


def _innovate(w: _Scratch, state: FloatArray, held_input: FloatArray, measurement: FloatArray, out: FloatArray) -> None:
    """y - C xhat - D u."""
    out[:] = measurement
    for factor, vector in ((w.C[0], state[0]), (w.C[1], state[1]), (w.D, held_input)):
        if factor is not None:
            np.multiply(factor, vector, w.line)
            np.subtract(out, w.line, out)


def _rate(w: _Scratch, row: int, state: FloatArray, held_input: FloatArray, innovation: FloatArray) -> None:
    """T (A xhat + B u + L innovation)."""
    out = w.rate[row]
    np.multiply(w.gain[row], innovation, out)
    for factor, vector in ((w.A[row][0], state[0]), (w.A[row][1], state[1]), (w.B[row], held_input)):
        if factor is not None:
            np.multiply(factor, vector, w.line)
            np.add(out, w.line, out)


def _error_matrix(w: _Scratch, row: int, column: int) -> None:
    """M = T A - T L C."""
    out, A, C = w.M[row, column], w.A[row][column], w.C[column]
    if C is None:
        out[:] = 0.0 if A is None else A
        return
    np.multiply(w.gain[row], C, out)
    if A is None:
        np.negative(out, out)
    else:
        np.subtract(A, out, out)


def _split(w: _Scratch) -> None:
    """M = m I + N, N^2 = delta I; N11 = -N22 is left in M11, the off-diagonal entries are those of M."""
    N11 = w.M[0, 0]
    np.add(N11, w.M[1, 1], w.mean)
    np.multiply(w.mean, 0.5, w.mean)
    np.subtract(N11, w.mean, N11)
    np.multiply(N11, N11, w.delta)
    np.multiply(w.M[0, 1], w.M[1, 0], w.line)
    np.add(w.delta, w.line, w.delta)


def _correct(w: _Scratch, state: FloatArray) -> None:
    """xhat + (alpha I + beta N) rate."""
    (N11, N12), (N21, _) = w.M
    first, second = w.correction
    np.multiply(N11, w.rate[0], first)
    np.multiply(N12, w.rate[1], w.line)
    np.add(first, w.line, first)
    np.multiply(N21, w.rate[0], second)
    np.multiply(N11, w.rate[1], w.line)
    np.subtract(second, w.line, second)
    for row in (0, 1):
        np.multiply(w.correction[row], w.beta, w.correction[row])
        np.multiply(w.rate[row], w.alpha, w.line)
        np.add(w.correction[row], w.line, w.line)
        np.add(state[row], w.line, state[row])
