"""The road in a manoeuvre file: friction or surface, zones of other friction, grade and bank."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from estimators.errors import unknown
from estimators.vehicle import CORNERS
from studies.drives.quantities import Offset, to_si
from studies.truth.profile import Piece, check_units
from studies.truth.road import SURFACES, Zone
from synthesis.toml_file import StrictTable

_GROUPS = {
    "all": CORNERS, "left": ("fl", "rl"), "right": ("fr", "rr"), "front": ("fl", "fr"), "rear": ("rl", "rr"),
    **{corner: (corner,) for corner in CORNERS},
}  # fmt: skip


def _angles(pieces: list[Piece]) -> list[Piece]:
    check_units(pieces, "rad")
    return pieces


def _known(corners: str) -> str:
    if corners not in _GROUPS:
        raise ValueError(unknown("corners", corners, _GROUPS))
    return corners


def _place(text: str) -> str:
    to_si(text, "m")
    return text


def _friction(friction: float | None, surface: str | None) -> float:
    if (friction is None) == (surface is None):
        raise ValueError("give friction (such as 0.3) or surface (dry, wet, snow, ice), one of the two")
    return SURFACES[surface] if surface is not None else float(friction or 0.0)


class ZoneTable(StrictTable):
    """A stretch of place (of each wheel along its way) or time, with its own friction for some wheels."""

    corners: Annotated[str, AfterValidator(_known)] = "all"
    friction: float | None = Field(default=None, gt=0.0, le=2.0)
    surface: Literal["dry", "wet", "snow", "ice"] | None = None
    from_place: Annotated[str, AfterValidator(_place)] | None = None
    to_place: Annotated[str, AfterValidator(_place)] | None = None
    from_time: Offset | None = None
    to_time: Offset | None = None
    blend: float = Field(default=0.15, gt=0.0)  # m, or s for times

    @model_validator(mode="after")
    def _one_friction(self) -> ZoneTable:
        _friction(self.friction, self.surface)
        return self

    def zone(self) -> Zone:
        """For the road."""
        given = {name: to_si(text, "m") for name in ("from_place", "to_place") if (text := getattr(self, name))}
        given |= {name: value for name in ("from_time", "to_time") if (value := getattr(self, name)) is not None}
        chosen = _GROUPS[self.corners]
        a, b, c, d = (corner in chosen for corner in CORNERS)
        return Zone(_friction(self.friction, self.surface), (a, b, c, d), blend=self.blend, **given)


class Road(StrictTable):
    """Friction (1 is dry asphalt) or surface everywhere, zones above it (later ones on top), grade and bank over time."""

    friction: float | None = Field(default=None, gt=0.0, le=2.0)
    surface: Literal["dry", "wet", "snow", "ice"] | None = None
    zone: list[ZoneTable] = Field(default_factory=list)
    grade: Annotated[list[Piece], AfterValidator(_angles)] = Field(default_factory=list)
    bank: Annotated[list[Piece], AfterValidator(_angles)] = Field(default_factory=list)

    @model_validator(mode="after")
    def _one_friction(self) -> Road:
        if self.friction is not None or self.surface is not None:
            _friction(self.friction, self.surface)
        return self

    @property
    def coefficient(self) -> float:
        """Friction where no zone is; dry if nothing is said."""
        return (
            SURFACES["dry"]
            if self.friction is None and self.surface is None
            else _friction(self.friction, self.surface)
        )

    def zones(self) -> tuple[Zone, ...]:
        """For the road."""
        return tuple(table.zone() for table in self.zone)
