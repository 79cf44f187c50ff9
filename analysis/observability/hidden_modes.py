"""The mode that makes a pair not detectable or not stabilisable, and the parameter value at which it does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from flint import fmpq

from analysis.observability.modes import hautus_test
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.certificate.refute import undetectable_place
from synthesis.loop.from_model import plant_of
from synthesis.loop.plant import Plant
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.rational import as_float

SHARE = 0.1  # of the largest component of an eigenvector: smaller ones are not named


@dataclass(frozen=True, repr=False)
class HiddenMode(Display):
    """A mode that does not decay and that no output shows, or no input moves, where the parameters stand still at `place`.

    `eigenvalue` [1/s]; `states` are the names of those that take part in it, the largest part first, each in its own unit.
    """

    place: Mapping[str, float]
    units: Mapping[str, str]
    eigenvalue: complex
    states: tuple[str, ...]

    @property
    def words(self) -> str:
        """The mode and its place, for a message."""
        value = self.eigenvalue
        number = f"{value.real:.4g}" + (f" +- {abs(value.imag):.4g} j" if value.imag else "")
        where = ", ".join(f"{name} = {number:.6g} {self.units[name]}" for name, number in self.place.items())
        return f"the mode at {number} 1/s ({', '.join(self.states)}) at {where or 'its only point'}"


def undetectable_mode(model: LpvModel) -> HiddenMode | None:
    """A mode that does not decay and does not show in the outputs, somewhere in the range; None if none was found.

    The place is found exactly on a grid and wherever the observability matrix loses rank at a rational value
    (`synthesis.certificate.refute.undetectable_place`); the mode by the Popov-Belevitch-Hautus test there.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> print(undetectable_mode(model))
    None
    """
    return _hidden(model, plant_of(model), dual=False)


def unstabilisable_mode(model: LpvModel) -> HiddenMode | None:
    """A mode that does not decay and that no input moves: the undetectable mode of the dual pair (A', B').

    Without inputs every mode that does not decay is one.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> print(unstabilisable_mode(model))
    None
    """
    return _hidden(model, plant_of(model).dual, dual=True)


def _hidden(model: LpvModel, plant: Plant, dual: bool) -> HiddenMode | None:
    found = undetectable_place(plant)
    if found is None:
        return None
    place = {p.name: _value(p.middle, p.half_width, u) for p, u in zip(model.parameters, found, strict=True)}
    at = model.on(np.array([list(place.values())]).reshape(1, len(place)))
    A, C = (at.A[0].T, at.B[0].T) if dual else (at.A[0], at.C[0])
    eigenvalue, vector = _mode(A, C)
    size = np.abs(vector)
    names = [s.name for s in model.states]
    states = tuple(names[i] for i in np.argsort(-size, kind="stable") if size[i] > SHARE * size.max())
    return HiddenMode(place, {p.name: p.unit for p in model.parameters}, eigenvalue, states)


def _mode(A: FloatArray, C: FloatArray) -> tuple[complex, FloatArray]:
    """The best hidden eigenvalue among those that do not certainly decay, and its direction in A."""
    if not C.size:
        C = np.zeros((1, len(A)))
    test = hautus_test(A, C)
    distance = np.where(test.decays, np.inf, test.distance)
    value = complex(test.eigenvalues[int(np.argmin(distance))])
    value = complex(value.real, 0.0) if abs(value.imag) <= test.tolerance * np.linalg.norm(A, 2) else value
    stacked = np.vstack([A - value * np.eye(len(A)), C * np.linalg.norm(A, 2) / max(np.linalg.norm(C, 2), 1e-300)])
    return value, np.asarray(np.linalg.svd(stacked)[2][-1])


def _value(middle: float, half: float, u: fmpq) -> float:
    return middle + half * as_float(u)
