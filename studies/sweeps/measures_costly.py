"""Measures that solve something for every design: use them on designs of tens or hundreds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache, partial
from typing import Literal

import numpy as np
from pydantic import Field

from analysis.joint_spectral_radius import joint_spectral_radius
from analysis.rank_loss_speeds import RankLossSpeeds
from estimators.arrays import FloatArray
from studies.spec import ScheduleSpec
from studies.sweeps.measure import Measure
from studies.sweeps.measures import MeasureSpec
from studies.sweeps.plant import ModelPlant
from studies.sweeps.subject import Batch, Subject
from synthesis.deploy import claim_channel, deploy
from synthesis.errors import SpecError
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel


class JointSpectralRadius(MeasureSpec):
    """Proved upper bound of the joint spectral radius of the received updates at `speeds` grid points, switched arbitrarily.

    One design at a time: every bound is proved in exact rational arithmetic on the modes of its own design, which no array
    holds; an unproved norm bound over the batch would be quick, and looser than the figure that a gate is to hold.
    """

    id: Literal["joint_spectral_radius"]
    speeds: int = Field(default=5, ge=1)
    tolerance: float = Field(default=1e-2, gt=0, lt=1)

    def build(self) -> Measure:
        """The measure."""
        function = partial(_switching, self.speeds, self.tolerance)
        return Measure(self.name or self.id, "1", "smaller", function, 1.0, definition=self.key())


class CertifiedGamma(MeasureSpec):
    """The gain from disturbance to error that is certified when the observer is designed again for the perturbed plant.

    From the specification that the schedule was made from. `deployed`: also tabulated, and proved exactly for the table;
    otherwise the verified bound of the design. `channel` is one of the specification, by default the one that is minimised.
    One semidefinite program for each design: the solver takes one problem at a time.
    """

    id: Literal["certified_gamma"]
    channel: str | None = None
    deployed: bool = False

    def build(self) -> Measure:
        """The measure."""
        function = partial(_certified, self.channel, self.deployed)
        check = partial(_can_be_designed, self.channel)
        return Measure(self.name or self.id, "1", "smaller", function, 0.0, "reciprocal", self.key(), check)


class RankLossSpeed(MeasureSpec):
    """The lowest scheduling parameter at which some rate in its bounds loses observability; inf where none does."""

    id: Literal["rank_loss_speed"]

    def build(self) -> Measure:
        """The measure; its unit is that of the scheduling parameter."""
        return Measure(
            self.name or self.id, "rad/s", "larger", _rank_loss, 0.0, "reciprocal", self.key(), _has_rank_loss
        )  # fmt: skip


def _switching(speeds: int, tolerance: float, batch: Batch) -> FloatArray:
    places = np.unique(np.linspace(0, len(batch.grid) - 1, speeds).round().astype(int))
    updates = batch.coast.received[:, places]
    return np.array([joint_spectral_radius(modes, tolerance).upper for modes in updates])


def _certified(channel: str | None, deployed: bool, batch: Batch) -> FloatArray:
    spec, model = _designable(batch.subject)
    return np.array(
        [
            _gamma(
                spec,
                _perturbed(model, {name: float(column[i]) for name, column in batch.columns.items()}),
                channel,
                deployed,
            )
            for i in range(batch.count)
        ]
    )


def _gamma(spec: ScheduleSpec, model: LpvModel, channel: str | None, deployed: bool) -> float:
    design = spec.observer_design()
    gains = spec.design(model)
    wanted = channel or design.minimised.name
    if deployed:
        claims = deploy(gains, spec.deploy_settings()).claims
        kind = "gain" if gains.update == "held" else "sampled gain"
        asked = claim_channel(next(c for c in design.channels if c.name == wanted))
        return next(claim.level for claim in claims if (claim.kind, claim.channel) == (kind, asked))
    bound = next(c.bound for c in design.channels if c.name == wanted)
    return (bound or gains.gamma) if gains.verdict is Verdict.CERTIFIED else float("nan")


def _perturbed(model: LpvModel, values: Mapping[str, float]) -> LpvModel:
    constants = {
        name: replace(constant, value=values.get(name, constant.value)) for name, constant in model.constants.items()
    }
    return replace(model, constants=constants)


def _designable(subject: Subject) -> tuple[ScheduleSpec, LpvModel]:
    if subject.specification is None or not isinstance(subject.plant, ModelPlant):
        raise SpecError(
            f"subject '{subject.name}': certified_gamma needs the specification that the gains were designed from and a "
            "symbolic model; sweep a schedule of a catalogue model"
        )
    return subject.specification, subject.plant.model


def _can_be_designed(channel: str | None, subject: Subject) -> None:
    spec, _ = _designable(subject)
    names = [c.name for c in spec.observer_design().channels]
    if channel is not None and channel not in names:
        raise SpecError(f"certified_gamma: channel '{channel}' is not one of {', '.join(names)}")


def _rank_loss(batch: Batch) -> FloatArray:
    constants = {name: column for name, column in batch.columns.items() if name in batch.subject.plant.parameters}
    found = _compiled(_symbolic(batch.subject)).lowest(constants)
    return np.broadcast_to(found, (batch.count,))


@lru_cache(maxsize=16)
def _compiled(model: LpvModel) -> RankLossSpeeds:
    return RankLossSpeeds(model)


def _symbolic(subject: Subject) -> LpvModel:
    if not isinstance(subject.plant, ModelPlant):
        raise SpecError(f"subject '{subject.name}': rank_loss_speed needs a symbolic model, not a schedule file alone")
    return subject.plant.model


def _has_rank_loss(subject: Subject) -> None:
    _compiled(_symbolic(subject))


COSTLY: Mapping[str, type[MeasureSpec]] = {
    "joint_spectral_radius": JointSpectralRadius, "certified_gamma": CertifiedGamma, "rank_loss_speed": RankLossSpeed,
}  # fmt: skip
