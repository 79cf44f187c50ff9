"""Specifications of schedules: TOML files that name a model, parameter values and what is asked of the gains."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from estimators.errors import unknown
from synthesis.design.deploy import DeploySettings
from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, design_observer
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.errors import SpecError
from synthesis.lmi.settings import LmiSettings
from synthesis.models.catalogue import CATALOGUE
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, Quantity, load_parameter_set
from synthesis.toml_file import StrictTable, find_toml, load_toml, shipped_files


class ModelSpec(StrictTable):
    """Which model of the catalogue, with which parameter values, over which box."""

    id: str
    parameters: str
    wheel_speed_maximum: float = Field(gt=0)
    wheel_speed_rate: float = Field(ge=0)


class ChannelSpec(StrictTable):
    """One channel of the design; without `bound` it is the one that is minimised."""

    disturbances: list[str] = Field(min_length=1)
    errors: list[str] = Field(min_length=1)
    bound: float | None = Field(default=None, gt=0)
    weights: list[float] | None = None


class DesignSpec(StrictTable):
    """What is asked of the gains (synthesis.design.hinf_observer)."""

    degree: int = 1
    decay_rate: float = 0.0
    fastest_pole: float | None = None
    backoff: float = 0.02
    relaxation: Literal["auto", "grid", "vertex", "exact"] = "auto"
    points: int = 140
    solver: str = "CLARABEL"
    channels: list[ChannelSpec] = Field(min_length=1)


class DeploySpec(StrictTable):
    """How the gains become a table (synthesis.design.deploy) and how they are run (synthesis.loop.observer)."""

    update: Literal["held", "sampled"] = "held"
    sample_time: float
    dtype: Literal["float32", "float64"] = "float64"
    interpolation_cost: float = 0.01


class ScheduleSpec(StrictTable):
    """A whole specification."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9-]*$")
    description: str
    model: ModelSpec
    gains: DesignSpec = Field(alias="design")
    deploy: DeploySpec

    def parameter_set(self, folder: Path = Path()) -> ParameterSet:
        """The parameter values: a shipped set by name, or a TOML file beside the specification."""
        return load_parameter_set(self.model.parameters, folder)

    def build_model(self, parameters: ParameterSet) -> LpvModel:
        """The LPV model over its box."""
        if self.model.id not in CATALOGUE:
            raise SpecError(f"spec '{self.name}': {unknown('model', self.model.id, CATALOGUE)}")
        return CATALOGUE[self.model.id](
            parameters, wheel_speed_maximum=self.model.wheel_speed_maximum, wheel_speed_rate=self.model.wheel_speed_rate
        )

    def observer_design(self) -> ObserverDesign:
        """As the synthesis takes it."""
        spec = self.gains
        channels = tuple(
            Channel(tuple(c.disturbances), tuple(c.errors), c.bound, tuple(c.weights) if c.weights else None)
            for c in spec.channels
        )
        settings = LmiSettings(relaxation=spec.relaxation, points=spec.points, solver=spec.solver)
        return ObserverDesign(
            channels, spec.degree, spec.decay_rate, spec.fastest_pole, backoff=spec.backoff, settings=settings
        )

    def design(self, model: LpvModel) -> ObserverGains:
        """The gains for the update that the specification names."""
        if self.deploy.update == "sampled":
            return design_sampled_observer(model, self.observer_design(), self.deploy.sample_time)
        return design_observer(model, self.observer_design())

    def deploy_settings(self) -> DeploySettings:
        """As the deployment takes it."""
        return DeploySettings(self.deploy.sample_time, self.deploy.dtype, self.deploy.interpolation_cost)

    def resolved(self, parameters: ParameterSet) -> dict[str, Any]:
        """The specification with the parameter values in it: what the digest in a schedule file speaks of."""
        return {
            **self.model_dump(mode="json", by_alias=True),
            "parameter_set": parameters.model_dump(mode="json", exclude_none=True),
        }


FASTEST = 3.0  # of a pole times the sample time, as in the shipped specifications of longitudinal observers


@dataclass(frozen=True)
class Variant:
    """The same specification for another wheel or another sample time: effective radius, m, and s; None keeps what it has.

    The fastest pole stays where it is, but below 3/sample_time (or what the specification itself allows), where sampling ends it.
    """

    radius: float | None = None
    sample_time: float | None = None

    def name(self, spec: str) -> str:
        """What the schedule is called, such as corner-estimation-longitudinal-400mm-10ms."""
        parts = [(self.radius, "mm"), (self.sample_time, "ms")]
        endings = [f"-{value * 1e3:g}{unit}".replace(".", "p") for value, unit in parts if value is not None]
        return spec + "".join(endings)

    def spec(self, base: ScheduleSpec) -> ScheduleSpec:
        """The specification at this sample time, with a name of its own."""
        gains, deploy = base.gains, base.deploy
        if self.sample_time is not None:
            deploy = deploy.model_copy(update={"sample_time": self.sample_time})
            if gains.fastest_pole is not None:
                times = max(FASTEST, gains.fastest_pole * base.deploy.sample_time)
                fastest = min(gains.fastest_pole, times / self.sample_time)
                gains = gains.model_copy(update={"fastest_pole": fastest})
        return base.model_copy(update={"name": self.name(base.name), "gains": gains, "deploy": deploy})

    def parameters(self, base: ParameterSet) -> ParameterSet:
        """The parameter set with this radius."""
        if self.radius is None:
            return base
        quantity = Quantity(value=self.radius, unit="m", source="given as --radius")
        return base.model_copy(update={"vehicle": {**base.vehicle, "effective_radius": quantity}})


def shipped_specs() -> dict[str, Path]:
    """The specifications that come with the package, by name."""
    return shipped_files("studies", "specs")


def load_spec(name: str | Path) -> tuple[ScheduleSpec, Path]:
    """A shipped specification by name or one of your own by path; returns it with its folder.

    Raises SpecError with the file, the key and what is wrong.
    """
    path = find_toml(name, shipped_specs(), "specification")
    return load_toml(path, ScheduleSpec, "specification"), path.parent
