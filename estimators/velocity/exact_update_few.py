"""`exact_update` for a handful of entries: the same formulas on plain numbers.

One numpy call costs about a microsecond whatever the size of its arrays, and the update takes a hundred of them: below
some ten entries plain arithmetic is several times faster.
"""

from __future__ import annotations

from estimators.interpolate import PiecewiseLinear
from estimators.phi import phi
from estimators.schedule import GainSchedule
from estimators.velocity.exact_update import plant_entries


class ExactUpdateFew:
    """Plant, gains and sample time of a schedule, ready for `advance` on one entry after the other."""

    def __init__(self, schedule: GainSchedule) -> None:
        entries = plant_entries(schedule)
        self.constants = [entry[0] if len(entry) == 1 else 0.0 for entry in entries]
        self.varying = [(place, entry) for place, entry in enumerate(entries) if len(entry) > 1]
        self.middle, self.half = schedule.plant["A"].middle, schedule.plant["A"].half
        self.sampled = schedule.update == "sampled"
        factor = 1.0 if self.sampled else schedule.sample_time
        self.gains = PiecewiseLinear(schedule.breakpoints, factor * schedule.table[:, :, 0])  # K or T L

    def advance(
        self, x1: float, x2: float, held_input: float, measurement: float, parameter: float, coast: bool
    ) -> tuple[float, float, float]:
        """The two states at the end of the sample, and the innovation y - C xhat - D u at its start."""
        values = self.constants.copy()
        u = (parameter - self.middle) / self.half
        for place, entry in self.varying:
            here, later = entry[-1], 0.0
            for coefficient in entry[-2:0:-1]:  # Clenshaw
                here, later = coefficient + 2.0 * u * here - later, here
            values[place] = entry[0] + u * here - later
        a11, a12, a21, a22, b1, b2, c1, c2, d = values
        offset, gain1, gain2, slope1, slope2 = self.gains.column(parameter)
        gain1, gain2 = (0.0, 0.0) if coast else (gain1 + slope1 * offset, gain2 + slope2 * offset)
        innovation = measurement - c1 * x1 - c2 * x2 - d * held_input
        jump1 = jump2 = 0.0
        if self.sampled:
            jump1, jump2, gain1, gain2 = gain1 * innovation, gain2 * innovation, 0.0, 0.0
        rate1 = gain1 * innovation + a11 * x1 + a12 * x2 + b1 * held_input
        rate2 = gain2 * innovation + a21 * x1 + a22 * x2 + b2 * held_input
        n11, n12, n21, n22 = a11 - gain1 * c1, a12 - gain1 * c2, a21 - gain2 * c1, a22 - gain2 * c2
        mean = 0.5 * (n11 + n22)
        n11 -= mean
        alpha, beta = phi(mean, n11 * n11 + n12 * n21)
        x1 += alpha * rate1 + beta * (n11 * rate1 + n12 * rate2) + jump1
        x2 += alpha * rate2 + beta * (n21 * rate1 - n11 * rate2) + jump2
        return x1, x2, innovation
