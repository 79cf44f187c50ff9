"""Norms of an observer's error over a grid of the scheduling parameters: Fig. 2 of P3 for any model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from analysis.errors import AnalysisError
from analysis.norms.hinf import HinfNorm, hinf_norm
from estimators.arrays import FloatArray
from synthesis.models.lpv import LpvModel
from synthesis.models.selection import selection as named


def selection(model: LpvModel, disturbances: Sequence[str], errors: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """d (nd, k) that feeds the named disturbances and z (j, nx) that reads the named state errors, in that order."""
    for what, names in (("disturbance", disturbances), ("state", errors)):
        if not names:
            raise AnalysisError(f"model '{model.name}': name at least one {what}")
    return named(model, disturbances, errors, f"model '{model.name}'", AnalysisError)


def error_hinf_norm(
    model: LpvModel,
    gain: ArrayLike,
    grid: ArrayLike,
    disturbances: Sequence[str],
    errors: Sequence[str] | None = None,
    tolerance: float = 1e-9,
) -> HinfNorm:
    r"""H-infinity norm from disturbances to errors of e' = (A - L C) e + (E - L F) d at frozen parameters (P3 section IV).

    `gain` (nx, ny), or (g, nx, ny) with one gain for each grid point; `grid` (g, p), or (g,) for one parameter; `errors`
    defaults to all states. Arrays of the result have the shape (g,). The units are those of the named signals as they
    stand: nothing is weighted. Raises AnalysisError for unknown names and gains that do not fit.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> norm = error_hinf_norm(model, [[0.68], [183.1]], [0.0, 70.0, 140.0], ["force_noise"], ["relative_velocity"]).norm
    >>> norm.shape
    (3,)
    """
    d, z = selection(model, disturbances, tuple(errors) if errors is not None else tuple(s.name for s in model.states))
    A_e, B_e = model.on(grid).error_dynamics(checked_gain(model, gain))
    return hinf_norm(A_e, B_e @ d, z, tolerance=tolerance)


def checked_gain(model: LpvModel, gain: ArrayLike) -> FloatArray:
    """A gain (..., nx, ny); one number for each state is read as a column if there is one output."""
    array = np.asarray(gain, float)
    shape = (len(model.states), len(model.outputs))
    if array.ndim == 1 and shape[1] == 1:
        array = array[:, None]
    if array.ndim < 2 or array.shape[-2:] != shape or not np.isfinite(array).all():
        raise AnalysisError(
            f"model '{model.name}': a gain {np.shape(gain)} must be finite and (..., {shape[0]}, {shape[1]})"
        )
    return array
