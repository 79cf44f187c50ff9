"""The gate: what shrank, where, and what did it; with the shipped baseline as the thing that must break."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from estimators.schedule import SHIPPED, read_content, write_content
from studies.execution.processes import Serial
from studies.sweeps.baseline import Baseline, of_sweep, read_baseline, write_baseline
from studies.sweeps.engine import run_sweep
from studies.sweeps.gate import Comparison, compare
from studies.sweeps.reports import junit, markdown
from studies.sweeps.spec import build_sweep, shipped_sweeps
from studies.sweeps.summary import UNPROVED, Summary
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError
from tests.support.sweep_cases import small, sweep

NAME = "corner-estimation-longitudinal"
PARAMETERS = Path(str(resources.files("synthesis.models") / "parameters"))
BASELINES = Path(str(resources.files("studies.sweeps") / "baselines"))


def parameter_file(folder: Path, **factors: float) -> str:
    """A copy of P1's parameters with some longitudinal constants multiplied."""
    text = (PARAMETERS / "corner-estimation.toml").read_text()
    head, longitudinal, rest = re.split(r"(\[tire\.longitudinal\]\n(?:.+\n)*)", text, maxsplit=1)
    for name, factor in factors.items():
        value = tomllib.loads(head + longitudinal)["tire"]["longitudinal"][name]["value"]
        old = f"{name} = {{ value = {value}"
        assert longitudinal.count(old) == 1
        longitudinal = longitudinal.replace(old, f"{name} = {{ value = {value * factor!r}")
    (folder / "changed.toml").write_text(head + longitudinal + rest)
    return "changed.toml"


def run(folder: Path, content: dict[str, Any], quick: bool = False) -> tuple[Sweep, Summary]:
    whole = build_sweep(content, folder, quick)
    return whole, run_sweep(whole, folder / "out", Serial()).summary


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> Baseline:
    folder = tmp_path_factory.mktemp("before")
    whole, summary = run(folder, small())
    write_baseline(folder / "baseline.toml", of_sweep(whole, summary))
    return read_baseline(folder / "baseline.toml")


def against(before: Baseline, folder: Path, **changes: Any) -> list[Comparison]:
    whole, summary = run(folder, small(**changes))
    return compare(whole, summary, before)


def observers(parameters: str = "corner-estimation", schedule: str = NAME) -> list[dict[str, str]]:
    return [{"schedule": schedule, "parameters": parameters, "name": NAME}]


def test_nothing_shrinks_against_itself(before: Baseline, tmp_path: Path) -> None:
    compared = against(before, tmp_path)
    assert {j.state for j in compared} == {"same"} and len(compared) > 40


def test_baseline_reads_back_and_is_one_line_a_statistic(before: Baseline, tmp_path: Path) -> None:
    write_baseline(tmp_path / "again.toml", before)
    text = (tmp_path / "again.toml").read_text()
    again = read_baseline(tmp_path / "again.toml")
    assert again == replace(before, summary=again.summary) and again.summary.statistics == before.summary.statistics
    lines = [line for line in text.splitlines() if "value = " in line and " | " in line]
    assert len(lines) == sum(bool(f.measure) for f in before.summary.statistics)
    assert 'sigma1 = { value = 0.76, unit = "s/m" }' in text


def test_lower_sigma1_shrinks_the_margin_and_is_named(before: Baseline, tmp_path: Path) -> None:
    compared = against(before, tmp_path, subjects=observers(parameter_file(tmp_path, sigma1=0.9)))
    bad = {(j.before.measure, j.before.name): j for j in compared if not j.good}
    margin = bad["stability_margin", "nominal"]
    assert "sigma1 0.76 -> 0.684 s/m (-10 %) does it" in margin.line
    assert margin.after is not None and margin.after.at["sigma1"] == pytest.approx(0.684)
    assert margin.loss == pytest.approx((margin.after.value - margin.before.value) / abs(margin.before.value))
    assert ("noise_norm", "nominal") not in bad  # sigma1 does not enter it


def test_of_two_changes_the_one_that_did_it_is_named(before: Baseline, tmp_path: Path) -> None:
    """kappa costs the norm, sigma2 next to nothing; and kappa by itself gives the same loss."""
    both = against(before, tmp_path, subjects=observers(parameter_file(tmp_path, kappa=1.1, sigma2=0.9)))
    norm = next(j for j in both if (j.before.measure, j.before.name) == ("noise_norm", "worst"))
    assert not norm.good
    share = re.search(r"kappa 8\.32 -> 9\.152 1/m \(\+10 %\) alone does ([0-9.]+) % of it", norm.cause)
    assert share is not None and 95.0 < float(share[1]) < 105.0


def test_changed_gains_name_the_schedule(before: Baseline, tmp_path: Path) -> None:
    content = read_content(SHIPPED / f"{NAME}.json")
    for row in content["gain"]["table"]:
        row[1][0] *= 0.8
    write_content(tmp_path / "weak.json", content)
    compared = against(before, tmp_path, subjects=observers(schedule="weak.json"))
    bad = [j for j in compared if j.state == "shrunk"]
    assert bad and all(j.cause == f"the schedule '{NAME}': its gains changed does it" for j in bad)


def test_another_code_is_named_when_nothing_else_changed(before: Baseline, tmp_path: Path) -> None:
    worse = [
        replace(f, value=f.value * 1.5) if (f.measure, f.name) == ("stability_margin", "worst") else f
        for f in before.summary.statistics
    ]
    compared = against(replace(before, summary=replace(before.summary, statistics=tuple(worse))), tmp_path)
    bad = [j for j in compared if not j.good]
    assert len(bad) == 1 and "the code or its versions did" in bad[0].cause


