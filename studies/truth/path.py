"""Paths for the driver: pieces in a row, as curvature over the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from estimators.arrays import FloatArray
from studies.drives.quantities import Length
from studies.truth.course import PATH_GRID
from synthesis.toml_file import StrictTable

BLEND = 5.0
"""m over which the curvature changes between pieces: roads are no compasses, and drivers cannot jump."""
_NEEDS: dict[str, tuple[set[str], set[str]]] = {
    "straight": ({"length"}, set()),
    "arc": ({"radius", "angle_deg"}, set()),
    "lane-change": ({"length", "offset"}, set()),
    "slalom": ({"length", "wavelength", "offset"}, set()),
}


class PathPiece(StrictTable):
    """straight: ``length``. arc: ``radius`` and ``angle_deg``, positive to the left. lane-change: ``offset`` sideways
    within ``length``, k = 2 pi w/L^2 sin(2 pi s/L). slalom: y = offset sin(2 pi s/wavelength), k = y''. ``side`` turns
    the last two to the right.
    """

    kind: Literal["straight", "arc", "lane-change", "slalom"]
    length: Length | None = None
    radius: Length | None = None
    angle_deg: float | None = None
    offset: Length | None = None
    wavelength: Length | None = None
    side: Literal["left", "right"] = "left"
    repeat: int = Field(default=1, ge=1, le=1000)

    @model_validator(mode="after")
    def _keys_fit_kind(self) -> PathPiece:
        needs, may = _NEEDS[self.kind]
        given = self.model_fields_set - {"kind", "repeat", "side"}
        for name in sorted(needs - given):
            raise ValueError(f"{self.kind} needs {name}; add it")
        for name in sorted(given - needs - may):
            raise ValueError(f"{self.kind} takes no {name}; it takes {', '.join(sorted(needs))}")
        return self

    def curvature(self) -> FloatArray:
        """1/m on the grid."""
        if self.kind == "arc" and self.radius and self.angle_deg is not None:
            angle = math.radians(self.angle_deg)
            return np.full(max(1, round(abs(angle) * self.radius / PATH_GRID)), math.copysign(1.0 / self.radius, angle))
        length = self.length or 0.0
        s = PATH_GRID * (np.arange(max(1, round(length / PATH_GRID))) + 0.5)
        sign = 1.0 if self.side == "left" else -1.0
        if self.kind == "lane-change" and self.offset:
            return np.asarray(sign * 2.0 * math.pi * self.offset / length**2 * np.sin(2.0 * math.pi * s / length))
        if self.kind == "slalom" and self.offset and self.wavelength:
            wave = 2.0 * math.pi / self.wavelength
            return np.asarray(-sign * self.offset * wave**2 * np.sin(wave * s))
        return np.zeros_like(s)


def curvature(pieces: Sequence[PathPiece]) -> FloatArray:
    """Curvature over the way (m, on `PATH_GRID`), blended over `BLEND`; straight on after the end."""
    row = np.concatenate([np.tile(piece.curvature(), piece.repeat) for piece in pieces])
    window = round(BLEND / PATH_GRID)
    padded = np.concatenate([np.zeros(window), row, np.zeros(window)])
    return np.convolve(padded, np.full(window, 1.0 / window), mode="same")[window:]
