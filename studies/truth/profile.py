"""Profiles over time and paths over the way: pieces in a row, as tables on a uniform grid, linear between its points.

Each piece starts from the value at which the last one ended; the truth records what was applied.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence, Set
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from estimators.arrays import FloatArray
from studies.drives import quantities
from studies.drives.quantities import Duration, Length
from synthesis.toml_file import StrictTable

GRID = 0.005  # s, spacing of the tables
PATH_GRID = 0.25  # m, spacing of curvature tables
_SHARE = re.compile(r"[-+]?[0-9]*\.?[0-9]+( ?%)?")
_NEEDS: dict[str, tuple[set[str], set[str]]] = {
    "hold": ({"time"}, {"to"}), "ramp": ({"time", "to"}, set()), "smooth": ({"time", "to"}, set()),
    "sine": ({"time", "amplitude", "period"}, set()), "half-sine": ({"time", "amplitude"}, set()),
    "pulses": ({"time", "amplitude", "period"}, {"duty"}), "table": ({"times", "values", "unit"}, set()),
}  # fmt: skip
"""Keys that each kind must have, and those that it may have."""
BLEND = 5.0  # m over which the curvature changes between pieces: roads are no compasses, and drivers cannot jump
_PATH_NEEDS = {
    "straight": {"length"}, "arc": {"radius", "angle_deg"}, "lane-change": {"length", "offset"},
    "slalom": {"length", "wavelength", "offset"},
}  # fmt: skip


def _check_keys(kind: str, given: Set[str], needs: Set[str], may: Set[str]) -> None:
    for name in sorted(needs - given):
        raise ValueError(f"{kind} needs {name}; add it")
    for name in sorted(given - needs - may):
        raise ValueError(f"{kind} takes no {name}; it takes {', '.join(sorted(needs | may))}")


class Piece(StrictTable):
    """One piece; values are quantities with a unit.

    hold: stays, after a jump to ``to`` if given. ramp: linear to ``to``. smooth: half a cosine to ``to``. sine: starts at
    zero phase around the present value. half-sine: up and back. pulses: the present value plus ``amplitude`` during the
    first ``duty`` of each ``period``. table: linear between ``times`` (s, from the start of the piece) and ``values``.
    """

    kind: Literal["hold", "ramp", "smooth", "sine", "half-sine", "pulses", "table"]
    time: Duration | None = None
    to: str | None = None
    amplitude: str | None = None
    period: Duration | None = None
    duty: float = Field(default=0.5, gt=0.0, lt=1.0)
    times: list[float] | None = None
    values: list[float] | None = None
    unit: str | None = None

    @model_validator(mode="after")
    def _keys_fit_kind(self) -> Piece:
        _check_keys(self.kind, self.model_fields_set - {"kind"}, *_NEEDS[self.kind])
        if self.kind == "table":
            times, values = np.array(self.times), np.array(self.values)
            if times.size < 2 or times.size != values.size or times[0] != 0.0 or (np.diff(times) <= 0).any():
                raise ValueError("table: times must start at 0 and grow, with as many values")
        return self

    @property
    def duration(self) -> float:
        """s."""
        return self.times[-1] if self.times is not None else float(self.time or 0.0)

    def value(self, t: FloatArray, start: float, unit: str) -> FloatArray:
        """At ``t`` seconds from the start of the piece, from the value ``start``, in ``unit``; clipped to the piece."""
        T = self.duration
        t = np.clip(t, 0.0, T)
        if self.times is not None and self.values is not None:
            scale = to_si(f"1 {self.unit}".strip(), unit)
            return np.asarray(np.interp(t, self.times, np.array(self.values) * scale))
        to = start if self.to is None else to_si(self.to, unit)
        if self.kind == "hold":
            return np.full_like(t, to)
        if self.kind == "ramp":
            return np.asarray(start + (to - start) * t / T)
        if self.kind == "smooth":
            return np.asarray(start + (to - start) * 0.5 * (1.0 - np.cos(np.pi * t / T)))
        size = to_si(self.amplitude, unit)
        if self.kind == "half-sine":
            return np.asarray(start + size * np.sin(np.pi * t / T))
        cycles = t / (self.period or T)
        if self.kind == "sine":
            return np.asarray(start + size * np.sin(2.0 * np.pi * cycles))
        return np.asarray(start + size * (cycles % 1.0 < self.duty))

    def end(self, start: float, unit: str) -> float:
        """The value that the next piece starts from; pulses leave none."""
        return start if self.kind == "pulses" else float(self.value(np.array([self.duration]), start, unit)[0])


def to_si(text: object, unit: str) -> float:
    """A quantity as in drive files; for ``share`` a number between -1 and 1 in quotes, or percent: "0.5", "50 %"."""
    if unit != "share":
        return quantities.to_si(text, unit)
    if not isinstance(text, str) or not _SHARE.fullmatch(text):
        raise ValueError(f'\'{quantities.short(str(text))}\' is no share; write it like "0.5" or "50 %"')
    value = float(text.rstrip(" %")) / (100.0 if text.endswith("%") else 1.0)
    if not -1.0 <= value <= 1.0:
        raise ValueError(f"'{quantities.short(text)}' is out of range; a share is between -1 and 1")
    return value


def _pieces(unit: str) -> AfterValidator:
    """Refuses pieces with a value that is no quantity in a unit of ``unit``, by number and key."""

    def check(pieces: list[Piece]) -> list[Piece]:
        for k, piece in enumerate(pieces):
            given = {"to": piece.to, "amplitude": piece.amplitude}
            given["unit"] = None if piece.unit is None else f"1 {piece.unit}".strip()
            for name, text in given.items():
                try:
                    _ = None if text is None else to_si(text, unit)
                except ValueError as error:
                    raise ValueError(f"piece[{k}].{name}: {error}") from None
        return pieces

    return AfterValidator(check)


Angles = Annotated[list[Piece], _pieces("rad")]
Torques = Annotated[list[Piece], _pieces("N*m")]
Speeds = Annotated[list[Piece], _pieces("m/s")]
Shares = Annotated[list[Piece], _pieces("share")]


def sampled(pieces: Sequence[Piece], unit: str, duration: float, start: float = 0.0, grid: float = GRID) -> FloatArray:
    """The profile at 0, grid, 2 grid, ... beyond ``duration``, in ``unit``; after the last piece its value stays."""
    t = grid * np.arange(int(np.ceil(duration / grid - 1e-9)) + 2)
    out, begin = np.full(t.shape, start), 0.0
    for piece in pieces:
        inside = t >= begin - 1e-9
        out[inside] = piece.value(np.asarray(t[inside] - begin, dtype=np.float64), start, unit)
        begin += piece.duration
        start = piece.end(start, unit)
        out[t >= begin - 1e-9] = start
    return out


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
        _check_keys(self.kind, self.model_fields_set - {"kind", "repeat", "side"}, _PATH_NEEDS[self.kind], set())
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
