"""Tyre forces of the four corners and the attitude of the body, from what a production car measures."""

from estimators.forces.attitude import AttitudeObserver, AttitudeStep, without_gravity
from estimators.forces.body_response import BodyResponse
from estimators.forces.lateral_ukf import LateralForceEstimator, LateralForceStep
from estimators.forces.pid import PidForceObserver
from estimators.forces.planar import PlanarModel, planar_model, planar_outputs
from estimators.forces.total import Reconciled, normalised, reconcile
from estimators.forces.unknown_input import UnknownInputForceObserver
from estimators.forces.vertical import LoadStep, VerticalLoads, levelled, vertical_loads
from estimators.forces.wheel import WheelForceStep
from estimators.forces.wheel_ukf import WheelForceFilter

__all__ = [
    "AttitudeObserver",
    "AttitudeStep",
    "BodyResponse",
    "LateralForceEstimator",
    "LateralForceStep",
    "LoadStep",
    "PidForceObserver",
    "PlanarModel",
    "Reconciled",
    "UnknownInputForceObserver",
    "VerticalLoads",
    "WheelForceFilter",
    "WheelForceStep",
    "levelled",
    "normalised",
    "planar_model",
    "planar_outputs",
    "reconcile",
    "vertical_loads",
    "without_gravity",
]
