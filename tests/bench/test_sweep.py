"""What a sweep costs: the whole, two workers against one, the growth with designs, the folder, going on, and a drive.

Ratios come from one run and are recorded, not asserted: a machine has other things to do. Seconds of processor time stand beside
those of the clock; what they say of two workers holds on a busy machine too. `--benchmark-only` takes the sizes of the shipped
sweep; otherwise everything runs once on small ones.
"""

from __future__ import annotations

from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from time import perf_counter, process_time
from typing import Any

import pytest

from studies.execution.processes import Processes, Serial
from studies.sweeps.engine import run_sweep
from studies.sweeps.evaluate import VALID, evaluate_chunk
from studies.sweeps.spec import build_sweep
from studies.sweeps.summary import summarise
from studies.sweeps.sweep import Sweep
from studies.sweeps.tables import compute
from tests.support.sweep_cases import NOISE, small, sweep
from tests.support.synthetic_drive import columns, write_drive, write_log

MEASURES = [{"id": "stability_margin"}, NOISE, {"id": "sampled_radius"}, {"id": "critical_drop_probability"}]


def shipped_size(benchmark: Any, samples: int) -> Sweep:
    """The four measures at 141 speeds, in chunks of 1000 designs."""
    large = benchmark.enabled
    return sweep(
        measures=MEASURES, grid={"points": 141 if large else 5}, chunk=1000 if large else 20,
        designs=[{"kind": "latin hypercube", "samples": (samples if large else 60) - 1}],
    )  # fmt: skip


def timed(function: Any, *arguments: Any, **named: Any) -> tuple[float, Any]:
    start = perf_counter()
    answer = function(*arguments, **named)
    return perf_counter() - start, answer


def processor(who: int) -> float:
    """Seconds of processor time of this process, or of its children that have ended."""
    used = getrusage(who)
    return used.ru_utime + used.ru_stime


def test_two_workers_against_one(benchmark: Any, tmp_path: Path) -> None:
    """20,000 designs x 141 speeds x 4 measures on two processes, beside the same on one.

    `ratio_by_processor_time`: all that the parent does is counted as if no worker ran beside it.
    """
    whole = shipped_size(benchmark, 20_000)
    compute(whole, next(whole.chunks()))  # symbols are compiled before the clock starts, and before workers are forked
    at = processor(RUSAGE_SELF)
    one, alone = timed(run_sweep, whole, tmp_path / "one", Serial())
    busy = processor(RUSAGE_SELF) - at
    folders = iter(range(100))
    at, before = processor(RUSAGE_SELF), processor(RUSAGE_CHILDREN)
    result = benchmark.pedantic(lambda: run_sweep(whole, tmp_path / f"two{next(folders)}", Processes(2)), rounds=1)
    parent, workers = processor(RUSAGE_SELF) - at, processor(RUSAGE_CHILDREN) - before
    assert result.summary == alone.summary
    if benchmark.stats is not None:
        two = benchmark.stats.stats.median
        benchmark.extra_info.update(
            designs=result.count("designs"), one_worker_s=one, two_workers_s=two, ratio=one / two, one_worker_cpu_s=busy,
            parent_cpu_s=parent, workers_cpu_s=workers, ratio_by_processor_time=busy / (parent + 0.5 * workers),
        )  # fmt: skip


