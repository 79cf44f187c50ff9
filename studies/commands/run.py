"""Output of `gainsmith run`: the result as a table, and what to know beside it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from studies.commands.outcome import one_line
from studies.commands.pages import write_page
from studies.commands.terminal import print_table, progress_bar
from studies.drives.frames import FrameReport
from studies.drives.run import RunResult, check_drive, run_drive
from studies.errors import LogError
from synthesis.errors import SpecError

CHECK_HEADER = ("comparison", "slope (1 is right)", "quality", "verdict")
HEADER = ("quantity", "NRMS (%)", "RMS", "maximum", "reference peak", "unit", "samples")


def summary_rows(result: RunResult) -> list[tuple[str, ...]]:
    """One row an estimate of a quantity in the columns of ``HEADER``, V_x first; none without references.

    Forces that never exceed the least one of the rule have nothing to compare, and no row.
    """
    notes = result.metrics["pipeline"].get("notes", {})
    signals = {"vx": result.metrics["velocity"], **result.metrics["pipeline"].get("signals", {})}
    rows = []
    for signal, estimates in signals.items():
        for name, entry in estimates.items():
            if entry["samples"]:
                mark = " (*)" if signal in notes else ""
                rows.append((f"{signal.replace('_', ' ')}: {name.replace('_', ' ')}{mark}", *_cells(entry)))
    return rows


def remarks(result: RunResult) -> list[str]:
    """What to know beside the table, one line each: rows marked (*) first, then everything that was assumed."""
    pipeline = result.metrics["pipeline"]
    shown = {name for name, found in pipeline.get("signals", {}).items() if any(e["samples"] for e in found.values())}
    notes = pipeline.get("notes", {}).items()
    marked = [f"(*) {signal.replace('_', ' ')}: {text}" for signal, text in notes if signal in shown]
    assumed = dict.fromkeys([*result.metrics["assumptions"], *pipeline.get("assumptions", [])])
    return [*marked, *(f"assumed: {text}" for text in assumed)]


def _cells(entry: dict[str, Any]) -> tuple[str, ...]:
    digits = {"m/s": 3, "rad": 4}.get(entry["unit"], 0)
    shown = [("nrms_percent", 2), ("rms", digits), ("max_error", digits), ("reference_peak", digits)]
    numbers = ["-" if entry[key] is None else f"{entry[key]:.{count}f}" for key, count in shown]
    return (*numbers, entry["unit"], str(entry["samples"]))


def run_log(
    logs: list[Path],
    drive: Path | None,
    out: Path | None,
    check: bool,
    no_check: bool,
    as_json: bool,
    guess: bool = False,
    report: Path | None = None,
) -> int:
    """Replay the log and print the metrics beside the baselines, or check it only; 0 when done."""
    if report is not None and (guess or check):
        raise SpecError("run: --report is about a whole run; leave out --check and --guess")
    if guess:
        return _guess(logs, drive, as_json)
    if drive is None:
        raise SpecError("run: --drive is missing; give a drive file, or --guess to have a first one written")
    if check:
        return _check(logs, drive, as_json)
    if out is None:
        raise SpecError("run: --out is missing; give a folder for the results, or --check to look at the log only")
    with progress_bar() as progress:
        task = progress.add_task("replaying", total=1.0)
        result = run_drive(
            logs, drive, out, check=not no_check, progress=lambda done: progress.update(task, completed=done)
        )
    if report is not None:
        from studies.report.drive import drive_page

        write_page(report, drive_page(result))
    if as_json:
        print(json.dumps(result.metrics, indent=1))
        return 0
    rows = summary_rows(result)
    if rows:
        print_table(f"{result.metrics.get('drive', drive.stem)}: against the reference", HEADER, rows)
    else:
        print("no reference: nothing to compare the estimates with")
    for line in remarks(result):
        print(line)
    earlier = f", in the place of the results of '{one_line(result.replaced, 60)}'" if result.replaced else ""
    print(f"written to {out}{earlier}")
    return 0


def check_rows(found: FrameReport) -> list[tuple[str, ...]]:
    """One row a comparison, in the columns of ``CHECK_HEADER``."""

    def number(value: float | None) -> str:
        return "-" if value is None else f"{value:.3g}"

    return [(row["comparison"], number(row["slope"]), number(row["quality"]), row["verdict"]) for row in found.rows()]


def _check(logs: list[Path], drive: Path, as_json: bool) -> int:
    found = check_drive(logs, drive)
    if as_json:
        print(json.dumps({"comparisons": found.rows(), "complaint": found.complaint}, indent=1))
    else:
        print_table(f"{drive.stem}: signals beside one another", CHECK_HEADER, check_rows(found), left=(0, 3))
    if found.complaint is not None:
        raise LogError(found.complaint)
    return 0


def _guess(logs: list[Path], drive: Path | None, as_json: bool) -> int:
    from studies.drives.guess import write_guess

    target, guessed = write_guess(logs, drive)
    if as_json:
        print(json.dumps({"drive": str(target), "found": guessed.found, "missing": guessed.missing}, indent=1))
        return 0
    print_table("columns", ("signal", "column"), sorted(guessed.found.items()), left=(0, 1))
    if guessed.missing:
        print(f"not found: {', '.join(guessed.missing)}; fill them in")
    names = " ".join(str(path) for path in logs)
    print(f"written to {target}: edit it, then gainsmith run {names} --drive {target} --check")
    return 0
