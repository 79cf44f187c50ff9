r"""Coordinates in which both halves of an output feedback are numbers near one: the regulator's and the filter's.

With the cost matrix R and the error covariance S in the middle of the range, Y is about gamma R^-1 and X about gamma S^-1. No
one coordinate system makes both the unit matrix, as eigenvalues of X Y do not depend on it: noise that is filtered out fast and
costs nothing makes them 1e8. So the regulator's half is written in the states T_r x in which Y is about one, the filter's in
T_f x in which X is, and [Y I; I X] becomes [Y J; J' X] with J = T_r T_f^-1 <= 1: the small numbers stand where they do no harm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.generalised_plant import Frame, GeneralisedPlant, gathered, middle


@dataclass(frozen=True)
class Halves:
    """The plant in both coordinates, J (n, n), and by what the rows of rates are multiplied so that they are near one (n,)."""

    regulator: GeneralisedPlant
    filter: GeneralisedPlant
    joint: FloatArray
    weights: dict[str, FloatArray]

    def half(self, name: str) -> GeneralisedPlant:
        """Of Y or of X."""
        return self.regulator if name == "Y" else self.filter


def halves_of(plant: GeneralisedPlant, frame: Frame, weights: dict[str, FloatArray] | None = None) -> Halves:
    """The plant as given, in the coordinates of the frame; `weights` are its own, or those of another piece of it."""
    regulator = plant.scaled(replace(frame, states=frame.regulator))
    observer = plant.scaled(replace(frame, states=frame.filter))
    weights = weights or {"Y": _weights(regulator, "B"), "X": _weights(observer, "C")}
    return Halves(regulator, observer, frame.joint, weights)


def _weights(plant: GeneralisedPlant, used: Literal["B", "C"]) -> FloatArray:
    """One over the root of the speed of every state: its own, and what disturbances, costs and the gains of its half give it.

    What measured noise tells of the disturbances (E F'), and inputs of the costs (Cz'Dzu), is taken off by the gains.
    """
    A, B, C = (middle(getattr(plant, key), plant.denominator) for key in ("A", "B", "C"))
    E, F, Cz, Dzu = (gathered(plant, key) for key in ("E", "F", "Cz", "Dzu"))
    E, Cz = E - E @ np.linalg.pinv(F) @ F, Cz - Dzu @ np.linalg.pinv(Dzu) @ Cz
    through = (B**2).sum(axis=1) if used == "B" else (C**2).sum(axis=0)
    speed = np.abs(np.diag(A)) + (E**2).sum(axis=1) + (Cz**2).sum(axis=0) + through
    return np.asarray(1.0 / np.sqrt(np.where(speed > 0.0, speed, 1.0)))
