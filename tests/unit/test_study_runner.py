"""The runner on small studies: whole results, resuming, failures, kills, locks and full disks."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from studies.execution.fingerprint import Sources
from studies.parts.record import check_parts
from studies.registry import Registry
from studies.run import RunSummary, run_studies
from studies.study import QUICK, Part, PartResult, Preparation, Scope, Study
from synthesis.errors import SpecError
from tests.support.study_fakes.registry import REGISTRY
from tests.support.study_fakes.trace import VARIABLE

ROOT = Path(__file__).parents[2]
FAKES = Path(__file__).parents[1] / "support" / "study_fakes"
Run = Callable[..., RunSummary]


@pytest.fixture
def trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "trace"
    folder.mkdir()
    monkeypatch.setenv(VARIABLE, str(folder))
    return folder


@pytest.fixture
def sources(tmp_path: Path) -> Path:
    """What the fingerprint is taken of, in place of packages that change while tests are written: a copy of the fakes."""
    folder = tmp_path / "sources"
    shutil.copytree(FAKES, folder / FAKES.relative_to(ROOT))
    return folder


@pytest.fixture
def run(tmp_path: Path, sources: Path, trace: Path) -> Run:
    def start(*ids: str, out: str = "out", scope: Scope = QUICK) -> RunSummary:
        return run_studies(ids, tmp_path / out, scope, 2, REGISTRY, sources=Sources(sources, ["tests"]))

    return start


def counts(trace: Path) -> dict[str, int]:
    """How often each part was computed."""
    names = [path.name.partition(".")[0] for path in trace.glob("*.*")]
    return {name: names.count(name) for name in names}


def append(path: Path) -> None:
    path.write_text(path.read_text() + "# changed\n")


def tree(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_results_are_stored_as_the_study_gave_them(run: Run, tmp_path: Path) -> None:
    summary = run("alpha")
    assert summary.good
    out = tmp_path / "out"
    claims = {claim["id"]: claim for claim in json.loads((out / "claims.json").read_text())}
    assert list(claims) == ["P1-root", "P1-pair", "P1-wrong", "P1-sign", "P1-open", "P1-extra"]
    assert list(claims["P1-root"]) == [
        "id", "paper", "where", "statement", "published", "computed", "tolerance", "verdict", "reading",
        "claimed", "found", "advice",
    ]  # fmt: skip
    assert claims["P1-root"]["computed"] == 2.0**0.5 and claims["P1-root"]["found"].startswith("The root is 1.414 m")
    assert claims["P1-pair"]["computed"] == {"omega=0": 0.5, "omega=40": [1, 2.5]}
    assert claims["P1-wrong"]["computed"] is None and claims["P1-open"]["computed"] == "inf"
    assert claims["P1-extra"]["computed"] is True and claims["P1-extra"]["verdict"] == "derived (not claimed)"
    with (out / "alpha" / "tables" / "mixed.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [["name", "value [1]", "good"], ["a, b", str(1 / 3), "true"], ["c", "", "false"], ["d", "", "true"]]
    result = json.loads((out / "alpha" / "result.json").read_text())
    assert result["scope"] == {"quick": True, "seeds": 12}
    assert result["claims"] == list(claims.values()) and result["failed"] == []
    assert result["parts"][0]["measures"] == {"seeds": 12, "gap": None}
    listed = [name for part in result["parts"] for figure in part["figures"] for name in figure["files"]]
    assert sorted(listed) == ["figures/cloud.png", "figures/cloud.svg", "figures/sine.png", "figures/sine.svg"]
    assert all((out / "alpha" / name).stat().st_size > 1000 for name in listed)


def test_a_second_run_computes_nothing_and_a_fresh_one_gives_the_same_bytes(
    run: Run, trace: Path, tmp_path: Path
) -> None:
    run("alpha")
    before = tree(tmp_path / "out")
    again = run("alpha")
    assert {outcome.state for outcome in again.outcomes} == {"stored"}
    assert counts(trace) == {"alpha-numbers": 1, "alpha-curve": 1}
    assert tree(tmp_path / "out") == before
    run("alpha", out="other")
    assert tree(tmp_path / "other") == before
    assert counts(trace) == {"alpha-numbers": 2, "alpha-curve": 2}


@pytest.mark.parametrize("change", ["source", "imported", "data", "seeds", "damage"])
def test_what_a_result_depends_on_is_computed_again(
    run: Run, trace: Path, sources: Path, tmp_path: Path, change: str
) -> None:
    run("beta")
    scope = QUICK
    fakes = sources / FAKES.relative_to(ROOT)
    if change == "source":
        append(fakes / "beta" / "study.py")
    elif change == "imported":
        append(fakes / "trace.py")
    elif change == "data":
        (fakes / "beta" / "gains.toml").write_text("gain = 2\n")
    elif change == "seeds":
        scope = Scope(quick=True, seeds=13)
    else:
        stored = tmp_path / "out" / ".parts" / "beta" / "sum" / "part.json"
        stored.write_bytes(stored.read_bytes()[:-30])
    run("beta", scope=scope)
    assert counts(trace)["beta-P2-sum"] == 2


def test_what_a_result_does_not_depend_on_is_not_computed_again(run: Run, trace: Path, sources: Path) -> None:
    """A module that the study does not import, and data of another study: neither the part nor the study is another."""
    run("beta")
    fakes = sources / FAKES.relative_to(ROOT)
    append(fakes / "alpha" / "study.py")
    append(fakes / "registry.py")
    (fakes / "alpha" / "gains.toml").write_text("gain = 2\n")
    assert {o.part: o.state for o in run("beta").outcomes}["sum"] == "stored"
    assert counts(trace)["beta-P2-sum"] == 1


def test_a_part_that_raises_is_named_and_the_others_go_on(run: Run, trace: Path, tmp_path: Path) -> None:
    summary = run("beta")
    assert not summary.good and summary.missing_claims == ["P2-lost"]
    ((study, part, message),) = summary.failures
    assert (study, part) == ("beta", "lost")
    assert message.startswith("ZeroDivisionError: no number to divide by (tests/support/study_fakes/beta/study.py:")
    assert [c["id"] for c in json.loads((tmp_path / "out" / "claims.json").read_text())] == ["P2-sum"]
    result = json.loads((tmp_path / "out" / "beta" / "result.json").read_text())
    assert result["missing_claims"] == ["P2-lost"] and result["failed"][0]["part"] == "lost"
    (trace / "mended").touch()
    assert run("beta").good
    assert counts(trace) == {"beta-P2-lost": 2, "beta-P2-sum": 1}


def test_what_parts_share_is_computed_once_and_before_them(run: Run, trace: Path, tmp_path: Path) -> None:
    summary = run("sharing")
    assert counts(trace) == {"number": 1, "broken": 1, "read": 2, "alone": 1}
    assert summary.failures == [("sharing", "three", "broken: ZeroDivisionError: nothing to share "
                                 "(tests/support/study_fakes/sharing/study.py:20)")]  # fmt: skip
    shared = tmp_path / "out" / ".parts" / ".prepared"
    assert sorted(p.name for p in shared.iterdir()) == ["number"]  # kept for what is missing; nothing half-written
    (trace / "mended").touch()
    assert run("sharing").good
    assert counts(trace) == {"number": 1, "broken": 2, "read": 2, "alone": 2}
    assert not shared.exists()  # nobody reads it any more


def test_two_preparations_of_one_name_are_refused() -> None:
    def nothing(_scope: Scope, _folder: Path) -> None:
        """Prepare nothing."""

    def other(_scope: Scope, _folder: Path) -> None:
        """Prepare nothing else."""

    def study(name: str, *needs: Preparation) -> Study:
        return Study(name, name, "", "", (Part("one", "One", lambda _: PartResult(), 1.0, needs),))

    same = Preparation("numbers", nothing)
    check_parts([study("a", same), study("b", Preparation("numbers", nothing))])
    with pytest.raises(SpecError, match="study 'b': another preparation is called 'numbers', too"):
        check_parts([study("a", same), study("b", Preparation("numbers", other))])
    with pytest.raises(SpecError, match=r"study 'a': preparation '\.\./up'"):
        check_parts([study("a", Preparation("../up", nothing))])


def test_what_parts_share_belongs_to_the_scope(run: Run, trace: Path, tmp_path: Path) -> None:
    run("sharing")
    run("sharing", scope=Scope(seeds=12))
    assert counts(trace)["number"] == 2
    result = json.loads((tmp_path / "out" / "sharing" / "result.json").read_text())
    assert [part["measures"] for part in result["parts"] if part["name"] == "one"] == [{"number": 70.0}]


def test_crashes_and_unfit_results_stay_with_their_part(run: Run, tmp_path: Path) -> None:
    summary = run("crash")
    failures = {part: message for _, part, message in summary.failures}
    assert "SIGKILL" in failures["killed"]
    assert "row 2 has 1 cells for 2 columns" in failures["ragged"]
    assert "names are letters" in failures["escaping"]
    assert "sets is a set" in failures["unstorable"]
    assert {outcome.part for outcome in summary.outcomes if outcome.state == "computed"} == {"good"}
    assert not list(tmp_path.rglob("escape*"))
    assert not list(tmp_path.rglob(".unfinished-*"))


SCRIPT = """
import sys
from pathlib import Path
from studies.execution.fingerprint import Sources
from studies.run import run_studies
from studies.study import QUICK
from tests.support.study_fakes.registry import REGISTRY
out, sources, study, limit = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], int(sys.argv[4])
if limit:
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
try:
    run_studies([study], out, QUICK, 2, REGISTRY, sources=Sources(sources, ["tests"]))
