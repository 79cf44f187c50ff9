r"""The generalised plant of a feedback design: what acts, what is to stay small, what is measured, what is moved.

    x' = A x + B u + E d,    y = C x + D u + F d,    z = Cz x + Dzu u + Dzd d

z are performance signals, chosen by name among states, outputs and inputs, each divided by the size that counts as one; d are
disturbances, each multiplied by its size. All matrices are numerators over the model's denominator, coefficients in powers of
the scaled parameters (d_1+1, .., d_p+1, rows, columns).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, solve_continuous_are

from estimators.arrays import FloatArray
from estimators.errors import unknown
from synthesis.design.feedback_channel import FeedbackChannel, feedback_channel_matrices
from synthesis.errors import ProblemError
from synthesis.lmi.scaling import output_sizes, signal_scale
from synthesis.models.extract import PolynomialModel
from synthesis.models.lpv import LpvModel
from synthesis.models.pieces import ModelPiece

SHAKE = 1e-6  # of the mean variance, on every state: what nothing excites, or nothing weighs, has no size of its own
REGULAR = (0.0, 1e-6, 1e-3, 1.0)  # of the size of every measurement, where some have no noise


@dataclass(frozen=True)
class ChannelPlant:
    """What one channel adds: E, F and Dzd times the sizes of its disturbances; Cz, Dzd and Dzu over those of its signals."""

    channel: FeedbackChannel
    E: FloatArray
    F: FloatArray
    Cz: FloatArray
    Dzd: FloatArray
    Dzu: FloatArray


@dataclass(frozen=True)
class GeneralisedPlant:
    """A, B, C, D (of the measured outputs), the denominator, and the channels."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    denominator: FloatArray
    channels: tuple[ChannelPlant, ...]

    def scaled(self, frame: Frame) -> GeneralisedPlant:
        """The plant in the coordinates of the frame."""
        T, u, y, root = frame.states, frame.inputs, frame.outputs, np.sqrt(frame.unit)
        back = np.linalg.inv(T)
        return replace(
            self,
            A=T @ self.A @ back / frame.clock,
            B=T @ self.B * u / frame.clock,
            C=self.C @ back / y[:, None],
            D=self.D * u / y[:, None],
            channels=tuple(
                replace(
                    part,
                    E=T @ part.E / (root * frame.clock),
                    F=part.F / y[:, None] / root,
                    Cz=part.Cz @ back / root,
                    Dzd=part.Dzd / frame.unit,
                    Dzu=part.Dzu * u / root,
                )
                for part in self.channels
            ),
        )


@dataclass(frozen=True)
class Frame:
    """Coordinates in which the solver works: states T x (`states` is T), inputs and outputs over their sizes.

    Time is counted in units of 1/clock s, and a gain of `unit` is one. The least gain does not depend on them; how well it is
    found does. `joint` is the error covariance, and the cost matrix, in the middle of the range in these coordinates.
    """

    states: FloatArray
    inputs: FloatArray
    outputs: FloatArray
    unit: float
    clock: float
    joint: FloatArray

    @property
    def regulator(self) -> FloatArray:
        """T_r: in the states T_r x the cost matrix is one (`synthesis.design.halves`)."""
        return _power(self.joint, 0.5) @ self.states

    @property
    def filter(self) -> FloatArray:
        """T_f: in the states T_f x the error covariance is one."""
        return _power(self.joint, -0.5) @ self.states


def generalised_plant(
    model: LpvModel,
    channels: Sequence[FeedbackChannel],
    measured: Sequence[str] | None = None,
    piece: ModelPiece | None = None,
) -> GeneralisedPlant:
    """Numerators of all matrices, on one of the model's pieces where it has several. Raises ProblemError for unknown names."""
    poly, rows = model.polynomial if piece is None else piece.polynomial, measured_rows(model, measured)
    return GeneralisedPlant(
        poly.A,
        poly.B,
        poly.C[..., rows, :],
        poly.D[..., rows, :],
        poly.denominator,
        tuple(_channel_plant(model, poly, channel, rows) for channel in channels),
    )


def measured_rows(model: LpvModel, measured: Sequence[str] | None) -> list[int]:
    """Places of the measured outputs among those of the model; None: all. Raises ProblemError for an unknown name."""
    outputs = [signal.name for signal in model.outputs]
    for name in measured or ():
        if name not in outputs:
            raise ProblemError(f"model '{model.name}', measured: {unknown('output', name, outputs)}")
    return [outputs.index(name) for name in measured or outputs]


def _channel_plant(model: LpvModel, poly: PolynomialModel, channel: FeedbackChannel, rows: list[int]) -> ChannelPlant:
    below = poly.denominator
    W, Z = feedback_channel_matrices(model, channel)
    nx, nu, nd = len(model.states), len(model.inputs), len(model.disturbances)
    blocks = {
        "Cz": (below * np.eye(nx), poly.C, np.zeros((nu, nx))),
        "Dzu": (np.zeros((nx, nu)), poly.D, below * np.eye(nu)),
        "Dzd": (np.zeros((nx, nd)), poly.F, np.zeros((nu, nd))),
    }
    shown = {key: Z @ _stacked(parts, poly.parameters) for key, parts in blocks.items()}
    return ChannelPlant(channel, poly.E @ W, poly.F[..., rows, :] @ W, shown["Cz"], shown["Dzd"] @ W, shown["Dzu"])


