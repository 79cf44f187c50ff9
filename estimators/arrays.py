"""The types of numpy arrays in signatures, by what their entries are."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

AnyArray: TypeAlias = NDArray[Any]
FloatArray: TypeAlias = NDArray[np.float64]
ComplexArray: TypeAlias = NDArray[np.complex128]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int64]  # counts
IndexArray: TypeAlias = NDArray[np.intp]  # places in another array
FlagArray: TypeAlias = NDArray[np.int32]  # sums of `estimators.faults.Flag`
