"""Verdicts that follow from a comparison, for the kinds of claim that `studies.claim` has no comparison for."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from studies.claim import ClaimVerdict, agrees, reproduced


def derived(holds: bool) -> ClaimVerdict:
    """DERIVED if a relation that the paper does not state holds as derived, else NOT_REPRODUCED."""
    return ClaimVerdict.DERIVED if holds else ClaimVerdict.NOT_REPRODUCED


def erratum(printed_holds: bool, corrected_holds: bool) -> ClaimVerdict:
    """ERRATUM only if the printed form fails and the corrected one holds; a printed form that holds is REPRODUCED."""
    return reproduced(printed_holds, ClaimVerdict.ERRATUM if corrected_holds else ClaimVerdict.NOT_REPRODUCED)


def under_specified(spread: float, smallest: float, holds: bool = True) -> ClaimVerdict:
    """UNDER_SPECIFIED when admissible readings of the paper differ by more than `smallest`.

    When they do not, one value is determined and the claim stands or falls with `holds`.
    """
    return ClaimVerdict.UNDER_SPECIFIED if spread > smallest else reproduced(holds)


def partly(whole: bool, part: bool) -> ClaimVerdict:
    """REPRODUCED on the whole, PARTLY on a part that the paper names, else NOT_REPRODUCED."""
    return reproduced(whole, ClaimVerdict.PARTLY if part else ClaimVerdict.NOT_REPRODUCED)


def among_readings(values: Iterable[float], published: float, half_last_digit: float) -> ClaimVerdict:
    """A printed number against its value under every reading of what is left open.

    All readings round to it: REPRODUCED. It lies between two of them, which differ: UNDER_SPECIFIED. None reaches it:
    NOT_REPRODUCED.
    """
    array = np.asarray(list(values), float)
    inside = array.min() - half_last_digit <= published <= array.max() + half_last_digit
    otherwise = ClaimVerdict.UNDER_SPECIFIED if inside else ClaimVerdict.NOT_REPRODUCED
    return reproduced(all(agrees(float(v), published, half_last_digit) for v in array), otherwise)


def open_choice(readings: Iterable[ArrayLike], resolution: float) -> ClaimVerdict:
    """Nothing is printed to compare with: UNDER_SPECIFIED if the readings differ by more than `resolution`, else REPRODUCED."""
    stack = np.stack([np.asarray(r, float) for r in readings])
    return under_specified(float(np.ptp(stack, axis=0).max()), resolution)
