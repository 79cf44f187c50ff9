"""Bernstein coefficients of a matrix on boxes that the border of a set cuts: positive definite on the part inside, in floats."""

from __future__ import annotations

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from synthesis.polynomials.half_spaces import Faces
from synthesis.polynomials.multiplier import root


def positive_on_part(boxes: FloatArray, centre: FloatArray, half: FloatArray, faces: Faces, guard: float) -> BoolArray:
    """Which boxes (g, d_1+1, .., d_v+1, k, k) are so where the inequality that cuts most off each holds (M - g N, see `root`).

    `centre` and `half` (g, v) are those of the boxes, whose first axes are the parameters of `faces`. Every coefficient of the
    other variables has a multiplier N of its own: what it multiplies sums to one and is not negative.
    """
    count, size = faces.normals.shape[1], boxes.shape[-1]
    start = faces.bounds + faces.slack - centre[:, :count] @ faces.normals.T
    slopes = faces.normals * half[:, None, :count]
    reach = np.abs(slopes).sum(axis=-1)
    depth = np.where(reach > 0.0, (reach - start) / np.where(reach > 0.0, reach, 1.0), -np.inf)
    rows, which = np.arange(len(boxes)), depth.argmax(axis=1)
    start, slopes = start[rows, which], slopes[rows, which]
    length = (slopes**2).sum(axis=1)
    lines = [np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1) for n in boxes.shape[1 : 1 + count]]
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, count)
    values = boxes.reshape(len(boxes), len(nodes), -1, size, size)
    weights = nodes / np.maximum((nodes**2).sum(axis=0), 1e-300)
    slope = np.einsum("ki,gkrab->girab", weights, values)
    place = np.clip(slopes * (start / length)[:, None], -1.0, 1.0)
    M0 = values.mean(axis=1) + np.einsum("gi,girab->grab", place, slope)
    V = root(M0, -np.einsum("gi,girab->grab", slopes / length[:, None], slope))
    N = V @ np.swapaxes(V, -1, -2)
    g = start[:, None] - slopes @ nodes.T
    rest = values - g[:, :, None, None, None] * N[:, None]
    rounding = 64.0 * size * np.finfo(float).eps * np.abs(g).max(axis=1) * np.abs(N).sum(axis=(-2, -1)).max(axis=1)
    least = np.linalg.eigvalsh(rest)[..., 0].reshape(len(boxes), -1).min(axis=1)
    return np.asarray((depth[rows, which] > 0.0) & (least > guard + rounding))
