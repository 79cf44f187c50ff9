"""One sweep gives one set of bytes: any workers, any order, any number of kills; and nothing is lost or written twice."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from studies.execution.processes import Finished, Serial
from studies.sweeps.engine import run_sweep
from studies.sweeps.store import locked_folder
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError
from tests.support.sweep_cases import contents, sweep

FORKS = Path(__file__).parents[1] / "support" / "sweep_forks.py"
SMALL = """
name = "small"
description = "for tests"
chunk = 14
subjects = [{ schedule = "corner-estimation-longitudinal", parameters = "corner-estimation" }]
measures = [
  { id = "stability_margin" },
  { id = "hinf_norm", name = "noise_norm", disturbances = ["force_noise"], errors = ["relative_velocity"] },
  { id = "critical_drop_probability" },
]
designs = [{ kind = "one at a time", levels = 3 }, { kind = "saltelli", blocks = 16, seed = 1 }]
vary.constants.relative = 0.2
grid.points = 5
"""  # tests.support.sweep_cases.small as a file


@pytest.fixture(scope="module")
def whole() -> Sweep:
    return sweep()


@pytest.fixture(scope="module")
def done(whole: Sweep, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("done")
    run_sweep(whole, folder, Serial())
    return contents(folder)


class Backwards:
    """The last chunk first, every chunk computed twice: what a cluster that loses results may do."""

    def run(self, function: Any, whole: Sweep, chunks: Any) -> Any:
        return (Finished(chunk, function(whole, chunk)) for chunk in reversed(list(chunks)) for _ in range(2))


def test_same_bytes_in_any_order(whole: Sweep, done: dict[str, bytes], tmp_path: Path) -> None:
    run_sweep(whole, tmp_path / "out", Backwards())
    assert contents(tmp_path / "out") == done
    rows = sum(pq.read_metadata(p).num_rows for p in (tmp_path / "out").glob("rows/*/*/*"))
    assert rows == whole.designs(whole.observers[0])


@pytest.fixture(scope="module")
def forked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """What the script of forks did, and what it told."""
    folder = tmp_path_factory.mktemp("forked")
    (folder / "small.toml").write_text(SMALL)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, FORKS, folder, folder / "small.toml"],
        capture_output=True, text=True, check=False, env=environment, timeout=900,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("workers", [2, 3])
def test_same_bytes_by_any_number_of_processes(forked: tuple[Path, dict[str, Any]], workers: int) -> None:
    folder, _ = forked
    assert contents(folder / f"workers{workers}") == contents(folder / "serial")


@pytest.mark.parametrize(("run", "kills"), [("one", 22), ("two", 4)])
def test_killed_at_random_moments_ends_with_the_same_bytes(
    forked: tuple[Path, dict[str, Any]], run: str, kills: int
) -> None:
    """In one process and with two workers; half-written files must never be taken for chunks (the control: a cut file)."""
    folder, report = forked[0], forked[1][run]
    assert report["killed"] == kills
    assert report["there"] == sorted(report["there"])  # what was there is still there
    assert (
        0 < report["computed"] <= report["all"] - report["there"][-1] < report["all"]
    )  # it went on from where it was left
    assert contents(folder / run) == contents(folder / "straight")


def test_a_full_disk_is_one_line_and_loses_nothing(forked: tuple[Path, dict[str, Any]]) -> None:
    """A limit on the size of files fails like a full disk, in the middle of a write."""
    folder, report = forked
    code, words = report["full"]
    assert code == 2 and "free space" in words and len(words.strip().splitlines()) == 1
    assert report["left"] == []
    kept = {k: v for k, v in contents(folder / "full").items() if not k.startswith(("pictures", "report"))}
    assert kept == contents(folder / "serial")


def test_a_dead_worker_is_one_line(forked: tuple[Path, dict[str, Any]]) -> None:
    words = forked[1]["dead"]
    assert "worker process was killed" in words and "--resume" in words and "\n" not in words


def test_a_cut_chunk_is_computed_again_and_nothing_else(whole: Sweep, done: dict[str, bytes], tmp_path: Path) -> None:
    run_sweep(whole, tmp_path, Serial())
    files = sorted(tmp_path.glob("rows/*/*/*.parquet"))
    files[2].write_bytes(files[2].read_bytes()[:-30])
    files[5].unlink()
    (tmp_path / "rows" / ".unfinished-abc.parquet").write_bytes(b"half")
    assert run_sweep(whole, tmp_path, Serial(), resume=True).computed == 2
    assert contents(tmp_path) == done
    assert run_sweep(whole, tmp_path, Serial(), resume=True).computed == 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"designs": [{"kind": "saltelli", "blocks": 32, "seed": 1}]}, "definition|designs had 3 entries, has now 2"),
        ({"vary": {"constants": {"relative": 0.25}}}, "vary.sigma0.relative was 0.2, is now 0.25"),
        ({"grid": {"points": 6}}, "was 5, is now 6"),
        ({"subjects": [{"schedule": "longitudinal-speed", "name": "corner-estimation-longitudinal"}]}, "constants"),
    ],
)
def test_another_sweep_in_the_folder_is_refused_by_name(
    whole: Sweep, tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    run_sweep(whole, tmp_path, Serial())
    before = contents(tmp_path)
    with pytest.raises(SpecError, match=words) as refused:
        run_sweep(sweep(**changes), tmp_path, Serial(), resume=True)
    assert "cannot be resumed" in str(refused.value) and "\n" not in str(refused.value)
    with pytest.raises(SpecError, match="--resume"):
        run_sweep(whole, tmp_path, Serial())
    assert contents(tmp_path) == before


def test_other_versions_are_refused(whole: Sweep, tmp_path: Path) -> None:
    run_sweep(whole, tmp_path, Serial())
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    manifest["versions"]["numpy"] = "1.0"
    (tmp_path / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(SpecError, match=r"numpy was '1.0'"):
        run_sweep(whole, tmp_path, Serial(), resume=True)


def test_two_runs_on_one_folder(whole: Sweep, tmp_path: Path) -> None:
    code = (
        "import fcntl, sys; file = open(sys.argv[1], 'a+'); fcntl.lockf(file, fcntl.LOCK_EX); "
        "print('held', flush=True); input()"
    )
    holder = subprocess.Popen(
        [sys.executable, "-S", "-c", code, tmp_path / ".lock"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None and holder.stdout.readline() == "held\n"
    with pytest.raises(SpecError, match="another sweep is writing"):
        run_sweep(whole, tmp_path, Serial())
    holder.kill()
    holder.communicate()
    run_sweep(whole, tmp_path, Serial())  # a killed process leaves no lock behind
    with locked_folder(tmp_path, whole):
        pass


def test_a_folder_that_is_a_file(whole: Sweep, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(SpecError, match="is not a folder"):
        run_sweep(whole, tmp_path / "file", Serial())
