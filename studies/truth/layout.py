"""The state of B vehicles as one array (STATES, B): what the body does, then eight quantities of four wheels each.

Inside the integration the batch is the last axis, corners (4, B): every quantity lies in one piece of memory, which makes
the step three times as fast. Outside, the batch comes first.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from estimators.arrays import FloatArray

BODY: Final = (
    "x",  # m, of the centre of gravity on the road
    "y",
    "yaw",  # rad
    "vx",  # m/s, of the centre of gravity along the car
    "vy",
    "yaw_rate",  # rad/s
    "heave",  # m, from the static position, up
    "heave_rate",
    "roll",  # rad, left side up
    "roll_speed",
    "pitch",  # rad, nose up
    "pitch_speed",
    "jack_front",  # N, lateral load transfer through the links of the axle
    "jack_rear",
    "distance",  # m, along the way of the centre of gravity, backwards counting down
)
WHEEL: Final = (
    "wheel_speed",  # rad/s
    "wheel_angle",  # rad
    "deflection_x",  # state of the tire: bristle deflection in m, or lagged slip
    "deflection_y",
    "compliance_x",  # m, wheel centre against the body, P3 (14)
    "compliance_y",
    "compliance_x_rate",
    "compliance_y_rate",
)
STATES: Final = len(BODY) + 4 * len(WHEEL)
B: Final = {name: k for k, name in enumerate(BODY)}  # Row of each body state
W: Final = {name: slice(len(BODY) + 4 * k, len(BODY) + 4 * k + 4) for k, name in enumerate(WHEEL)}
"""Rows fl, fr, rl, rr of each wheel state."""
JACK: Final = slice(B["jack_front"], B["jack_rear"] + 1)
DEFLECTION: Final = slice(W["deflection_x"].start, W["deflection_y"].stop)
COMPLIANCE: Final = slice(W["compliance_x"].start, W["compliance_y"].stop)
COMPLIANCE_RATE: Final = slice(W["compliance_x_rate"].start, W["compliance_y_rate"].stop)


def column(items: Sequence[object], name: str) -> FloatArray:
    """An attribute of all items as one array with the items last: (B,) of numbers, (2, B) of pairs."""
    return np.ascontiguousarray(np.array([getattr(item, name) for item in items], dtype=np.float64).T)


def rolling(speed: npt.ArrayLike, radius: FloatArray) -> FloatArray:
    """State (STATES, B) of cars that roll freely straight ahead at ``speed`` (B,), m/s; negative is backwards, 0 at rest."""
    state = np.zeros((STATES, radius.shape[1]))
    state[B["vx"]] = speed
    state[W["wheel_speed"]] = state[B["vx"]] / radius
    return state
