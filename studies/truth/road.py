"""The road under every wheel: friction that changes with place and time, corner by corner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, Field, model_validator

from estimators.arrays import FloatArray
from estimators.errors import unknown
from estimators.vehicle import CORNERS
from studies.drives.quantities import Offset, Place
from studies.truth.layout import column
from studies.truth.profile import Angles
from synthesis.errors import SpecError
from synthesis.toml_file import StrictTable

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
        self.friction = column(zones, "friction")
        self.corners = column(zones, "corners")
        self._from, self._to, self._blend = (column(zones, name) for name in ("from_place", "to_place", "blend"))
        self._since, self._until = column(zones, "from_time"), column(zones, "to_time")
        self._placed = bool((self._from > -_EVER).any() or (self._to < _EVER).any())

    def share(self, place: FloatArray, time: float) -> FloatArray:
        """How much of the contact patch is in the zone, 0 to 1."""
        inside = self.corners * _over(time - self._since, self._blend) * _over(self._until - time, self._blend)
        if self._placed:
            inside = inside * _over(place - self._from, self._blend) * _over(self._to - place, self._blend)
        return inside


def _over(way: FloatArray, blend: FloatArray) -> FloatArray:
    return np.asarray(np.minimum(np.maximum(way / blend + 0.5, 0.0), 1.0))


_GROUPS = {
    "all": CORNERS, "left": ("fl", "rl"), "right": ("fr", "rr"), "front": ("fl", "fr"), "rear": ("rl", "rr"),
    **{corner: (corner,) for corner in CORNERS},
}  # fmt: skip


def _known(corners: str) -> str:
    if corners not in _GROUPS:
        raise ValueError(unknown("corners", corners, _GROUPS))
    return corners


def _friction(friction: float | None, surface: str | None) -> float:
    if (friction is None) == (surface is None):
        raise ValueError("give friction (such as 0.3) or surface (dry, wet, snow, ice), one of the two")
    return SURFACES[surface] if surface is not None else float(friction or 0.0)


class ZoneTable(StrictTable):
    """A stretch of place (of each wheel along its way) or time, with its own friction for some wheels."""

    corners: Annotated[str, AfterValidator(_known)] = "all"
    friction: float | None = Field(default=None, gt=0.0, le=2.0)
    surface: Literal["dry", "wet", "snow", "ice"] | None = None
    from_place: Place | None = None
    to_place: Place | None = None
    from_time: Offset | None = None
    to_time: Offset | None = None
    blend: float = Field(default=0.15, gt=0.0)  # m, or s for times

    @model_validator(mode="after")
    def _one_friction(self) -> ZoneTable:
        _friction(self.friction, self.surface)
        return self

    def zone(self) -> Zone:
        """For the road."""
        ends = ("from_place", "to_place", "from_time", "to_time")
        given = {name: value for name in ends if (value := getattr(self, name)) is not None}
        chosen = _GROUPS[self.corners]
        a, b, c, d = (corner in chosen for corner in CORNERS)
        return Zone(_friction(self.friction, self.surface), (a, b, c, d), blend=self.blend, **given)


class Road(StrictTable):
    """Friction (1 is dry asphalt) or surface everywhere, zones above it (later ones on top), grade and bank over time."""

    friction: float | None = Field(default=None, gt=0.0, le=2.0)
    surface: Literal["dry", "wet", "snow", "ice"] | None = None
    zone: list[ZoneTable] = Field(default_factory=list)
    grade: Angles = Field(default_factory=list)
    bank: Angles = Field(default_factory=list)

    @model_validator(mode="after")
    def _one_friction(self) -> Road:
        if self.friction is not None or self.surface is not None:
            _friction(self.friction, self.surface)
        return self

    @property
    def coefficient(self) -> float:
        """Friction where no zone is; dry if nothing is said."""
        given = self.friction is not None or self.surface is not None
        return _friction(self.friction, self.surface) if given else SURFACES["dry"]

    def zones(self) -> tuple[Zone, ...]:
        """For the road."""
        return tuple(table.zone() for table in self.zone)
