"""The models of the papers by name; specifications may name these and no other code."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.lpv import LpvModel

CATALOGUE: dict[str, Callable[..., LpvModel]] = {
    "corner-velocity-longitudinal": partial(corner_velocity_model, direction="longitudinal"),
    "corner-velocity-lateral": partial(corner_velocity_model, direction="lateral"),
}

__all__ = ["CATALOGUE", "corner_velocity_model"]
