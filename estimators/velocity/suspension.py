"""Compliance of the suspension: how fast a wheel moves against the body under its tire force, P3 (14)-(15).

    M_u psi'' + C_q psi' + K_q psi = F_q,    V_xc = Vbar_xc + psi_x',   V_yc = Vbar_yc + psi_y'

With F_q the tire force on the unsprung mass, in the body frame, psi is the displacement of the wheel against the body:
adding psi' to the velocity of the body at the corner gives that of the wheel centre, which belongs into slips. For the
centre of gravity psi' must not be added (P3 notes 9 item 11).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import any_missing, batch, entries, mask, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.memory import Memory
from estimators.phi import phi_of
from estimators.signals import limits


@dataclass(frozen=True)
class SuspensionParameters:
    """Per corner; the defaults are P3 Table I.

    Raises:
        EstimatorError: names every value that is not finite and above zero (damping: zero or above).
    """

    stiffness_x: float = 3e5  # K_x, N/m
    stiffness_y: float = 7e5  # K_y, N/m
    damping_x: float = 3730.0  # C_x, N s/m
    damping_y: float = 3730.0  # C_y, N s/m; the paper has one value for both
    unsprung_mass: float = 46.0  # M_u, kg

    def __post_init__(self) -> None:
        bad = []
        for name, unit in (("stiffness_x", "N/m"), ("stiffness_y", "N/m"), ("unsprung_mass", "kg")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                bad.append(f"{name} = {value!r} {unit} must be above zero")
        for name in ("damping_x", "damping_y"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                bad.append(f"{name} = {value!r} N s/m must not be negative")
        if bad:
            raise EstimatorError("suspension parameters: " + "; ".join(bad))


class SuspensionStep(NamedTuple):
    """Motion of the wheels against the body at the end of the sample, body frame."""

    displacement: FloatArray  # (..., 4, 2) psi_x, psi_y, m
    velocity: FloatArray  # (..., 4, 2) m/s, to be added to the velocity of the body at the corner
    flags: FlagArray  # (..., 4)


class SuspensionCompliance(Memory):
    """The two oscillators of every corner, exact for forces held over a sample.

    Raises:
        EstimatorError: a sample time that is not above zero, a batch without entries.
    """

    memory = ("state", "force")

    def __init__(self, parameters: SuspensionParameters, sample_time: float, batch_shape: tuple[int, ...] = ()) -> None:
        step = setting(sample_time, "sample_time", "s")
        p = self.parameters = parameters
        self.batch_shape = batch(batch_shape)
        pairs = [
            _held(k, c, p.unsprung_mass, step) for k, c in ((p.stiffness_x, p.damping_x), (p.stiffness_y, p.damping_y))
        ]
        self._A, self._B = (np.stack(part) for part in zip(*pairs, strict=True))  # (2, 2, 2), (2, 2)
        self.state: FloatArray = np.zeros((*self.batch_shape, 4, 2, 2))  # corner, direction, [psi, psi']
        self.force: FloatArray = np.zeros((*self.batch_shape, 4, 2))

    def step(self, force_x: npt.ArrayLike, force_y: npt.ArrayLike) -> SuspensionStep:
        """Forces on the tires (..., 4), N, body frame, held over the sample; a missing one is held and flagged.

        Raises:
            EstimatorError: another shape.
        """
        shape = (*self.batch_shape, 4)
        force = np.stack([entries(force_x, shape, "force_x"), entries(force_y, shape, "force_y")], axis=-1)
        good: BoolArray = np.absolute(force) <= limits.FORCE
        flags: FlagArray = np.zeros(shape, dtype=np.int32)
        raise_flag(flags, any_missing(~good, shape), Flag.MISSING_INPUT)
        self.force = np.where(good, force, self.force)
        self.state = np.einsum("dij,...dj->...di", self._A, self.state) + self._B * self.force[..., None]
        return SuspensionStep(self.state[..., 0].copy(), self.state[..., 1].copy(), flags)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Puts the entries `where` (mask of the batch shape; None: all) to rest.

        Raises:
            EstimatorError: a mask of another shape.
        """
        chosen = mask(where, self.batch_shape, "where")
        self.state[chosen] = 0.0
        self.force[chosen] = 0.0


def _held(stiffness: float, damping: float, mass: float, time: float) -> tuple[FloatArray, FloatArray]:
    """A_d = I + M phi(M), B_d = T phi(M) b of M = T [0 1; -k/m -c/m], b = [0, 1/m]."""
    M = time * np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]])
    integral = phi_of(M)
    return np.eye(2) + M @ integral, time * integral @ np.array([0.0, 1.0 / mass])
