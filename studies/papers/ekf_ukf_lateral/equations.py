"""The two equations of P4 that contradict the others: the last output of (12) and the sign of the tire force (3)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from studies.papers.ekf_ukf_lateral.observability import in_numbers
from synthesis.models.catalogue.four_wheel import SUBSTITUTES, four_wheel_model
from synthesis.models.discretise import zero_order_hold
from synthesis.models.nonlinear import NonlinearModel
from synthesis.polynomials.matrix import FloatArray

SPEED = 20.0  # m/s
LOADS = {"load_fl": 4000.0, "load_fr": 4000.0, "load_rl": 3100.0, "load_rr": 3100.0}  # linear tires: of no consequence


def acceleration_mismatch(model: NonlinearModel) -> sp.Expr:
    r"""y_4 minus V (beta' + r) cos(beta) + V' sin(beta): the lateral acceleration that the states of (11) really have.

    Zero for every state and input if (12) belongs to (11); with (1) this is the force balance across the car.
    """
    v, beta, r = sp.symbols("speed sideslip yaw_rate")
    kinematic = v * (model.f[2] + r) * sp.cos(beta) + model.f[1] * sp.sin(beta)
    return sp.factor(sp.simplify(sp.expand_trig(sp.expand(model.h[3] - kinematic))))


@dataclass(frozen=True)
class StraightPoles:
    """Real parts of the poles in 1/s of driving straight ahead, ascending: sideslip and yaw rate."""

    quasi_static: FloatArray  # (2,) forces follow the slip at once: the linear single track
    lagged: FloatArray  # (6,) with the relaxation (6) of the four forces

    @property
    def stable(self) -> bool:
        """Whether the car drives straight by itself."""
        return bool(max(self.quasi_static.max(), self.lagged.max()) < 0.0)


@cache
def straight_poles(force_sign: int, speed: float = SPEED) -> StraightPoles:
    """Poles of P4 (11) linearised at zero slip, `force_sign` -1 as (3) is printed, 1 corrected.

    Speed and drive force are integrators in either case and are left out. The quasi-static poles are those of the Schur
    complement that eliminates the forces.
    """
    model = four_wheel_model(force_sign=force_sign)
    point = {symbol: sp.Integer(0) for symbol in (*model.state_symbols, *model.input_symbols)}
    point |= {sp.Symbol(name): sp.Rational(str(value)) for name, value in {"speed": speed, **LOADS}.items()}
    f, moving = in_numbers(model).f, [0, 2, 3, 4, 5, 6]
    x = [model.state_symbols[j] for j in moving]
    A = np.array([[float(f[i].diff(symbol).xreplace(point)) for symbol in x] for i in moving])
    reduced = A[:2, :2] - A[:2, 2:] @ np.linalg.solve(A[2:, 2:], A[2:, :2])
    return StraightPoles(np.sort(np.linalg.eigvals(reduced).real), np.sort(np.linalg.eigvals(A).real))


def single_track(force_sign: int, speed: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """A (..., 2, 2) and b (..., 2, 1) of sideslip and yaw rate under steering: the linear single track in closed form."""
    car = {name: constant.value for name, constant in SUBSTITUTES.items()}
    front, rear = 2.0 * force_sign * car["front_stiffness"], 2.0 * force_sign * car["rear_stiffness"]
    a, b, m, inertia = car["front_axle_distance"], car["rear_axle_distance"], car["mass"], car["yaw_inertia"]
    v = np.asarray(speed, float)
    moment = a * front - b * rear
    A, B = np.empty((*v.shape, 2, 2)), np.empty((*v.shape, 2, 1))
    A[..., 0, 0], A[..., 0, 1] = -(front + rear) / (m * v), -1.0 - moment / (m * v**2)
    A[..., 1, 0], A[..., 1, 1] = -moment / inertia, -(a**2 * front + b**2 * rear) / (inertia * v)
    B[..., 0, 0], B[..., 1, 0] = front / (m * v), a * front / inertia
    return A, B


def single_track_poles(force_sign: int, speed: ArrayLike) -> FloatArray:
    """Real parts (..., 2) in 1/s of the poles of the linear single track at speeds [m/s], ascending."""
    return np.sort(np.linalg.eigvals(single_track(force_sign, speed)[0]).real, axis=-1)


def step_response(force_sign: int, steering: float, seconds: float = 2.0) -> tuple[FloatArray, FloatArray]:
    """Time (n,) [s] and yaw rate (n,) [rad/s] of the single track at `SPEED` after a step of `steering` [rad]."""
    step = 0.01
    Phi, Gamma = zero_order_hold(*single_track(force_sign, SPEED), step)
    time = np.arange(0.0, seconds, step)
    x, yaw = np.zeros(2), np.empty(len(time))
    for k in range(len(time)):
        yaw[k] = x[1]
        x = Phi @ x + Gamma[:, 0] * steering
    return time, yaw
