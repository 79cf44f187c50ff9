"""A truth vehicle: published masses, lengths and tires, and what a sheet does not give but a moving car has."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from zlib import crc32

import numpy as np

from estimators.display import Display
from estimators.errors import unknown
from estimators.vehicle import VehicleParameters
from estimators.velocity.suspension import SuspensionParameters
from studies.truth.drivetrain import Drivetrain
from studies.truth.lugre import LuGreParameters
from studies.truth.magic_formula import MagicFormulaParameters
from synthesis.errors import SpecError
from synthesis.models.parameter_set import ParameterSet, load_parameter_set
from synthesis.toml_file import shipped_files

SUSPENSION = {
    "suspension_stiffness_longitudinal",
    "suspension_stiffness_lateral",
    "suspension_damping",
    "unsprung_mass",
}


@dataclass(frozen=True)
class Chassis:
    """Springs, dampers, inertias and drag of the body: typical of passenger cars, given by no sheet.

    Raises SpecError for a value that is not finite and above zero (drag, rolling resistance, bars: zero or above).
    """

    roll_inertia_ratio: float = 0.2  # I_x/I_z
    pitch_inertia_ratio: float = 0.9  # I_y/I_z
    front_ride_frequency: float = 1.25  # Hz, of a corner's share of the mass on its spring
    rear_ride_frequency: float = 1.4  # Hz
    ride_damping: float = 0.35  # damping ratio of the corners
    anti_roll_ratio: float = 0.5  # roll stiffness of both bars over that of the springs
    anti_roll_front_share: float = 0.6  # of the bars' stiffness
    load_lag: float = 0.01  # s, with which links pass on lateral load transfer: a wheel on its tire's vertical spring
    drag_area: float = 0.8  # c_d A, m^2
    rolling_resistance: float = 0.01  # c_rr

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            free = entry.name in {"anti_roll_ratio", "anti_roll_front_share", "drag_area", "rolling_resistance"}
            if not (math.isfinite(value) and (value > 0 or (free and value == 0))):
                bound = "at least 0" if free else "above 0"
                raise SpecError(f"chassis.{entry.name} = {value!r}: must be finite and {bound}")


@dataclass(frozen=True, repr=False)
class TruthVehicle(Display):
    """One car of the truth; `parameters` is what estimators may know of it (exactly, or with an error of their own)."""

    name: str
    parameters: VehicleParameters
    lugre: LuGreParameters
    drivetrain: Drivetrain = field(default_factory=Drivetrain)
    chassis: Chassis = field(default_factory=Chassis)
    suspension: SuspensionParameters = field(default_factory=SuspensionParameters)  # defaults: P3 Table I
    magic_formula: MagicFormulaParameters = field(default_factory=MagicFormulaParameters)

    def changed(self, **changes: object) -> TruthVehicle:
        """A copy with other parts; keys of `VehicleParameters` and `Chassis` are taken too, such as ``mass=2000.0``."""
        base = {entry.name for entry in fields(VehicleParameters) if entry.init}
        body, own = {entry.name for entry in fields(Chassis)}, {entry.name for entry in fields(TruthVehicle)}
        for name in changes:
            if name not in base | body | own:
                raise SpecError(f"truth vehicle '{self.name}': {unknown('parameter', name, base | body | own)}")
        # rolling_resistance is in both: the truth has it, and what estimators know of it is their own business
        chassis = {k: v for k, v in changes.items() if k in body}
        car = {k: v for k, v in changes.items() if k in base - body}
        rest: dict[str, object] = {k: v for k, v in changes.items() if k in own}
        if chassis:
            rest["chassis"] = replace(self.chassis, **chassis)  # type: ignore[arg-type]
        if car:
            rest["parameters"] = replace(self.parameters, **car)  # type: ignore[arg-type]
        return replace(self, **rest)  # type: ignore[arg-type]


def vehicle_parameters(values: ParameterSet) -> VehicleParameters:
    """The car of a parameter set as the estimators take it. Raises SpecError naming what the set lacks."""
    given = {
        entry.name: values.vehicle[entry.name].value
        for entry in fields(VehicleParameters)
        if entry.init and entry.name in values.vehicle
    }
    try:
        return VehicleParameters(**given)
    except TypeError as error:
        raise SpecError(f"parameter set '{values.id}': {error}; add it to [vehicle]") from None


def load_vehicle(name: str | Path, folder: Path = Path()) -> TruthVehicle:
    """The truth vehicle of a parameter set: shipped with the models or with the truth by name, or a TOML file in ``folder``.

    Raises SpecError: no such set, or values that no car has.

    >>> load_vehicle("peugeot-307").parameters.mass  # kg
    1447.0
    """
    own = shipped_vehicles()
    values = load_parameter_set(own.get(str(name), name), folder)
    given = {key: entry.value for key, entry in values.vehicle.items()}
    suspension = SuspensionParameters()
    if "suspension_stiffness_longitudinal" in given:
        if missing := sorted(SUSPENSION - given.keys()):
            raise SpecError(f"parameter set '{values.id}': its suspension needs {', '.join(missing)}; add to [vehicle]")
        suspension = SuspensionParameters(
            stiffness_x=given["suspension_stiffness_longitudinal"], stiffness_y=given["suspension_stiffness_lateral"],
            damping_x=given["suspension_damping"], damping_y=given["suspension_damping"],
            unsprung_mass=given["unsprung_mass"],
        )  # fmt: skip
    return TruthVehicle(values.id, vehicle_parameters(values), LuGreParameters.of(values), suspension=suspension)


def shipped_vehicles() -> dict[str, Path]:
    """Vehicles that only the truth needs, by name; those of the models are found by `load_parameter_set`."""
    return shipped_files("studies.truth", "vehicles")


def varied(vehicle: TruthVehicle, spread: Mapping[str, float], seeds: Sequence[int]) -> list[TruthVehicle]:
    """One car per seed, each parameter of ``spread`` times 1 + spread u, u uniform in [-1, 1].

    Keys are those of `VehicleParameters` and `Chassis`; a seed gives a parameter the same u whatever else is varied.
    Raises SpecError for an unknown key or a spread outside [0, 1).
    """
    known = {entry.name for kind in (VehicleParameters, Chassis) for entry in fields(kind) if entry.init}
    for name, size in spread.items():
        if name not in known:
            raise SpecError(f"spread: {unknown('parameter', name, known)}")
        if not 0.0 <= size < 1.0:
            raise SpecError(f"spread of {name} = {size!r}: a share of the value, at least 0 and below 1")
    cars = []
    for seed in seeds:
        changes: dict[str, object] = {}
        for name, size in spread.items():
            rng = np.random.default_rng(np.random.SeedSequence((seed, crc32(name.encode()))))
            owner = vehicle.chassis if hasattr(vehicle.chassis, name) else vehicle.parameters
            factor = 1.0 + size * rng.uniform(-1.0, 1.0)
            value = getattr(owner, name)
            changes[name] = tuple(v * factor for v in value) if isinstance(value, tuple) else value * factor
        cars.append(vehicle.changed(**changes))
    return cars
