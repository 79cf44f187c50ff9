"""Wheel inertia from the balance of the whole car: what the torques do not turn into acceleration, they turn into spin.

    sum T/R_e = m a_x + I_w sum (dw/dt)/R_e + d v^2 + b,    with T scaled by k and late by t,

over straight driving: k and t (of the torque signals), d (drag of air) and b (rolling resistance, grade, accelerometer
bias) are fitted with I_w. While wheels roll, dw/dt = a_x/R_e, and I_w cannot be told from the scale: the wheels together
weigh 4 I_w/R_e^2, about 2 % of the car. Only wheels that spin up or lock against the car excite it.

That is when a_x jumps, and a sample says nothing of what it was since the one before: the mean of an interval lies anywhere
between both, a standard deviation of |difference|/sqrt 12, independent from interval to interval. The wheel speeds count
all of it, so a row is as uncertain as its residual and the filtered jumps together, and weighed so. (Unweighed, a single
interval at the end of a patch of ice moves the inertia by 3 %.)
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.vehicle import GRAVITY
from studies.identify.data import DriveSignals
from studies.identify.estimate import Estimate, Rules, Unknown, estimate
from studies.identify.settings import IdentifySettings

STRAIGHT = 0.01  # rad of steering below which lateral forces hardly brake the car
PASSES = 3  # the first weighs all rows alike, the others by the residual of the one before


def fit_inertia(data: DriveSignals, prior: float, settings: IdentifySettings) -> Estimate | None:
    """Wheel inertia, kg m^2, and its nuisances; residual in m/s^2 of the car. None without torques at all wheels."""
    if data.torque is None:
        return None
    car, radius, smooth, rate = data.drive.vehicle, data.inputs.radius, data.filter.smooth, data.filter.rate
    mass = car.mass
    pull = smooth(np.sum(data.torque / radius, axis=1)) / mass
    late = rate(np.sum(data.torque / radius, axis=1)) / mass
    spin = rate(np.sum(data.inputs.wheel_speed / radius, axis=1)) / mass
    drag = smooth(data.vx * np.abs(data.vx)) / mass
    felt = smooth(data.inputs.ax)
    weight = car.rolling_resistance * GRAVITY

    def balance(p: Mapping[str, float]) -> FloatArray:
        rest = p["torque_scale"] * (pull - p["torque_delay"] * late) - felt - p["wheel_inertia"] * spin
        return np.asarray(rest - p["drag"] * drag - p["acceleration_bias"])[:, None]

    bias, delay = settings.acceleration_bias, settings.torque_delay
    unknowns = (
        Unknown("wheel_inertia", prior, settings.inertia_spread, settings.inertia_width, (-2.5, 2.5), informed=False),
        Unknown("torque_scale", 1.0, settings.torque_scale_spread, settings.torque_scale_spread, (-1.5, 1.5)),
        Unknown("torque_delay", 0.0, delay, delay, (-0.1, 0.1), positive=False),
        Unknown("drag", settings.drag_prior, settings.drag_spread, settings.drag_spread, (-2.0, 5.0), positive=False),
        Unknown("acceleration_bias", weight, bias, bias, (-3.0, 3.0), positive=False),
    )
    floor = 10 * settings.residual_floor
    rules = Rules(settings.confidence, floor, data.filter.correlation, settings.least_freedom)
    mask = straight(data)
    jump = np.nan_to_num(np.diff(data.inputs.ax, prepend=data.inputs.ax[:1]))
    jumps = data.filter.power(jump**2 / 12)[:, None]  # variance of F[a_x], m^2/s^4, by what a_x did between its samples
    trust = np.ones_like(jumps)
    for _ in range(PASSES):

        def residual(p: Mapping[str, float], trust: FloatArray = trust) -> FloatArray:
            return balance(p) * trust

        found = estimate(residual, mask, unknowns, rules)
        trust = np.asarray(1 / np.sqrt(1 + jumps / max(found.rms, floor) ** 2))
    return found


def straight(data: DriveSignals) -> BoolArray:
    """Samples (n, 1) of straight forward driving with all wheels turning."""
    turned = np.abs(data.inputs.steer).max(axis=1) > STRAIGHT
    return data.filter.settled(data.bad.any(axis=1) | turned | (data.vx < 0))[:, None]
