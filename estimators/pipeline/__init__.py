"""From raw signals to forces, slips, velocities and sideslip of the whole car: one object, composed of replaceable parts."""

from estimators.pipeline.corner_set import CornerObservers, CornerSetStep
from estimators.pipeline.pipeline import EstimationPipeline
from estimators.pipeline.result import Check, Consistency, PipelineStep
from estimators.pipeline.sideslip_parts import FourWheelSideslip, StiffnessSideslip
from estimators.pipeline.signals import VehicleSignals
from estimators.pipeline.wheel_parts import DifferentiatedPid

__all__ = [
    "Check",
    "Consistency",
    "CornerObservers",
    "CornerSetStep",
    "DifferentiatedPid",
    "EstimationPipeline",
    "FourWheelSideslip",
    "PipelineStep",
    "StiffnessSideslip",
    "VehicleSignals",
]
