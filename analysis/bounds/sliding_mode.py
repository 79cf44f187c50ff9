"""Convergence conditions of the sliding-mode force observer (P5 (7), (A.4), (A.8), (A.12))."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from analysis.checks import positive, square
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from estimators.sideslip import SlidingGains
from estimators.vehicle import RigidBody

Output = Literal["yaw_rate", "lateral_acceleration", "longitudinal_acceleration"]
OUTPUTS: tuple[Output, ...] = ("yaw_rate", "lateral_acceleration", "longitudinal_acceleration")


@dataclass(frozen=True, repr=False)
class SlidingModeGains(Display):
    """Omega_1 .. Omega_12 of P5 (6): rows x_1 .. x_4, columns sign(y_1), sign(y_2), sign(y_3); rad/s^2 and N/s.

    >>> SlidingModeGains.of(omega1=10, omega4=40000)[4]
    40000.0
    """

    matrix: FloatArray

    def __post_init__(self) -> None:
        found = np.asarray(self.matrix, float)
        if found.shape != (4, 3) or not np.isfinite(found).all():
            raise AnalysisError(f"sliding-mode gains of shape {found.shape} must be a finite (4, 3): Omega_1..3 first")
        found.setflags(write=False)
        object.__setattr__(self, "matrix", found)

    @classmethod
    def of(cls, **omega: float) -> SlidingModeGains:
        """By number, the rest zero: of(omega1=10, omega4=40000, ...)."""
        matrix = np.zeros(12)
        names = [f"omega{i + 1}" for i in range(12)]
        for name, value in omega.items():
            if name not in names:
                raise AnalysisError(unknown("gain", name, names))
            matrix[names.index(name)] = value
        return cls(matrix.reshape(4, 3))

    def __getitem__(self, number: int) -> float:
        return float(self.matrix.ravel()[number - 1])


_P5 = SlidingGains()
PUBLISHED = SlidingModeGains.of(
    omega1=_P5.yaw, omega4=_P5.split, omega5=_P5.front, omega7=-_P5.split, omega8=_P5.rear, omega12=_P5.longitudinal
)
"""P5 notes 1; Omega_5 is rounded from 52142.857."""


@dataclass(frozen=True)
class Violation:
    """One condition that does not hold: which, by how much, and what it means on the road."""

    condition: str
    amount: float
    meaning: str


@dataclass(frozen=True, repr=False)
class SlidingModeConvergence(Display):
    r"""What P5 Appendix A says of a set of gains; s = L_1 x2 - L_2 x3 is the yaw moment error [N*m].

    yaw_moment_limit: (A.4) holds while |s| < I_z (Omega_1 - |Omega_2| - |Omega_3|) [N*m]: a local condition.
    yaw_margin, longitudinal_margin, lateral_margin: epsilon of (A.4) and (A.8) for the moment error and force rates given.
    split_decay_rate: -Omega_7 (L_1 + L_2) / (Omega_1 I_z) [1/s] on the surface x1 = 0 (A.12).
    split_residual: -L_1 Omega_5 + L_2 Omega_8 [N*m/s] left over in (A.11) when (7) is rounded.
    split_ultimate: |s| in the end [N*m] under the residual and force rates given.
    """

    shown_units: ClassVar = {
        "yaw_moment_limit": "N m", "split_decay_rate": "1/s", "split_residual": "N m/s", "split_ultimate": "N m",
    }  # fmt: skip

    yaw_moment_limit: float
    yaw_margin: float
    longitudinal_margin: float
    lateral_margin: float
    split_decay_rate: float
    split_residual: float
    split_ultimate: float
    violations: tuple[Violation, ...]

    @property
    def holds(self) -> bool:
        """All inequalities of (7), (A.4), (A.8) hold; a rounded equality in (7) is reported, not fatal."""
        return not any(v.condition != "Omega_5 = Omega_8 L_2 / L_1 (7)" for v in self.violations)


def sliding_mode_convergence(
    gains: SlidingModeGains,
    vehicle: RigidBody,
    yaw_moment_error: float = 0.0,
    force_rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> SlidingModeConvergence:
    r"""Check P5 (7), (A.4) (with the sign of (A.5)), (A.8) and (A.12) for |L_1 x2 - L_2 x3| <= `yaw_moment_error` [N*m].

    `force_rates` are bounds on |F_y1'|, |F_yw2'|, |F_x1'| [N/s]; the paper assumes constant forces, but they add to the
    disturbance that each sign term must overcome, and leave a split error of sup|L_1 F_y1' - L_2 F_yw2'| / decay.

    >>> from analysis.bounds.sliding_mode import PUBLISHED
    >>> from estimators.vehicle import RigidBody
    >>> car = RigidBody(mass=1400.0, yaw_inertia=2400.0, front_axle_distance=1.1, rear_axle_distance=1.6)
    >>> sliding_mode_convergence(PUBLISHED, car, yaw_moment_error=1000.0).holds
    True
    """
    rates = [abs(float(rate)) for rate in force_rates]
    if len(rates) != 3 or not np.isfinite([*rates, yaw_moment_error]).all():
        raise AnalysisError(f"force_rates {force_rates} and yaw_moment_error {yaw_moment_error} must be finite numbers")
    moment = abs(float(yaw_moment_error))
    g, front, rear = gains, vehicle.front_axle_distance, vehicle.rear_axle_distance
    limit = vehicle.yaw_inertia * (g[1] - abs(g[2]) - abs(g[3]))
    yaw = (limit - moment) / vehicle.yaw_inertia
    along = g[12] - abs(g[11]) - abs(g[10]) - rates[2]
    across = g[5] + g[8] - abs(g[6]) - abs(g[9]) - rates[0] - rates[1]
    decay = -g[7] * (front + rear) / (g[1] * vehicle.yaw_inertia) if g[1] else 0.0
    residual = -front * g[5] + rear * g[8]
    ultimate = (abs(residual) + front * rates[0] + rear * rates[1]) / decay if decay > 0.0 else np.inf
    checks = (
        (
            "Omega_1 > |Omega_2| + |Omega_3| + |s| / I_z (A.4)",
            yaw,
            "the yaw rate estimate need not reach the measured one",
        ),
        ("Omega_12 > |Omega_11| + |Omega_10| + |F_x1'| (A.4)", along, "the longitudinal force is not followed"),
        (
            "Omega_5 + Omega_8 > |Omega_6| + |Omega_9| + |F_y'| (A.8)",
            across,
            "the sum of the lateral forces is not followed",
        ),
        ("Omega_4 > 0 (7)", g[4], "front and rear force are not separated"),
    )
    violations = [Violation(name, value, meaning) for name, value, meaning in checks if not value > 0.0]
    if g[4] != -g[7]:
        violations.append(
            Violation("Omega_4 = -Omega_7 (7)", g[4] + g[7], "yaw error disturbs the sum of the lateral forces")
        )
    if abs(residual) > 1e-9 * abs(rear * g[8]):
        violations.append(
            Violation(
                "Omega_5 = Omega_8 L_2 / L_1 (7)", g[5] - g[8] * rear / front,
                f"chatter of the lateral error leaks {residual:g} N*m/s into the front/rear split",
            )
        )  # fmt: skip
    return SlidingModeConvergence(limit, yaw, along, across, decay, residual, ultimate, tuple(violations))


def reaching_time(gains: SlidingModeGains, vehicle: RigidBody, yaw_error: float, yaw_moment_error: float) -> float:
    r"""Bound on the time [s] to reach the sliding surface x1 = 0 for good, from any |x1| [rad/s] and |s| [N*m].

    (A.4) is local, |s| < I_z Omega_1, but convergence is not. With (7) exact, V = (L_1 + L_2) Omega_4 |x1| + s^2 / (2 I_z) has
    V' = -(L_1 + L_2) Omega_4 Omega_1 off the surface, whatever s is: the surface is crossed until |s| < I_z Omega_1, and then
    kept. So V(0) / ((L_1 + L_2) Omega_4 Omega_1) bounds the time spent off it. Constant forces; inf if (7) does not hold.
    """
    span = vehicle.front_axle_distance + vehicle.rear_axle_distance
    residual = -vehicle.front_axle_distance * gains[5] + vehicle.rear_axle_distance * gains[8]
    exact = gains[4] == -gains[7] and abs(residual) <= 1e-9 * abs(vehicle.rear_axle_distance * gains[8])
    if not (exact and gains[1] > 0.0 and gains[4] > 0.0 and not gains.matrix[0, 1:].any()):
        return float("inf")
    start = span * gains[4] * abs(yaw_error) + yaw_moment_error**2 / (2.0 * vehicle.yaw_inertia)
    return float(start / (span * gains[4] * gains[1]))


def linear_zone_matrix(gains: SlidingModeGains, vehicle: RigidBody, widths: Mapping[Output, float]) -> FloatArray:
    r"""A (4, 4) of x~' = A x~ inside the linear zones, sign(y_i) replaced by y_i / width_i (P5 notes 4).

    Widths in rad/s, m/s^2, m/s^2; P5 does not print them.
    """
    for name in widths:
        if name not in OUTPUTS:
            raise AnalysisError(unknown("output", name, OUTPUTS))
    missing = [name for name in OUTPUTS if name not in widths]
    if missing:
        raise AnalysisError(f"no width for {', '.join(missing)}; give one for every output")
    scale = np.array([1.0 / positive(f"width of {name}", widths[name]) for name in OUTPUTS])
    m = vehicle.mass
    C = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0 / m, 1.0 / m, 0.0], [0.0, 0.0, 0.0, 1.0 / m]])
    A = np.zeros((4, 4))
    A[0, 1:3] = np.array([vehicle.front_axle_distance, -vehicle.rear_axle_distance]) / vehicle.yaw_inertia
    return np.asarray(A - gains.matrix * scale @ C)


def sampled_radius(matrix: FloatArray, sample_time: float) -> float:
    """Spectral radius of I + T A: what the Euler step of the observer does to its error when the forces are constant."""
    A = square("matrix", matrix)
    step = positive("sample_time [s]", sample_time)
    return float(np.abs(np.linalg.eigvals(np.eye(len(A)) + step * A)).max())


def smallest_zone_widths(gains: SlidingModeGains, vehicle: RigidBody, sample_time: float) -> dict[Output, float]:
    """Width below which each loop alone overshoots by more than it corrects: gain times T / 2 (radius 1 of I + T A).

    >>> from analysis.bounds.sliding_mode import PUBLISHED
    >>> from estimators.vehicle import RigidBody
    >>> car = RigidBody(mass=1400.0, yaw_inertia=2400.0, front_axle_distance=1.1, rear_axle_distance=1.6)
    >>> round(smallest_zone_widths(PUBLISHED, car, sample_time=0.001)["yaw_rate"], 6)  # rad/s
    0.005
    """
    half = 0.5 * positive("sample_time [s]", sample_time)
    return {
        "yaw_rate": gains[1] * half,
        "lateral_acceleration": (gains[5] + gains[8]) * half / vehicle.mass,
        "longitudinal_acceleration": gains[12] * half / vehicle.mass,
    }
