"""The update of a two-state observer over one sample with u and y held, exact in either form.

    held     xhat' = A xhat + B u + L (y - C xhat - D u) integrated over the sample,   M = T (A - L C)
             xhat+ = xhat + T phi(M) (A xhat + B u + L innovation)
    sampled  xhat+ = xhat + T phi(M) (A xhat + B u) + K innovation,                    M = T A

with phi(M) = int_0^1 e^(M s) ds and innovation = y - C xhat - D u at the start of the sample. `held` is the update for which
P1 section 9 gives the poles: forward Euler and "predict, then correct with T L" are unstable with the published gains at 200 Hz.
Its error follows the plant's own motion within a sample; that of `sampled` does not (synthesis.loop.observer).
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import ScheduleError
from estimators.interpolate import PiecewiseLinear
from estimators.phi import Phi
from estimators.schedule import GainSchedule

Factor = FloatArray | None  # an entry of a matrix: None where zero, 0-d where constant, else (n,)
_MOST_GROWTH = 50.0  # exponent of growth in one sample; from e^700 on float64 overflows
_LARGEST_STEP = 1e50  # of the numbers in T A, T L C: their products meet states of up to 1e100 (screening.LIMIT)
_LOOKS = 65  # places between which growth may hide: it has room from e^50 to e^700


def plant_entries(schedule: GainSchedule) -> list[tuple[float, ...]]:
    """Chebyshev coefficients, lowest order first, of T A (4, by rows), T B (2), C (2) and D; () is zero, one is a constant."""
    found: list[tuple[float, ...]] = []
    for key, scale in (("A", schedule.sample_time), ("B", schedule.sample_time), ("C", 1.0), ("D", 1.0)):
        coefficients = schedule.plant[key].coefficients
        shape = {"A": 4, "B": 2, "C": 2, "D": 1}[key]
        for column in coefficients.reshape(len(coefficients), shape).T:
            entry = [scale * float(value) for value in column]
            while entry and entry[-1] == 0:
                entry.pop()
            found.append(tuple(entry))
    return found


def refuse_explosive(schedule: GainSchedule) -> None:
    """A proved schedule never comes here; a wrong sign or sample time must not end in an overflow."""
    largest = {key: float(np.abs(schedule.plant[key].coefficients).sum(axis=0).max(initial=0.0)) for key in "ABCD"}
    period, gain = schedule.sample_time, float(np.abs(schedule.table).max())
    gain *= 1.0 if schedule.update == "sampled" else period
    if not period * (largest["A"] + largest["B"]) + gain * (largest["C"] + largest["D"]) <= _LARGEST_STEP:
        raise ScheduleError(
            f"schedule '{schedule.name}': plant, gains and sample time multiply to more than {_LARGEST_STEP:g} in one "
            "sample, where float64 overflows; check their units"
        )
    places = np.union1d(schedule.breakpoints, np.linspace(schedule.parameter.min, schedule.parameter.max, _LOOKS))
    plant = schedule.plant_at(places)
    closed = plant.A - schedule.gain(places) @ plant.C if schedule.update == "held" else plant.A
    for matrices in (plant.A, closed):
        growth = period * np.linalg.eigvals(matrices).real.max(axis=-1)
        if not growth.max() <= _MOST_GROWTH:
            at = f"{schedule.parameter.name} = {places[growth.argmax()]:g} {schedule.parameter.unit}"
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
        self.mean, self.delta, self.alpha, self.beta, self.line, self.place = np.empty((6, count))
        self.later, self.before = np.empty((2, count))
        self.phi = Phi(count)


class ExactUpdate:
    """Plant, gains and sample time of a schedule, ready for `advance` on chunks of entries."""

    def __init__(self, schedule: GainSchedule) -> None:
        self.entries = plant_entries(schedule)
        self.middle, self.half = schedule.plant["A"].middle, schedule.plant["A"].half
        self.sampled = schedule.update == "sampled"
        factor = 1.0 if self.sampled else schedule.sample_time
        self.gains = PiecewiseLinear(schedule.breakpoints, factor * schedule.table[:, :, 0])  # K or T L
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
        np.subtract(parameter, self.middle, w.place)
        np.divide(w.place, self.half, w.place)
        for entry, out in w.varying:
            _clenshaw(w, entry, out)
        _innovate(w, state, held_input, measurement, innovation)
        for row in (0, 1):
            _rate(w, row, state, held_input, None if self.sampled else innovation)
            for column in (0, 1):
                _error_matrix(w, row, column, self.sampled)
        _split(w)
        w.phi.into(w.mean, w.delta, w.alpha, w.beta)
        _correct(w, state)
        if self.sampled:
            np.multiply(w.gain, innovation, w.gain)
            np.add(state, w.gain, state)


def _clenshaw(w: _Scratch, entry: tuple[float, ...], out: FloatArray) -> None:
    """sum over k of entry[k] T_k(u) by Clenshaw's recurrence b_k = c_k + 2 u b_k+1 - b_k+2."""
    u = w.place
    if len(entry) == 2:
        np.multiply(u, entry[1], out)
        np.add(out, entry[0], out)
        return
    here, later = w.before, w.later
    here[:], later[:] = entry[-1], 0.0
    for coefficient in entry[-2:0:-1]:
        np.multiply(u, here, out)
        np.add(out, out, out)
        np.subtract(out, later, later)
        np.add(later, coefficient, later)
        here, later = later, here
    np.multiply(u, here, out)
    np.subtract(out, later, out)
    np.add(out, entry[0], out)


def _innovate(w: _Scratch, state: FloatArray, held_input: FloatArray, measurement: FloatArray, out: FloatArray) -> None:
    """y - C xhat - D u."""
    out[:] = measurement
    for factor, vector in ((w.C[0], state[0]), (w.C[1], state[1]), (w.D, held_input)):
        if factor is not None:
            np.multiply(factor, vector, w.line)
            np.subtract(out, w.line, out)


def _rate(w: _Scratch, row: int, state: FloatArray, held_input: FloatArray, innovation: FloatArray | None) -> None:
    """T (A xhat + B u + L innovation); without the last term if the gains correct once a sample."""
    out = w.rate[row]
    if innovation is None:
        out[:] = 0.0
    else:
        np.multiply(w.gain[row], innovation, out)
    for factor, vector in ((w.A[row][0], state[0]), (w.A[row][1], state[1]), (w.B[row], held_input)):
        if factor is not None:
            np.multiply(factor, vector, w.line)
            np.add(out, w.line, out)


def _error_matrix(w: _Scratch, row: int, column: int, sampled: bool) -> None:
    """M = T A - T L C, or T A."""
    out, A, C = w.M[row, column], w.A[row][column], w.C[column]
    if C is None or sampled:
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
