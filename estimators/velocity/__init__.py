"""Velocity observers of the corners, their mapping to the vehicle, and the vehicle-level fusion."""

from estimators.velocity.corners import CornerVectors, corner_acceleration, corner_velocity, tire_frame, vehicle_frame
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
    "corner_velocity",
    "side_slip_angle",
    "slip_ratio",
    "tire_frame",
    "to_centre",
    "to_corners",
    "vehicle_frame",
    "with_constant_gain",
]