def _stacked(parts: Sequence[FloatArray], count: int) -> FloatArray:
    """Coefficient arrays of different degrees, one below the other."""
    lifted = [part.reshape((1,) * (count + 2 - part.ndim) + part.shape) for part in parts]
    leading = np.max([part.shape[:count] for part in lifted], axis=0).astype(int)
    grown = [
        np.pad(part, [*((0, n - have) for n, have in zip(leading, part.shape[:count], strict=True)), (0, 0), (0, 0)])
        for part in lifted
    ]
    return np.concatenate(grown, axis=-2)


def frame_of(plant: GeneralisedPlant) -> Frame:
    """From the filter and the regulator in the middle of the range (two Riccati equations).

    With error covariance S and cost matrix R, X is about gamma S^-1 and Y about gamma R^-1, and gamma^2 exceeds the largest
    eigenvalue of S R, whose root is the unit. With T T = G, the geometric mean of S^-1 and R (G S G = R), both become alike. It
    is the only symmetric T that does that: nothing turns where modes are alike.
    """
    A, B, C = (middle(getattr(plant, key), plant.denominator) for key in ("A", "B", "C"))
    E, F, Cz, Dzu = (gathered(plant, key) for key in ("E", "F", "Cz", "Dzu"))
    seen = C / output_sizes(C * np.linalg.norm(E, axis=1), F)[:, None]
    moved = B / output_sizes(B.T * np.linalg.norm(Cz, axis=0), Dzu.T)
    balanced = signal_scale(A, np.hstack([E, moved]), np.vstack([Cz, seen]))
    A, B, E = A * balanced[:, None] / balanced, B * balanced[:, None], E * balanced[:, None]
    C, Cz = C / balanced, Cz / balanced
    S, R = _variance(A, C, E, F), _variance(A.T, B.T, Cz.T, Dzu.T)
    # So that units of states do not choose the axes along which T is symmetric.
    even = (np.diag(R) / np.diag(S)) ** 0.25
    S, R = even[:, None] * S * even, R / even[:, None] / even
    A, B, C, balanced = even[:, None] * A / even, even[:, None] * B, C / even, balanced * even
    half = _power(S, 0.5)
    between, back = half @ R @ half, np.linalg.inv(half)
    unit = float(np.sqrt(np.linalg.eigvalsh(between)[-1]))
    T = _power(back @ _power(between, 0.5) @ back, 0.5)
    speed = float(np.linalg.norm(T @ A @ np.linalg.inv(T), 2))
    clock = speed if 0.0 < speed < np.inf else 1.0
    joint = T @ S @ T / unit
    T = T * np.sqrt(clock)  # in that time errors vary by S / clock, and states cost clock R
    root = np.sqrt(unit)
    inputs = 1.0 / output_sizes((T @ B).T / clock, Dzu.T / root)  # what they cost; for free, what they move
    outputs = output_sizes(np.linalg.solve(T, C.T).T, F / root)
    return Frame(T * balanced, inputs, outputs, unit, clock, 0.5 * (joint + joint.T))


def _variance(A: FloatArray, C: FloatArray, E: FloatArray, F: FloatArray) -> FloatArray:
    """Error covariance of a constant plant's filter where all states are excited a little; the unit matrix if there is none."""
    n, sizes = len(A), output_sizes(C, F)
    C, F = C / sizes[:, None], F / sizes[:, None]
    process, cross, sensor = E @ E.T, E @ F.T, F @ F.T
    size = float(np.trace(process)) / n or 1.0
    for regular in REGULAR:
        floor = regular * (float(np.trace(sensor)) / len(sensor) or 1.0)
        try:
            found = solve_continuous_are(
                A.T,
                C.T,
                process + max(regular, SHAKE) * size * np.eye(n),
                sensor + floor * np.eye(len(sensor)),
                s=cross,
            )
        except (LinAlgError, ValueError):
            continue
        if np.isfinite(found).all() and np.linalg.eigvalsh(found)[0] > 0.0:
            return np.asarray(found)
    return np.eye(n)


def _power(matrix: FloatArray, exponent: float) -> FloatArray:
    """Of a symmetric positive definite matrix."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors * np.maximum(values, values[-1] * 1e-14) ** exponent) @ vectors.T)


def middle(coefficients: FloatArray, below: FloatArray) -> FloatArray:
    """Of a numerator over its denominator, in the middle of the range."""
    first = (0,) * (coefficients.ndim - 2)
    return np.asarray(coefficients[first] / below[first])


def gathered(plant: GeneralisedPlant, key: str) -> FloatArray:
    """Of all channels in the middle of the range: inputs side by side, performance signals one below the other."""
    parts = [middle(getattr(part, key), plant.denominator) for part in plant.channels]
    return np.concatenate(parts, axis=1 if key in ("E", "F") else 0)
