"""What a measure is, and those that a file can name: norms, radii, drop probabilities, over all designs and points at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from analysis.drops.frozen import critical_drop_probability, drop_radius
from analysis.drops.modes import DropModes, DropPolicy
from analysis.norms.hinf import hinf_norm
from analysis.norms.planar import planar_hinf_norm
from estimators.arrays import FloatArray
from estimators.display import Display
from studies.sweeps.observer import Batch, Observer
from synthesis.errors import SpecError
from synthesis.models.selection import selection
from synthesis.toml_file import StrictTable


def _nothing(*_observer: Observer) -> None:
    pass


@dataclass(frozen=True, repr=False)
class Measure(Display):
    """`function(batch)` returns (designs, grid), or (designs,) for a number that belongs to no place of the grid.

    The batch holds the designs' parameter values, the observer (model, gains, sample time) and the grid, with all matrices made.
    Infinite values are answers (an unstable design), NaN is an outcome of its own. A loss is measured relative to the distance
    from `limit`, at which the measure becomes worthless (a margin of 0, a radius of 1). `variance` says what Sobol indices
    speak of: the value, or its reciprocal for a measure that may be infinite. `definition` is what makes two measures the
    same; `check` refuses an observer that the measure does not fit (SpecError). `prepare` makes what all chunks share, once,
    before workers are started.
    A function that must travel to other processes is one that a module defines, or a `functools.partial` of one.

    >>> Measure("double", "1", "larger", lambda batch: 2.0).name
    'double'
    """

    name: str
    unit: str
    better: Literal["larger", "smaller"]
    function: Callable[[Batch], ArrayLike]
    limit: float = 0.0
    variance: Literal["value", "reciprocal"] = "value"
    definition: Mapping[str, Any] = field(default_factory=dict)
    check: Callable[[Observer], None] = _nothing
    prepare: Callable[[], None] = _nothing

    def __call__(self, batch: Batch) -> FloatArray:
        """The values (n, g) or (n,). Raises SpecError for any other shape."""
        with np.errstate(all="ignore"):  # an unstable design overflows: that is an answer
            values = np.asarray(self.function(batch), float)
        if values.shape not in ((batch.count, len(batch.grid)), (batch.count,)):
            raise SpecError(
                f"measure '{self.name}' returned the shape {values.shape} for {batch.count} designs and {len(batch.grid)} "
                "grid points; return (designs, grid) or (designs,)"
            )
        return values

    @property
    def sign(self) -> float:
        """+1 where larger is worse: sign * value is to be kept small."""
        return 1.0 if self.better == "smaller" else -1.0

    def loss(self, before: float, after: float) -> float:
        """How much of the distance from the limit was lost (positive) or won; inf for a measure that became worthless."""
        if before == after:
            return 0.0
        if math.isnan(before) or math.isnan(after):
            return math.inf if math.isnan(after) else -math.inf
        if math.isinf(before) or math.isinf(after):
            return self.sign * (math.inf if after > before else -math.inf)
        distance = abs(before - self.limit)
        change = self.sign * (after - before)
        return change / distance if distance > 0.0 else math.copysign(math.inf, change)

    def spread(self, values: FloatArray) -> FloatArray:
        """What variance is taken of."""
        if self.variance == "value":
            return values
        with np.errstate(divide="ignore"):
            return 1.0 / values


class MeasureSpec(StrictTable):
    """One [[measures]] table; `name` replaces the `title` made from `id` and options. The others are those of `Measure`."""

    id: str
    name: str | None = Field(default=None, pattern=r"^[A-Za-z0-9][A-Za-z0-9_ ,.>+-]*$")
    unit: ClassVar[str] = "1"
    better: ClassVar[Literal["larger", "smaller"]] = "smaller"
    limit: ClassVar[float] = 0.0
    variance: ClassVar[Literal["value", "reciprocal"]] = "value"

    @property
    def title(self) -> str:
        """The name without a name."""
        return self.id

    def _values(self, batch: Batch) -> FloatArray:
        """The number of every design and grid point, or of every design."""
        raise NotImplementedError

    def check(self, observer: Observer) -> None:
        """Raises SpecError for an observer that the measure does not fit."""

    def definition(self) -> Mapping[str, Any]:
        """What makes two measures the same."""
        return self.model_dump(mode="json")

    def prepare(self) -> None:
        """Make what all chunks share."""

    def build(self) -> Measure:
        """The measure."""
        return Measure(
            self.name or self.title, self.unit, self.better, self._values, self.limit, self.variance, self.definition(),
            self.check, self.prepare,
        )  # fmt: skip

    def beside(self, folder: Path) -> MeasureSpec:
        """The same with file names relative to the folder of the sweep file."""
        return self


class StabilityMargin(MeasureSpec):
    """Growth of the error in 1/s, max Re lambda(A_e), or that of the update which the runtime performs; negative is stable.

    P3 section IV.
    """

    id: Literal["stability_margin"]
    unit: ClassVar[str] = "1/s"

    def _values(self, batch: Batch) -> FloatArray:
        return batch.margin


class HinfNorm(MeasureSpec):
    """H-infinity norm from disturbances to state errors at frozen parameters; infinite where the observer is unstable.

    Its unit is left at 1 where several signals meet.
    """

    id: Literal["hinf_norm"]
    disturbances: Annotated[list[str], Field(min_length=1)]
    errors: Annotated[list[str], Field(min_length=1)]
    tolerance: float = Field(default=1e-6, ge=1e-12, lt=1e-2)
    variance: ClassVar[Literal["value", "reciprocal"]] = "reciprocal"

    @property
    def title(self) -> str:
        """With both ends of the channel."""
        return f"hinf_norm {'+'.join(self.disturbances)} > {'+'.join(self.errors)}"

    def _values(self, batch: Batch) -> FloatArray:
        d, z = self.channel(batch.observer)
        A_e, B_e = batch.error
        if A_e.shape[-1] == 2 and min(d.shape[1], len(z)) == 1:  # in closed form
            return planar_hinf_norm(A_e, B_e @ d, z)[0]
        return hinf_norm(A_e, B_e @ d, z, tolerance=self.tolerance).norm

    def check(self, observer: Observer) -> None:
        """The channel must be there, and an error equation."""
        observer.require_error_equation()
        self.channel(observer)

    def channel(self, observer: Observer) -> tuple[FloatArray, FloatArray]:
        """d (nd, k) feeding the disturbances and z (j, nx) reading the state errors. Raises SpecError."""
        return selection(observer.plant, self.disturbances, self.errors, f"subject '{observer.name}'", SpecError)


class SampledRadius(MeasureSpec):
    """Spectral radius of the runtime's update with a received sample: e^{A_e T} (P1 notes 9), or e^{A T} - K C."""

    id: Literal["sampled_radius"]
    limit: ClassVar[float] = 1.0

    def _values(self, batch: Batch) -> FloatArray:
        """The eigenvalues of e^{A_e T} are the exponentials of those of A_e T: the margin serves, and is made so for K."""
        return np.asarray(np.exp(batch.observer.sample_time * batch.margin))


