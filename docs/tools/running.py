"""Run the blocks of pages: each page in a process and an empty folder of its own."""

from __future__ import annotations

import io
import multiprocessing
import os
import shlex
import signal
import subprocess
import sys
import traceback
from concurrent.futures import ProcessPoolExecutor
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from docs.tools.fences import RUN, Block, blocks

ROOT = str(Path(__file__).parents[2])
KEPT = (".svg", ".png")
LONGEST = 180  # s of a page, on a loaded machine
WIDTH = "92"  # columns of tables in the outputs


@dataclass(frozen=True)
class PageRun:
    """What the blocks of a page printed, the pictures they left, and what went wrong (empty: nothing)."""

    outputs: list[str]
    pictures: dict[str, bytes] = field(default_factory=dict)
    failure: str = ""
    seconds: float = 0.0


def run_pages(texts: dict[str, str]) -> dict[str, PageRun]:
    """Run every page that has something to run, two at a time; the same pages are not run twice."""
    return _run_pages(frozenset(texts.items()))


@cache
def _run_pages(pages: frozenset[tuple[str, str]]) -> dict[str, PageRun]:
    texts = dict(sorted(pages))
    jobs = {place: text for place, text in texts.items() if any(b.language in RUN for b in blocks(text))}
    done = {place: PageRun([""] * len(blocks(text))) for place, text in texts.items()}
    if ROOT not in sys.path:  # MkDocs takes back what its hook added; the workers import this module by its name
        sys.path.insert(0, ROOT)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn"), _set_look) as pool:
        done |= zip(jobs, pool.map(_run_page, jobs, jobs.values()), strict=True)
    return done


def _set_look() -> None:
    """How outputs and figures look in a worker."""
    os.environ |= {
        "COLUMNS": WIDTH,
        "NO_COLOR": "1",
        "MPLBACKEND": "svg",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    import matplotlib.pyplot as plt

    plt.rcParams |= {
        "figure.figsize": (7.2, 3.4), "figure.constrained_layout.use": True, "axes.grid": True, "grid.alpha": 0.3,
        "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "gainsmith", "font.size": 10,
    }  # fmt: skip


def _run_page(place: str, text: str) -> PageRun:
    start = _processor_time()
    outputs: list[str] = []
    failure = ""
    signal.signal(signal.SIGALRM, _too_long)
    signal.alarm(LONGEST)
    with TemporaryDirectory() as folder, chdir(folder):
        names: dict[str, object] = {"__name__": "__main__"}
        for block in blocks(text):
            try:
                outputs.append(_run_block(block, names))
            except BaseException:
                failure = f"{place}:{block.line}: {traceback.format_exc(limit=-2)}"
                break
        signal.alarm(0)
        found = {path.name: path.read_bytes() for path in Path().rglob("*") if path.suffix in KEPT}
    return PageRun(outputs, found, failure, _processor_time() - start)


def _too_long(*_: object) -> None:
    raise TimeoutError(f"the page runs for more than {LONGEST} s")


def _processor_time() -> float:
    """Of this process and of the workers that it waited for, s."""
    return sum(os.times()[:4])


def _run_block(block: Block, names: dict[str, object]) -> str:
    if block.title:
        Path(block.title).parent.mkdir(parents=True, exist_ok=True)
        Path(block.title).write_text(block.code, encoding="utf-8")
    elif block.language == "python":
        said = io.StringIO()
        with redirect_stdout(said):
            exec(compile(block.code, "block", "exec"), names)
        return said.getvalue()
    elif block.language == "sh":
        return "".join(_run_line(line) for line in block.code.replace("\\\n", " ").splitlines() if line.strip())
    return ""


def _run_line(line: str) -> str:
    """One command; a line that ends in `# exit N` must end with that code."""
    words, _, comment = line.partition("  #")
    wanted = int(comment.split("exit", 1)[1].split()[0]) if "exit" in comment else 0
    argv = shlex.split(words)
    if argv[0] == "gainsmith":
        code, said = _command_line(argv[1:])
    else:
        done = subprocess.run(words, shell=True, capture_output=True, text=True, check=False)
        code, said = done.returncode, done.stdout + done.stderr
    if code != wanted:
        raise RuntimeError(f"`{words.strip()}` ended with {code}, not {wanted}: {said}")
    return said


def _command_line(argv: list[str]) -> tuple[int, str]:
    from studies.cli import main

    said = io.StringIO()
    given, sys.argv = sys.argv, ["gainsmith", *argv]
    try:
        with redirect_stdout(said), redirect_stderr(said):
            code = main(argv)
    except SystemExit as end:
        code = int(end.code or 0)
    finally:
        sys.argv = given
    return code, said.getvalue()
