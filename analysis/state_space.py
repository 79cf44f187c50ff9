"""State-space systems as users have them: arrays, or an object with A, B, C, D and dt (python-control, scipy.signal)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from analysis.errors import AnalysisError


class Given(NamedTuple):
    """The matrices as they were given, and whether time is discrete."""

    A: Any
    B: Any
    C: Any
    D: Any
    discrete: bool


def given_system(
    A: Any, B: ArrayLike | None = None, C: ArrayLike | None = None, D: ArrayLike | None = None, discrete: object = None
) -> Given:
    """An object in the place of A brings all matrices and its time; B (n,), C (n,) and a plain D of one system are accepted.

    dt = 0 is continuous, a number or True discrete; None is continuous for scipy.signal, and open for python-control: say which.
    Raises AnalysisError for `discrete` that is no truth value or contradicts the object, and for matrices beside an object.
    """
    asked = flag("discrete", discrete)
    if not all(hasattr(A, name) for name in ("A", "B", "C", "D", "dt")):
        return Given(A, _column(A, B), _row(A, C), _plain(D), bool(asked))
    if not (B is None and C is None and D is None):
        raise AnalysisError(f"{type(A).__name__} brings its own B, C and D; give it alone")
    time = _time(A)
    if time is None and asked is None:
        raise AnalysisError(f"{type(A).__name__} has dt = None: say discrete=True or discrete=False")
    if time is not None and asked is not None and asked != time:
        raise AnalysisError(f"{type(A).__name__} has dt = {A.dt}, which contradicts discrete={asked}")
    return Given(A.A, A.B, A.C, A.D, bool(asked if time is None else time))


def flag(name: str, value: object) -> bool | None:
    """True, False or None. Raises AnalysisError for anything else: a word is not a truth value."""
    if value is None or isinstance(value, bool | np.bool_):
        return None if value is None else bool(value)
    raise AnalysisError(f"{name} = {value!r} is not a truth value; give True or False")


def _time(system: Any) -> bool | None:
    if system.dt is None:
        return None if type(system).__module__.startswith("control") else False
    return bool(system.dt is True or system.dt > 0)


def _column(A: Any, B: Any) -> Any:
    return np.asarray(B)[:, None] if _axes(A) == 2 and _axes(B) == 1 else B


def _row(A: Any, C: Any) -> Any:
    return np.asarray(C)[None, :] if _axes(A) == 2 and _axes(C) == 1 else C


def _plain(D: Any) -> Any:
    return np.full((1, 1), D) if _axes(D) == 0 else D


def _axes(array: Any) -> int | None:
    """Number of axes; None for nothing, and for what is no array (its own check says so)."""
    try:
        return None if array is None else int(np.ndim(array))
    except ValueError:
        return None
