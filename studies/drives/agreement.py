"""Signals of a log beside what the other signals say of them: the comparisons that show a wrong sign, unit or side.

With R_e w of the wheels, track t, wheelbase L, yaw rate r and steering angle d (frame x forward, y left, z up):

    a_x = V'                           V: mean of the wheel surface speeds
    r = (v_right - v_left) / t         on the rear and on the front axle
    a_y = r V                          without V_y', which is short
    r = V d / (L + K V^2)              single track, K = L / (25 m/s)^2 (usual understeer)
    a_z = g

Each is a robust line (:mod:`.robust_line`) through averages over 0.2 s, where the axles roll alike and the car moves. Nothing
in the choice of samples depends on the scale of a signal: a wrong unit must not hide itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.vehicle import GRAVITY
from studies.drives.drive_file import DriveFile, Vehicle
from studies.drives.quantities import CORNERS, at_corners
from studies.drives.robust_line import Line, robust_line

WINDOW = 0.2  # s of averaging, and half of the span of V'
STEP = 0.1  # s between the samples of a comparison
SLIP, SLACK = 0.05, 0.3  # axles may differ by this share of the speed and by this, m/s
MOVING = 2.0  # m/s
CHARACTERISTIC_SPEED = 25.0  # m/s at which a usual car needs twice the Ackermann angle
TURNS, SIDEWAYS, ALONG = 0.03, 0.5, 0.6  # rad/s, m/s^2, m/s^2 that count as excitation
BAND, WIDE_BAND = 1.7, 5.0
"""Factors up to which a slope counts as 1. Snow, drift and slip reach 0.63 to 1.27 on the truth vehicles of this project;
steering on ice reaches 0.42, and a line through the origin holds offsets and grades."""
MATCH, WIDE_MATCH = 1.6, 3.0
"""Factors up to which a mistake explains a slope: less than what is no news, since a mistake leaves a slope of 1 behind."""
SURE = 0.9  # least quality of a line from which a mistake is inferred; any clear one of the other sign will do
WHEEL_SPREAD = 0.2  # interquartile range of a wheel's ratio to the others, above which it slips rather than misreads


@dataclass(frozen=True)
class Comparison:
    """``line``: slope of one quantity over what others predict for it, None where the log does not excite it.

    ``gains``: which groups of columns the slope is proportional to (1) or inversely so (-1). ``band``: factor that is no news;
    ``match``: factor up to which a mistake explains the slope.
    """

    title: str
    gains: Mapping[str, int]
    line: Line | None
    band: float
    match: float = MATCH

    @property
    def decides(self) -> bool:
        """Whether the log says anything."""
        return self.line is not None and self.line.clear

    def misfit(self, factors: Mapping[str, float]) -> float:
        """|log| of slope over the one that the ``factors`` of wrong columns explain; infinite at another sign, 0 undecided."""
        if self.line is None or not self.line.clear:
            return 0.0
        left = self.line.slope
        for group, power in self.gains.items():
            left /= factors.get(group, 1.0) ** power
        return float(abs(np.log(left))) if left > 0.0 else np.inf

    @property
    def agrees(self) -> bool:
        """Whether nothing has to be explained: the slope is 1 within the band, or the log says nothing."""
        return bool(self.misfit({}) <= np.log(self.band))

    @property
    def contradicts(self) -> bool:
        """Whether a mistake may be inferred from this line."""
        return not self.agrees and self.line is not None and (self.line.quality >= SURE or self.line.slope < 0.0)

    @property
    def sure(self) -> bool:
        """Whether the slope is known to a few percent: no offset is in it."""
        return self.line is not None and self.line.quality >= SURE and not self.line.anchored

    def explained(self, factors: Mapping[str, float], wheels: float = 1.0) -> bool:
        """Whether the slope is 1 once the factors are taken out; one that agrees and has none of them stays as it is.

        ``wheels``: the factor that was taken out of all wheel speeds before the comparison.
        """
        touched = self.gains.keys() & factors.keys() or (wheels != 1.0 and "wheels" in self.gains)
        return (self.agrees and not touched) or bool(self.misfit(factors) <= np.log(self.match))


def compare(signals: Mapping[str, FloatArray], drive: DriveFile) -> list[Comparison]:
    """Every comparison that the signals (n,) in SI on the grid of ``drive`` allow."""
    return _Log(signals, drive).comparisons()


def wheels_apart(signals: Mapping[str, FloatArray], drive: DriveFile) -> list[Comparison]:
    """Each wheel beside the median of all: a steady ratio far from 1 is a unit, a sign or a factor of one column."""
    speed = surface_speeds(signals, drive.vehicle)
    whole = np.median(speed, axis=1)
    whole = np.where(np.isfinite(whole) & (np.abs(whole) > MOVING), whole, np.nan)
    found = []
    for k, corner in enumerate(CORNERS):
        ratio = (speed[:, k] / whole)[np.isfinite(whole)]
        line = None
        if ratio.size * drive.sample_time > 1.0:
            low, middle, high = np.percentile(ratio, (25, 50, 75))
            steady = high - low < WHEEL_SPREAD * abs(middle)
            line = Line(float(middle), 1.0 if steady else 0.0, ratio.size)
        found.append(Comparison(f"wheel {corner} beside all", {f"wheel_speed_{corner}": 1}, line, 2.0))
    return found


class _Log:
    def __init__(self, signals: Mapping[str, FloatArray], drive: DriveFile) -> None:
        self.signals, self.car = signals, drive.vehicle
        self.window, self.step = (max(1, round(span / drive.sample_time)) for span in (WINDOW, STEP))
        wheels = surface_speeds(signals, self.car)
        speed = np.stack([self.mean(one) for one in wheels.T], axis=-1)
        front, rear = speed[:, :2].mean(axis=1), speed[:, 2:].mean(axis=1)
        self.speed = 0.5 * (front + rear)
        self.front = (speed[:, 1] - speed[:, 0]) / self.car.front_track
        self.rear = (speed[:, 3] - speed[:, 2]) / self.car.rear_track
        self.rolls = np.abs(front - rear) < SLIP * np.abs(self.speed) + SLACK
        self.moves = self.rolls & (np.abs(self.speed) > MOVING)
        self.span = 2 * self.window * drive.sample_time

    def comparisons(self) -> list[Comparison]:
        found = [self._along(), *self._turning(), *self._sideways(), *self._steered()]
        if "az" in self.signals:
            found.append(_gravity(self.signals["az"]))
        return found

    def _along(self) -> Comparison:
        k, slope, rolls = self.window, np.full(self.speed.shape, np.nan), self.rolls.copy()
        if slope.size > 2 * k:
            slope[k:-k] = (self.speed[2 * k :] - self.speed[: -2 * k]) / self.span
            rolls[k:-k] &= self.rolls[2 * k :] & self.rolls[: -2 * k]
        felt = self.mean(self.signals["ax"], 2 * k)
        gains = {"ax": 1, "wheels": -1}
        return self._line("ax over the slope of the wheel speed", gains, slope, felt, rolls, ALONG)

    def _turning(self) -> list[Comparison]:
        rear_steers = "steer_rl" in self.signals
        found = []
        if not rear_steers:
            title, gains = "front over rear wheel difference", {"front": 1, "rear": -1}
            found.append(self._line(title, gains, self.rear, self.front, self.moves, TURNS, WIDE_BAND, WIDE_MATCH))
        if "yaw_rate" in self.signals:
            turn = self.mean(self.signals["yaw_rate"])
            for axle, said in (("front", self.front), ("rear", self.rear)):
                if axle == "front" or not rear_steers:
                    title, gains = f"yaw rate over {axle} wheel difference", {"yaw_rate": 1, "wheels": -1, axle: -1}
                    found.append(self._line(title, gains, said, turn, self.moves, TURNS))
        return found

    def _turn(self) -> tuple[str, dict[str, int], FloatArray]:
        """The yaw rate, or without one the difference of the rear wheels."""
        if "yaw_rate" in self.signals:
            return "yaw rate", {"yaw_rate": 1}, self.mean(self.signals["yaw_rate"])
        return "rear wheel difference", {"wheels": 1, "rear": 1}, self.rear

    def _sideways(self) -> list[Comparison]:
        if "ay" not in self.signals:
            return []
        name, own, turn = self._turn()
        gains = {"ay": 1, "wheels": -1 - own.get("wheels", 0), **{k: -1 for k in own if k != "wheels"}}
        felt = self.mean(self.signals["ay"])
        return [self._line(f"ay over {name} times speed", gains, turn * self.speed, felt, self.moves, SIDEWAYS)]

    def _steered(self) -> list[Comparison]:
        steer = steering_angle(self.signals, self.car)
        if steer is None:
            return []
        name, own, turn = self._turn()
        base = self.car.front_axle_distance + self.car.rear_axle_distance
        said = self.speed * self.mean(steer) / (base * (1.0 + (self.speed / CHARACTERISTIC_SPEED) ** 2))
        gains = {**own, "wheels": own.get("wheels", 0) - 1, "steering": -1}
        return [
            self._line(f"{name} over steering times speed", gains, said, turn, self.moves, TURNS, WIDE_BAND, WIDE_MATCH)
        ]

    def _line(
        self,
        title: str,
        gains: dict[str, int],
        x: FloatArray,
        y: FloatArray,
        use: BoolArray,
        moves: float,
        band: float = BAND,
        match: float = MATCH,
    ) -> Comparison:
        line = robust_line(np.where(use, x, np.nan)[:: self.step], y[:: self.step], moves)
        wide = line is not None and line.anchored
        return Comparison(title, gains, line, WIDE_BAND if wide else band, match)

    def mean(self, value: FloatArray, samples: int | None = None) -> FloatArray:
        """Over the window, or so many samples."""
        return averaged(value, samples or self.window)


def averaged(value: FloatArray, samples: int) -> FloatArray:
    """Centred mean of the finite samples (n,); NaN where less than half of them are."""
    half = samples // 2
    known = np.isfinite(value)
    total = np.concatenate([[0.0], np.cumsum(np.where(known, value, 0.0))])
    count = np.concatenate([[0], np.cumsum(known)])
    k = np.arange(value.size)
    low, high = np.maximum(k - half, 0), np.minimum(k + half + 1, value.size)
    n = count[high] - count[low]
    mean = (total[high] - total[low]) / np.maximum(n, 1)
    return np.where(2 * n > 2 * half + 1, mean, np.nan)


def surface_speeds(signals: Mapping[str, FloatArray], car: Vehicle) -> FloatArray:
    """R_e w (n, 4), m/s."""
    radius = np.repeat([car.effective_radius_front, car.effective_radius_rear], 2)
    return np.asarray(at_corners(signals, "wheel_speed") * radius)


def steering_angle(signals: Mapping[str, FloatArray], car: Vehicle) -> FloatArray | None:
    """Mean road-wheel angle of the front axle (n,), rad; None where nothing measures it."""
    if "steering" in signals:
        return signals["steering"]
    if "hand_wheel" in signals and car.steering_ratio:
        return signals["hand_wheel"] / car.steering_ratio
    if "steer_fl" in signals and "steer_fr" in signals:
        return 0.5 * (signals["steer_fl"] + signals["steer_fr"])
    return None


def _gravity(az: FloatArray) -> Comparison:
    known = az[np.isfinite(az)]
    line = Line(float(np.median(known)) / GRAVITY, 1.0, known.size) if known.size else None
    return Comparison("az over gravity", {"az": 1}, line, BAND)