def test_growth_with_designs(benchmark: Any) -> None:
    """Four times the designs must cost four times as much: bare evaluation, no folder."""
    whole = shipped_size(benchmark, 8000)
    chunks = list(whole.chunks())[1:]  # without the nominal design
    few = chunks[: max(1, len(chunks) // 4)]
    evaluate_chunk(whole, chunks[0])
    start = process_time()
    quarter, _ = timed(lambda: [evaluate_chunk(whole, c) for c in few])
    middle = process_time()
    done = benchmark.pedantic(lambda: [evaluate_chunk(whole, c) for c in chunks], rounds=1)
    quarter_cpu, all_cpu = middle - start, process_time() - middle
    assert sum(len(found.outcome) for found in done) == chunks[-1].stop
    if benchmark.stats is not None:
        share = chunks[-1].stop / few[-1].stop
        all_s = benchmark.stats.stats.median
        benchmark.extra_info.update(
            times_the_designs=share, times_the_cost=all_s / quarter, times_the_cpu=all_cpu / quarter_cpu,
            microseconds_a_point=1e6 * all_cpu / (8000 * 141),
        )  # fmt: skip


def test_folder_manifest_and_progress_against_bare_evaluation(benchmark: Any, tmp_path: Path) -> None:
    """The same chunks, evaluated only, and run into a folder with progress; statistics are counted apart."""
    whole = shipped_size(benchmark, 8000)
    chunks = list(whole.chunks())
    for chunk in chunks[:2]:
        compute(whole, chunk)
    start = process_time()
    bare, _ = timed(lambda: [evaluate_chunk(whole, c) for c in chunks])
    bare_cpu = process_time() - start
    folders = iter(range(100))
    seen: list[int] = []
    start = process_time()
    result = benchmark.pedantic(
        lambda: run_sweep(
            whole, tmp_path / f"out{next(folders)}", Serial(), progress=lambda done, _: seen.append(done)
        ),
        rounds=1,
    )
    folder_cpu = process_time() - start
    start = process_time()
    statistics, summary = timed(summarise, result.folder)
    statistics_cpu = process_time() - start
    assert seen[-1] == len(chunks) and summary == result.summary
    if benchmark.stats is not None:
        whole_s = benchmark.stats.stats.median
        benchmark.extra_info.update(
            bare_s=bare, folder_s=whole_s, statistics_s=statistics, inside_measures_s=result.seconds,
            overhead_percent=100.0 * (whole_s - statistics - result.seconds) / result.seconds,
            bare_cpu_s=bare_cpu, folder_cpu_s=folder_cpu, statistics_cpu_s=statistics_cpu,
        )  # fmt: skip


@pytest.mark.parametrize("missing", [0, 1])
def test_resume(benchmark: Any, tmp_path: Path, missing: int) -> None:
    """Going on with a finished sweep, and with one that misses a chunk (recorded beside the cost of that chunk)."""
    whole = shipped_size(benchmark, 20_000)
    run_sweep(whole, tmp_path, Serial())
    files = sorted(tmp_path.glob("rows/*/*/*.parquet"))
    before = files[-1].read_bytes()

    def remove() -> None:
        for file in files[len(files) - missing :]:
            file.unlink()

    benchmark.pedantic(lambda: run_sweep(whole, tmp_path, Serial(), resume=True), setup=remove, rounds=3)
    assert files[-1].read_bytes() == before
    if benchmark.stats is not None and missing:
        cost, _ = timed(compute, whole, list(whole.chunks())[-1])
        benchmark.extra_info.update(chunk_s=cost, beyond_the_chunk_s=benchmark.stats.stats.median - cost)


def test_drive_of_many_designs(benchmark: Any, tmp_path: Path) -> None:
    """`estimator_nrms`: four corner observers of every design on one log, per design, corner and sample."""
    large = benchmark.enabled
    designs, duration = (200, 10.0) if large else (3, 0.5)
    write_log(tmp_path / "log.csv", columns(duration=duration))
    write_drive(tmp_path)
    asked = {"id": "estimator_nrms", "drive": "drive.toml", "logs": ["log.csv"]}
    content = small(
        measures=[asked], grid={"points": 2}, chunk=designs, designs=[{"kind": "latin hypercube", "samples": designs}]
    )
    whole = build_sweep(content, tmp_path)
    chunk = list(whole.chunks())[1]
    evaluate_chunk(whole, next(whole.chunks()))
    found = benchmark.pedantic(lambda: evaluate_chunk(whole, chunk), rounds=1)
    assert (found.outcome == VALID).all() and len(found.outcome) == designs
    if benchmark.stats is not None:
        seconds = benchmark.stats.stats.median
        steps = designs * 4 * (200.0 * duration + 1.0)
        benchmark.extra_info.update(
            ms_a_design=1e3 * seconds / designs, microseconds_a_corner_step=1e6 * seconds / steps
        )
