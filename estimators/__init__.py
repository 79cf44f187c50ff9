"""What runs on the target: gain schedules, estimators and their fault handling; numpy is all it needs."""

from estimators.errors import EstimatorError, RangeError, ScheduleError
from estimators.faults import Flag
from estimators.schedule import GainSchedule
from estimators.velocity.lpv import LpvStep, LpvVelocityObserver

__all__ = [
    "EstimatorError",
    "Flag",
    "GainSchedule",
    "LpvStep",
    "LpvVelocityObserver",
    "RangeError",
    "ScheduleError",
]
