"""Lever arm and angles of the inertial unit from a drive with a velocity reference: what a rigid body makes of both.

A unit at l from the centre of gravity, turned by R against the car (`estimators.signals.mounting`), reads

    a = R' (a_cg + w' x l + w x (w x l)) + b,        w = R w_unit,
    a_cg = (V_x' - r V_y + g theta, V_y' + r V_x + g phi, g),        theta' = -q + r phi, phi' = p - r theta,

and the body tilts with its accelerations, phi = k_y a_y and theta = k_x a_x, but not with the yaw rate, so that the gyros read
p = k_y a_y' + k_x r a_x + b_p, q = -k_x a_x' + k_y r a_y + b_q, and the third accelerometer -k_x a_x^2 - k_y a_y^2 beyond g.
Where p and q are not measured, phi and theta are k_y a_y and k_x a_x; they come late by a time of some 0.05 s, for the body has
mass. All sides pass one prefilter, and those of the accelerations a washout s/(s + 1/T), which takes constants away: a bias, a
grade, and with them what gravity says of the unit's roll and pitch; turns and brakes say it.

Nuisances with priors: biases, scales, tilts k and their delay, rates in phase with a_y (what the body's motion is beyond a delay:
at constant speed it looks like an angle of the unit), the arm at which it pitches and rolls (it looks like a lever arm in a
launch), and a late clock of the reference, which looks like a lever arm in
a turn at constant speed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.signals.mounting import Mounting, lever_acceleration
from estimators.vehicle import GRAVITY
from studies.drives.drive_file import DriveFile
from studies.drives.log import DriveLog
from studies.drives.mounted import PULLS, RATES, Place
from studies.identify.estimate import Estimate, Rules, Unknown, estimate
from studies.identify.prefilter import Prefilter, first_order_lag
from studies.identify.settings import IdentifySettings

ARMS, ANGLES = ("x", "y", "z"), ("roll", "pitch", "yaw")
WASHOUT = 2.0  # s: longer than a steering motion, shorter than a change of grade
ROWS = 8  # in a correlation length of the prefilter: more say nothing new
PASSES = 3
"""The first weighs all channels by `_WEIGHTS` and believes the drive file; each further one starts from the one before."""
_WEIGHTS = np.array([1.0, 1.0, 1.0, 10.0, 10.0])
"""Of rows in m/s^2 and rad/s: a gyro's noise is a tenth of an accelerometer's."""
_NEEDS = {"ax": "signals.ax", "ay": "signals.ay", "yaw_rate": "signals.yaw_rate"}
_TURNED = 0.5  # rad by which angles may differ from those of the drive file: more is another axis


@dataclass(frozen=True)
class MountingFit:
    """What a log says of the unit, or why nothing was fitted (``absent``)."""

    given: Place
    fit: Estimate | None
    absent: str = ""


@dataclass(frozen=True)
class _Rows:
    """Filtered signals (n, ...) of the unit, and velocities of the reference; ``channels`` of a_x to q are measured."""

    pull: FloatArray  # F[a] (n, 3)
    rate: FloatArray  # F[w] (n, 3), without washout
    angle: FloatArray  # F[integral of w] (n, 3)
    slope: FloatArray  # D[w] (n, 3)
    spin: FloatArray  # D[w] (n, 3), without washout
    products: FloatArray  # F[w w'] (n, 3, 3)
    velocity_slope: FloatArray  # D[V_x, V_y] (n, 2)
    turning: FloatArray  # F[w_i V_j] (n, 3, 2)
    pulled: FloatArray  # F[a_x, a_y] (n, 2) of the car
    level: FloatArray  # the same without washout
    change: FloatArray  # D[a_x, a_y] (n, 2) of the car, without washout
    squares: FloatArray  # F[a_x^2, a_y^2] (n, 2) of the car
    turned: FloatArray  # F[r a_x, r a_y] (n, 2) of the car, without washout
    twist: FloatArray  # F[integral of r a_x, r a_y] (n, 2) of the car
    channels: BoolArray  # (5,)
    tilts: FloatArray  # (3,) whether roll and pitch rates are measured

    def residual(self, p: Mapping[str, float]) -> FloatArray:
        """Readings minus what the motion of the reference makes of them (n, 5)."""
        unit = _mounting(p)
        R, lever = unit.rotation, unit.lever
        turn = self.turning.swapaxes(1, 2) @ R[2]  # F[r V_x, r V_y]
        along = self.velocity_slope[:, 0] - turn[:, 1]
        across = self.velocity_slope[:, 1] + turn[:, 0]
        rest, slope, change = R @ [p["bias_x"], p["bias_y"], p["bias_z"]], self.slope @ R.T, self.change
        tilt = np.array([p["tilt_x"], p["tilt_y"]])
        roll, fall = ((self.angle @ R.T)[:, :2] - self.twist * tilt).T * self.tilts[:2, None]
        free_x, free_y = np.array([p["scale_x"], p["scale_y"]]) + GRAVITY * tilt * (1.0 - self.tilts[1::-1])
        car = np.stack([
            along + free_x * self.pulled[:, 0] - GRAVITY * fall + p["late_x"] * change[:, 0],
            across + free_y * self.pulled[:, 1] + GRAVITY * roll + p["late_y"] * change[:, 1],
            slope[:, 0] * p["heave_x"] + slope[:, 1] * p["heave_y"] + p["jacking"] * self.level[:, 1] - self.squares @ tilt,
        ], axis=1) + rest  # fmt: skip
        products = R @ self.products @ R.T
        felt = np.cross(slope, lever) + products @ lever - lever * np.trace(products, axis1=1, axis2=2)[:, None]
        rate = (self.rate + p["tilt_delay"] * self.spin) @ R.T
        sway = p["sway"] * self.level[:, 1] + p["rate_bias_x"]
        rolls = rate[:, 0] - tilt[1] * change[:, 1] - tilt[0] * self.turned[:, 0] - sway
        pitches = rate[:, 1] + tilt[0] * change[:, 0] - tilt[1] * self.turned[:, 1] - p["rate_bias_y"]
        return np.column_stack([self.pull - (car + felt) @ R, rolls, pitches])


def fit_mounting(log: DriveLog, drive: DriveFile, settings: IdentifySettings) -> MountingFit:
    """Lever arm, m, and angles, rad, of the unit; the drive file's are the priors. Rows without a reference V_y say nothing."""
    given = drive.mounting.inertial
    missing = [key for name, key in _NEEDS.items() if name not in log.unit]
    missing += [f"reference.{name}" for name in ("vx", "vy") if name not in log.reference]
    if missing:
        return MountingFit(given, None, f"not fitted: {', '.join(missing)} missing")
    zero = np.zeros_like(log.time)
    pull, rate = (np.stack([log.unit.get(name, zero) for name in names], axis=1) for names in (PULLS, RATES))
    velocity = np.stack([log.reference["vx"], log.reference["vy"]], axis=1)
    known = np.isfinite(np.concatenate([pull, rate, velocity], axis=1)).all(axis=1)
    filter_ = Prefilter(known, drive.sample_time, settings.mounting_lag, settings.settling)
    every = max(1, filter_.correlation // ROWS)
    slow = ~known | (np.abs(velocity[:, 0]) < settings.least_speed)
    settled = filter_.settled(slow)
    for run in filter_.runs:
        settled[run.start : run.start + filter_.memory] = False
    correlation = max(1, filter_.correlation // every)
    rules = Rules(settings.confidence, 10 * settings.residual_floor, correlation, settings.least_freedom)
    weights, at, start, fit = _WEIGHTS, given.mounting, None, None
    unknowns = _unknowns(given.mounting, settings)
    for _ in range(PASSES):
        rows = _rows(filter_, at, (pull, rate, velocity), drive.sample_time, log.unit.keys(), every)
        mask = settled[::every, None] & rows.channels

        def weighed(p: Mapping[str, float], weights: FloatArray = weights, rows: _Rows = rows) -> FloatArray:
            return rows.residual(p) * weights

        fit = estimate(weighed, mask, unknowns, rules, start)
        start = {u.name: float(x) for u, x in zip(fit.unknowns, fit.x, strict=True)}
        at = _mounting(fit.values())
        squares = np.where(mask, np.nan_to_num(fit.residual), 0.0) ** 2
        size = np.sqrt(squares.sum(axis=0) / np.maximum(mask.sum(axis=0), 1))
        weights = np.where(rows.channels, weights * max(fit.rms, rules.floor) / np.maximum(size, rules.floor), 0.0)
    return MountingFit(given, fit)


def _mounting(p: Mapping[str, float]) -> Mounting:
    return Mounting(**{name: p[name] for name in (*ARMS, *ANGLES)})


def _rows(
    filter_: Prefilter,
    at: Mounting,
    given: tuple[FloatArray, FloatArray, FloatArray],
    step: float,
    measured: Collection[str],
    every: int,
) -> _Rows:
    pull, rate, velocity = given
    n = len(pull)

    runs = [
        slice(run.start + filter_.memory, run.stop) for run in filter_.runs if run.stop - run.start > filter_.memory
    ]

    def washed(value: FloatArray) -> FloatArray:
        """Starts at rest where the prefilter has settled, all sides of an equation alike."""
        flat = value.reshape(n, -1)
        return (flat - first_order_lag(flat, step, WASHOUT, runs)).reshape(value.shape)

    def summed(value: FloatArray) -> FloatArray:
        out = np.full_like(value, np.nan)
        for run in filter_.runs:
            out[run] = step * np.cumsum(value[run], axis=0)
        return out

    smooth, slope = filter_.smooth, filter_.rate
    products = (rate[:, :, None] * rate[:, None]).reshape(n, 9)
    turning = (rate[:, :, None] * velocity[:, None]).reshape(n, 6)
    spin, spun = slope(rate), rate @ at.rotation.T
    # the body tilts with the acceleration of its centre of gravity, not with that of the unit
    own = (pull @ at.rotation.T - lever_acceleration(at.lever, smooth(spun), spin @ at.rotation.T))[:, :2]
    own, curved = np.nan_to_num(own), np.nan_to_num(own * spun[:, 2:])
    columns = (
        washed(smooth(pull)), smooth(rate), washed(smooth(summed(rate))), washed(spin), spin,
        washed(smooth(products)).reshape(n, 3, 3), washed(slope(velocity)), washed(smooth(turning)).reshape(n, 3, 2),
        washed(smooth(own)), smooth(own), slope(own), washed(smooth(own**2)), smooth(curved), washed(smooth(summed(curved))),
    )  # fmt: skip
    names = (*PULLS, *RATES[:2])
    there = np.array([name in measured for name in names])
    kept: list[Any] = [column[::every] for column in columns]
    kept += [there, np.array([*there[3:], False], dtype=np.float64)]
    return _Rows(*kept)


def _unknowns(given: Mounting, s: IdentifySettings) -> tuple[Unknown, ...]:
    def arm(name: str) -> Unknown:
        value = getattr(given, name)
        bounds = (value - 5 * s.arm_spread, value + 5 * s.arm_spread)
        return Unknown(name, value, s.arm_spread, s.arm_width, bounds, positive=False, informed=False)

    def angle(name: str) -> Unknown:
        value = getattr(given, name)
        bounds = (value - _TURNED, value + _TURNED)
        return Unknown(name, value, s.mounting_spread, s.mounting_width, bounds, positive=False, informed=False)

    def nuisance(name: str, prior: float, spread: float) -> Unknown:
        return Unknown(name, prior, spread, spread, (prior - 20 * spread, prior + 20 * spread), positive=False)

    both = {
        "bias": s.acceleration_bias, "scale": s.scale_spread, "late": s.reference_delay, "heave": s.heave_arm,
        "rate_bias": s.rate_bias,
    }  # fmt: skip
    return (
        *map(arm, ARMS), *map(angle, ANGLES), nuisance("bias_z", 0.0, s.acceleration_bias),
        *(nuisance(f"{name}_{axis}", 0.0, spread) for name, spread in both.items() for axis in "xy"),
        nuisance("tilt_x", 0.003, s.tilt_spread), nuisance("tilt_y", 0.006, s.tilt_spread),
        nuisance("tilt_delay", 0.05, s.tilt_delay), nuisance("sway", 0.0, s.sway), nuisance("jacking", 0.0, s.jacking),
    )  # fmt: skip
