"""Specifications of schedules: TOML files that name a model, parameter values and what is asked of the gains."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from estimators.errors import unknown
from studies.law_spec import (
    FeedbackDesign,
    check_keys,
    design_feedback,
    feedback_design,
    regions_of,
    without_other_laws,
)
from studies.spec_tables import DeploySpec, DesignSpec, ModelSpec
from studies.weight_spec import weighed
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.law_table import Gains
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.errors import SpecError
from synthesis.exchange.model_file import load_model
from synthesis.exchange.model_text import model_text
from synthesis.lmi.settings import LmiSettings
from synthesis.models.catalogue import CATALOGUE
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, Quantity, load_parameter_set
from synthesis.toml_file import StrictTable, find_toml, read_table, read_toml, shipped_files
from synthesis.toml_places import Places

OBSERVER, FEEDBACK = "-observer", "-feedback"  # end the names of examples' specifications


@dataclass(frozen=True)
class Plant:
    """The model that a specification is about, with the parameter set that it was built from, if it was."""

    model: LpvModel
    parameters: ParameterSet | None

    @property
    def published_gains(self) -> tuple[tuple[float, float], ...] | None:
        """The range of gains that the source of a catalogue model prints."""
        if self.parameters is None:
            return None
        tire = self.parameters.tire.get(self.model.name.removeprefix("corner-velocity-"))
        return None if tire is None or tire.published is None else tire.published.gain_range


class ScheduleSpec(StrictTable):
    """A whole specification."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9-]*$")
    description: str
    model: ModelSpec
    gains: DesignSpec = Field(alias="design")
    deploy: DeploySpec

    @model_validator(mode="after")
    def _keys_of_the_law(self) -> Self:
        check_keys(self.gains, self.deploy)
        return self

    @property
    def law(self) -> str | None:
        """The feedback law that is designed; None for an observer."""
        return self.gains.law

    def plant(self, folder: Path = Path(), radius: float | None = None) -> Plant:
        """The model: a file beside the specification, or one of the catalogue, on request with another effective radius, m."""
        if self.model.file is None:
            parameters = self.parameter_set(folder)
            if radius is not None:
                quantity = Quantity(value=radius, unit="m", source="given as --radius")
                vehicle = {**parameters.vehicle, "effective_radius": quantity}
                parameters = parameters.model_copy(update={"vehicle": vehicle})
            return Plant(self._weighed(self.build_model(parameters)), parameters)
        if radius is not None:
            raise SpecError(
                f"spec '{self.name}': --radius is for models of the catalogue; edit {self.model.file} instead"
            )
        if Path(self.model.file).suffix != ".toml":
            raise SpecError(f"spec '{self.name}': model.file '{self.model.file}' is not a .toml file; give its path")
        return Plant(self._weighed(load_model(folder / self.model.file)), None)

    @property
    def weight_states(self) -> int:
        """Of dynamic weights, the last states of the model."""
        return sum(weight.order for weight in self.gains.dynamic_weights or ())

    def _weighed(self, model: LpvModel) -> LpvModel:
        return weighed(model, self.gains.dynamic_weights or (), self.law)

    def parameter_set(self, folder: Path = Path()) -> ParameterSet:
        """The parameter values of a catalogue model: a shipped set by name, or a TOML file beside the specification."""
        if self.model.parameters is None:
            raise SpecError(f"spec '{self.name}': its model is the file {self.model.file}, which has no parameter set")
        return load_parameter_set(self.model.parameters, folder)

    def build_model(self, parameters: ParameterSet) -> LpvModel:
        """The catalogue model over its box."""
        if self.model.id not in CATALOGUE:
            raise SpecError(f"spec '{self.name}': {unknown('model', str(self.model.id), CATALOGUE)}")
        return CATALOGUE[self.model.id](
            parameters, wheel_speed_maximum=self.model.wheel_speed_maximum, wheel_speed_rate=self.model.wheel_speed_rate
        )

    def observer_design(self) -> ObserverDesign:
        """As the synthesis takes it."""
        spec = self.gains
        channels = tuple(
            Channel(
                tuple(c.disturbances), tuple(c.errors or ()), c.bound, tuple(c.weights) if c.weights else None, norm
            )
            for c in spec.channels
            for norm in (c.norm or "H-infinity",)
        )
        settings = LmiSettings(relaxation=spec.relaxation, points=spec.points, solver=spec.solver)
        return ObserverDesign(
            channels, spec.degree, spec.decay_rate, spec.fastest_pole, backoff=spec.backoff, settings=settings,
            regions=regions_of(spec),
        )  # fmt: skip

    def feedback_design(self) -> FeedbackDesign:
        """As the synthesis takes it, of a feedback law."""
        return feedback_design(self.gains)

    def design(self, model: LpvModel) -> Gains:
        """The gains for the law and the update that the specification names."""
        if self.law is not None:
            return design_feedback(model, self.feedback_design(), self.law, self.deploy.sample_time, self.weight_states)
        if self.deploy.update == "sampled":
            return design_sampled_observer(model, self.observer_design(), self.deploy.sample_time)
        return design_observer(model, self.observer_design())

    def deploy_settings(self) -> DeploySettings:
        """As the deployment takes it."""
        deploy = self.deploy
        limits = {name: (pair[0], pair[1]) for name, pair in (deploy.limits or {}).items()}
        return DeploySettings(deploy.sample_time, deploy.dtype, deploy.interpolation_cost, limits=limits)

    def resolved(self, plant: Plant) -> dict[str, Any]:
        """The specification with the values of its model in it: what the digest in a schedule file speaks of."""
        own = without_other_laws(self.model_dump(mode="json", by_alias=True))
        own["model"] = {key: value for key, value in own["model"].items() if value is not None}
        if plant.parameters is None:
            return {**own, "model_text": model_text(plant.model).splitlines()}
        return {**own, "parameter_set": plant.parameters.model_dump(mode="json", exclude_none=True)}


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


