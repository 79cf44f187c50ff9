"""The tables of a specification of a schedule, key by key."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from studies.weight_spec import WeightSpec
from synthesis.design.norms import Norm
from synthesis.toml_file import StrictTable


class ModelSpec(StrictTable):
    """A model file of your own, or a model of the catalogue with its parameter values and its box."""

    file: str | None = Field(default=None, examples=["plant.toml"])
    id: str | None = None
    parameters: str | None = None
    wheel_speed_maximum: float | None = Field(default=None, gt=0)
    wheel_speed_rate: float | None = Field(default=None, ge=0)

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Self:
        catalogue = ("id", "parameters", "wheel_speed_maximum", "wheel_speed_rate")
        given = [key for key in catalogue if getattr(self, key) is not None]
        if self.file is not None and given:
            raise ValueError(f"{given[0]} stands beside file; a model file says everything of its model, so remove it")
        if self.file is None and len(given) < len(catalogue):
            missing = next(key for key in catalogue if key not in given)
            raise ValueError(f'{missing} is missing; add it, or name a model file: file = "plant.toml"')
        return self


class ChannelSpec(StrictTable):
    """One channel of the design; without `bound` it is the one that is minimised.

    An observer has `errors`, a feedback law `performance` signals with `sizes`. `norm`: what is bounded, the L2 gain if it is
    left out (synthesis.design.norms).
    """

    disturbances: list[str] = Field(min_length=1)
    errors: list[str] | None = Field(default=None, min_length=1)
    performance: list[str] | None = Field(default=None, min_length=1)
    bound: float | None = Field(default=None, gt=0)
    weights: list[float] | None = None
    sizes: list[float] | None = None
    norm: Norm | None = None


class RegionsSpec(StrictTable):
    """Where every frozen pole s is to lie (synthesis.design.pole_regions): 1/s, a ratio, 1/s twice, rad/s.

    Of a sampled design the strips (synthesis.design.sampled_regions), and centre and radius of a disc of the poles z = exp(s T).
    """

    disc: float | None = Field(default=None, gt=0)
    damping: float | None = Field(default=None, gt=0, lt=1)
    vertical_strip: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    horizontal_strip: float | None = Field(default=None, gt=0)
    sampled_disc: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None


class DesignSpec(StrictTable):
    """What is asked of the gains of an observer (synthesis.design.hinf_observer), or of the feedback law that is named."""

    law: Literal["state feedback", "sampled state feedback", "output feedback", "static output feedback"] | None = None
    degree: int = 1
    decay_rate: float = 0.0
    fastest_pole: float | None = None
    regions: RegionsSpec | None = Field(default=None, examples=["{ vertical_strip = [2.0, 80.0] }"])
    damping: float | None = None
    input_limits: dict[str, float] | None = None
    state_sizes: dict[str, float] | None = None
    feedthrough: bool | None = None
    measured: list[str] | None = Field(default=None, min_length=1)
    start: list[list[float]] | None = Field(default=None, min_length=1)
    uses: list[Annotated[list[str], Field(min_length=2, max_length=2)]] | None = Field(default=None, min_length=1)
    backoff: float = 0.02
    relaxation: Literal["auto", "grid", "vertex", "exact"] = "auto"
    points: int = 140
    solver: str = "CLARABEL"
    dynamic_weights: list[WeightSpec] | None = Field(default=None, min_length=1)
    channels: list[ChannelSpec] = Field(min_length=1)


class DeploySpec(StrictTable):
    """How the gains become a table (synthesis.design.deploy) and how they are run (synthesis.loop.observer)."""

    update: Literal["held", "sampled"] = "held"
    sample_time: float
    dtype: Literal["float32", "float64"] = "float64"
    interpolation_cost: float = 0.01
    limits: dict[str, Annotated[list[float], Field(min_length=2, max_length=2)]] | None = None
