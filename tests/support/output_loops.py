"""The closed loop of an output feedback, and its frozen gain: a second way to the level that is claimed."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.output_feedback import OutputFeedback

FREQUENCIES = np.concatenate([[0.0], np.geomspace(1e-3, 1e4, 300)])


def closed(found: OutputFeedback, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A, B, C, D from all disturbances to states, outputs and inputs, written out from the definition of the law."""
    at = found.model.on(points)
    Ak, Bk, Ck, Dk = found.controller(points)
    n = at.A.shape[1]
    # u = Ck xk + Dk (C x + F d): no law here has a feedthrough from an output that u acts on
    u_x, u_d = np.concatenate([Dk @ at.C, Ck], axis=2), Dk @ at.F
    y_x = np.concatenate([at.C, np.zeros((len(Ak), at.C.shape[1], n))], axis=2) + at.D @ u_x
    y_d = at.F + at.D @ u_d
    x = np.broadcast_to(np.eye(n, 2 * n), (len(Ak), n, 2 * n))
    A = np.concatenate([at.A @ x + at.B @ u_x, Bk @ y_x], axis=1)
    A[:, n:, n:] += Ak
    B = np.concatenate([at.E + at.B @ u_d, Bk @ y_d], axis=1)
    return A, B, np.concatenate([x, y_x, u_x], axis=1), np.concatenate([np.zeros_like(at.E), y_d, u_d], axis=1)


def frozen_gain(found: OutputFeedback, channel: FeedbackChannel, points: FloatArray) -> float:
    """The largest singular value over a grid of frequencies and the given places; infinite for a pole on the right."""
    model = found.model
    A, B, C, D = closed(found, points)
    if np.linalg.eigvals(A).real.max() >= 0.0:
        return np.inf
    names = [s.name for s in (*model.states, *model.outputs, *model.inputs)]
    rows = [names.index(name) for name in channel.performance]
    columns = [[s.name for s in model.disturbances].index(name) for name in channel.disturbances]
    Z = np.eye(len(names))[rows] / np.array(channel.sizes or (1.0,) * len(rows))[:, None]
    W = np.eye(B.shape[2])[:, columns] * np.array(channel.weights or (1.0,) * len(columns))
    resolvent = 1j * FREQUENCIES[:, None, None, None] * np.eye(A.shape[1]) - A
    driven = np.broadcast_to((B @ W).astype(complex), (*resolvent.shape[:2], B.shape[1], len(columns)))
    answer = Z @ C @ np.linalg.solve(resolvent, driven)
    return float(np.linalg.norm(answer + Z @ D @ W, 2, axis=(-2, -1)).max())
