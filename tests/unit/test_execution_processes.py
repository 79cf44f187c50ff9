"""Worker processes: every task once, whatever dies; errors come back; nobody is left behind."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from studies.execution.processes import Finished, Processes, Serial, in_order
from synthesis.errors import SpecError


def shifted(shift: int, task: int) -> int:
    """The function of most tests: refuses 13, dies at 66, and says where it ran."""
    if task == 13:
        raise SpecError("13 is unlucky")
    if task == 66:
        os.kill(os.getpid(), signal.SIGKILL)
    return task + shift


def process_of(_: None, task: int) -> int:
    time.sleep(0.01 * task)
    return os.getpid()


def touched(folder: Path, task: str) -> None:
    (folder / f"{task}.new").write_text(str(os.getpid()))
    (folder / f"{task}.new").rename(folder / task)
    time.sleep(600.0)


@pytest.mark.parametrize("executor", [Serial(), Processes(2), Processes(3, ahead=1), Processes(2, once=True)])
def test_every_task_is_answered_once(executor: Serial | Processes) -> None:
    found = {finished.task: finished.value for finished in executor.run(shifted, 100, range(12))}
    assert found == {task: task + 100 for task in range(12)}


@pytest.mark.parametrize("once", [True, False])
def test_a_dead_worker_is_told_and_what_waited_for_it_is_computed(once: bool) -> None:
    results = list(Processes(2, once=once).run(shifted, 0, [1, 2, 66, 3, 4, 5, 6]))
    assert sorted(finished.value for finished in results if not finished.death) == [1, 2, 3, 4, 5, 6]
    (dead,) = (finished for finished in results if finished.death)
    assert dead.task == 66 and "SIGKILL" in dead.death


def test_an_error_comes_back_as_it_is_and_ends_the_workers() -> None:
    pool = Processes(2).run(shifted, 0, [1, 13, 2])
    with pytest.raises(SpecError, match="13 is unlucky"):
        list(pool)


def test_processes_are_kept_or_of_one_task() -> None:
    kept = {finished.value for finished in Processes(2).run(process_of, None, [1] * 6)}
    single = {finished.value for finished in Processes(2, once=True).run(process_of, None, [1] * 6)}
    assert len(kept) <= 2 and len(single) == 6 and os.getpid() not in kept | single


def test_leaving_early_ends_the_workers() -> None:
    with closing(Processes(2).run(process_of, None, [0, 0, 9999, 9999])) as results:
        workers = {next(results).value, next(results).value}
    for pid in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_workers_are_there_at_once_and_end_with_results_that_nobody_asks_for(tmp_path: Path) -> None:
    results = Processes(1).run(touched, tmp_path, ["file"])
    while not (tmp_path / "file").exists():
        time.sleep(0.01)
    results.close()
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "file").read_text()), 0)


def test_tasks_may_wait_for_others() -> None:
    """Asked for a task while none is ready, the source answers None and is asked again."""
    done: list[int] = []

    def ready() -> Iterator[int | None]:
        yield 1
        while 1 not in done:
            yield None
        yield from (2, 3)

    for finished in Processes(2).run(shifted, 0, ready()):
        done.append(finished.value)  # noqa: PERF401  the source looks at what is done
    assert done[0] == 1 and sorted(done) == [1, 2, 3]


def test_values_in_order(tmp_path: Path) -> None:
    assert list(in_order(abs, [-3, -1, -2, 5], 2)) == [3, 1, 2, 5]
    assert list(in_order(abs, [], 2)) == []
    with pytest.raises(SpecError, match="a worker did not finish"):
        list(in_order(os._exit, [3, 3], 2))
    assert Finished("task").value is None
