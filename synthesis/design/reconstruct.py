"""From the unknowns of `synthesis.design.output_feedback_lmi` back to the controller, at many places at once."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.generalised_plant import GeneralisedPlant
from synthesis.design.output_feedback_lmi import Wanted
from synthesis.lmi.result import LmiResult
from synthesis.models.numeric import values

Controller = tuple[FloatArray, FloatArray, FloatArray, FloatArray]  # Ak, Bk, Ck, Dk, a place in front


def reconstructed(
    plant: GeneralisedPlant, result: LmiResult, wanted: Wanted, points: FloatArray, level: float
) -> Controller:
    """Ak, Bk, Ck, Dk at scaled parameters (g, p), in the coordinates of the plant that is given.

    The controller's states are an estimate of the plant's: M = Y where Y stands still, N = -X where X does. Its gains need no
    rate then, and follow the parameters as smoothly as X and Y do.
    """
    still = np.hstack([points, np.zeros_like(points)])
    below = values(plant.denominator, points)
    A, B, C = (values(getattr(plant, key), points) / below for key in ("A", "B", "C"))
    X, Y, Bh, Ch = (result.values[name].at(still)[..., 0] for name in ("X", "Y", "Bh", "Ch"))
    Dk = (
        result.values["Dh"].at(still)[..., 0] if wanted.feedthrough else np.zeros((len(points), B.shape[2], C.shape[1]))
    )
    if wanted.eliminated(len(plant.channels)):
        part = {key: values(getattr(plant.channels[0], key), points) / below for key in ("E", "F", "Cz", "Dzd", "Dzu")}
        cross = _cross(part, X, Y, B, C, Bh, Ch, Dk, level)
    else:
        cross = result.values["cross"].at(still)[..., 0] / below
    closed = A + B @ Dk @ C
    Ah = np.swapaxes(cross - closed, 1, 2)
    if wanted.still == "Y":
        M, N = Y, np.linalg.inv(Y) - X
    else:
        M, N = Y - np.linalg.inv(X), -X
    right = np.linalg.inv(np.swapaxes(M, 1, 2))
    Ck = (Ch - Dk @ C @ Y) @ right
    NBk = Bh - X @ B @ Dk
    NAk = (Ah - NBk @ C @ Y - X @ closed @ Y) @ right - X @ B @ Ck
    Ak, Bk = (np.asarray(np.linalg.solve(N, right), float) for right in (NAk, NBk))
    return Ak, Bk, np.asarray(Ck), np.asarray(Dk)


def _cross(
    part: dict[str, FloatArray],
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
    regulator = np.concatenate(
        [part["E"] + B @ Dk @ part["F"], np.swapaxes(part["Cz"] @ Y + part["Dzu"] @ Ch, 1, 2)], axis=2
    )
    filtering = np.concatenate(
        [X @ part["E"] + Bh @ part["F"], np.swapaxes(part["Cz"] + part["Dzu"] @ Dk @ C, 1, 2)], axis=2
    )
    direct = part["Dzd"] + part["Dzu"] @ Dk @ part["F"]
    g, z, w = direct.shape
    corner = np.zeros((g, w + z, w + z))
    corner[:, :w, w:], corner[:, w:, :w] = np.swapaxes(direct, 1, 2), direct
    corner -= level * np.eye(w + z)
    return np.asarray(regulator @ np.linalg.solve(corner, np.swapaxes(filtering, 1, 2)))
