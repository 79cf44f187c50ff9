"""The command: exit codes, one line on bad input, what it leaves behind."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from studies.cli import main
from studies.sweeps.baseline import read_baseline
from studies.sweeps.spec import shipped_sweeps

SPEC = """
name = "mine"
description = "for tests"
chunk = 14
measures = [{ id = "stability_margin" }, { id = "critical_drop_probability" }]
designs = [{ kind = "one at a time", levels = 3 }, { kind = "saltelli", blocks = 8 }, { kind = "worst case", samples = 4, generations = 0 }]
grid.points = 3
vary.constants.relative = 0.2

[[subjects]]
name = "tire"
schedule = "corner-estimation-longitudinal"
PARAMETERS

[quick]
points = 2
designs = [{ kind = "corners" }]
"""  # noqa: E501


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(SPEC.replace("PARAMETERS", 'parameters = "corner-estimation"'))
    return path


def sweep(spec: Path | str, out: Path, *more: str) -> int:
    return main(["sweep", str(spec), "--workers", "1", "--out", str(out), *more])


def test_gate_end_to_end(spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Write the baseline, pass it, change the tire, fail with the parameter named, accept it with a diff that can be read."""
    baseline, out = tmp_path / "ci" / "baseline.toml", tmp_path / "out"
    gate = ("--quick", "--baseline", str(baseline))
    assert sweep(spec, out / "first", *gate, "--update-baseline") == 0
    first = baseline.read_text()
    capsys.readouterr()
    assert sweep(spec, out / "first", "--resume", *gate) == 0
    assert "nothing shrank" in capsys.readouterr().out
    assert (out / "first" / "pictures" / "before-after.svg").exists()

    tire = Path("synthesis/models/parameters/corner-estimation.toml")
    text = (Path(__file__).parents[2] / tire).read_text().replace("value = 0.76,", "value = 0.684,")
    (tmp_path / "tire.toml").write_text(text)
    spec.write_text(SPEC.replace("PARAMETERS", 'parameters = "tire.toml"'))
    junit, summary = tmp_path / "ci" / "junit.xml", tmp_path / "ci" / "summary.md"
    more = (*gate, "--junit", str(junit), "--summary", str(summary))
    assert sweep(spec, out / "second", *more) == 1
    assert "sigma1 0.76 -> 0.684" in " ".join(capsys.readouterr().out.split())
    assert any("sigma1" in f.get("message", "") for f in ElementTree.fromstring(junit.read_bytes()).iter("failure"))
    assert "sigma1" in summary.read_text()
    drawn = {p.stem for p in (out / "second" / "pictures").iterdir()}
    assert drawn == {"before-after", "tire-map"}  # corners alone have no tornado and no cloud
    assert sweep(spec, out / "first", "--resume", "--quick") == 2  # the folder is of another tire
    report = capsys.readouterr().err
    assert "sigma1" in report and len(report.strip().splitlines()) == 1

    assert sweep(spec, out / "second", "--resume", *gate, "--update-baseline") == 0
    assert sweep(spec, out / "second", "--resume", *gate) == 0
    old, new = set(first.splitlines()), set(baseline.read_text().splitlines())
    assert 0 < len(new - old) < len(new) and 'sigma1 = { value = 0.684, unit = "s/m" }' in new - old


def test_full_form_draws_everything(spec: Path, tmp_path: Path) -> None:
    assert sweep(spec, tmp_path / "out") == 0
    assert {p.suffix for p in (tmp_path / "out" / "pictures").iterdir()} == {".svg", ".png"}
    assert {p.stem for p in (tmp_path / "out" / "pictures").iterdir()} == {"tire-tornado", "tire-map", "tire-scatter"}
    report = (tmp_path / "out" / "report.md").read_text()
    assert "pictures/tire-tornado.svg" in report and "stability_margin" in report


def test_quick_and_json(spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sweep(spec, tmp_path / "out", "--quick", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    counts = {f["name"]: f["value"] for f in report["figures"] if f["kind"] == "count"}
    assert report["form"] == "quick" and counts["designs"] == 33 and counts["invalid designs"] == 0
    assert not (tmp_path / "out" / "pictures").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('id = "stability_margin"', 'id = "stability_margn"', "did you mean stability_margin"),
        ("vary.constants.relative = 0.2", "vary.sigma.relative = 0.2", "did you mean sigma"),
        ("vary.constants.relative = 0.2", "vary.sigma1.range = [0.9, 0.5]", "minimum < maximum"),
        ("grid.points = 3", "grid.points = 1", "grid.points"),
        ("blocks = 8", "blocks = 9", "8 or 16"),
        ("[quick]", "[quik]", "did you mean quick"),
        ("chunk = 14", "chunk = 14\nchunk = 15", "mine.toml"),
    ],
)
def test_bad_files_are_one_line_and_exit_2(
    spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, words: str
) -> None:
    spec.write_text(spec.read_text().replace(old, new))
    assert sweep(spec, tmp_path / "out") == 2
    report = capsys.readouterr().err
    assert words in report and "mine.toml" in report and len(report.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_bad_arguments_are_one_line_and_exit_2(spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, words in (
        (["sweep", "tire-vehicl"], "did you mean tire-vehicle"),
        (["sweep", str(tmp_path / "absent.toml")], "no such sweep file"),
        (["sweep", str(spec), "--update-baseline"], "--baseline FILE"),
        (["sweep", str(spec), "--baseline", str(tmp_path / "absent.toml")], "no such baseline"),
        (["sweep", str(spec), "--workers", "0"], "at least 1"),
    ):
        assert main(arguments) == 2
        report = capsys.readouterr().err
        assert words in report and len(report.strip().splitlines()) == 1


def test_invalid_designs_are_told_and_nan_is_refused_at_the_end(
    spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec.write_text(spec.read_text().replace("vary.constants.relative = 0.2", "vary.sigma0.range = [-100.0, 700.0]"))
    assert sweep(spec, tmp_path / "invalid") == 0
    report = capsys.readouterr().err
    assert "designs are invalid (sigma0 = " in report and "sign" in report
    counts = {
        f["name"]: f["value"] for f in json.loads((tmp_path / "invalid" / "summary.json").read_text())["figures"][:3]
    }
    assert 0 < counts["invalid designs"] < counts["designs"]

    import numpy as np

    from studies.sweeps import measures

    monkeypatch.setattr(measures, "critical_drop_probability", lambda A, _: np.full(A.shape[:-2], np.nan))
    spec.write_text(SPEC.replace("PARAMETERS", 'parameters = "corner-estimation"'))
    assert sweep(spec, tmp_path / "nan") == 2
    report = capsys.readouterr().err
    assert "not a number" in report and len(report.strip().splitlines()) == 1
    assert (tmp_path / "nan" / "summary.json").exists()  # nothing is lost
    (tmp_path / "b.toml").write_text("old")
    assert sweep(spec, tmp_path / "nan", "--resume", "--baseline", str(tmp_path / "b.toml"), "--update-baseline") == 2
    assert (tmp_path / "b.toml").read_text() == "old"  # and no baseline is made of it


def test_shipped_sweeps_are_there() -> None:
    assert set(shipped_sweeps()) == {"tire-vehicle", "gain-box", "drop-tolerance"}
    shipped = Path(__file__).parents[2] / "studies" / "sweeps" / "baselines"
    names = {p.name for p in shipped.glob("*.toml")}
    assert names == {f"{n}{form}.toml" for n in shipped_sweeps() for form in ("", ".quick")}
    assert all(read_baseline(shipped / name).summary.statistics for name in names)
