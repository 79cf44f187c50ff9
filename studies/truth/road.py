"""The road under every wheel: friction that changes with place and time, corner by corner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from estimators.arrays import FloatArray
from estimators.vehicle import CORNERS
from synthesis.errors import SpecError

SURFACES = {"dry": 1.0, "wet": 0.6, "snow": 0.35, "ice": 0.2}
"""Friction by name: ordinary values; the manoeuvre files of the papers give numbers."""
_EVER = 1e12


@dataclass(frozen=True)
class Zone:
    """A stretch of road or time in which some wheels have another friction; later zones lie over earlier ones.

    Places are those of each wheel's centre along its way, m, with the centre of gravity at 0 at the start. The change
    takes `blend` (m for places, s for times), the length of a contact patch or so: the tire is on both surfaces then.
    """

    friction: float
    corners: tuple[bool, bool, bool, bool] = (True, True, True, True)
    from_place: float = -_EVER
    to_place: float = _EVER
    from_time: float = -_EVER
    to_time: float = _EVER
    blend: float = 0.15


class Roads:
    """Friction (4, B) of B cars: a base for each, and their zones, padded to the same number."""

    def __init__(self, base: npt.ArrayLike, zones: Sequence[Sequence[Zone]]) -> None:
        self.base: FloatArray = np.ones((len(CORNERS), 1)) * np.asarray(base, dtype=np.float64)
        if not (np.isfinite(self.base).all() and (self.base > 0).all()):
            raise SpecError("road friction must be finite and above 0")
        most = max((len(z) for z in zones), default=0)
        nothing = Zone(1.0, (False, False, False, False))
        rows = [[*z, *[nothing] * (most - len(z))] for z in zones]
        self._zones = [_Layer([row[k] for row in rows]) for k in range(most)]

    def friction(self, place: FloatArray, time: float) -> FloatArray:
        """At the places (4, B), m, of the wheels and one time, s."""
        out = self.base
        for zone in self._zones:
            out = out + zone.share(place, time) * (zone.friction - out)
        return out


class _Layer:
    """One zone of each car."""

    def __init__(self, zones: Sequence[Zone]) -> None:
        def column(name: str) -> FloatArray:
            return np.array([getattr(z, name) for z in zones], dtype=np.float64)

        self.friction = column("friction")
        self.corners = np.array([z.corners for z in zones], dtype=np.float64).T
        self._from, self._to, self._blend = column("from_place"), column("to_place"), column("blend")
        self._since, self._until = column("from_time"), column("to_time")
        self._placed = bool((self._from > -_EVER).any() or (self._to < _EVER).any())

    def share(self, place: FloatArray, time: float) -> FloatArray:
        """How much of the contact patch is in the zone, 0 to 1."""
        inside = self.corners * _over(time - self._since, self._blend) * _over(self._until - time, self._blend)
        if self._placed:
            inside = inside * _over(place - self._from, self._blend) * _over(self._to - place, self._blend)
        return inside


def _over(way: FloatArray, blend: FloatArray) -> FloatArray:
    out: FloatArray = np.minimum(np.maximum(way / blend + 0.5, 0.0), 1.0)
    return out
