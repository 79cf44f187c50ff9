"""Published parameter values as data: TOML files with units and sources."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from estimators.errors import unknown
from synthesis.errors import ModelError, SpecError
from synthesis.models.param import Constant


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Quantity(_Strict):
    """A value with its unit and the place where it is printed."""

    value: float
    unit: str
    source: str

    def constant(self) -> Constant:
        """As a model constant (checks the unit)."""
        return Constant(self.value, self.unit, self.source)


class Published(_Strict):
    """Gains and matrices as the source prints them, for comparison; never used as a certificate."""

    gains: tuple[float, ...] | None = None
    gains_high_slip: tuple[float, ...] | None = None
    gain_box: tuple[tuple[float, float], ...] | None = None
    gain_range: tuple[tuple[float, float], ...] | None = None
    lyapunov: tuple[tuple[tuple[str, ...], ...], ...] | None = None
    source: str


class Tire(_Strict):
    """Average lumped LuGre tire in one direction."""

    sigma0: Quantity
    sigma1: Quantity
    sigma2: Quantity
    kappa: Quantity
    published: Published | None = None


class ParameterSet(_Strict):
    """One vehicle with its tires, as published or as identified."""

    id: str
    citation: str
    note: str = ""
    vehicle: dict[str, Quantity]
    tire: Annotated[dict[str, Tire], Field(min_length=1)]


def load_parameter_set(name: str | Path) -> ParameterSet:
    """A shipped set by its name, or a set of your own by its path (ends with .toml).

    Raises SpecError naming the file, the key and the remedy.
    """
    path = Path(name)
    if path.suffix == ".toml":
        where, read = str(path), path.read_bytes
        if not path.is_file():
            raise SpecError(f"{path}: no such parameter file")
    else:
        folder = resources.files("synthesis.models") / "parameters"
        names = sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))
        if str(name) not in names:
            raise SpecError(unknown("parameter set", str(name), names))
        where, read = f"{name}.toml", (folder / f"{name}.toml").read_bytes
    try:
        data: dict[str, Any] = tomllib.loads(read().decode("utf-8"))
        found = ParameterSet.model_validate(data)
        for entry in (*found.vehicle.values(), *(q for t in found.tire.values() for q in quantities(t).values())):
            entry.constant()
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, ModelError) as error:
        raise SpecError(f"{where}: {error}") from None
    except ValidationError as error:
        raise SpecError(f"{where}: {first_line(error)}") from None
    return found


def quantities(tire: Tire) -> dict[str, Quantity]:
    """The four LuGre constants by name."""
    return {"sigma0": tire.sigma0, "sigma1": tire.sigma1, "sigma2": tire.sigma2, "kappa": tire.kappa}


def first_line(error: ValidationError) -> str:
    """All violations of a file in one line: key and what is wrong with it."""
    parts = [f"{'.'.join(str(part) for part in entry['loc'])}: {entry['msg'].lower()}" for entry in error.errors()]
    return "; ".join(parts)
