"""How a drive file is mended, in words: signs, factors, and columns that hold another angle than their name says."""

from __future__ import annotations

from collections.abc import Sequence

from studies.drives.drive_file import WHEEL_SPEEDS, DriveFile

RATIOS = (5.0, 40.0)
"""What a steering wheel turns over what the road wheels seem to: gears have 10 to 25, and understeer looks like more."""


def flip(drive: DriveFile, names: Sequence[str]) -> str:
    """The other sign for the signals of these names."""
    signs = {"negative" if drive.signals[name].sign == "positive" else "positive" for name in names}
    return f'sign = "{signs.pop()}" for {keys(names)}' if len(signs) == 1 else f"the other sign for {keys(names)}"


def keys(names: Sequence[str]) -> str:
    """The keys of the signals of these names in a drive file."""
    return "signals.wheel_speed_*" if list(names) == list(WHEEL_SPEEDS) else "signals." + ", ".join(names)


def times_too_large(names: Sequence[str], factor: float) -> str:
    """What reads so many times the truth."""
    if list(names) == ["hand_wheel"] and 1.0 / RATIOS[1] < factor < 1.0 / RATIOS[0]:
        return "signals.hand_wheel holds the angle of the road wheels: name it steering"
    if list(names) == ["steering"] and RATIOS[0] < factor < RATIOS[1]:
        return (
            "signals.steering holds the angle of the steering wheel: name it hand_wheel, with vehicle.steering_ratio "
            f"(near {factor:.2g})"
        )
    return f"{keys(names)} read {factor:.3g} times too large: divide factor by {factor:.3g}"
