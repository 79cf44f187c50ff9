"""Modes as users have them: arrays, objects with A and dt (python-control, scipy.signal), or a list of such objects."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from analysis.errors import AnalysisError
from analysis.state_space import flag, given_system


def state_matrices(modes: Any, discrete: object) -> tuple[Any, bool]:
    """A of an object, the list of A of a list of objects, anything else as it is; and whether time is discrete.

    `discrete` None takes the time from the objects, and continuous time for arrays. Raises AnalysisError for objects whose time
    contradicts `discrete` or each other, and for a list of objects and arrays together.
    """
    asked = flag("discrete", discrete)
    if _is_system(modes):
        given = given_system(modes, discrete=asked)
        return given.A, given.discrete
    if not isinstance(modes, list | tuple) or not any(_is_system(mode) for mode in modes):
        return modes, bool(asked)
    if not all(_is_system(mode) for mode in modes):
        raise AnalysisError("modes are objects and arrays together; give one kind")
    found = [given_system(mode, discrete=asked) for mode in modes]
    if len({given.discrete for given in found}) > 1:
        raise AnalysisError("modes are continuous and discrete together; a switched system has one kind of time")
    periods = {mode.dt for mode in modes if not isinstance(mode.dt, bool) and mode.dt is not None}
    if len(periods) > 1:
        raise AnalysisError(
            f"modes have the sample times {', '.join(f'{p:g}' for p in sorted(periods))} s; resample them to one"
        )
    return [given.A for given in found], found[0].discrete


def with_output(A: Any, C: ArrayLike | None, discrete: bool) -> tuple[Any, Any]:
    """A and C of arrays, or of an object in the place of A that brings both. Raises AnalysisError as `given_system`."""
    if C is None and not _is_system(A):
        raise AnalysisError("C is missing; give A and C, or a system object with both")
    given = given_system(A, C=C, discrete=discrete)
    return given.A, given.C


def _is_system(system: Any) -> bool:
    return all(hasattr(system, name) for name in ("A", "B", "C", "D", "dt"))
