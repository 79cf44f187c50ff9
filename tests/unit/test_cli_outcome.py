"""How commands end: one line, known exit codes, no child and no leftover, whatever stops them."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from estimators.errors import GainsmithError
from studies.cli import main, parser
from studies.commands import doctor
from studies.commands.help import HELP
from studies.commands.outcome import LONGEST, one_line, run

ROOT = Path(__file__).parents[2]
SHIPPED = "longitudinal-speed"
GAINSMITH = (sys.executable, "-m", "studies.cli")


def raising(error: BaseException) -> int:
    raise error


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (GainsmithError("mass: 0 kg"), 2, "gainsmith: mass: 0 kg"),
        (OSError(errno.ENOSPC, "No space left on device", "out/a.csv"), 2, "out/a.csv: No space left on device; free space"),
        (OSError(errno.ENOSPC, "No space left on device"), 2, "output: No space left on device; free space"),
        (PermissionError(errno.EACCES, "Permission denied", "out"), 2, "choose another folder"),
        (OSError(errno.EROFS, "Read-only file system", "out"), 2, "choose another folder"),
        (OSError(errno.EMFILE, "Too many open files", "a"), 2, "ulimit -n"),
        (KeyboardInterrupt(), 130, "interrupted; what is written is whole"),
    ],
)  # fmt: skip
def test_whatever_stops_a_command_is_one_line(
    error: BaseException, code: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("run", lambda: raising(error)) == code
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1
    if "space" not in words:
        assert "free space" not in said


def test_a_fault_of_ours_is_not_swallowed() -> None:
    with pytest.raises(ZeroDivisionError):
        run("run", lambda: raising(ZeroDivisionError("ours")))


def test_resumable_commands_say_how_to_go_on(capsys: pytest.CaptureFixture[str]) -> None:
    run("sweep", lambda: raising(KeyboardInterrupt()))
    assert "--resume goes on where it stopped" in capsys.readouterr().err


def test_messages_are_printable_and_short() -> None:
    assert one_line("plain µ") == "plain µ"
    assert one_line("a\nb\x1b[31m\r") == "a\\nb\\x1b[31m\\r"
    long = one_line("no such spec '" + "x" * 140_000 + "'; did you mean longitudinal-speed?")
    assert (
        len(long) <= LONGEST and long.startswith("no such spec") and long.endswith("did you mean longitudinal-speed?")
    )
    assert len(one_line("\n" * LONGEST)) <= LONGEST


def test_a_name_with_line_ends_is_refused_in_one_short_line(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a\nb\x1b[2J", "n" * 140_000):
        assert main(["schedules", name]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and len(said) <= LONGEST + len("gainsmith: \n") and "\x1b" not in said


def test_wrong_arguments_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["certify"])
    assert (
        capsys.readouterr().err
        == "gainsmith: the following arguments are required: FILE; see gainsmith certify --help\n"
    )


def test_a_reader_that_goes_away_is_no_error() -> None:
    command = f"{sys.executable} -m studies.cli list | head -1; exit ${{PIPESTATUS[0]}}"
    ended = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr, ended.stdout) == (0, "", "specifications:\n")


def test_a_closed_output_is_no_output() -> None:
    command = f"{sys.executable} -m studies.cli --version >&-"
    ended = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_output_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(
            [*GAINSMITH, "list"], cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert ended.returncode == 2
    assert ended.stderr == "gainsmith: output: No space left on device; free space or choose another disk\n"


def test_a_bare_machine_is_enough() -> None:
    """No HOME, no locale, an output without Unicode, few file handles."""
    bare = {"PATH": "/usr/bin:/bin", "LC_ALL": "C", "PYTHONIOENCODING": "ascii"}
    command = f"ulimit -n 40; exec {sys.executable} -m studies.cli certify longitudinal-speed"
    ended = subprocess.run(["bash", "-c", command], cwd=ROOT, env=bare, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "certified: 10 claims" in ended.stdout


@pytest.mark.parametrize(("sent", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")])
def test_a_signal_ends_schedules_with_its_workers(tmp_path: Path, sent: signal.Signals, word: str) -> None:
    command = [*GAINSMITH, "schedules", "--out", str(tmp_path / "out")]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    if not children.exists():
        process.kill()
        process.wait()
        pytest.skip("needs a system that lists the children of a process")
    while process.poll() is None and not (workers := children.read_text().split()):
        time.sleep(0.01)
    process.send_signal(sent)
    said = process.communicate(timeout=300)[1]
    assert (process.returncode, said) == (
        128 + sent,
        f"gainsmith: {word}; what is written is whole, what was under way is discarded\n",
    )
    for worker in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(int(worker), 0)
    assert not list(tmp_path.rglob(".unfinished-*"))


def test_every_command_has_help_with_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    top = parser()
    (commands,) = (action.choices for action in top._actions if action.dest == "command")
    assert commands is not None and set(commands) == set(HELP)
    for name in HELP:
        with pytest.raises(SystemExit, match="0"):
            main([name, "--help"])
        page = capsys.readouterr().out
        assert f"gainsmith {name}" in page.partition("example")[2]
        assert "Writes" in page


def test_shipped_schedules_are_certified_by_their_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["certify", SHIPPED]) == 0
    assert main(["certify", "no-such-schedule"]) == 2
    Path(SHIPPED).write_text("a file of this name comes first")
    assert main(["certify", SHIPPED]) == 2


def test_doctor_finds_what_does_not_work(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["doctor"]) == 0
    assert "cvxpy:SCS" in capsys.readouterr().out
    monkeypatch.setattr(
        doctor, "requires", lambda _: ["numpy<2", "sympy>=1.13,<2", 'no-such-library>=1; extra == "logs"']
    )
    assert main(["doctor"]) == 1
    page = capsys.readouterr().out
    assert "pip install 'numpy<2'" in page and "pip install 'gainsmith[logs]'" in page
    assert page.count("FAILS") == 1 and page.count("absent") == 1
