"""The measures that a sweep file can name: norms, radii, drop probabilities, over all designs and grid points at once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from analysis.dropout import critical_drop_probability, drop_radius
from analysis.dropout_modes import DropPolicy
from analysis.norms import hinf_norm
from analysis.planar import planar_hinf_norm
from estimators.arrays import FloatArray
from estimators.errors import unknown
from studies.sweeps.measure import Measure
from studies.sweeps.subject import Batch, Subject
from synthesis.errors import SpecError
from synthesis.toml_file import StrictTable


class MeasureSpec(StrictTable):
    """One [[measures]] table; `name` replaces the name made from `id` and options."""

    id: str
    name: str | None = Field(default=None, pattern=r"^[A-Za-z0-9][A-Za-z0-9_ ,.>+-]*$")

    def build(self) -> Measure:
        """The measure."""
        raise NotImplementedError

    def beside(self, folder: Path) -> MeasureSpec:
        """The same with file names relative to the folder of the sweep file."""
        return self

    def key(self) -> dict[str, object]:
        """What makes two measures the same."""
        return self.model_dump(mode="json")


class StabilityMargin(MeasureSpec):
    """Growth of the error in 1/s, max Re lambda(A_e), or that of the update which the runtime performs; negative is stable.

    P3 section IV.
    """

    id: Literal["stability_margin"]

    def build(self) -> Measure:
        """The measure."""
        return Measure(self.name or self.id, "1/s", "smaller", _margin, definition=self.key())


class HinfNorm(MeasureSpec):
    """H-infinity norm from disturbances to state errors at frozen parameters; infinite where the observer is unstable."""

    id: Literal["hinf_norm"]
    disturbances: Annotated[list[str], Field(min_length=1)]
    errors: Annotated[list[str], Field(min_length=1)]
    tolerance: float = Field(default=1e-6, ge=1e-12, lt=1e-2)

    def build(self) -> Measure:
        """The measure; its unit is left at 1 where several signals meet."""
        d, e = tuple(self.disturbances), tuple(self.errors)
        name = self.name or f"hinf_norm {'+'.join(d)} > {'+'.join(e)}"
        function, check = partial(_norm, d, e, self.tolerance), partial(_has_channel, d, e)
        return Measure(name, "1", "smaller", function, 0.0, "reciprocal", self.key(), check)


class SampledRadius(MeasureSpec):
    """Spectral radius of the runtime's update with a received sample: e^{A_e T} (P1 section 9), or e^{A T} - K C."""

    id: Literal["sampled_radius"]

    def build(self) -> Measure:
        """The measure."""
        return Measure(self.name or self.id, "1", "smaller", _sampled, 1.0, definition=self.key())


class SecondMomentRadius(MeasureSpec):
    """Spectral radius of the second moment's update when each sample is lost with probability p (P3 (24), Fig. 8)."""

    id: Literal["second_moment_radius"]
    drop_probability: float = Field(ge=0, le=1)
    policy: DropPolicy = "coast"

    def build(self) -> Measure:
        """The measure."""
        name = self.name or f"second_moment_radius p {self.drop_probability:g} {self.policy}"
        function = partial(_second_moment, self.drop_probability, self.policy)
        return Measure(name, "1", "smaller", function, 1.0, definition=self.key())


class CriticalDropProbability(MeasureSpec):
    """Smallest drop probability at which mean-square stability is lost (P3 Fig. 7)."""

    id: Literal["critical_drop_probability"]
    policy: DropPolicy = "coast"

    def build(self) -> Measure:
        """The measure."""
        suffix = "" if self.policy == "coast" else f" {self.policy}"
        function = partial(_critical, self.policy)
        return Measure(self.name or self.id + suffix, "1", "larger", function, definition=self.key())


def _margin(batch: Batch) -> FloatArray:
    return batch.margin


def _norm(disturbances: tuple[str, ...], errors: tuple[str, ...], tolerance: float, batch: Batch) -> FloatArray:
    d, z = channel(batch.subject, disturbances, errors)
    A_e, B_e = batch.error
    if A_e.shape[-1] == 2 and min(d.shape[1], len(z)) == 1:
        return planar_hinf_norm(A_e, B_e @ d, z)[0]
    return hinf_norm(A_e, B_e @ d, z, tolerance=tolerance).norm


def _sampled(batch: Batch) -> FloatArray:
    # The eigenvalues of e^{A_e T} are the exponentials of those of A_e T: the margin serves, at no cost, and is made so for K.
    return np.asarray(np.exp(batch.subject.sample_time * batch.margin))


def _second_moment(probability: float, policy: DropPolicy, batch: Batch) -> FloatArray:
    modes = batch.coast if policy == "coast" else batch.modes(policy)
    return drop_radius(modes.dropped, modes.received, probability)


def _critical(policy: DropPolicy, batch: Batch) -> FloatArray:
    modes = batch.coast if policy == "coast" else batch.modes(policy)
    return critical_drop_probability(modes.dropped, modes.received)


def channel(subject: Subject, disturbances: tuple[str, ...], errors: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """d (nd, k) feeding the named disturbances and z (j, nx) reading the named state errors. Raises SpecError."""
    inputs, states = [s.name for s in subject.plant.disturbances], [s.name for s in subject.plant.states]
    for what, names, known in (("disturbance", disturbances, inputs), ("state", errors, states)):
        for name in names:
            if name not in known:
                raise SpecError(f"subject '{subject.name}': {unknown(what, name, known)}")
    return np.eye(len(inputs))[:, [inputs.index(n) for n in disturbances]], np.eye(len(states))[
        [states.index(n) for n in errors]
    ]


def _has_channel(disturbances: tuple[str, ...], errors: tuple[str, ...], subject: Subject) -> None:
    subject.require_error_equation()
    channel(subject, disturbances, errors)


FAST: Mapping[str, type[MeasureSpec]] = {
    "stability_margin": StabilityMargin, "hinf_norm": HinfNorm, "sampled_radius": SampledRadius,
    "second_moment_radius": SecondMomentRadius, "critical_drop_probability": CriticalDropProbability,
}  # fmt: skip
