"""The baseline: a small file in the repository, one line a statistic, against which later sweeps are held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import Field

from studies.execution.files import write_bytes
from studies.sweeps.summary import Statistic, Summary
from studies.sweeps.sweep import Sweep
from studies.sweeps.tables import versions
from synthesis.errors import SpecError
from synthesis.toml_file import StrictTable, read_table, read_toml

SCHEMA = "gainsmith.sweep-baseline/1"
DIGITS = 8
HEAD = """\
# The baseline of a sweep, one line a statistic. Written by `gainsmith sweep --update-baseline`; review its diff like code.
"""


class _StatisticLine(StrictTable):
    value: float = Field(allow_inf_nan=True)
    unit: str = "1"
    kind: str = "value"
    confidence: float | None = None
    design: int | None = None
    at: dict[str, float] = Field(default_factory=dict)


class _Constant(StrictTable):
    value: float
    unit: str


class _Nominal(StrictTable):
    constants: dict[str, _Constant]
    breakpoints: list[float]
    gains: list[list[list[float]]]


class _File(StrictTable):
    schema_: str = Field(alias="schema")
    sweep: str
    form: str
    sha256: str
    made_with: dict[str, str]
    nominal: dict[str, _Nominal]
    figures: dict[str, dict[str, _StatisticLine]]


@dataclass(frozen=True)
class Baseline:
    """What a sweep was once: its statistics, the constants and gains it was run around, and the digest of what was asked."""

    summary: Summary
    sha256: str
    nominal: Mapping[str, Mapping[str, Any]]
    made_with: Mapping[str, str]


def of_sweep(sweep: Sweep, summary: Summary) -> Baseline:
    """The baseline that a finished sweep makes, its values rounded as they are written."""
    statistics = tuple(
        replace(f, value=_rounded(f.value), at={k: _rounded(v) for k, v in f.at.items()}) for f in summary.statistics
    )
    made = {name: versions()[name] for name in ("gainsmith", "numpy", "scipy")}
    return Baseline(replace(summary, statistics=statistics), sweep.digest, sweep.nominal, made)


def write_baseline(path: Path, baseline: Baseline) -> None:
    """TOML, written beside and renamed."""
    lines = [HEAD, f'schema = "{SCHEMA}"', f'sweep = "{baseline.summary.sweep}"', f'form = "{baseline.summary.form}"']
    lines += [f'sha256 = "{baseline.sha256}"', f"made_with = {_inline(baseline.made_with)}"]
    for observer, nominal in baseline.nominal.items():
        lines += ["", f'[nominal."{observer}"]', f"breakpoints = {nominal['breakpoints']}", "gains = ["]
        lines += [f"  {row}," for row in nominal["gains"]]
        lines += ["]", f'[nominal."{observer}".constants]']
        lines += [f"{_key(name)} = {_inline(entry)}" for name, entry in nominal["constants"].items()]
    observer = ""
    for statistic in baseline.summary.statistics:
        if statistic.observer != observer:
            observer = statistic.observer
            lines += ["", f'[figures."{observer}"]']
        name = f"{statistic.measure} | {statistic.name}" if statistic.measure else statistic.name
        lines.append(f'"{name}" = {_statistic(statistic)}')
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, ("\n".join(lines) + "\n").encode(), sync=True)


def read_baseline(path: Path) -> Baseline:
    """Read and check. Raises SpecError, one line."""
    data = read_toml(path, "no such baseline; make it with --update-baseline")
    if data.get("schema") != SCHEMA:
        raise SpecError(f"{path}: schema {data.get('schema')!r} is not '{SCHEMA}'")
    found = read_table(_File, data, str(path))
    statistics = []
    for observer, entries in found.figures.items():
        for name, line in entries.items():
            measure, _, rest = name.rpartition(" | ")
            statistics.append(Statistic(observer, measure, rest, **line.model_dump()))
    nominal = {name: entry.model_dump() for name, entry in found.nominal.items()}
    return Baseline(Summary(found.sweep, found.form, tuple(statistics), ()), found.sha256, nominal, found.made_with)


def _statistic(statistic: Statistic) -> str:
    confidence = None if statistic.confidence is None else _rounded(statistic.confidence)
    parts = {"kind": statistic.kind, "unit": statistic.unit, "confidence": confidence, "design": statistic.design}
    usual = {"kind": "value", "unit": "1", "confidence": None, "design": None}
    unusual = {key: value for key, value in parts.items() if value != usual[key]}
    return _inline({"value": statistic.value, **unusual, **({"at": statistic.at} if statistic.at else {})})


def _inline(table: Mapping[str, Any]) -> str:
    return "{ " + ", ".join(f"{_key(name)} = {_value(value)}" for name, value in table.items()) + " }"


def _key(name: str) -> str:
    return name if name.replace("_", "a").replace("-", "a").isalnum() else f'"{name}"'


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return _inline(value)
    return f'"{value}"' if isinstance(value, str) else repr(value)  # repr of a float is TOML: 0.1, 1e-05, inf, nan


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
