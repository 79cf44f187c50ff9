"""State-space systems as users have them: arrays, or an object with A, B, C, D and dt (python-control, scipy.signal)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from analysis.errors import AnalysisError

if TYPE_CHECKING:
    import control


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
    """An object in the place of A brings all matrices and its time; a transfer function is realised first.

    B (n,), C (n,), plain numbers and D = 0 of one system are read as `control.ss` reads them. dt = 0 is continuous, a number
    or True discrete; None is continuous for scipy.signal, and open for python-control: say which, except for a static gain.
    Raises AnalysisError for `discrete` that is no truth value or contradicts the object, and for matrices beside an object.
    """
    asked = flag("discrete", discrete)
    A = _realised(A)
    if not _is_system(A):
        return _given_arrays(A, B, C, D, bool(asked))
    if not (B is None and C is None and D is None):
        raise AnalysisError(f"{type(A).__name__} brings its own B, C and D; give it alone")
    time = _time(A)
    if time is None and asked is None and np.size(A.A):
        raise AnalysisError(f"{type(A).__name__} has dt = None: say discrete=True or discrete=False")
    if time is not None and asked is not None and asked != time:
        raise AnalysisError(f"{type(A).__name__} has dt = {A.dt}, which contradicts discrete={asked}")
    return Given(A.A, A.B, A.C, A.D, bool(asked if time is None else time))


def given_pair(A: Any, beside: ArrayLike | None, discrete: object, name: str) -> tuple[Any, Any, bool]:
    """A, its B or C (`name`) and whether time is discrete. Raises AnalysisError as `given_system`, and if the matrix is
    missing."""
    if beside is None and not _is_system(_realised(A)):
        raise AnalysisError(f"{name} is missing; give A and {name}, or a system object with both")
    given = given_system(A, discrete=discrete, **({} if beside is None else {name: beside}))
    return given.A, getattr(given, name), given.discrete


def state_space(
    A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike, like: Any, discrete: bool
) -> control.StateSpace:
    """A `control.StateSpace` with the sample time of the object `like`, or dt = 0 or True if that is none."""
    import control as library

    time = getattr(like, "dt", None)
    return library.ss(A, B, C, D, (True if discrete else 0) if time is None else time)


def flag(name: str, value: object) -> bool | None:
    """True, False or None. Raises AnalysisError for anything else: a word is not a truth value."""
    if value is None or isinstance(value, bool | np.bool_):
        return None if value is None else bool(value)
    raise AnalysisError(f"{name} = {value!r} is not a truth value; give True or False")


def _is_system(system: Any) -> bool:
    return all(hasattr(system, name) for name in ("A", "B", "C", "D", "dt"))


def _realised(system: Any) -> Any:
    """Transfer functions of either library as state-space objects, anything else as it is."""
    if _is_system(system) or not hasattr(system, "dt"):
        return system
    try:
        if hasattr(system, "to_ss"):
            return system.to_ss()
        if type(system).__module__.startswith("control"):
            import control as library

            return library.ss(system)
    except Exception as error:  # improper, no state space, or a realisation that needs slycot
        raise AnalysisError(f"{type(system).__name__} has no state-space form: {error}") from None
    return system


def _time(system: Any) -> bool | None:
    if system.dt is None:
        return None if type(system).__module__.startswith("control") else False
    return bool(system.dt is True or system.dt > 0)


def _given_arrays(A: Any, B: Any, C: Any, D: Any, discrete: bool) -> Given:
    """Vectors and numbers of one system as matrices; stacks, and what is no array, stay for the checks that follow."""
    if _axes(A) == 0:
        A = np.reshape(A, (1, 1))
    one = _axes(A) == 2
    single = one and np.shape(A)[0] == 1
    if one and _axes(B) is not None and _axes(B) < 2:  # type: ignore[operator]
        B = np.reshape(B, (1, -1) if single else (-1, 1))
    if one and _axes(C) is not None and _axes(C) < 2:  # type: ignore[operator]
        C = np.reshape(C, (-1, 1) if single else (1, -1))
    if _axes(D) == 0:
        D = None if D == 0 else np.reshape(D, (1, 1))
    elif one and _axes(D) == 1:
        D = np.reshape(D, (1, -1))
    return Given(A, B, C, D, discrete)


def _axes(array: Any) -> int | None:
    """Number of axes; None for nothing, and for what is no array (its own check says so)."""
    try:
        return None if array is None else int(np.ndim(array))
    except ValueError:
        return None