def test_missing_statistics_and_new_outcomes_break_it(before: Baseline, tmp_path: Path) -> None:
    whole, summary = run(tmp_path, small())
    fewer = replace(summary, statistics=tuple(f for f in summary.statistics if f.name != "median"))
    gone = [j for j in compare(whole, fewer, before) if not j.good]
    assert len(gone) == 3 and all("not made any more" in j.line for j in gone)
    more = tuple(replace(f, value=2.0) if f.name == "invalid designs" else f for f in summary.statistics)
    (new,) = [j for j in compare(whole, replace(summary, statistics=more), before) if not j.good]
    assert "invalid designs: 0 -> 2" in new.line
    moved = tuple(replace(f, value=f.value + 0.6) if f.name == "total index kappa" else f for f in summary.statistics)
    report = compare(whole, replace(summary, statistics=moved), before)
    assert {j.state for j in report} == {"same", "moved"} and all(j.good for j in report)  # told, and breaks nothing


def test_a_baseline_of_something_else_is_refused(before: Baseline, tmp_path: Path) -> None:
    whole, summary = run(tmp_path, small(vary={"constants": {"relative": 0.3}}))
    with pytest.raises(SpecError, match="another definition"):
        compare(whole, summary, before)
    with pytest.raises(SpecError, match="is of sweep 'small'"):
        compare(sweep(name="other"), summary, before)
    with pytest.raises(SpecError, match="--update-baseline"):
        read_baseline(tmp_path / "absent.toml")
    (tmp_path / "old.toml").write_text('schema = "gainsmith.sweep-baseline/0"')
    with pytest.raises(SpecError, match="schema"):
        read_baseline(tmp_path / "old.toml")


def test_reports_say_the_same(before: Baseline, tmp_path: Path) -> None:
    changed = small(subjects=observers(parameter_file(tmp_path, sigma1=0.9)))
    whole, summary = run(tmp_path, changed)
    compared = compare(whole, summary, before)
    bad = [j for j in compared if not j.good]
    suite = ElementTree.fromstring(junit(whole.name, summary, compared))[0]
    assert int(suite.get("tests", "")) == len(compared) and int(suite.get("failures", "")) == len(bad)
    failures = [f.get("message", "") for f in suite.iter("failure")]
    assert failures == [j.line for j in bad] and any("sigma1" in f for f in failures)
    page = markdown(summary, compared)
    assert f"**{len(bad)} of {len(compared)} statistics shrank" in page and "sigma1 0.76 -> 0.684" in page
    assert "Nothing shrank" in markdown(summary, [j for j in compared if j.good])


def test_statistics_are_those_of_the_rows(tmp_path: Path) -> None:
    """Worst and quantiles against all rows at once."""
    import pyarrow.parquet as pq

    whole, summary = run(tmp_path, small())
    parts = [pq.read_table(p) for p in sorted((tmp_path / "out").glob("rows/*/*/*.parquet"))]
    for measure in whole.measures:
        signed = measure.sign * np.concatenate([p.column(measure.name).to_numpy() for p in parts])
        stage = np.concatenate([np.array(p.column("stage").to_pylist()) for p in parts])
        worst = summary.of(NAME, measure.name, "worst")
        assert worst is not None and measure.sign * worst.value == signed.max()
        assert worst.design == int(signed.argmax())
        for name, share in (("median", 0.5), ("quantile 95 %", 0.95), ("quantile 99 %", 0.99)):
            found = summary.of(NAME, measure.name, name)
            wanted = np.quantile(signed[stage == "saltelli"], share, method="inverted_cdf")
            assert found is not None and measure.sign * found.value == wanted


@pytest.mark.parametrize("name", sorted(shipped_sweeps()))
@pytest.mark.parametrize("form", ["full", "quick"])
def test_shipped_baselines_are_of_the_shipped_sweeps(name: str, form: str) -> None:
    content = tomllib.loads(shipped_sweeps()[name].read_text())
    whole = build_sweep(content, Path(), quick=form == "quick")
    found = read_baseline(BASELINES / (f"{name}.toml" if form == "full" else f"{name}.quick.toml"))
    assert found.sha256 == whole.digest and found.nominal == whole.nominal


@pytest.mark.parametrize("factor", [1.1, 0.9])
def test_sigma1_changed_by_ten_per_cent_breaks_the_shipped_baseline(tmp_path: Path, factor: float) -> None:
    """The negative control, in both directions: one costs margin; the other costs none, but the proof is of another tire."""
    content = tomllib.loads(shipped_sweeps()["tire-vehicle"].read_text())
    baseline = read_baseline(BASELINES / "tire-vehicle.quick.toml")
    whole, summary = run(tmp_path, content, quick=True)
    assert all(j.good for j in compare(whole, summary, baseline))
    content["subjects"][0]["parameters"] = parameter_file(tmp_path, sigma1=factor)
    (tmp_path / "changed").mkdir()
    changed = build_sweep(content, tmp_path, quick=True)
    summary = run_sweep(changed, tmp_path / "changed", Serial()).summary
    bad = [j for j in compare(changed, summary, baseline) if not j.good]
    assert bad and all("sigma1" in j.cause and j.before.observer == NAME for j in bad)
    assert any(j.before.name == UNPROVED for j in bad)
    assert any(j.before.measure == "stability_margin" for j in bad) == (factor < 1.0)
