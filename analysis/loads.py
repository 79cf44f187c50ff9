"""Axle and corner loads from the inertial unit (P1 (14)-(17); P2 (13)-(14); P3 (26)-(27))."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from analysis.checks import as_stack
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.forces import levelled
from estimators.vehicle import GRAVITY
from synthesis.models.parameter_set import ParameterSet

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

NEEDED = (
    "mass", "front_axle_distance", "rear_axle_distance", "cg_height", "roll_center_height", "front_track", "rear_track",
)  # fmt: skip


@dataclass(frozen=True, repr=False)
class Loads(Display):
    """Vertical loads in N, positive when pressing on the road; every array has the broadcast shape of the inputs."""

    shown_units: ClassVar = {
        "front": "N", "rear": "N", "front_left": "N", "front_right": "N", "rear_left": "N", "rear_right": "N",
    }  # fmt: skip

    front: FloatArray
    rear: FloatArray
    front_left: FloatArray
    front_right: FloatArray
    rear_left: FloatArray
    rear_right: FloatArray


def vertical_loads(
    vehicle: ParameterSet,
    longitudinal: ArrayLike,
    lateral: ArrayLike,
    normal: ArrayLike | None = None,
    pitch: ArrayLike = 0.0,
    roll: ArrayLike = 0.0,
    gravity: float = GRAVITY,
) -> Loads:
    r"""Loads for IMU accelerations [m/s^2] (specific force, normal = +g at rest, taken if None) and body pitch and roll [rad].

    a_tx = a_x cos p + a_z sin p, a_tz = a_z cos p - a_x sin p                                     (P1 (14))
    F_zf = -m (h a_tx - L_r a_tz) / (L_f + L_r), F_zr = m (h a_tx + L_f a_tz) / (L_f + L_r)       (P1 (15), P3 (26))
    F_ziL = m_i/T_i [a_fz (T_i/2 - h_rc sin r) - a_fy h], F_ziR likewise with +, m_i = F_zi / g    (P1 (17), P3 (27))

    As printed, including two doubtful points of the source: the signs in (14), (16) double gravity on a slope instead of
    removing it unless the angles are taken opposite to (11), and h_rc stands where the roll arm h - h_rc is meant.
    Raises AnalysisError for a missing vehicle constant and values not finite.

    >>> loads = vertical_loads(load_parameter_set("corner-estimation"), longitudinal=3.0, lateral=0.0)
    >>> bool(loads.front < loads.rear)  # the car squats
    True
    """
    missing = [name for name in NEEDED if name not in vehicle.vehicle]
    if missing:
        raise AnalysisError(f"parameter set '{vehicle.id}' has no vehicle.{', vehicle.'.join(missing)}; add it")
    m, front_arm, rear_arm, height, roll_height, *tracks = (vehicle.vehicle[name].value for name in NEEDED)
    normal = gravity if normal is None else normal
    given = {
        "longitudinal": longitudinal,
        "lateral": lateral,
        "normal": normal,
        "pitch": pitch,
        "roll": roll,
    }
    try:
        ax, ay, az, pitch, roll = np.broadcast_arrays(*(as_stack(k, v, ndim=0) for k, v in given.items()))
    except ValueError as error:
        if isinstance(error, AnalysisError):
            raise
        shapes = ", ".join(f"{k} {np.shape(v)}" for k, v in given.items())
        raise AnalysisError(f"accelerations and angles do not broadcast: {shapes}") from None
    along, _, above = levelled(ax, ay, az, -pitch, 0.0 * roll)
    base = front_arm + rear_arm
    front = -m / base * (height * along - rear_arm * above)
    rear = m / base * (height * along + front_arm * above)
    _, across, upright = levelled(ax, ay, az, 0.0 * pitch, -roll)
    corners = []
    for load, track in zip((front, rear), tracks, strict=True):
        for side in (-1.0, 1.0):
            lever = upright * (track / 2 + side * roll_height * np.sin(roll)) + side * across * height
            corners.append(load / gravity / track * lever)
    return Loads(front, rear, *corners)
