"""How a measure of a model moves with its parameters: one at a time, on grids, on samples.

A measure is any function from named samples, each an array (N,), to an array (N, ...): stability margin, norm, spectral
radius, critical probability, gains. It is called once with all samples, never in a loop (see `analysis.perturbed` for
models, and `one_by_one` for a function that knows no arrays).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from analysis.checks import as_stack
from analysis.errors import AnalysisError
from analysis.labelled import Axis, LabelledArray
from analysis.sensitivity.box import Box, Ranges
from analysis.sensitivity.designs import Design
from estimators.arrays import FloatArray
from estimators.display import Display

Measure: TypeAlias = Callable[[Mapping[str, FloatArray]], ArrayLike]


@dataclass(frozen=True, repr=False)
class OneAtATime(Display):
    """`nominal` value, and `values` and `deviations` = values - nominal with the axes (parameter, factor, ...)."""

    nominal: LabelledArray
    values: LabelledArray
    deviations: LabelledArray

    def ranking(self) -> list[tuple[str, float]]:
        """Parameters by their largest deviation in size, the strongest first."""
        size = np.abs(self.deviations.values).reshape(len(self.deviations.axes[0].labels), -1).max(axis=1)
        order = np.argsort(-size, kind="stable")
        return [(str(self.deviations.axes[0].labels[i]), float(size[i])) for i in order]


def evaluate(measure: Measure, columns: Mapping[str, FloatArray]) -> FloatArray:
    """measure(columns) as an array (N, ...). Infinite values are answers (an unstable model); NaN is not.

    Raises AnalysisError if the measure does not return one value for each sample, or returns NaN.

    >>> import numpy as np
    >>> evaluate(lambda at: at["a"] ** 2, {"a": np.array([1.0, 3.0])}).tolist()
    [1.0, 9.0]
    """
    count = len(next(iter(columns.values())))
    out = np.asarray(measure(columns), float)
    if out.ndim < 1 or len(out) != count:
        raise AnalysisError(
            f"the measure returned the shape {out.shape} for {count} samples; its first axis must be the samples"
        )
    bad = np.isnan(out).reshape(count, -1).any(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        sample = ", ".join(f"{name} = {values[first]:.6g}" for name, values in columns.items())
        raise AnalysisError(f"the measure is not a number at {int(bad.sum())} of {count} samples, first at {sample}")
    return out


def one_by_one(function: Callable[[dict[str, float]], ArrayLike]) -> Measure:
    """A measure from a function of one sample; as slow as its loop.

    >>> import numpy as np
    >>> one_by_one(lambda at: at["a"] ** 2)({"a": np.array([1.0, 3.0])}).tolist()
    [1.0, 9.0]
    """

    def measure(columns: Mapping[str, FloatArray]) -> FloatArray:
        count = len(next(iter(columns.values())))
        return np.array([function({name: float(values[i]) for name, values in columns.items()}) for i in range(count)])

    return measure


def one_at_a_time(
    measure: Measure,
    nominal: Mapping[str, float],
    factors: Sequence[float] = (0.8, 1.2),
    axes: tuple[Axis, ...] = (),
    name: str = "measure",
    unit: str = "1",
) -> OneAtATime:
    """Each parameter times each factor, the others nominal (P3 Figs 3-5); `axes` name the measure's own axes, if any.

    >>> one_at_a_time(lambda at: at["a"] + 0.1 * at["b"], {"a": 1.0, "b": 1.0}).ranking()[0][0]
    'a'
    """
    names = tuple(nominal)
    start = np.array([float(as_stack(key, value, ndim=0)) for key, value in nominal.items()])
    scale = as_stack("factors", factors, ndim=1).ravel()
    if not names or not len(scale):
        raise AnalysisError("nothing to vary; give at least one parameter and one factor")
    samples = np.tile(start, (1 + len(names) * len(scale), 1))
    places = 1 + np.arange(len(names) * len(scale)).reshape(len(names), len(scale))
    for i in range(len(names)):
        samples[places[i], i] *= scale
    values = evaluate(measure, {key: samples[:, i] for i, key in enumerate(names)})
    own = axes or plain_axes(values.shape[1:])
    lead = (Axis("parameter", np.array(names)), Axis("factor", scale))
    notes = {"design": "one at a time", "nominal": dict(zip(names, start.tolist(), strict=True))}
    moved = values[places]
    return OneAtATime(
        LabelledArray(name, values[0], own, unit, notes),
        LabelledArray(name, moved, (*lead, *own), unit, notes),
        LabelledArray(f"deviation of {name}", moved - values[0], (*lead, *own), unit, notes),
    )


def sample(
    measure: Measure,
    design: Design,
    ranges: Ranges,
    axes: tuple[Axis, ...] = (),
    name: str = "measure",
    unit: str = "1",
) -> LabelledArray:
    """The measure over a design in the box of `ranges`, along an axis `sample`.

    The samples are in the notes, column by column, so that a saved result can be read alone.

    >>> sample(lambda at: at["a"], LatinHypercube(samples=4), {"a": (0.0, 1.0)}).values.shape
    (4,)
    """
    box = Box.of(ranges)
    columns = box.columns(design.everywhere(box))
    values = evaluate(measure, columns)
    notes = {**design.model_dump(), "samples": {key: column.tolist() for key, column in columns.items()}}
    lead = Axis("sample", np.arange(len(values), dtype=float))
    return LabelledArray(name, values, (lead, *(axes or plain_axes(values.shape[1:]))), unit, notes)


def sample_grid(
    measure: Measure,
    levels: Mapping[str, ArrayLike],
    axes: tuple[Axis, ...] = (),
    name: str = "measure",
    unit: str = "1",
) -> LabelledArray:
    """The measure at every combination of the given levels, with an axis for each parameter.

    >>> sample_grid(lambda at: at["a"] * at["b"], {"a": [1.0, 2.0], "b": [10.0]}).values.tolist()
    [[10.0], [20.0]]
    """
    if not levels:
        raise AnalysisError("no parameter to vary; give at least one name with its levels")
    lines = [as_stack(f"levels of {key}", given, ndim=1).ravel() for key, given in levels.items()]
    mesh = np.meshgrid(*lines, indexing="ij")
    values = evaluate(measure, {key: column.ravel() for key, column in zip(levels, mesh, strict=True)})
    lead = [Axis(key, line) for key, line in zip(levels, lines, strict=True)]
    own = axes or plain_axes(values.shape[1:])
    shaped = values.reshape(*mesh[0].shape, *values.shape[1:])
    return LabelledArray(name, shaped, (*lead, *own), unit, {"design": "grid"})


def plain_axes(shape: tuple[int, ...]) -> tuple[Axis, ...]:
    """Numbered axes for a measure that names none."""
    return tuple(Axis(f"output_{i}", np.arange(size, dtype=float)) for i, size in enumerate(shape))
