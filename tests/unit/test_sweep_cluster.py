"""A real scheduler with two real workers on the loopback address; one of them is killed in the middle."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from studies.cli import main
from studies.execution import cluster as cluster_module
from studies.execution.cluster import Cluster
from studies.execution.processes import Serial
from studies.sweeps.engine import run_sweep
from studies.sweeps.sweep import Sweep
from synthesis.errors import SpecError
from tests.support.sweep_cases import contents, many_chunks

pytest.importorskip("distributed", reason="Dask is not installed: pip install 'gainsmith[cluster]'")
ROOT = Path(__file__).parents[2]
FOR_EVER = 120.0  # s: no measurement; what took as long was not waiting for an answer of a few seconds


def start(*arguments: str) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-m", *arguments], cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )  # fmt: skip


@pytest.fixture(scope="module")
def whole() -> Sweep:
    return many_chunks()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler, and the processes: it and its two workers, one thread each."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    scheduler = start(
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--no-show"
    )
    options = (
        "--nthreads",
        "1",
        "--no-nanny",
        "--no-dashboard",
        "--host",
        "127.0.0.1",
        "--local-directory",
        str(tmp_path),
    )
    workers = [start("distributed.cli.dask_worker", address, *options) for _ in range(2)]
    try:
        yield address, [scheduler, *workers]
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


def wait_for_workers(address: str, count: int) -> None:
    from distributed import Client

    for _ in range(120):
        try:
            with Client(address, timeout=5, set_as_default=False) as client:
                client.wait_for_workers(count, timeout=60)
                return
        except (OSError, TimeoutError):
            time.sleep(0.5)
    pytest.fail(f"no {count} workers at {address}")


@pytest.mark.filterwarnings("ignore")  # lost connections are what this is about
def test_what_dies_in_the_middle_loses_nothing_and_counts_nothing_twice(
    cluster: tuple[str, list[subprocess.Popen[bytes]]],
    whole: Sweep,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    address, (scheduler, first, second) = cluster
    wait_for_workers(address, 2)
    killed: list[int] = []

    def killing(process: subprocess.Popen[bytes]) -> Callable[[int, int], None]:
        def report(done: int, total: int) -> None:
            if done == 10:
                process.send_signal(signal.SIGKILL)
                killed.append(process.wait())

        return report

    # a worker: the other one goes on
    result = run_sweep(whole, tmp_path / "cluster", Cluster(address), progress=killing(first))
    assert killed == [-signal.SIGKILL] and second.poll() is None
    assert result.computed == whole.chunk_count()
    files = sorted((tmp_path / "cluster").glob("rows/*/*/*.parquet"))
    designs = [d for file in files for d in pq.read_table(file).column("design").to_pylist()]
    assert designs == list(range(whole.designs(whole.observers[0])))
    run_sweep(whole, tmp_path / "here", Serial())
    assert contents(tmp_path / "cluster") == contents(tmp_path / "here")

    # all workers, for longer than one waits
    with monkeypatch.context() as patch:
        patch.setattr(cluster_module, "LOOK", 1e-6)
        patch.setattr(Cluster, "_workers", lambda *_: False)
        with pytest.raises(SpecError, match=f"{address}: no worker for .*--resume"):
            run_sweep(whole, tmp_path / "nobody", Cluster(address))

    # the scheduler: one line that says how to go on, nothing of Dask's own, and one goes on
    capfd.readouterr()
    with pytest.raises(
        SpecError, match=f"{address}: the scheduler was lost; finished chunks are kept, .*--resume"
    ) as lost:
        run_sweep(whole, tmp_path / "lost", Cluster(address), progress=killing(scheduler))
    assert "\n" not in str(lost.value) and capfd.readouterr() == ("", "")
    resumed = run_sweep(whole, tmp_path / "lost", Serial(), resume=True)
    assert 0 < resumed.computed <= whole.chunk_count() - 10
    assert contents(tmp_path / "lost") == contents(tmp_path / "here")


@pytest.mark.parametrize(("listens", "patience"), [(False, 0.5), (True, None)])
def test_a_scheduler_that_does_not_answer_is_one_line(
    whole: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, listens: bool, patience: float | None
) -> None:
    """A port that nobody listens to, and one where somebody accepts and says nothing: asked for no longer than is said."""
    assert cluster_module.ANSWER < 10.0
    if patience is not None:
        monkeypatch.setattr(cluster_module, "ANSWER", patience)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        if not listens:
            silent.close()
        start_at = time.monotonic()
        with pytest.raises(SpecError, match=f"no answer within {cluster_module.ANSWER:g} s") as refused:
            run_sweep(whole, tmp_path / "out", Cluster(f"tcp://127.0.0.1:{port}"))
        assert time.monotonic() - start_at < FOR_EVER
    assert "\n" not in str(refused.value)


def test_a_stranger_that_answers_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A web server, say; and nothing is written."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            caller, _ = server.accept()
            with caller:
                caller.sendall(b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n")
                caller.recv(1 << 16)

        thread = threading.Thread(target=answer)
        thread.start()
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        assert main(["sweep", "gain-box", "--scheduler", address, "--out", str(tmp_path / "out")]) == 2
        thread.join()
    report = capsys.readouterr().err
    assert "no Dask scheduler" in report and len(report.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_an_address_that_is_none(whole: Sweep, tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="unknown address scheme"):
        run_sweep(whole, tmp_path / "out", Cluster("nowhere://x"))
