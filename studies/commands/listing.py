"""Output of `gainsmith list`."""

from __future__ import annotations

import json
from importlib import resources

from studies.registry import MODULES
from studies.spec import load_spec, shipped_specs
from synthesis.models.catalogue import CATALOGUE


def run_list(as_json: bool) -> int:
    """What comes with the package."""

    def stems(package: str, folder: str, ending: str) -> list[str]:
        entries = (resources.files(package) / folder).iterdir()
        return sorted(entry.name.removesuffix(ending) for entry in entries if entry.name.endswith(ending))

    found = {
        "specifications": {name: load_spec(name)[0].description for name in shipped_specs()},
        "parameter sets": stems("synthesis.models", "parameters", ".toml"),
        "models": sorted(CATALOGUE),
        "schedules": stems("estimators", "schedules", ".json"),
        "studies": list(MODULES),
        "sweeps": stems("studies", "sweeps/specs", ".toml"),
        "manoeuvres": stems("studies", "manoeuvres", ".toml"),
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
