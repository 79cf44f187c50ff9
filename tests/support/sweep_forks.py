"""Sweeps in forked processes: by several workers, on a full disk, with a worker that dies, and killed at random moments.

    python sweep_forks.py FOLDER SPEC.toml

A test starts it once: a fresh process without threads can fork, which costs no imports. Prints one JSON object.
"""

from __future__ import annotations

import io
import json
import os
import resource
import signal
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stderr
from pathlib import Path
from random import Random
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))
from studies.cli import main as command
from studies.execution.processes import Executor, Processes, Serial
from studies.sweeps import engine
from studies.sweeps.engine import run_sweep
from studies.sweeps.spec import load_sweep
from studies.sweeps.sweep import Sweep
from studies.sweeps.tables import compute
from synthesis.errors import SpecError
from tests.support.sweep_cases import many_chunks


def in_child(work: Callable[[], Any]) -> Any:
    """What `work` returns in a forked process, as JSON."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writer, json.dumps(work()).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        report = pipe.read()
    os.waitpid(child, 0)
    return json.loads(report)


def full_disk(spec: str, out: Path, limit: int) -> tuple[int, str]:
    """Exit code and standard error of the command when no file may be longer than `limit` bytes."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    with redirect_stderr(io.StringIO()) as report:
        code = command(["sweep", spec, "--workers", "1", "--out", str(out)])
    return code, report.getvalue()


def dead_worker(whole: Sweep, out: Path) -> str:
    engine.compute = lambda *_: os._exit(9)
    try:
        run_sweep(whole, out, Processes(2))
    except SpecError as error:
        return str(error)
    return ""


def held_after(chunks: int) -> Callable[[int, int], None]:
    """A progress that lets a run keep so many chunks and then holds it: a fast run waits for its kill as a slow one does."""
    left = iter(range(chunks))

    def report(done: int, total: int) -> None:
        if next(left, None) is None:
            while True:
                signal.pause()

    return report


def killed(whole: Sweep, folder: Path, kills: int, executor: Executor) -> dict[str, Any]:
    """How many were killed while they ran, the chunks there after each, and those that the last run had left to do."""
    draw, there = Random(kills), [0]
    each = (whole.chunk_count() - 1) // kills - 1  # held_after keeps one more; so the last run has something left
    for _ in range(kills):
        child = os.fork()
        if child == 0:
            run_sweep(whole, folder, executor, resume=True, progress=held_after(each))
            os._exit(0)
        wanted = there[-1] + draw.randrange(3)
        while count(folder) < wanted:
            time.sleep(1e-4)
        time.sleep(draw.uniform(0.0, 0.008))  # somewhere inside the next chunks
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if not os.WIFSIGNALED(status):
            break
        there.append(count(folder))
    computed = run_sweep(whole, folder, Serial(), resume=True).computed
    return {"killed": len(there) - 1, "there": there, "computed": computed, "all": whole.chunk_count()}


def count(folder: Path) -> int:
    return len(list(folder.glob("rows/*/*/[0-9]*.parquet")))


def main(out: Path, spec: str) -> None:
    whole, many = load_sweep(spec), many_chunks()
    for sweep in (whole, many):
        compute(sweep, next(sweep.chunks()))  # everything is compiled before the first fork
    report: dict[str, Any] = {}
    run_sweep(whole, out / "serial", Serial())
    for workers in (2, 3):
        run_sweep(whole, out / f"workers{workers}", Processes(workers))
    largest = max(path.stat().st_size for path in (out / "serial" / "rows").rglob("*.parquet"))
    report["full"] = in_child(lambda: full_disk(spec, out / "full", largest - 1))
    report["left"] = [path.name for path in (out / "full").rglob(".unfinished-*")]
    run_sweep(whole, out / "full", Serial(), resume=True)
    report["dead"] = in_child(lambda: dead_worker(whole, out / "dead"))
    run_sweep(many, out / "straight", Serial())
    report["one"] = killed(many, out / "one", 22, Serial())
    report["two"] = killed(many, out / "two", 4, Processes(2))
    print(json.dumps(report))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
