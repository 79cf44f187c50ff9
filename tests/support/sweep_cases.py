"""Small sweeps for tests, and folders as bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from studies.sweeps.spec import build_sweep
from studies.sweeps.sweep import Sweep

NOISE = {"id": "hinf_norm", "name": "noise_norm", "disturbances": ["force_noise"], "errors": ["relative_velocity"]}


def small(**changes: Any) -> dict[str, Any]:
    """The content of a sweep file: one schedule, few designs, few speeds."""
    content: dict[str, Any] = {
        "name": "small",
        "description": "for tests",
        "subjects": [{"schedule": "corner-estimation-longitudinal", "parameters": "corner-estimation"}],
        "vary": {"constants": {"relative": 0.2}},
        "grid": {"points": 5},
        "measures": [{"id": "stability_margin"}, NOISE, {"id": "critical_drop_probability"}],
        "designs": [{"kind": "one at a time", "levels": 3}, {"kind": "saltelli", "blocks": 16, "seed": 1}],
        "chunk": 14,
    }
    return {**content, **changes}


def sweep(**changes: Any) -> Sweep:
    """The same, built."""
    return build_sweep(small(**changes), Path())


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def many_chunks() -> Sweep:
    """101 chunks that cost next to nothing."""
    return sweep(designs=[{"kind": "latin hypercube", "samples": 200}], chunk=2, grid={"points": 2})
