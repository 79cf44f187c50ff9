"""The schedule file, and a gain schedule as the runtime uses it."""

from estimators.schedule.check import SCHEMA, SECTIONS, check_content
from estimators.schedule.files import canonical, check_seal, read_content, sealed, write_content
from estimators.schedule.gain_schedule import (
    SHIPPED,
    GainSchedule,
    PlantMatrices,
    SchedulingParameter,
    Signal,
    Update,
    outside_range,
)
from estimators.schedule.plant import PlantPolynomial, PlantPolynomials
from estimators.schedule.quotient import PlantQuotient
from estimators.schedule.upgrade import FIRST_FORMAT, upgraded

__all__ = [
    "FIRST_FORMAT",
    "SCHEMA",
    "SECTIONS",
    "SHIPPED",
    "GainSchedule",
    "PlantMatrices",
    "PlantPolynomial",
    "PlantPolynomials",
    "PlantQuotient",
    "SchedulingParameter",
    "Signal",
    "Update",
    "canonical",
    "check_content",
    "check_seal",
    "outside_range",
    "read_content",
    "sealed",
    "upgraded",
    "write_content",
]
