"""Why an estimate is weaker than usual: bit flags that a step returns beside it."""

from __future__ import annotations

from enum import IntFlag
from typing import Any

import numpy as np
import numpy.typing as npt

FlagArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]


class Flag(IntFlag):
    """One bit a reason; a step returns them summed in an integer array, 0 where nothing is wrong.

    `Flag(int(step.flags[2]))` names the reasons of one entry.
    """

    NONE = 0
    MISSING_MEASUREMENT = 1  # not finite: the entry coasts on the kinematics
    STALE_MEASUREMENT = 2  # repeated for too long: the entry coasts
    MISSING_INPUT = 4  # not finite: held at the last finite one
    MISSING_PARAMETER = 8  # not finite: held at the last finite one
    PARAMETER_OUT_OF_RANGE = 16  # outside the certified range: clipped to it
    RATE_OUT_OF_RANGE = 32  # faster than the certified rates: used, without the guarantee
    RESET = 64  # the state was set anew: by `reset`, or because it had left the representable range


def raise_flag(flags: FlagArray, where: npt.NDArray[Any], flag: Flag) -> None:
    """Adds `flag` to the entries `where`, in place."""
    flags[where] |= int(flag)
