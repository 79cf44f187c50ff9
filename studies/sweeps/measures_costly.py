"""Measures that solve something for every design: use them on designs of tens or hundreds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from analysis.observability.rank_loss_speeds import RankLossSpeeds
from analysis.switching.joint_spectral_radius import joint_spectral_radius
from estimators.arrays import FloatArray
from studies.spec import ScheduleSpec
from studies.sweeps.measures import MeasureSpec
from studies.sweeps.observer import Batch, Observer
from synthesis.design.deploy import claim_channel, deploy
from synthesis.design.hinf_observer import ObserverGains
from synthesis.design.norms import CLAIMED
from synthesis.errors import SpecError
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel


class JointSpectralRadius(MeasureSpec):
    """Proved upper bound of the joint spectral radius of the received updates at `speeds` grid points, switched arbitrarily.

    One design at a time: every bound is proved in exact rational arithmetic on the modes of its own design, which no array
    holds; an unproved norm bound over the batch would be quick, and looser than the number that a gate is to hold.
    """

    id: Literal["joint_spectral_radius"]
    speeds: int = Field(default=5, ge=1)
    tolerance: float = Field(default=1e-2, gt=0, lt=1)
    limit: ClassVar[float] = 1.0

    def _values(self, batch: Batch) -> FloatArray:
        places = np.unique(np.linspace(0, len(batch.grid) - 1, self.speeds).round().astype(int))
        updates = batch.coast.received[:, places]
        return np.array([joint_spectral_radius(modes, self.tolerance).upper for modes in updates])


class CertifiedGamma(MeasureSpec):
    """The gain from disturbance to error that is certified when the observer is designed again for the perturbed plant.

    From the specification that the schedule was made from. `deployed`: also tabulated, and proved exactly for the table;
    otherwise the verified bound of the design. `channel` is one of the specification, by default the one that is minimised.
    One semidefinite program for each design: the solver takes one problem at a time.
    """

    id: Literal["certified_gamma"]
    channel: str | None = None
    deployed: bool = False
    variance: ClassVar[Literal["value", "reciprocal"]] = "reciprocal"

    def _values(self, batch: Batch) -> FloatArray:
        spec, model = _designable(batch.observer)
        found = []
        for row in range(batch.count):
            constants = {
                name: replace(constant, value=float(batch.columns[name][row])) if name in batch.columns else constant
                for name, constant in model.constants.items()
            }
            found.append(self._gamma(spec, replace(model, constants=constants)))
        return np.array(found)

    def _gamma(self, spec: ScheduleSpec, model: LpvModel) -> float:
        design, gains = spec.observer_design(), spec.design(model)
        assert isinstance(gains, ObserverGains)  # an observer's schedule comes from an observer's specification
        wanted = self.channel or design.minimised.name
        asked = next(c for c in design.channels if c.name == wanted)
        if self.deployed:
            kind = f"{'' if gains.update == 'held' else 'sampled '}{CLAIMED[asked.norm]}"
            claims = deploy(gains, spec.deploy_settings()).claims
            return next(c.level for c in claims if (c.kind, c.channel) == (kind, claim_channel(asked)))
        return (asked.bound or gains.gamma) if gains.verdict is Verdict.CERTIFIED else float("nan")

    def check(self, observer: Observer) -> None:
        """The specification and its channel must be there."""
        names = [c.name for c in _designable(observer)[0].observer_design().channels]
        if self.channel is not None and self.channel not in names:
            raise SpecError(f"certified_gamma: channel '{self.channel}' is not one of {', '.join(names)}")


class RankLossSpeed(MeasureSpec):
    """The lowest scheduling parameter at which some rate in its bounds loses observability; inf where none does.

    Its unit is that of the scheduling parameter.
    """

    id: Literal["rank_loss_speed"]
    unit: ClassVar[str] = "rad/s"
    better: ClassVar[Literal["larger", "smaller"]] = "larger"
    variance: ClassVar[Literal["value", "reciprocal"]] = "reciprocal"

    def _values(self, batch: Batch) -> FloatArray:
        known = batch.observer.plant.parameters
        constants = {name: column for name, column in batch.columns.items() if name in known}
        return np.broadcast_to(_rank_loss(batch.observer).lowest(constants), (batch.count,))

    def check(self, observer: Observer) -> None:
        """There must be a symbolic model."""
        _rank_loss(observer)


def _designable(observer: Observer) -> tuple[ScheduleSpec, LpvModel]:
    if observer.specification is None or observer.plant.model is None:
        raise SpecError(
            f"subject '{observer.name}': certified_gamma needs the specification that the gains were designed from and a "
            "symbolic model; sweep a schedule of a catalogue model"
        )
    return observer.specification, observer.plant.model


def _rank_loss(observer: Observer) -> RankLossSpeeds:
    if observer.plant.model is None:
        raise SpecError(f"subject '{observer.name}': rank_loss_speed needs a symbolic model, not a schedule file alone")
    return _compiled(observer.plant.model)


@lru_cache(maxsize=16)
def _compiled(model: LpvModel) -> RankLossSpeeds:
    return RankLossSpeeds(model)


COSTLY: Mapping[str, type[MeasureSpec]] = {
    "joint_spectral_radius": JointSpectralRadius, "certified_gamma": CertifiedGamma, "rank_loss_speed": RankLossSpeed,
}  # fmt: skip
