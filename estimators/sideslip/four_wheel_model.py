"""Four-wheel model with Dugoff tires and relaxation: transition, measurement and Jacobians, used by two filters.

Slip angles are positive where they give a positive force (to the left): alpha = delta - direction of motion.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.filters.workspace import Workspace
from estimators.sideslip.dugoff import LEAST_KNEE, dugoff_force, dugoff_slope
from estimators.vehicle import FourWheel

STATES = (
    ("yaw_rate", "rad/s"),
    ("speed", "m/s"),
    ("sideslip", "rad"),
    ("lateral_force_front_left", "N"),
    ("lateral_force_front_right", "N"),
    ("lateral_force_rear_left", "N"),
    ("lateral_force_rear_right", "N"),
    ("longitudinal_force_front", "N"),
)
AFFINE_FROM = 3
"""The first state in which the transition is affine while those before it are held: the forces."""
REST_TIME = 0.1  # s, with which sideslip and lateral forces fade away at standstill


class FourWheelModel(NamedTuple):
    """P4 (1)-(6), (11), (12), Euler discretised, at given inputs; all arrays have the batch shape b or broadcast to it.

    States, last axis: yaw rate, speed, sideslip, F_y of front left, front right, rear left, rear right, F_x of the
    front axle; see `STATES`. Outputs: yaw rate, speed, a_x, a_y.

    Declared additions: speeds in denominators are at least `slow`; T V / sigma is at most 1 (Euler would oscillate);
    where `at_rest`, sideslip and lateral forces fade with 0.1 s and the rest stays (the model is singular there).
    """

    vehicle: FourWheel
    sample_time: float  # s
    sine: FloatArray  # (b) of the steering angle of the front wheels
    cosine: FloatArray
    knees: FloatArray  # (4, b) tan(alpha) = mu F_z / (2 C) up to which a tire is linear
    slow: float  # m/s
    at_rest: BoolArray | None  # (b); None: nowhere
    memory: Workspace  # of `transition_of_points`

    @classmethod
    def at(
        cls,
        vehicle: FourWheel,
        sample_time: float,
        steering: FloatArray,
        loads: FloatArray,
        slow: float,
        at_rest: BoolArray | None = None,
        memory: Workspace | None = None,
    ) -> FourWheelModel:
        """From the steering angle (b) in rad and the loads (b, 4) in N; `memory` None: fresh."""
        last = loads.ndim - 1
        knees = loads.transpose(last, *range(last)) * (0.5 * vehicle.friction / _stiffness(vehicle, steering.ndim))
        np.maximum(knees, LEAST_KNEE, out=knees)
        return cls(
            vehicle, sample_time, np.sin(steering), np.cos(steering), knees, slow, at_rest, memory or Workspace()
        )

    def transition(self, x: FloatArray) -> FloatArray:
        """X + T f(X, U), P4 (11); x (..., 8)."""
        return self._moved(x, np.empty((8, *x.shape[:-1])))

    def transition_of_points(self, x: FloatArray) -> FloatArray:
        """`transition`, good until the next call."""
        return self._moved(x, self.memory("moved", (8, *x.shape[:-1])))

    def _moved(self, x: FloatArray, out: FloatArray) -> FloatArray:
        v, time = self.vehicle, self.sample_time
        yaw, beta, drive = x[..., 0], x[..., 2], x[..., 7]
        forces = x.transpose(x.ndim - 1, *range(x.ndim - 1))[3:7]
        targets = out[3:7]
        speed = np.maximum(x[..., 1], self.slow)
        sine, cosine = np.sin(beta), np.cos(beta)
        self._tangents(yaw, speed, beta, targets)
        self._saturate(targets)
        targets -= forces
        share = time * speed
        targets[:2] *= np.minimum(share * (1.0 / v.front_relaxation), 1.0)
        targets[2:] *= np.minimum(share * (1.0 / v.rear_relaxation), 1.0)
        targets += forces

        self._push(forces, drive, sine, cosine, out[:3])
        out[2] /= speed
        yaw_time = time * yaw
        out[2] -= yaw_time
        for k, own in enumerate((yaw, x[..., 1], beta)):
            out[k] += own
        out[7] = drive
        if self.at_rest is not None:
            fade = math.exp(-time / REST_TIME)
            for k in range(7):
                out[k] = np.where(self.at_rest, x[..., k] * (1.0 if k < 2 else fade), out[k])
        return out.transpose(*range(1, out.ndim), 0)

    def transition_slope(self, x: FloatArray, d: FloatArray) -> FloatArray:
        """transition(x + d) - transition(x) for d (count, ..., 8) that moves the forces alone; good until the next call.

        The forces are relaxed with a share of their own, and enter the motion of the body linearly.
        """
        v, time = self.vehicle, self.sample_time
        speed, beta = np.maximum(x[..., 1], self.slow), x[..., 2]
        move = d.transpose(d.ndim - 1, *range(d.ndim - 1))
        out = self.memory("slope", move.shape)
        share = time * speed
        np.multiply(move[3:5], 1.0 - np.minimum(share * (1.0 / v.front_relaxation), 1.0), out[3:5])
        np.multiply(move[5:7], 1.0 - np.minimum(share * (1.0 / v.rear_relaxation), 1.0), out[5:7])
        out[7] = move[7]
        self._push(move[3:7], move[7], np.sin(beta), np.cos(beta), out[:3])
        out[2] /= speed
        if self.at_rest is not None:
            fade = math.exp(-time / REST_TIME)
            for k in range(7):
                out[k] = np.where(self.at_rest, move[k] * (1.0 if k < 2 else fade), out[k])
        return out.transpose(*range(1, out.ndim), 0)

    def transition_jacobian(self, x: FloatArray) -> FloatArray:
        """Derivative of `transition`, (..., 8, 8)."""
        v, time = self.vehicle, self.sample_time
        lead = x.shape[:-1]
        beta, drive = x[..., 2], x[..., 7]
        forces = np.moveaxis(x[..., 3:7], -1, 0)
        sine, cosine = self.sine, self.cosine
        speed = np.maximum(x[..., 1], self.slow)
        moving = np.asarray(x[..., 1] > self.slow, dtype=np.float64)
        front, rear = forces[0] + forces[1], forces[2] + forces[3]
        lateral, along = front * cosine + drive * sine, drive * cosine - front * sine
        side = lateral + rear
        sb, cb = np.sin(beta), np.cos(beta)
        F = np.zeros((8, 8, *lead))
        for k in range(8):
            F[k, k] = 1.0
        inertia = time / v.yaw_inertia
        F[0, 3] = inertia * (v.front_axle_distance * cosine + 0.5 * v.track * sine)
        F[0, 4] = inertia * (v.front_axle_distance * cosine - 0.5 * v.track * sine)
        F[0, 5] = F[0, 6] = -inertia * v.rear_axle_distance
        F[0, 7] = inertia * v.front_axle_distance * sine
        inverse = time / v.mass
        F[1, 2] = inverse * (side * cb - along * sb)
        F[1, 3] = F[1, 4] = inverse * (cosine * sb - sine * cb)
        F[1, 5] = F[1, 6] = inverse * sb
        F[1, 7] = inverse * (cosine * cb + sine * sb)
        F[2, 0] = -time
        F[2, 1] = -inverse * (side * cb - along * sb) / speed**2 * moving
        F[2, 2] += -inverse * (side * sb + along * cb) / speed
        F[2, 3] = F[2, 4] = inverse * (cosine * cb + sine * sb) / speed
        F[2, 5] = F[2, 6] = inverse * cb / speed
        F[2, 7] = inverse * (sine * cb - cosine * sb) / speed
        tangents = np.empty((4, *lead))
        slopes = self._tangent_slopes(x, speed, moving, tangents)
        knees = self.knees.reshape(4, *(1,) * (len(lead) + 1 - self.knees.ndim), *self.knees.shape[1:])
        stiffness = _stiffness(v, len(lead))
        targets = dugoff_force(stiffness, tangents, knees)
        gains = dugoff_slope(stiffness, tangents, knees) * slopes  # (3 states, 4 wheels, ...)
        for wheel, sigma in enumerate((v.front_relaxation,) * 2 + (v.rear_relaxation,) * 2):
            share = np.minimum(time * speed / sigma, 1.0)
            F[3 + wheel, :3] = share * gains[:, wheel]
            F[3 + wheel, 1] += np.where(share < 1, time / sigma * moving, 0.0) * (targets[wheel] - forces[wheel])
            F[3 + wheel, 3 + wheel] = 1.0 - share
        if self.at_rest is not None:
            fade = np.diag([1.0, 1.0] + [math.exp(-time / REST_TIME)] * 5 + [1.0])
            F = np.where(self.at_rest, fade.reshape(8, 8, *(1,) * len(lead)), F)
        return np.moveaxis(F, (0, 1), (-2, -1))

    def measurement(self, x: FloatArray) -> FloatArray:
        """Yaw rate, speed, a_x, a_y, P4 (12) with x_8 sin(u_1) in the last line; (..., 4)."""
        return self._measured(x, np.empty((4, *x.shape[:-1])))

    def measurement_of_points(self, x: FloatArray) -> FloatArray:
        """`measurement`, good until the next call."""
        return self._measured(x, self.memory("measured", (4, *x.shape[:-1])))

    def measurement_slope(self, _: FloatArray, d: FloatArray) -> FloatArray:
        """measurement(x + d) - measurement(x), the same for all x: the measurement is linear; good until the next call."""
        return self._measured(d, self.memory("measured slope", (4, *d.shape[:-1])))

    def _measured(self, x: FloatArray, out: FloatArray) -> FloatArray:
        front, drive = x[..., 3] + x[..., 4], x[..., 7]
        out[0], out[1] = x[..., 0], x[..., 1]
        inverse = 1.0 / self.vehicle.mass
        sine, cosine = self.sine * inverse, self.cosine * inverse
        along, across = out[2, ...], out[3, ...]
        np.multiply(drive, cosine, along)
        along -= front * sine
        np.add(x[..., 5], x[..., 6], across)
        across *= inverse
        front *= cosine
        across += front
        across += drive * sine
        return out.transpose(*range(1, out.ndim), 0)

    def measurement_jacobian(self, x: FloatArray) -> FloatArray:
        """Derivative of `measurement`, (..., 4, 8)."""
        H = np.zeros((*x.shape[:-1], 4, 8))
        sine, cosine = (part[..., None] / self.vehicle.mass for part in (self.sine, self.cosine))
        H[..., 0, 0] = H[..., 1, 1] = 1.0
        H[..., 2, 3:5], H[..., 2, 7:] = -sine, cosine
        H[..., 3, 3:5], H[..., 3, 5:7], H[..., 3, 7:] = cosine, 1.0 / self.vehicle.mass, sine
        return H

    def _push(
        self, forces: FloatArray, drive: FloatArray, sine: FloatArray, cosine: FloatArray, out: FloatArray
    ) -> None:
        """T times the yaw acceleration, T times the accelerations along and across the motion, into `out` (3, ...).

        `forces` (4, ...) and `drive` (...) in N; sine and cosine of the sideslip. Linear in the forces.
        """
        v, time = self.vehicle, self.sample_time
        moment, ahead, aside = out[0, ...], out[1, ...], out[2, ...]
        front, rear = forces[0] + forces[1], forces[2] + forces[3]
        lateral = front * self.cosine
        lateral += drive * self.sine  # of the front axle in body axes
        along = drive * self.cosine
        front *= self.sine
        along -= front
        np.subtract(forces[0], forces[1], moment)
        moment *= self.sine * (0.5 * v.track * time / v.yaw_inertia)
        moment += lateral * (time / v.yaw_inertia * v.front_axle_distance)
        moment -= rear * (time / v.yaw_inertia * v.rear_axle_distance)
        # cos(beta - delta) and sin(beta - delta) of (11) expanded: forces in body axes, turned by beta
        lateral += rear
        lateral *= time / v.mass
        along *= time / v.mass
        np.multiply(along, cosine, ahead)
        ahead += lateral * sine
        np.multiply(lateral, cosine, aside)
        along *= sine
        aside -= along

    def _tangents(self, yaw: FloatArray, speed: FloatArray, beta: FloatArray, out: FloatArray) -> None:
        """tan(alpha) of P4 (2) into `out` (4, ...)."""
        half = yaw * (0.5 * self.vehicle.track)
        ahead = np.empty((2, *half.shape))
        np.subtract(speed, half, ahead[0, ...])
        np.add(speed, half, ahead[1, ...])
        np.maximum(ahead, self.slow, out=ahead)
        drift = speed * beta
        side = yaw * self.vehicle.front_axle_distance
        side += drift
        # tan(delta - arctan(vy / vx)) = (sin(delta) vx - cos(delta) vy) / (cos(delta) vx + sin(delta) vy)
        below = ahead * self.cosine
        below += side * self.sine
        np.maximum(below, self.slow, out=below)
        side *= self.cosine
        np.multiply(ahead, self.sine, out[:2])
        out[:2] -= side
        out[:2] /= below
        drift -= yaw * self.vehicle.rear_axle_distance
        np.divide(drift, ahead, out[2:])
        np.negative(out[2:], out[2:])

    def _saturate(self, tangents: FloatArray) -> None:
        """Replaces tan(alpha) (4, ...) by the Dugoff force, as `dugoff.dugoff_force` does."""
        knees = self.knees.reshape(4, *(1,) * (tangents.ndim - self.knees.ndim), *self.knees.shape[1:])
        share = np.absolute(tangents)
        np.maximum(share, knees, out=share)
        np.divide(knees, share, share)
        tangents *= share
        np.subtract(2.0, share, share)
        tangents *= share
        tangents[:2] *= self.vehicle.front_stiffness
        tangents[2:] *= self.vehicle.rear_stiffness

    def _tangent_slopes(self, x: FloatArray, speed: FloatArray, moving: FloatArray, out: FloatArray) -> FloatArray:
        """Derivatives of tan(alpha) by yaw rate, speed and sideslip, (3, 4, ...); tan(alpha) itself into `out`."""
        v, sine, cosine = self.vehicle, self.sine, self.cosine
        yaw, beta = x[..., 0], x[..., 2]
        self._tangents(yaw, speed, beta, out)
        half = (0.5 * v.track) * yaw
        ahead = np.stack((speed - half, speed + half))
        free = ahead > self.slow
        np.maximum(ahead, self.slow, out=ahead)
        below = cosine * ahead + sine * (speed * beta + v.front_axle_distance * yaw)
        open_ = below > self.slow
        np.maximum(below, self.slow, out=below)
        slopes = np.empty((3, *out.shape))
        along = (free * np.array([-0.5, 0.5]).reshape(2, *(1,) * yaw.ndim) * v.track, free * moving, 0.0 * ahead)
        across = ((v.front_axle_distance, -v.rear_axle_distance), (beta * moving,) * 2, (speed,) * 2)
        for k in range(3):
            top = sine * along[k] - cosine * across[k][0]
            slopes[k, :2] = (top - out[:2] * open_ * (cosine * along[k] + sine * across[k][0])) / below
            slopes[k, 2:] = (-across[k][1] - out[2:] * along[k]) / ahead
        return slopes


def _stiffness(vehicle: FourWheel, axes: int) -> FloatArray:
    values = (vehicle.front_stiffness,) * 2 + (vehicle.rear_stiffness,) * 2
    return np.array(values).reshape(4, *(1,) * axes)
