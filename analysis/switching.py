"""Switched gains: what is guaranteed however the modes follow each other (P3 section 5)."""

from analysis.joint_spectral_radius import joint_spectral_radius
from analysis.switching_lyapunov import common_quadratic_lyapunov
from analysis.switching_pair import exact_pair_test, pair_margin
from analysis.switching_similarity import (
    best_diagonal_transform,
    common_growth,
    diagonal_window,
    similarity_bound,
    symmetric_growth,
)

__all__ = [
    "best_diagonal_transform",
    "common_growth",
    "common_quadratic_lyapunov",
    "diagonal_window",
    "exact_pair_test",
    "joint_spectral_radius",
    "pair_margin",
    "similarity_bound",
    "symmetric_growth",
]
