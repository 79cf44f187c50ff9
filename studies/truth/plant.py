"""Equations of motion of B double-track vehicles: planar motion, heave, roll, pitch, four spinning wheels.

    m (vx' - r vy) = sum F_xb - drag - m g sin(grade)        F_xb, F_yb: tire forces in the body's axes
    m (vy' + r vx) = sum F_yb - m g cos(grade) sin(bank)     I_z r' = sum (x F_yb - y F_xb)
    I_x phi'' = sum (y F_z + h F_yb)                         m z'' = sum F_z - m g cos(grade) cos(bank)
    I_y theta'' = sum (x F_z + (h - R_e) F_xb + T)           I_w w' = T - R_e (F_x + c_rr F_z sign w)
    M_u psi_q'' + C_q psi_q' + K_q psi_q = F_qb              P3 (14); psi' adds to the wheel centre's velocity, (15)

phi: left side up, theta: nose up. F_z from springs, dampers, anti-roll bars and the lateral transfer through the links of
each axle (roll centre), never negative; wheel centres move with the body about the roll axis, so that the work of the
tires is what the body gets. The torque T that turns a wheel reacts on the body: the T in pitch.
Left out: vertical motion of the unsprung masses, camber, aligning torque, gyroscopic moments, aerodynamic lift.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.vehicle import GRAVITY
from studies.truth.fleet import Fleet, Tire
from studies.truth.layout import COMPLIANCE, COMPLIANCE_RATE, DEFLECTION, JACK, B, W


class Controls(NamedTuple):
    """What acts on the cars from outside, held over a step."""

    steer: FloatArray  # (4, B) rad, road-wheel angles
    drive: FloatArray  # (4, B) N m
    brake: FloatArray  # (4, B) N m that the brake can hold, >= 0
    friction: FloatArray  # (4, B) of the road under each wheel
    grade: FloatArray  # (B,) rad, uphill positive
    bank: FloatArray  # (B,) rad, left side up


class SteerAngles(NamedTuple):
    """Sine and cosine of the steering angles (4, B)."""

    sine: FloatArray
    cosine: FloatArray


class Slide(NamedTuple):
    """How the tires move over the road, tire frame, m/s."""

    velocity: FloatArray  # (2, 4, B) v_xt, v_yt of the wheel centres
    surface: FloatArray  # (4, B) R_e w
    slip: FloatArray  # (2, 4, B) v_rx = R_e w - v_xt, v_ry = -v_yt


class Forces(NamedTuple):
    """N: x and y in the tire frame and in the axes of the body (2, 4, B), and loads (4, B)."""

    tire: FloatArray
    body: FloatArray
    load: FloatArray


class Plant:
    """B vehicles on one kind of tire."""

    def __init__(self, fleet: Fleet, tire: Tire) -> None:
        self.fleet, self.tire = fleet, tire
        self._drop: FloatArray = fleet.height - fleet.radius  # wheel centres below the centre of gravity
        self._roll_arm: FloatArray = fleet.height - fleet.roll_center

    def slide(self, state: FloatArray, steered: SteerAngles) -> Slide:
        """Velocities of the wheel centres, P1 notes 6, with roll, pitch and the compliance of the suspension."""
        car, spin = self.fleet, state[B["yaw_rate"]]
        x = state[B["vx"]] - spin * car.y + self._drop * state[B["pitch_speed"]] + state[W["compliance_x_rate"]]
        y = state[B["vy"]] + self._roll_arm * state[B["roll_speed"]] + spin * car.x + state[W["compliance_y_rate"]]
        velocity = _pair(x * steered.cosine + y * steered.sine, y * steered.cosine - x * steered.sine)
        surface = car.radius * state[W["wheel_speed"]]
        slip = -velocity
        slip[0] += surface
        return Slide(velocity, surface, slip)

    def transport(self, moving: Slide) -> FloatArray:
        """max(|R_e w|, |v_xt|, |v_yt|) (4, B), m/s: how fast the contact patch is renewed at least."""
        return np.asarray(np.maximum(np.absolute(moving.surface), np.absolute(moving.velocity).max(axis=0)))

    def loads(self, state: FloatArray) -> FloatArray:
        """F_z (4, B), N."""
        car, roll = self.fleet, state[B["roll"]]
        lift = state[B["heave"]] + car.y * roll + car.x * state[B["pitch"]]
        rate = state[B["heave_rate"]] + car.y * state[B["roll_speed"]] + car.x * state[B["pitch_speed"]]
        load = car.static_load - car.spring * lift - car.damper * rate
        bars = car.bar * roll
        left, right = load[0::2] - bars, load[1::2] + bars
        # links cannot pull a wheel through the road: they take no more than the springs leave on it
        jack = np.minimum(np.maximum(state[JACK], -np.maximum(right, 0.0)), np.maximum(left, 0.0))
        load[0::2], load[1::2] = left - jack, right + jack
        return np.asarray(np.maximum(load, 0.0))

    def in_body_axes(self, tire: FloatArray, load: FloatArray, steered: SteerAngles) -> Forces:
        """Tire forces (2, 4, B) turned by the steering angle."""
        x, y = tire
        body = _pair(x * steered.cosine - y * steered.sine, x * steered.sine + y * steered.cosine)
        return Forces(tire, body, load)

    def body_rates(self, state: FloatArray, forces: Forces, torque: FloatArray, controls: Controls) -> FloatArray:
        """d(state)/dt (STATES, B) of everything but wheel speed and deflections; `torque` (4, B) N m acts on wheels and body."""
        car, out = self.fleet, np.zeros_like(state)
        vx, vy, r, heading = state[B["vx"]], state[B["vy"]], state[B["yaw_rate"]], state[B["yaw"]]
        pull, push = forces.body.sum(axis=1)
        across = forces.body[1]
        fall = GRAVITY * np.cos(controls.grade)
        cosine, sine = np.cos(heading), np.sin(heading)
        out[B["x"]], out[B["y"]], out[B["yaw"]] = vx * cosine - vy * sine, vx * sine + vy * cosine, r
        out[B["vx"]] = (pull - car.drag * vx * np.absolute(vx)) / car.mass - GRAVITY * np.sin(controls.grade) + r * vy
        out[B["vy"]] = push / car.mass - fall * np.sin(controls.bank) - r * vx
        out[B["yaw_rate"]] = (car.x * across - car.y * forces.body[0]).sum(axis=0) / car.yaw_inertia
        out[B["heave"]] = state[B["heave_rate"]]
        out[B["heave_rate"]] = forces.load.sum(axis=0) / car.mass - fall * np.cos(controls.bank)
        out[B["roll"]], out[B["pitch"]] = state[B["roll_speed"]], state[B["pitch_speed"]]
        out[B["roll_speed"]] = ((car.y * forces.load).sum(axis=0) + car.height * push) / car.roll_inertia
        nose = (car.x * forces.load + self._drop * forces.body[0] + torque).sum(axis=0)
        out[B["pitch_speed"]] = nose / car.pitch_inertia
        side = across[0::2] + across[1::2]
        out[JACK] = (car.roll_center * side / car.track - state[JACK]) / car.load_lag
        out[B["distance"]] = np.copysign(np.sqrt(vx * vx + vy * vy), vx)
        speed = state[COMPLIANCE_RATE]
        out[COMPLIANCE] = speed
        out[COMPLIANCE_RATE] = (
            forces.body.reshape(8, -1) - car.compliance_stiffness * state[COMPLIANCE] - car.compliance_damping * speed
        ) / car.unsprung
        return out

    def derivative(self, state: FloatArray, controls: Controls) -> tuple[FloatArray, Forces]:
        """d(state)/dt (STATES, B) of everything at one instant, and the forces; for integrators of other people.

        A wheel that stands still is held by brake and rolling resistance as far as they reach.
        """
        car, steered = self.fleet, SteerAngles(np.sin(controls.steer), np.cos(controls.steer))
        moving, load = self.slide(state, steered), self.loads(state)
        transport, z = self.transport(moving), state[DEFLECTION].reshape(2, 4, -1)
        a, push = self.tire.rates(z, moving.slip, np.absolute(moving.surface), transport, controls.friction)
        dz = push - a * z
        tire = self.tire.forces(z, dz, moving.slip, transport, load, controls.friction)
        forces = self.in_body_axes(tire, load, steered)
        w = state[W["wheel_speed"]]
        free = controls.drive - car.radius * tire[0]
        rolling = car.radius * car.rolling_resistance * load
        most = controls.brake + rolling
        hold = np.where(w != 0.0, np.sign(w) * most, np.clip(free, -most, most))
        rolling = hold * (rolling / np.where(most > 0.0, most, 1.0))
        out = self.body_rates(state, forces, controls.drive - hold + rolling, controls)
        out[W["wheel_speed"]] = (free - hold) / car.wheel_inertia
        out[W["wheel_angle"]] = w
        out[DEFLECTION] = dz.reshape(8, -1)
        return out, forces


def _pair(x: FloatArray, y: FloatArray) -> FloatArray:
    """Both side by side, (2, ...): at these sizes three times as fast as `numpy.stack`."""
    out = np.empty((2, *x.shape))
    out[0], out[1] = x, y
    return out