except OSError as error:
    sys.exit(f"{Path(error.filename).name}: {error.strerror}")
"""


def spawn(out: Path, sources: Path, study: str = "slow", limit: int = 0) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", SCRIPT, str(out), str(sources), study, str(limit)]
    return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)


def wait_for(condition: Callable[[], object], seconds: float = 300.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.02)


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat")
    return not status.exists() or status.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_killed_in_the_middle_it_goes_on_where_it_stopped(run: Run, tmp_path: Path, sources: Path, trace: Path) -> None:
    out = tmp_path / "out"
    process = spawn(out, sources)
    wait_for(lambda: (out / ".parts" / "slow" / "first" / "part.json").exists() and list(trace.glob("slow-second.*")))
    with pytest.raises(SpecError, match=rf"another run writes here \(process {process.pid}\)"):
        run("beta")
    process.send_signal(signal.SIGKILL)
    process.communicate()
    (worker,) = (int(path.suffix[1:]) for path in trace.glob("slow-second.*"))
    wait_for(lambda: not alive(worker))
    assert not (out / "slow").exists() and not (out / "report.html").exists()
    (out / ".parts" / "slow" / ".unfinished-abc").mkdir()
    (trace / "released").touch()
    summary = run("slow")
    assert summary.good
    assert counts(trace) == {"slow-first": 1, "slow-second": 2}
    assert {(o.part, o.state) for o in summary.outcomes} == {("first", "stored"), ("second", "computed")}
    assert not list(tmp_path.rglob(".unfinished-*"))
    assert len((out / "slow" / "tables" / "first.csv").read_text().splitlines()) == 20_001


def test_killed_at_any_moment_the_next_run_gives_what_an_undisturbed_one_gives(
    run: Run, tmp_path: Path, sources: Path
) -> None:
    run("alpha", out="undisturbed")
    for moment in (".parts/alpha", ".parts/alpha/numbers", "alpha", "claims.json"):
        out = tmp_path / moment.replace("/", "-")
        process = spawn(out, sources, "alpha")
        wait_for((out / moment).exists)
        process.kill()
        process.communicate()
        for path in out.rglob("*.json"):
            if ".unfinished-" not in str(path):
                json.loads(path.read_text())
        run("alpha", out=out.name)
        assert tree(out) == tree(tmp_path / "undisturbed")


def test_a_disk_that_takes_no_more_is_one_line_and_leaves_nothing_half(
    tmp_path: Path, sources: Path, trace: Path
) -> None:
    (trace / "released").touch()
    process = spawn(tmp_path / "out", sources, limit=4096)
    message = process.communicate(timeout=300)[1]
    assert process.returncode == 1
    assert message.strip().endswith("File too large") and len(message.splitlines()) == 1
    assert not list(tmp_path.rglob(".unfinished-*")) and not list((tmp_path / "out").rglob("first*"))


def test_earlier_studies_stay_in_the_report_while_they_are_current(run: Run, sources: Path, tmp_path: Path) -> None:
    run("alpha")
    summary = run("beta")
    assert [record.id for record in summary.records] == ["alpha", "beta"]
    assert len(json.loads((tmp_path / "out" / "claims.json").read_text())) == 7
    append(sources / FAKES.relative_to(ROOT) / "alpha" / "study.py")
    assert [record.id for record in run("beta").records] == ["beta"]


def test_nothing_that_is_not_ours_is_replaced(run: Run, tmp_path: Path) -> None:
    mine = tmp_path / "out" / "beta" / "notes.txt"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    with pytest.raises(SpecError, match="is no result of a study"):
        run("beta")
    assert mine.read_text() == "mine"


def test_claims_come_in_the_order_of_the_papers(tmp_path: Path, sources: Path, trace: Path) -> None:
    (trace / "mended").touch()
    turned = Registry(dict(reversed(REGISTRY.modules.items())))
    run_studies(["beta", "alpha"], tmp_path / "out", QUICK, 2, turned, sources=Sources(sources, ["tests"]))
    papers = [claim["paper"] for claim in json.loads((tmp_path / "out" / "claims.json").read_text())]
    assert papers == ["P1"] * 6 + ["P2"] * 2
