"""Why an estimate is weaker than usual: bit flags that a step returns beside it."""

from __future__ import annotations

from enum import IntFlag

from estimators.arrays import AnyArray, FlagArray


class Flag(IntFlag):
    """One bit a reason; a step returns them summed in an integer array, 0 where nothing is wrong.

    `Flag(int(step.flags[2]))` names the reasons of one entry.

    >>> step_flags = int(Flag.MISSING_INPUT | Flag.GATED)
    >>> Flag.GATED in Flag(step_flags)
    True
    """

    NONE = 0
    MISSING_MEASUREMENT = 1  # not finite: the entry coasts on the kinematics
    STALE_MEASUREMENT = 2  # repeated for too long: the entry coasts
    MISSING_INPUT = 4  # not finite: held at the last finite one
    MISSING_PARAMETER = 8  # not finite: held at the last finite one
    PARAMETER_OUT_OF_RANGE = 16  # outside the certified range or set: moved to its border
    RATE_OUT_OF_RANGE = 32  # faster than the certified rates: used, without the guarantee
    RESET = 64  # the state was set anew: by `reset`, because it was lost, or had left the representable range
    WHEEL_STOPPED = 128  # a wheel does not turn though the car moves: locked, or its sensor is dead
    HIGH_SLIP = 256  # a wheel's surface leaves the car: not used
    GATED = 512  # further from the estimate than its model explains: not used
    STANDING = 1024  # standstill was recognised: speeds and yaw rate are zero
    NOT_EXCITED = 2048  # nothing excites a parameter (no steering, no side force): it is not observable, and keeps


DRIVING = Flag.STANDING | Flag.NOT_EXCITED
"""What the car does, not what is wrong with a signal: most of a drive carries one of these."""


def raise_flag(flags: FlagArray, where: AnyArray, flag: Flag) -> None:
    """Adds `flag` to the entries `where`, in place."""
    flags[where] |= int(flag)
