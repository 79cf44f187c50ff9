"""Published parameter values as data: TOML files with units and sources."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from synthesis.models.param import Constant
from synthesis.toml_file import StrictTable, find_toml, load_toml, shipped_files


class Quantity(StrictTable):
    """A value with its unit and the place where it is printed."""

    value: float
    unit: str
    source: str

    @model_validator(mode="after")
    def _unit_exists(self) -> Self:
        self.constant()
        return self

    def constant(self) -> Constant:
        """As a model constant (checks the unit)."""
        return Constant(self.value, self.unit, self.source)


class Published(StrictTable):
    """Gains and matrices as the source prints them, for comparison; never used as a certificate."""

    model_config = ConfigDict(strict=False)  # a list of TOML becomes a tuple
    gains: tuple[float, ...] | None = None
    gains_high_slip: tuple[float, ...] | None = None
    gain_box: tuple[tuple[float, float], ...] | None = None
    gain_range: tuple[tuple[float, float], ...] | None = None
    lyapunov: tuple[tuple[tuple[str, ...], ...], ...] | None = None
    source: str


class Tire(StrictTable):
    """Average lumped LuGre tire in one direction."""

    sigma0: Quantity
    sigma1: Quantity
    sigma2: Quantity
    kappa: Quantity
    published: Published | None = None


class ParameterSet(StrictTable):
    """One vehicle with its tires, as published or as identified.

    >>> load_parameter_set("corner-estimation").tire["longitudinal"].sigma0.unit
    '1/m'
    """

    id: str
    citation: str
    note: str = ""
    vehicle: dict[str, Quantity]
    tire: Annotated[dict[str, Tire], Field(min_length=1)]


def load_parameter_set(name: str | Path, folder: Path = Path()) -> ParameterSet:
    """A shipped set by its name, or a set of your own by its path from ``folder`` (ends with .toml).

    Raises SpecError naming the file, the key and the remedy.

    >>> load_parameter_set("corner-estimation").vehicle["effective_radius"].value
    0.33
    """
    return load_toml(folder / find_toml(name, shipped_parameter_sets(), "parameter set"), ParameterSet, "parameter")


def shipped_parameter_sets() -> dict[str, Path]:
    """The parameter sets that come with the models, by name."""
    return shipped_files("synthesis.models", "parameters")


def quantities(tire: Tire) -> dict[str, Quantity]:
    """The four LuGre constants by name."""
    return {"sigma0": tire.sigma0, "sigma1": tire.sigma1, "sigma2": tire.sigma2, "kappa": tire.kappa}
