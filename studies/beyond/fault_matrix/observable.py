"""Which faults the relations can show at all: what a fault adds to every residual of a healthy car, against what is allowed.

    r_ik + c_i - c_k,   |r_ik + c_i - c_k| <= t_i + t_k: nobody can see it

r is a residual of the healthy car, t what its witnesses are allowed to be off, both as the monitor has them on that drive; c is
what the fault moves a witness by, from the formulas of the witnesses and the true speed V_x, so the monitor has no part in it:

    turn   m/s^2  yaw rate V_x dr, a_y d(a_y) - g d(roll), steering V_x^2 d(tan delta)/L
    pull   m/s^2  a_x against the forces d(a_x) - g d(pitch)
    axles  m/s    front against rear axle V_x d(tan delta)

all low-passed as there. Pitch and roll are errors that the attitude part makes of the fault. Wheels and torques, for which
this is not written down, count as seen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import cast

import numpy as np
from scipy.signal import lfilter

from estimators.arrays import BoolArray, FloatArray
from estimators.forces import AttitudeObserver
from estimators.pipeline import EstimationPipeline
from estimators.vehicle import GRAVITY
from estimators.velocity import FusionSettings, VelocityFusion
from estimators.velocity.parity import SIDE, STEERING, UNLEVELLED, YAW_RATE
from estimators.velocity.signal_monitor import LOCKED
from studies.trials.estimation import assumed_car
from studies.truth import Measured

_UNKNOWN = ("wheel_speed", "torque")
_S = FusionSettings()


@dataclass(frozen=True)
class Healthy:
    """Residuals of healthy cars and what they may be; (seeds, drives, n), levels of `turn` (6, seeds, drives, n)."""

    drawn: Measured
    level: FloatArray  # m/s^2
    allowed: FloatArray  # m/s^2
    known: BoolArray
    gap: FloatArray  # m/s^2, a_x less forces
    gap_allowed: FloatArray
    apart: FloatArray  # m/s, front less rear axle condition
    spread: FloatArray  # m/s, one standard deviation
    roll: FloatArray  # rad
    pitch: FloatArray


def healthy(drawn: Measured) -> Healthy:
    """Of every draw on every drive, as the monitor of the default pipeline has them."""
    shape, time = drawn.batch_shape, drawn.sample_time
    pipeline = EstimationPipeline(assumed_car(drawn), time, shape, attitude=AttitudeObserver(time, shape))
    monitor, rows = cast(VelocityFusion, pipeline.velocity).signal_monitor, []
    for signals in drawn:
        step = pipeline.step(signals)
        readings, pull = monitor.turn.witnesses.readings, monitor.pull
        values = (*readings.level, *readings.allowed, *readings.known, pull.gap, pull.allowed)
        values = (*values, monitor.astray, monitor.spread, step.roll, step.pitch)
        rows.append([np.broadcast_to(np.ravel(value), math.prod(shape)) for value in values])
    table = np.moveaxis(np.array(rows), 0, -1).reshape(-1, *shape, drawn.time.size)
    return Healthy(drawn, table[:6], table[6:12], table[12:18] > 0.0, *table[18:])


def shares(of: Healthy, signals: Mapping[str, FloatArray], tilt: Mapping[str, FloatArray]) -> FloatArray:
    """Of faulty ``signals`` (seeds, drives, n[, 4]) the largest residual per allowance of all relations, (seeds, drives, n).

    ``tilt``: rad, roll and pitch as the attitude part has them with the fault. Above 1 some relation shows it. Infinite where
    a signal that is not modelled, or is missing, is at fault.
    """
    drawn, speed, car = of.drawn, of.drawn.truth["vx"], assumed_car(of.drawn)
    change = {name: value - drawn.signals[name] for name, value in signals.items()}
    unknown = np.zeros(of.gap.shape, dtype=np.bool_)
    for name, value in change.items():
        off = value.reshape(*unknown.shape, -1)
        unknown |= (~np.isfinite(off) | ((off != 0.0) & (name in _UNKNOWN))).any(axis=-1)
    front, true = (each["steer"][..., :2].mean(axis=-1) for each in (signals, drawn.signals))
    turned = np.tan(front) - np.tan(true)
    moved = np.zeros_like(of.level)
    moved[YAW_RATE] = speed * change["yaw_rate"]
    moved[SIDE] = change["ay"] - GRAVITY * (tilt["roll"] - of.roll)
    moved[UNLEVELLED] = change["ay"]
    moved[STEERING] = speed * speed * turned / car.wheelbase
    level = of.level + _low_passed(moved, _S.wheel_lag, drawn.sample_time)
    found = []
    for i, k in combinations(range(len(level)), 2):
        share = np.abs(level[i] - level[k]) / (of.allowed[i] + of.allowed[k])
        either = (moved[i] != 0.0) | (moved[k] != 0.0)
        found.append(np.where(of.known[i] & of.known[k] & either, share, 0.0))
    along = _low_passed(change["ax"] - GRAVITY * (tilt["pitch"] - of.pitch), _S.force_gap_memory, drawn.sample_time)
    found.append(np.where(along != 0.0, np.abs(of.gap + along) / of.gap_allowed, 0.0))
    axles = of.apart + _low_passed(speed * turned, _S.wheel_lag, drawn.sample_time)
    locked = np.diff(front, axis=-1, prepend=np.nan) == 0.0
    gate = np.where(locked, LOCKED, _S.gate)
    found.append(np.where(turned != 0.0, np.abs(axles) / (gate * np.maximum(of.spread, 1e-9)), 0.0))
    return np.where(unknown, np.inf, np.max(found, axis=0))


def _low_passed(value: FloatArray, lag: float, time: float) -> FloatArray:
    kept = math.exp(-time / lag)
    smooth: FloatArray = lfilter([1.0 - kept], [1.0, -kept], np.nan_to_num(value), axis=-1)
    return smooth
