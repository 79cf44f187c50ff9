"""A model in closed loop with the gain table that is deployed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synthesis.hinf_observer import Channel, channel_matrices
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.scaling import error_scale
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray, MatrixPolynomial


@dataclass(frozen=True)
class DeployedLoop:
    """A model in closed loop with a gain table (breakpoints, nx, ny), linear between its breakpoints."""

    model: LpvModel
    breakpoints: FloatArray
    table: FloatArray

    def scale(self) -> FloatArray:
        """Diagonal balancing of the mid-range error matrix."""
        middle = 0.5 * (self.breakpoints[0] + self.breakpoints[-1])
        return error_scale(self.error_matrices(np.array([middle]))[0][0])

    def error_matrices(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A_e (g, nx, nx) and B_e (g, nx, nd) on a grid."""
        flat = self.table.reshape(len(self.table), -1)
        gain = np.stack([np.interp(points, self.breakpoints, column) for column in flat.T], axis=1)
        return self.model.on(points).error_dynamics(gain.reshape(len(points), *self.table.shape[1:]))


def frozen_gain(loop: DeployedLoop, channel: Channel, points: int = 281) -> float:
    """Largest gain of the channel over constant parameters and a grid of frequencies: a bound from below.

    A constant parameter is one of the admissible trajectories, and every frequency bounds the norm there from below.
    """
    grid = np.linspace(loop.breakpoints[0], loop.breakpoints[-1], points)
    A_e, B_e = loop.error_matrices(grid)
    d, z = channel_matrices(loop.model, channel)
    frequencies = np.concatenate([[0.0], np.geomspace(1e-2, 1e4, 61)])
    resolvent = 1j * frequencies[:, None, None, None] * np.eye(A_e.shape[-1]) - A_e
    response = z @ np.linalg.solve(resolvent, np.broadcast_to(B_e @ d, (len(frequencies), *(B_e @ d).shape)))
    return float(np.linalg.norm(response, 2, axis=(-2, -1)).max())


def segment_gain(problem: LmiProblem, loop: DeployedLoop, segment: int, scale: FloatArray) -> MatrixPolynomial:
    """The linear gain between two breakpoints, in the scaled states."""
    low, high = loop.breakpoints[segment : segment + 2]
    first, second = (scale[:, None] * gain for gain in loop.table[segment : segment + 2])
    slope = (second - first) / (high - low)
    return problem.known(np.stack([first - slope * low, slope]))
