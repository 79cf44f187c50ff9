"""From the unknowns of `synthesis.design.output_feedback_lmi` back to the controller, at many places at once."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.halves import Halves
from synthesis.design.output_feedback_lmi import Wanted
from synthesis.lmi.result import LmiResult
from synthesis.models.numeric import values

Controller = tuple[FloatArray, FloatArray, FloatArray, FloatArray]  # Ak, Bk, Ck, Dk, a place in front


def reconstructed(plant: Halves, result: LmiResult, wanted: Wanted, points: FloatArray, level: float) -> Controller:
    """Ak, Bk, Ck, Dk at scaled parameters (g, p), in the coordinates of the filter's half.

    The controller's states are an estimate of the plant's: M = Y where Y stands still, N = -X where X does. Its gains need no
    rate then, and follow the parameters as smoothly as X and Y do. All inverses are of matrices near one: X - J'Y^-1 J and Y, or
    Y - J X^-1 J' and X.
    """
    still = np.hstack([points, np.zeros_like(points)])
    below = values(plant.filter.denominator, points)
    A, B, C = (values(getattr(plant.filter, key), points) / below for key in ("A", "B", "C"))
    X, Y, Bh, Ch = (result.values[name].at(still)[..., 0] for name in ("X", "Y", "Bh", "Ch"))
    Dk = (
        result.values["Dh"].at(still)[..., 0] if wanted.feedthrough else np.zeros((len(points), B.shape[2], C.shape[1]))
    )
    J, Br, Ar = plant.joint, values(plant.regulator.B, points) / below, values(plant.regulator.A, points) / below
    if wanted.eliminated(plant.filter.channels):
        regulator, filtering = (
            {key: values(getattr(half.channels[0], key), points) / below for key in ("E", "F", "Cz", "Dzd", "Dzu")}
            for half in (plant.regulator, plant.filter)
        )
        cross = _cross(regulator, filtering, X, Y, Br, C, Bh, Ch, Dk, level)
    else:
        lifted = 1.0 / np.outer(plant.weights["Y"], plant.weights["X"])
        cross = result.values["cross"].at(still)[..., 0] * lifted / below
    Ah = np.swapaxes(cross - (Ar @ J + Br @ Dk @ C), 1, 2)
    closed, eye = A + B @ Dk @ C, np.eye(len(J))
    if wanted.still == "Y":
        right = np.linalg.solve(Y, np.broadcast_to(J, Y.shape))  # Y^-1 J
        N, Z = -(X - J.T @ right), eye
    else:
        N = -X
        right = np.linalg.solve(Y - J @ np.linalg.solve(X, np.broadcast_to(J.T, X.shape)), np.broadcast_to(J, Y.shape))
        Z = eye + np.linalg.solve(X, J.T @ right)
    Ck = Ch @ right - Dk @ C @ Z
    Bk = np.linalg.solve(N, Bh - X @ B @ Dk)
    Ak = np.linalg.solve(N, Ah @ right - X @ B @ Ck - X @ closed @ Z) - Bk @ C @ Z
    return np.asarray(Ak), np.asarray(Bk), np.asarray(Ck), np.asarray(Dk)


def _cross(
    regulator: dict[str, FloatArray],
    filtering: dict[str, FloatArray],
    X: FloatArray,
    Y: FloatArray,
    B: FloatArray,
    C: FloatArray,
    Bh: FloatArray,
    Ch: FloatArray,
    Dk: FloatArray,
    level: float,
) -> FloatArray:
    """The upper right block that leaves nothing of itself in the Schur complement of the channel's other blocks."""
    F, Dzu = filtering["F"], filtering["Dzu"]
    upper = np.concatenate([regulator["E"] + B @ Dk @ F, np.swapaxes(regulator["Cz"] @ Y + Dzu @ Ch, 1, 2)], axis=2)
    lower = np.concatenate([X @ filtering["E"] + Bh @ F, np.swapaxes(filtering["Cz"] + Dzu @ Dk @ C, 1, 2)], axis=2)
    direct = filtering["Dzd"] + Dzu @ Dk @ F
    g, z, w = direct.shape
    corner = np.zeros((g, w + z, w + z))
    corner[:, :w, w:], corner[:, w:, :w] = np.swapaxes(direct, 1, 2), direct
    corner -= level * np.eye(w + z)
    return np.asarray(upper @ np.linalg.solve(corner, np.swapaxes(lower, 1, 2)))
