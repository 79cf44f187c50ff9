"""Arrays that are used again: fresh ones of a megabyte cost more in page faults than the arithmetic on them."""

from __future__ import annotations

import math

import numpy as np

from estimators.arrays import FloatArray


class Workspace:
    """Memory by name. What it returns is good until the same name is asked for again, and holds anything."""

    def __init__(self) -> None:
        self._blocks: dict[str, FloatArray] = {}

    def __call__(self, name: str, shape: tuple[int, ...]) -> FloatArray:
        """A contiguous array of that shape; its content is left over."""
        size = math.prod(shape)
        block = self._blocks.get(name)
        if block is None or block.size < size:
            block = self._blocks[name] = np.empty(size)
        return block[:size].reshape(shape)
