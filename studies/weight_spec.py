"""Dynamic weights of a specification: `[[design.dynamic_weights]]`, one linear system in series with one signal of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from estimators.errors import unknown
from synthesis.design.weighted_state_feedback import states_as_outputs
from synthesis.errors import ModelError, SpecError
from synthesis.models.lpv import LpvModel
from synthesis.models.weighted import weighted
from synthesis.models.weights import first_order_weight, state_space_weight, transfer_weight
from synthesis.toml_file import StrictTable

FORMS = {
    "first order": ("low_gain", "high_gain", "crossover"),
    "coefficients": ("numerator", "denominator"),
    "matrices": ("A", "B", "C", "D"),
}
STATE_FEEDBACK = ("state feedback", "sampled state feedback")
MOST_STATES = 8  # of one weight


class WeightSpec(StrictTable):
    """A weight W(s) of one signal (synthesis.models.weighted), in one of three forms; gains are pure numbers.

    First order: its gains at low and high frequencies and where it is 1 (rad/s). Coefficients: of falling powers of s. Matrices:
    of a system with one input and one output (A and B in 1/s).
    """

    signal: str
    low_gain: float | None = Field(default=None, ge=0)
    high_gain: float | None = Field(default=None, ge=0)
    crossover: float | None = Field(default=None, gt=0)
    numerator: list[float] | None = Field(default=None, min_length=1, max_length=MOST_STATES + 1)
    denominator: list[float] | None = Field(default=None, min_length=1, max_length=MOST_STATES + 1)
    A: list[list[float]] | None = Field(default=None, min_length=1, max_length=MOST_STATES)
    B: list[list[float]] | None = Field(default=None, min_length=1, max_length=MOST_STATES)
    C: list[list[float]] | None = Field(default=None, min_length=1, max_length=1)
    D: list[list[float]] | None = Field(default=None, min_length=1, max_length=1)

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        begun = [form for form, keys in FORMS.items() if any(getattr(self, key) is not None for key in keys)]
        if len(begun) != 1:
            words = "; or ".join(", ".join(keys) for keys in FORMS.values())
            raise ValueError(f"weight of '{self.signal}' has {len(begun)} forms; give one: {words}")
        missing = [key for key in FORMS[begun[0]] if getattr(self, key) is None]
        if missing:
            raise ValueError(f"weight of '{self.signal}': {missing[0]} is missing beside the rest of its {begun[0]}")
        if any(len(row) != len(rows[0]) for rows in (self.A, self.B) if rows for row in rows):
            raise ValueError(f"weight of '{self.signal}': the rows of a matrix are not equally long")
        try:
            self.system()
        except ModelError as error:
            raise ValueError(f"weight of '{self.signal}': {error}") from None
        return self

    @property
    def order(self) -> int:
        """Number of its states."""
        if self.A is not None:
            return len(self.A)
        return 1 if self.denominator is None else len(np.trim_zeros(np.array(self.denominator), "f")) - 1

    def system(self) -> Any:
        """As python-control has it."""
        if self.low_gain is not None and self.high_gain is not None and self.crossover is not None:
            return first_order_weight(self.low_gain, self.high_gain, self.crossover)
        if self.numerator is not None and self.denominator is not None:
            return transfer_weight(self.numerator, self.denominator)
        return state_space_weight(self.A, self.B, self.C, self.D)


def weighed(model: LpvModel, weights: Sequence[WeightSpec], law: str | None) -> LpvModel:
    """The model with its weights in series; raises SpecError for signals that are none, stand twice, or are not for the law.

    The states of a weight are run with the law: an observer estimates those of its disturbances, and dynamic output feedback of
    full order has states for them all. State feedback works them out from what it measures, which are then outputs of the model
    (synthesis.design.weighted_state_feedback). Static output feedback has no use for them.
    """
    if not weights:
        return model
    where, names = f"model '{model.name}', dynamic_weights", [weight.signal for weight in weights]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise SpecError(f"{where}: '{twice}' has two weights; multiply them")
    driven = [signal.name for signal in model.disturbances]
    others = [signal.name for group in (model.states, model.outputs, model.inputs) for signal in group]
    for name in names:
        if name not in (*driven, *others):
            raise SpecError(f"{where}: {unknown('signal', name, (*driven, *others))}")
        if law is None and name not in driven:
            raise SpecError(
                f"{where}: '{name}' is no disturbance; an observer's weights shape its disturbances ({', '.join(driven)})"
            )
    plain = states_as_outputs(model) if law in STATE_FEEDBACK else model
    return weighted(plain, {weight.signal: weight.system() for weight in weights})
