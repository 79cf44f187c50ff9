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
_NAMES = {
    "corners": (
        "CornerVectors",
        "corner_acceleration",
        "corner_acceleration_by_speed",
        "corner_velocity",
        "tire_frame",
        "vehicle_frame",
    ),
    "fusion": ("VelocityFusion",),
    "fusion_settings": ("FusionSettings",),
    "fusion_step": ("FusionStep",),
    "high_slip": ("HighSlipDetector", "HighSlipSettings", "HighSlipStep", "adaptive_threshold"),
    "kinematic": ("KinematicKalman", "KinematicStep"),
    "lpv": ("LpvStep", "LpvVelocityObserver"),
    "ltv_kalman": ("LtvKalmanObserver", "LtvStep"),
    "ltv_model": ("BristleTire",),
    "mapping": ("CentreVelocity", "CornerSlip", "SlipWeights", "to_centre", "to_corners"),
    "slip": ("side_slip_angle", "slip_ratio"),
    "suspension": ("SuspensionCompliance", "SuspensionParameters", "SuspensionStep"),
    "switching": ("SlipSwitch", "SwitchedStep", "SwitchedVelocityObserver", "with_constant_gain"),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}


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
