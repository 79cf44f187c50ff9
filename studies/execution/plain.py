"""Values as strict JSON can hold them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from studies.claim import JsonValue


def plain(value: Any, where: str) -> JsonValue:
    """``value`` with numpy scalars, arrays, tuples and enumerations replaced by numbers, lists and texts.

    NaN becomes null and infinities the texts "inf" and "-inf", as JSON has none. Raises TypeError that names ``where``
    for anything else: a result that cannot be stored is a mistake of the study.
    """
    if value is None or (isinstance(value, str | bool | int) and not isinstance(value, Enum)):
        return value
    if isinstance(value, Enum):
        return plain(value.value, where)
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist(), where)
    if isinstance(value, float):
        if math.isnan(value):
            return None
        return value if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(entry, f"{where}.{key}") for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry, where) for entry in value]
    raise TypeError(f"{where} is a {type(value).__name__}; only numbers, texts, lists and dictionaries can be stored")
