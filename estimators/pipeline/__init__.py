"""From raw signals to forces, slips, velocities and sideslip of the whole car: one object, composed of replaceable parts."""

from estimators.pipeline.corner_kinds import CornerSample, CornerStep, KalmanCorners, ScheduledCorners, SwitchedCorners
from estimators.pipeline.corner_set import CornerObservers, CornerSetStep
from estimators.pipeline.corner_velocity import CornerVelocity
from estimators.pipeline.mounted_unit import MountedUnit
from estimators.pipeline.pipeline import EstimationPipeline
from estimators.pipeline.result import Check, Consistency, PipelineStep
from estimators.pipeline.sideslip_parts import FourWheelSideslip, StiffnessSideslip
from estimators.pipeline.signals import VehicleSignals
from estimators.pipeline.wheel_parts import DifferentiatedPid

__all__ = [
    "Check",
    "Consistency",
    "CornerObservers",
    "CornerSample",
    "CornerSetStep",
    "CornerStep",
    "CornerVelocity",
    "DifferentiatedPid",
    "EstimationPipeline",
    "FourWheelSideslip",
    "KalmanCorners",
    "MountedUnit",
    "PipelineStep",
    "ScheduledCorners",
    "StiffnessSideslip",
    "SwitchedCorners",
    "VehicleSignals",
]
