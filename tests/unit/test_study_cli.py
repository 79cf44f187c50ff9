"""`gainsmith study`: exit codes, one-line refusals, output for people and machines."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from estimators.errors import GainsmithError
from studies.cli import main
from studies.commands.study import run_study
from tests.support.study_fakes.registry import REGISTRY
from tests.support.study_fakes.trace import VARIABLE

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["drop-tolerence"], "unknown study 'drop-tolerence'; did you mean drop-tolerance"),
        (["--all", "qqqq"], "unknown study 'qqqq'; known: against-wheels, consistency, corner-estimation"),
        ([], "name a study or give --all"),
        (["friction-floor", "--workers", "0"], "--workers 0"),
        (["friction-floor", "--seeds", "1"], "--seeds 1"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    assert main(["study", *arguments, "--out", str(tmp_path / "out")]) == 2
    line = capsys.readouterr().err.strip()
    assert words in line and len(line.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(GainsmithError, match="cannot be a folder"):
        fakes(tmp_path / "file", "alpha")


def fakes(out: Path, *studies: str, every: bool = False, as_json: bool = False) -> int:
    return run_study(list(studies), every, True, 2, 7, out, as_json, REGISTRY)


def test_good_runs_end_with_zero_and_failed_parts_with_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert fakes(tmp_path / "out", "alpha") == 0
    shown = capsys.readouterr()
    assert json.loads((tmp_path / "out" / "alpha" / "result.json").read_text())["scope"] == {"quick": True, "seeds": 7}
    assert "alpha" in shown.out and "report.html" in shown.out and not shown.err
    assert fakes(tmp_path / "out", "beta", as_json=True) == 1
    shown = capsys.readouterr()
    found = json.loads(shown.out)
    assert found["missing_claims"] == ["P2-lost"] and not found["good"]
    assert found["verdicts"]["reproduced"] == 2
    assert {(part["part"], part["state"]) for part in found["parts"]} == {("lost", "failed"), ("sum", "computed")}
    assert len(shown.err.strip().splitlines()) == 2
    assert "beta/lost: ZeroDivisionError" in shown.err and "P2-lost" in shown.err
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    (tmp_path / "mended").touch()
    assert fakes(tmp_path / "out", "beta") == 0


@pytest.mark.parametrize(("sent", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")])
def test_a_signal_is_one_line_and_ends_the_workers(
    sent: signal.Signals, word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    code = (
        "import sys; from pathlib import Path; from studies.commands.outcome import run;"
        "from studies.commands.study import run_study; from tests.support.study_fakes.registry import REGISTRY;"
        "sys.exit(run('study', lambda: run_study(['slow'], False, True, 1, None, Path(sys.argv[1]), False, REGISTRY)))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / "out")], cwd=ROOT, stderr=subprocess.PIPE, text=True
    )
    while not (waiting := list(tmp_path.glob("slow-second.*"))):
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(sent)
    message = process.communicate(timeout=300)[1]
    assert process.returncode == 128 + sent
    assert message == f"gainsmith: {word}; the same command goes on where it stopped\n"
    with pytest.raises(ProcessLookupError):
        os.kill(int(waiting[0].suffix[1:]), 0)
