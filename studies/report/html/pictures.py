"""Figures as data URIs, so that the page needs no other file."""

from __future__ import annotations

import re
from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path

# Drawings of tens of thousands of points are vectors of megabytes; up to here the sharper form is worth its size.
LARGEST_SVG = 160_000
POINT = 96.0 / 72.0  # CSS pixels


@dataclass(frozen=True)
class Picture:
    """An image source and its size in CSS pixels."""

    uri: str
    width: int
    height: int


def picture(folder: Path, name: str) -> Picture:
    """``name.svg`` of ``folder``, or ``name.png`` when the SVG is large and the PNG smaller; ValueError for a foreign SVG."""
    svg, png = (folder / f"{name}.{kind}" for kind in ("svg", "png"))
    content = svg.read_bytes()
    head = content[:2000].decode(errors="replace")
    size = [re.search(rf'<svg[^>]*\s{side}="([\d.]+)pt"', head) for side in ("width", "height")]
    if size[0] is None or size[1] is None:
        raise ValueError(f"{svg}: no width and height in points")
    width, height = (round(float(found[1]) * POINT) for found in size if found is not None)
    kind = "svg+xml"
    if len(content) > LARGEST_SVG and png.stat().st_size < len(content):
        content, kind = png.read_bytes(), "png"
    return Picture(f"data:image/{kind};base64,{b64encode(content).decode()}", width, height)
