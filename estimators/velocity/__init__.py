"""Velocity observers of the corners, their mapping to the vehicle, and the vehicle-level fusion."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from estimators.velocity.corners import (
        CornerVectors,
        corner_acceleration,
        corner_acceleration_by_speed,
        corner_velocity,
        tire_frame,
        vehicle_frame,
    )
    from estimators.velocity.fusion import VelocityFusion
    from estimators.velocity.fusion_settings import FusionSettings
    from estimators.velocity.fusion_step import FusionStep
    from estimators.velocity.high_slip import HighSlipDetector, HighSlipSettings, HighSlipStep, adaptive_threshold
    from estimators.velocity.kinematic import KinematicKalman, KinematicStep
    from estimators.velocity.lpv import LpvStep, LpvVelocityObserver
    from estimators.velocity.ltv_kalman import LtvKalmanObserver, LtvStep
    from estimators.velocity.ltv_model import BristleTire
    from estimators.velocity.mapping import CentreVelocity, CornerSlip, SlipWeights, to_centre, to_corners
    from estimators.velocity.slip import side_slip_angle, slip_ratio
    from estimators.velocity.suspension import SuspensionCompliance, SuspensionParameters, SuspensionStep
    from estimators.velocity.switching import SlipSwitch, SwitchedStep, SwitchedVelocityObserver, with_constant_gain

# The runtime of one observer must not pay for the import of all of them: names are fetched when they are asked for.
_HOME = {
    "BristleTire": "ltv_model",
    "CentreVelocity": "mapping",
    "CornerSlip": "mapping",
    "CornerVectors": "corners",
    "FusionSettings": "fusion_settings",
    "FusionStep": "fusion_step",
    "HighSlipDetector": "high_slip",
    "HighSlipSettings": "high_slip",
    "HighSlipStep": "high_slip",
    "KinematicKalman": "kinematic",
    "KinematicStep": "kinematic",
    "LpvStep": "lpv",
    "LpvVelocityObserver": "lpv",
    "LtvKalmanObserver": "ltv_kalman",
    "LtvStep": "ltv_kalman",
    "SlipSwitch": "switching",
    "SlipWeights": "mapping",
    "SuspensionCompliance": "suspension",
    "SuspensionParameters": "suspension",
    "SuspensionStep": "suspension",
    "SwitchedStep": "switching",
    "SwitchedVelocityObserver": "switching",
    "VelocityFusion": "fusion",
    "adaptive_threshold": "high_slip",
    "corner_acceleration": "corners",
    "corner_acceleration_by_speed": "corners",
    "corner_velocity": "corners",
    "side_slip_angle": "slip",
    "slip_ratio": "slip",
    "tire_frame": "corners",
    "to_centre": "mapping",
    "to_corners": "mapping",
    "vehicle_frame": "corners",
    "with_constant_gain": "switching",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


__all__ = [
    "BristleTire",
    "CentreVelocity",
    "CornerSlip",
    "CornerVectors",
    "FusionSettings",
    "FusionStep",
    "HighSlipDetector",
    "HighSlipSettings",
    "HighSlipStep",
    "KinematicKalman",
    "KinematicStep",
    "LpvStep",
    "LpvVelocityObserver",
    "LtvKalmanObserver",
    "LtvStep",
    "SlipSwitch",
    "SlipWeights",
    "SuspensionCompliance",
    "SuspensionParameters",
    "SuspensionStep",
    "SwitchedStep",
    "SwitchedVelocityObserver",
    "VelocityFusion",
    "adaptive_threshold",
    "corner_acceleration",
    "corner_acceleration_by_speed",
    "corner_velocity",
    "side_slip_angle",
    "slip_ratio",
    "tire_frame",
    "to_centre",
    "to_corners",
    "vehicle_frame",
    "with_constant_gain",
]
