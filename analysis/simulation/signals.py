"""What is given to a simulation by name: sizes, values, starts, trajectories; everything that does not fit is refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from analysis.errors import AnalysisError
from analysis.simulation.box import box_of
from estimators.arrays import FloatArray
from estimators.errors import unknown
from estimators.schedule import GainSchedule
from synthesis.models.lpv import LpvModel

Signals = Mapping[str, npt.ArrayLike]


def white_or_given(
    given: Signals, names: Sequence[str], shape: tuple[int, int], rng: np.random.Generator
) -> FloatArray:
    """Disturbances (runs, samples, names): a number is the standard deviation of a white sequence, an array the values."""
    found = laid(given, names, shape, "disturbance")
    for place, name in enumerate(names):
        if name in given and np.ndim(given[name]) == 0:
            if not found[0, 0, place] >= 0.0:
                raise AnalysisError(
                    f"disturbance '{name}' has the size {found[0, 0, place]:g}; give a standard deviation >= 0"
                )
            found[..., place] *= rng.standard_normal(shape)
    return found


def laid(given: Signals, names: Sequence[str], shape: tuple[int, int], what: str) -> FloatArray:
    """Values (runs, samples, names) of constants and arrays; zero where nothing is given."""
    found = np.zeros((*shape, len(names)))
    for name, values in given.items():
        if name not in names:
            raise AnalysisError(unknown(what, name, names))
        array = finite(values, f"{what} '{name}'")
        try:
            found[..., names.index(name)] = array
        except ValueError:
            raise AnalysisError(
                f"{what} '{name}' has the shape {array.shape}; give a number, ({shape[1]},) or {shape}: runs, samples"
            ) from None
    return found


def begun(given: npt.ArrayLike, shape: tuple[int, int], what: str) -> FloatArray:
    """States (runs, nx) from anything that can be broadcast to them."""
    array = finite(given, what)
    try:
        return np.broadcast_to(array, shape).copy()
    except ValueError:
        raise AnalysisError(f"{what} has the shape {array.shape}; it must broadcast to {shape}: runs, states") from None


def followed(system: GainSchedule | LpvModel, given: npt.ArrayLike) -> FloatArray:
    """Parameters (runs, samples + 1, p) inside the range of a plant."""
    box, array = box_of(system), finite(given, "parameters")
    if array.ndim != 3 or array.shape[2] != len(box.names) or array.shape[1] < 2 or not array.shape[0]:
        raise AnalysisError(
            f"parameters have the shape {array.shape}; '{system.name}' needs (runs, samples + 1, {len(box.names)})"
        )
    if box.constraints is not None and (broken := box.constraints.outside(array)).any():
        run, sample = (int(i) for i in np.argwhere(broken)[0])
        words = box.constraints.refusal(box.names, array[run, sample], f" (run {run}, sample {sample})")
        raise AnalysisError(f"parameters of '{system.name}': {words}")
    outside = (array < box.low) | (array > box.high)
    if outside.any():
        run, sample, axis = (int(i) for i in np.argwhere(outside)[0])
        raise AnalysisError(
            f"{box.names[axis]} = {array[run, sample, axis]:.6g} {box.units[axis]} in run {run}, sample {sample} is outside "
            f"[{box.low[axis]:g}, {box.high[axis]:g}] {box.units[axis]}"
        )
    return array


def finite(values: npt.ArrayLike, what: str) -> FloatArray:
    """As an array of finite numbers."""
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError):
        raise AnalysisError(f"{what} is not an array of numbers") from None
    if not np.isfinite(array).all():
        raise AnalysisError(f"{what} is not finite everywhere")
    return array


def places(wanted: Sequence[str], there: Sequence[str], kind: str, plant: str) -> list[int]:
    """Where the signals of a schedule are among those of a plant."""
    for name in wanted:
        if name not in there:
            raise AnalysisError(f"the schedule needs the {kind} of '{plant}': {unknown(kind, name, there)}")
    return [list(there).index(name) for name in wanted]
