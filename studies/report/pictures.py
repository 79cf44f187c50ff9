"""Drawings inside the page: each in the sharpest form that the weight of the whole page allows."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

BUDGET = 2_900_000  # bytes of all drawings, before base64 makes four of three: the page stays below 5 MB
LARGEST_SVG = 160_000  # drawings of tens of thousands of points are vectors of megabytes
SCALES = (1.0, 0.8, 0.65, 0.5)  # of the pixels that a drawing was stored with
COLOURS = 32  # of a page's copy: those of the curves and their soft edges
FREQUENT = 10  # of these colours are the most frequent ones
APART = 12  # of 255: nearer colours are one
POINT = 96.0 / 72.0  # CSS pixels


@dataclass(frozen=True)
class Picture:
    """An image source and its size in CSS pixels."""

    uri: str
    width: int
    height: int


def pictures(drawings: Sequence[tuple[Path, str]], budget: int = BUDGET) -> dict[tuple[Path, str], Picture]:
    """A picture for each ``name`` in its folder, where ``name.svg`` and ``name.png`` are; together about ``budget`` bytes.

    Small drawings come first: what they leave of their equal share goes to the larger ones.
    """
    left, made = budget, {}
    order = sorted(set(drawings), key=lambda drawing: ((drawing[0] / f"{drawing[1]}.png").stat().st_size, drawing))
    for count, drawing in zip(range(len(order), 0, -1), order, strict=True):
        content, kind = _form(*drawing, left // count)
        left = max(left - len(content), 0)
        made[drawing] = _picture(*drawing, content, kind)
    return made


def picture(folder: Path, name: str, share: int = LARGEST_SVG) -> Picture:
    """One drawing in at most ``share`` bytes where a form is that small; its PNG is read where its SVG is too large.

    Raises ValueError for a foreign SVG.
    """
    return _picture(folder, name, *_form(folder, name, share))


def _form(folder: Path, name: str, share: int) -> tuple[bytes, str]:
    vector = (folder / f"{name}.svg").read_bytes()
    if len(vector) <= min(share, LARGEST_SVG):
        return vector, "svg+xml"
    pixels = (folder / f"{name}.png").read_bytes()
    if len(pixels) <= share:
        return pixels, "png"
    content = b""
    for scale in SCALES if len(pixels) < 4 * share else SCALES[1:]:
        content = _smaller(pixels, scale, share)
        if len(content) <= share:
            break
    return content, "webp"


def _smaller(pixels: bytes, scale: float, share: int) -> bytes:
    """As WebP: curves in few colours without loss, or where that is too large (maps, noise) with loss."""
    from PIL import Image

    def saved(image: Image.Image, quality: int, lossless: bool) -> bytes:
        file = BytesIO()
        image.save(file, "WEBP", method=3, quality=quality, lossless=lossless)
        return file.getvalue()

    image = Image.open(BytesIO(pixels)).convert("RGB")
    if scale != 1.0:
        size = (round(image.width * scale), round(image.height * scale))
        image = image.resize(size, Image.Resampling.LANCZOS)
    exact = saved(_few(image), 50, lossless=True)
    return exact if len(exact) <= share else min(exact, saved(image, 40, lossless=False), key=len)


def _few(image: Any) -> Any:
    """The drawing in few colours: the most frequent ones (paper, grid, words), and those that cover all that occur (curves)."""
    from PIL import Image

    frequent = [
        colour for _, colour in sorted(image.getcolors(image.width * image.height), reverse=True)[: 4 * FREQUENT]
    ]
    covering = image.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).getpalette()
    chosen: list[tuple[int, ...]] = []
    for most, colours in ((FREQUENT, frequent), (COLOURS, zip(*[iter(covering)] * 3, strict=True))):
        for colour in colours:
            if len(chosen) < most and all(_distance(colour, other) >= APART for other in chosen):
                chosen.append(colour)
    palette = Image.new("P", (1, 1))
    palette.putpalette([value for colour in chosen + chosen[:1] * (256 - len(chosen)) for value in colour])
    return image.quantize(palette=palette, dither=Image.Dither.NONE).convert("RGB")


def _distance(a: tuple[int, ...], b: tuple[int, ...]) -> int:
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


def _picture(folder: Path, name: str, content: bytes, kind: str) -> Picture:
    path = folder / f"{name}.svg"
    with path.open("rb") as file:
        head = file.read(2000).decode(errors="replace")
    size = [re.search(rf'<svg[^>]*\s{side}="([\d.]+)pt"', head) for side in ("width", "height")]
    if size[0] is None or size[1] is None:
        raise ValueError(f"{path}: no width and height in points")
    width, height = (round(float(found[1]) * POINT) for found in size if found is not None)
    return Picture(f"data:image/{kind};base64,{b64encode(content).decode()}", width, height)
