"""A linear system at many places or along many trajectories: what loops become for a simulation."""

from __future__ import annotations

from typing import NamedTuple

from estimators.arrays import FloatArray


class Linear(NamedTuple):
    """x+ = A x + B w, z = C x + D w; stacks (..., rows, columns)."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