def shipped_specs() -> dict[str, Path]:
    """The specifications that come with the package, by name.

    >>> "longitudinal-speed" in shipped_specs()
    True
    """
    return shipped_files("studies", "specs")


def shipped_examples() -> dict[str, Path]:
    """The model files of the examples by name; the specification of each is beside it (NAME-observer, NAME-feedback)."""
    return {name: path for name, path in _examples().items() if not name.endswith((OBSERVER, FEEDBACK))}


def example_specs() -> dict[str, Path]:
    """The specifications of the examples by name: NAME-observer, NAME-feedback."""
    return {name: path for name, path in _examples().items() if name.endswith((OBSERVER, FEEDBACK))}


def _examples() -> dict[str, Path]:
    return shipped_files("studies", "examples")


def any_model(name: str | Path) -> LpvModel:
    """The model of a model file, of a specification, or of an example or shipped specification by name. Raises GainsmithError."""
    path = find_toml(name, {**shipped_specs(), **_examples()}, "model")
    if "matrices" not in (data := read_toml(path, "model")) and "design" in data:
        spec, folder = load_spec(path)
        return spec.plant(folder).model
    return load_model(path)


def load_spec(name: str | Path) -> tuple[ScheduleSpec, Path]:
    """A shipped specification (of a schedule or an example) by name, or one of your own by path; returns it with its folder.

    Raises SpecError with the file, the key and what is wrong.

    >>> spec, folder = load_spec("quarter-car-observer")
    >>> spec.deploy.update, spec.plant(folder).model.name
    ('sampled', 'quarter-car')
    """
    path = find_toml(name, {**shipped_specs(), **example_specs()}, "specification")
    data = read_toml(path, "specification")
    if "matrices" in data:
        raise SpecError(f'{path.name}: is a model file; a specification names it: file = "{path.name}" in [model]')
    return read_table(ScheduleSpec, data, path.name, Places(path.read_text(encoding="utf-8"))), path.parent