class _Dropping(MeasureSpec):
    """Measures of lost samples under a drop policy."""

    policy: DropPolicy = "coast"

    def _modes(self, batch: Batch) -> DropModes:
        return batch.coast if self.policy == "coast" else batch.modes(self.policy)


class SecondMomentRadius(_Dropping):
    """Spectral radius of the second moment's update when each sample is lost with probability p (P3 (24), Fig. 8)."""

    id: Literal["second_moment_radius"]
    drop_probability: float = Field(ge=0, le=1)
    limit: ClassVar[float] = 1.0

    @property
    def title(self) -> str:
        """With probability and policy."""
        return f"second_moment_radius p {self.drop_probability:g} {self.policy}"

    def _values(self, batch: Batch) -> FloatArray:
        modes = self._modes(batch)
        return drop_radius(modes.dropped, modes.received, self.drop_probability)


class CriticalDropProbability(_Dropping):
    """Smallest drop probability at which mean-square stability is lost (P3 Fig. 7)."""

    id: Literal["critical_drop_probability"]
    better: ClassVar[Literal["larger", "smaller"]] = "larger"

    @property
    def title(self) -> str:
        """With the policy, unless it is the usual one."""
        return self.id if self.policy == "coast" else f"{self.id} {self.policy}"

    def _values(self, batch: Batch) -> FloatArray:
        modes = self._modes(batch)
        return critical_drop_probability(modes.dropped, modes.received)


FAST: Mapping[str, type[MeasureSpec]] = {
    "stability_margin": StabilityMargin, "hinf_norm": HinfNorm, "sampled_radius": SampledRadius,
    "second_moment_radius": SecondMomentRadius, "critical_drop_probability": CriticalDropProbability,
}  # fmt: skip
