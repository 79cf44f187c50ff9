"""The errors of the runtime: each says what is wrong, where, in which unit, and what to do."""

from __future__ import annotations


class EstimatorError(ValueError):
    """Bad input to an estimator: the message names the place and the remedy."""


class ScheduleError(EstimatorError):
    """A schedule file or its content that cannot be trusted or understood."""


class RangeError(EstimatorError):
    """A parameter or a rate outside the box for which the schedule was proved."""
