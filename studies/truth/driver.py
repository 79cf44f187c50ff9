"""Who holds wheel and pedals: open-loop tables, a speed controller, and a path follower with preview.

Speed: F = m (v_t' + (v_t - v)/tau + integral), drive torque up to what there is, brakes for what is below zero.
Path: lateral error e and heading error eps against the path of curvature k(s) (Frenet),
    s' = (v_x cos eps - v_y sin eps)/(1 - k e),  e' = v_x sin eps + v_y cos eps,  eps' = r - k s'
    delta = (L + K v^2) k(s + d) - 2 L (e + d sin(eps + beta))/d^2,   d = max(4 m, 0.7 s v)
through a lag: pure pursuit of a point d ahead with the curvature fed forward.
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from studies.truth.course import Courses
from studies.truth.fleet import Fleet
from studies.truth.layout import B, W
from studies.truth.plant import Controls, Slide

TAU, INTEGRAL = 0.4, 2.0  # s, of the speed controller
PREVIEW_TIME, PREVIEW_LEAST = 0.7, 4.0  # s, m
UNDERSTEER = 0.0015  # rad s^2/m, K: more steering with speed
LARGEST_STEER, STEER_LAG = 0.6, 0.08  # rad, s


class Driver:
    """The drivers of B cars; stepped once per integration step, with the controls held over it."""

    def __init__(self, courses: Courses, fleet: Fleet) -> None:
        self.courses, self.fleet = courses, fleet
        size = fleet.size
        self.way, self.error, self.heading = np.zeros(size), np.zeros(size), np.zeros(size)
        self.steer, self.sum = np.zeros(size), np.zeros(size)
        self._base = fleet.x[0] - fleet.x[2]
        fleet.drivetrains.restart()

    def act(self, state: FloatArray, moving: Slide, time: float, h: float) -> Controls:
        """Controls of the step from ``time`` to ``time + h``, s."""
        courses, trains = self.courses, self.fleet.drivetrains
        middle = time + 0.5 * h
        steer, torque, share, brake, brake_share, grade, bank, target = courses.at(middle)
        w = state[W["wheel_speed"]]
        available = trains.available(w) if courses.controls_speed or share.any() else trains.maximum
        drive = torque + share * available
        brake = brake + brake_share * trains.maximum_brake
        if courses.controls_speed:
            pull, hold = self._speed(state, target, courses.at(middle + 0.02)[7], available, h)
            drive, brake = drive + pull, brake + hold
        if courses.follows.any():
            steer = np.where(courses.follows, self._path(state, h), steer)
        angles = np.zeros((4, steer.size))
        angles[:2] = steer
        size = np.maximum(np.maximum(np.absolute(moving.surface), np.absolute(moving.velocity[0])), 0.5)
        speed = np.absolute(state[B["vx"]])
        slip = moving.slip[0] * np.sign(moving.velocity[0]) / size
        driven, braked = trains.torques(drive, brake, slip, speed, w, h)
        place = state[B["distance"]] + 0.5 * h * state[B["vx"]] + self.fleet.x
        return Controls(angles, driven, braked, courses.roads.friction(place, middle), grade, bank)

    def _speed(
        self, state: FloatArray, target: FloatArray, soon: FloatArray, available: FloatArray, h: float
    ) -> tuple[FloatArray, FloatArray]:
        on = np.isfinite(target)
        wanted = np.where(on, target, 0.0)
        slope = np.where(np.isfinite(soon) & on, (soon - wanted) / 0.02, 0.0)
        missing = np.where(on, wanted - state[B["vx"]], 0.0)
        push = slope + missing / TAU + self.sum
        force = self.fleet.mass * push * self.fleet.radius[0]
        free = (force < available) & (force > -self.fleet.drivetrains.maximum_brake)
        self.sum = np.where(on & free, self.sum + h * missing / (TAU * INTEGRAL), self.sum)
        rests = on & (np.absolute(wanted) < 0.05) & (np.absolute(state[B["vx"]]) < 0.3)
        pull = np.where(rests, 0.0, np.clip(force, 0.0, available))
        hold = np.where(rests, 0.5 * self.fleet.drivetrains.maximum_brake, np.maximum(-force, 0.0))
        return np.where(on, pull, 0.0), np.where(on, hold, 0.0)

    def _path(self, state: FloatArray, h: float) -> FloatArray:
        vx, vy, r = state[B["vx"]], state[B["vy"]], state[B["yaw_rate"]]
        bend = self.courses.bend(self.way)
        ahead = np.maximum(PREVIEW_LEAST, PREVIEW_TIME * np.absolute(vx))
        course = self.heading + np.arctan(vy / np.maximum(np.absolute(vx), 1.0))
        wanted = (self._base + UNDERSTEER * vx * vx) * self.courses.bend(self.way + 0.5 * ahead)
        wanted -= 2.0 * self._base * (self.error + ahead * np.sin(course)) / ahead**2
        wanted = np.clip(wanted, -LARGEST_STEER, LARGEST_STEER)
        self.steer = self.steer + (1.0 - np.exp(-h / STEER_LAG)) * (wanted - self.steer)
        sine, cosine = np.sin(self.heading), np.cos(self.heading)
        path_speed = (vx * cosine - vy * sine) / np.maximum(1.0 - bend * self.error, 0.2)
        self.way = self.way + h * path_speed
        self.error = self.error + h * (vx * sine + vy * cosine)
        self.heading = self.heading + h * (r - bend * path_speed)
        return self.steer
