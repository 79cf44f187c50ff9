"""The update of a two-state observer over one sample with u and y held, exact in either form.

    held     xhat' = A xhat + B u + L (y - C xhat - D u) integrated over the sample,   M = T (A - L C)
             xhat+ = xhat + T phi(M) (A xhat + B u + L innovation)
    sampled  xhat+ = xhat + T phi(M) (A xhat + B u) + K innovation,                    M = T A

with phi(M) = int_0^1 e^(M s) ds and innovation = y - C xhat - D u at the start of the sample. `held` is the update for which
P1 notes 9 gives the poles: forward Euler and "predict, then correct with T L" are unstable with the published gains at 200 Hz.
Its error follows the plant's own motion within a sample; that of `sampled` does not (synthesis.loop.observer).
"""

from __future__ import annotations

import numpy as np

from estimators.arithmetic import Number
from estimators.errors import ScheduleError
from estimators.interpolate import PiecewiseLinear
from estimators.phi import phi
from estimators.schedule import GainSchedule

_MOST_GROWTH = 50.0  # exponent of growth in one sample; from e^700 on float64 overflows
_LARGEST_STEP = 1e50  # of the numbers in T A, T L C: their products meet states of up to 1e100 (arguments.LIMIT)
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
    gain *= 1.0 if schedule.observer_update == "sampled" else period
    if not period * (largest["A"] + largest["B"]) + gain * (largest["C"] + largest["D"]) <= _LARGEST_STEP:
        raise ScheduleError(
            f"schedule '{schedule.name}': plant, gains and sample time multiply to more than {_LARGEST_STEP:g} in one "
            "sample, where float64 overflows; check their units"
        )
    places = np.union1d(schedule.breakpoints, np.linspace(schedule.parameter.min, schedule.parameter.max, _LOOKS))
    plant = schedule.plant_at(places)
    closed = plant.A - schedule.gain(places) @ plant.C if schedule.observer_update == "held" else plant.A
    for matrices in (plant.A, closed):
        growth = period * np.linalg.eigvals(matrices).real.max(axis=-1)
        if not growth.max() <= _MOST_GROWTH:
            at = f"{schedule.parameter.name} = {places[growth.argmax()]:g} {schedule.parameter.unit}"
            raise ScheduleError(
                f"schedule '{schedule.name}': the error grows by e^{growth.max():.0f} in one sample at {at}; "
                "check the signs of the gains and the sample time"
            )


class ExactUpdate:
    """Plant, gains and sample time of a schedule; one formula for one entry, in plain numbers, and for many, in arrays."""

    def __init__(self, schedule: GainSchedule) -> None:
        entries = plant_entries(schedule)
        self.constants: list[Number] = [entry[0] if len(entry) == 1 else 0.0 for entry in entries]
        self.varying = [(place, entry) for place, entry in enumerate(entries) if len(entry) > 1]
        first = schedule.polynomials["A"]
        self.middle, self.half = first.middle, first.half
        self.sampled = schedule.observer_update == "sampled"
        factor = 1.0 if self.sampled else schedule.sample_time
        self.gains = PiecewiseLinear(schedule.breakpoints, factor * schedule.table[:, :, 0])  # K or T L

    def advance(
        self, x1: Number, x2: Number, held_input: Number, measurement: Number, parameter: Number, used: Number = True
    ) -> tuple[Number, Number, Number]:
        """The two states at the end of the sample, and the innovation y - C xhat - D u at its start.

        Floats (and a bool `used`), or arrays (n,); where not `used`, the entry moves with L = 0.
        """
        values = self.constants.copy()
        u = (parameter - self.middle) / self.half
        for place, entry in self.varying:
            here, later = entry[-1], 0.0
            for coefficient in entry[-2:0:-1]:  # Clenshaw's recurrence b_k = c_k + 2 u b_k+1 - b_k+2
                here, later = coefficient + 2.0 * u * here - later, here
            values[place] = entry[0] + u * here - later
        a11, a12, a21, a22, b1, b2, c1, c2, d = values
        gain1, gain2 = self.gains(parameter) if isinstance(parameter, np.ndarray) else self.gains.at(parameter)
        if used is not True:
            gain1, gain2 = used * gain1, used * gain2
        innovation = measurement - c1 * x1 - c2 * x2 - d * held_input
        jump1 = jump2 = 0.0
        if self.sampled:
            jump1, jump2, gain1, gain2 = gain1 * innovation, gain2 * innovation, 0.0, 0.0
        rate1 = gain1 * innovation + a11 * x1 + a12 * x2 + b1 * held_input
        rate2 = gain2 * innovation + a21 * x1 + a22 * x2 + b2 * held_input
        n11, n12, n21, n22 = a11 - gain1 * c1, a12 - gain1 * c2, a21 - gain2 * c1, a22 - gain2 * c2
        mean = 0.5 * (n11 + n22)
        n11 = n11 - mean
        alpha, beta = phi(mean, n11 * n11 + n12 * n21)
        first = x1 + (alpha * rate1 + beta * (n11 * rate1 + n12 * rate2) + jump1)
        second = x2 + (alpha * rate2 + beta * (n21 * rate1 - n11 * rate2) + jump2)
        return first, second, innovation
