"""Sideslip and lateral forces: four-wheel model with Dugoff tires, force observer with adaptive cornering stiffness."""

from estimators.sideslip.cornering_model import CorneringModel
from estimators.sideslip.dugoff import dugoff_force, dugoff_slope, used_friction
from estimators.sideslip.four_wheel import FourWheelObserver, FourWheelStep
from estimators.sideslip.four_wheel_model import FourWheelModel
from estimators.sideslip.sliding_mode import SlidingGains, SlidingModeObserver, SlidingStep, wheel_axes
from estimators.sideslip.stiffness import AdaptiveStiffnessObserver, FixedStiffnessObserver, StiffnessStep
from estimators.vehicle import FourWheel, SingleTrack

__all__ = [
    "AdaptiveStiffnessObserver",
    "CorneringModel",
    "FixedStiffnessObserver",
    "FourWheel",
    "FourWheelModel",
    "FourWheelObserver",
    "FourWheelStep",
    "SingleTrack",
    "SlidingGains",
    "SlidingModeObserver",
    "SlidingStep",
    "StiffnessStep",
    "dugoff_force",
    "dugoff_slope",
    "used_friction",
    "wheel_axes",
]
