"""Output of `gainsmith list`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from estimators.schedule import SHIPPED
from studies.registry import MODULES
from studies.spec import example_specs, shipped_specs
from synthesis.models.catalogue import CATALOGUE
from synthesis.models.parameter_set import shipped_parameter_sets
from synthesis.toml_file import read_toml, shipped_files


def run_list(as_json: bool) -> int:
    """What comes with the package."""
    found = {
        "specifications": _described(shipped_specs()),
        "examples": _described(example_specs()),
        "parameter sets": sorted(shipped_parameter_sets()),
        "models": sorted(CATALOGUE),
        "schedules": sorted(path.stem for path in SHIPPED.glob("*.json")),
        "studies": list(MODULES),
        "sweeps": sorted(shipped_files("studies", "sweeps/specs")),
        "manoeuvres": sorted(shipped_files("studies", "manoeuvres")),
    }
    if as_json:
        print(json.dumps(found, indent=1))
        return 0
    for heading, entries in found.items():
        print(f"{heading}:")
        for entry in entries:
            note = f"  {entries[entry]}" if isinstance(entries, dict) else ""
            print(f"  {entry:<32}{note}".rstrip())
    return 0


def _described(specs: Mapping[str, Path]) -> dict[str, str]:
    """As they stand in the files: to check a weight loads libraries that a list need not wait for."""
    return {name: read_toml(path, "specification")["description"] for name, path in specs.items()}
