"""The command line. Heavy imports happen when a command has been chosen, so that --help answers at once."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from textwrap import indent
from typing import NoReturn

from studies.commands.help import HELP, Paragraphs
from studies.commands.outcome import REFUSED, refuse, run, speak_safely

Command = Callable[[str, str], argparse.ArgumentParser]


class Parser(argparse.ArgumentParser):
    """What is wrong with the arguments in one line, and where to read on."""

    def error(self, message: str) -> NoReturn:
        """Exit with the code of bad input."""
        refuse(f"{message}; see {self.prog} --help")
        sys.exit(REFUSED)


def parser() -> argparse.ArgumentParser:
    """All commands and their arguments; the names of the arguments are those of the command's function."""
    top = Parser(
        prog="gainsmith",
        description="Observer gain schedules that carry their own proof.",
        epilog="Exit codes: 0 done and good, 1 done and bad (refuted, drift), 2 bad input, 130 interrupted, 143 terminated. "
        "`gainsmith COMMAND --help` says what a command does, what it writes, and shows an example.",
    )
    top.add_argument("--version", action="version", version=f"gainsmith {version('gainsmith')}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, function: str) -> argparse.ArgumentParser:
        said = HELP[name]
        new = commands.add_parser(
            name,
            help=said.text,
            description=said.description,
            epilog="example" + ("s" if "\n" in said.example else "") + ":\n" + indent(said.example, "  "),
            formatter_class=Paragraphs,
        )
        new.set_defaults(function=function)
        new.add_argument("--json", action="store_true", dest="as_json", help="machine-readable output")
        return new

    _models(command)
    _drives(command)
    _studies(command)
    command("list", "listing.run_list")
    command("doctor", "doctor.run_doctor")
    return top


def _models(command: Command) -> None:
    """From a model to proved gains."""
    new = command("new", "new.run_new")
    new.add_argument("name", metavar="NAME", help="of the files: letters, digits and hyphens")
    new.add_argument("--drive", action="store_true", help="a drive file and a simulated log instead")
    new.add_argument("--out", type=Path, metavar="DIR", help="where they go (default: here)")

    model = command("model", "model.run_model")
    model.add_argument("file", metavar="FILE", help="model file or specification (.toml), or a shipped name")
    model.add_argument("--out", type=Path, metavar="DIR", help="draw them into DIR")

    schedules = command("schedules", "schedules.run_schedules")
    schedules.add_argument("specs", nargs="*", metavar="SPEC", help="shipped name or .toml file (default: all shipped)")
    schedules.add_argument("--out", type=Path, metavar="DIR", help="where schedules are (default: schedules)")
    schedules.add_argument(
        "--check", action="store_true", help="write nothing; fail on drift against the schedules in DIR"
    )
    schedules.add_argument("--radius", metavar="LENGTH", help='another effective radius, such as "0.40 m"')
    schedules.add_argument("--sample-time", metavar="TIME", help='another sample time, such as "10 ms"')
    schedules.add_argument("--figures", type=Path, metavar="DIR", help="draw gains beside the published ranges")
    schedules.add_argument(
        "--report", type=Path, metavar="FILE", help="one page: gains, proved levels, tightest places"
    )

    certify = command("certify", "certify.run_certify")
    certify.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="schedule file, or the name of a shipped one"
    )

    simulate = command("simulate", "simulate.run_simulate")
    simulate.add_argument("schedule", type=Path, metavar="SCHEDULE", help="schedule file, or the name of a shipped one")
    simulate.add_argument("--runs", type=int, default=60, metavar="N", help="random trajectories (default: 60)")
    simulate.add_argument("--samples", type=int, metavar="N", help="of each (default: five decay times, 200 to 3000)")
    simulate.add_argument("--seed", type=int, default=0, metavar="S", help="of the random numbers (default: 0)")
    simulate.add_argument("--out", type=Path, metavar="DIR", help="draw trajectories and the worst run into DIR")


def _drives(command: Command) -> None:
    """What reads recorded drives."""
    run = command("run", "run.run_log")
    identify = command("identify", "identify.run_identify")
    for reader, text in (
        (run, "estimates, metrics and plots"),
        (identify, "parameter file, fit and residual pictures"),
    ):
        reader.add_argument(
            "logs",
            nargs="+",
            type=Path,
            metavar="LOG",
            help="log (CSV, MDF, ROS bag, MCAP, .mat), or several that belong together",
        )
        needed = reader is identify  # run says itself what is missing: --check and --guess need less
        reader.add_argument(
            "--drive", required=needed, type=Path, metavar="DRIVE.toml", help="columns, units, signs, vehicle"
        )
        reader.add_argument("--out", required=needed, type=Path, metavar="DIR", help=f"where {text} go")
    run.add_argument("--report", type=Path, metavar="FILE", help="one page: estimates, errors, flags, the log")
    checks = run.add_mutually_exclusive_group()
    checks.add_argument("--check", action="store_true", help="only compare the signals of the log with one another")
    checks.add_argument(
        "--guess", action="store_true", help="write a first drive file (to DRIVE.toml) from column names"
    )
    for group in (checks, identify):
        group.add_argument("--no-check", action="store_true", help="go on although signs, units or sides seem wrong")


def _studies(command: Command) -> None:
    """What takes long and goes on where it stopped."""
    study = command("study", "study.run_study")
    study.add_argument("studies", nargs="*", metavar="ID", help="studies to run (see gainsmith list)")
    study.add_argument("--all", action="store_true", dest="every", help="every study")
    study.add_argument("--quick", action="store_true", help="few seeds and coarse grids")
    study.add_argument("--seeds", type=int, metavar="N", help="Monte Carlo runs (default 200, quick 12)")
    study.add_argument("--workers", type=int, metavar="N", help="processes (default: all cores)")
    study.add_argument(
        "--out", type=Path, metavar="DIR", help="where results and report.html go (default: out/studies)"
    )

    sweep = command("sweep", "sweep.run_sweep")
    sweep.add_argument("spec", metavar="SPEC", help="shipped name or .toml file")
    place = sweep.add_mutually_exclusive_group()
    place.add_argument("--workers", type=int, metavar="N", help="processes (default: all cores)")
    place.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, tcp://host:port")
    sweep.add_argument("--quick", action="store_true", help="the quick form of the specification")
    sweep.add_argument("--resume", action="store_true", help="go on with an interrupted sweep in DIR")
    sweep.add_argument(
        "--out", type=Path, metavar="DIR", help="chunks, summary and pictures (default: out/sweep/NAME[-quick])"
    )
    sweep.add_argument(
        "--baseline", type=Path, metavar="FILE", help="fail when a statistic shrank beyond its tolerance"
    )
    sweep.add_argument("--update-baseline", action="store_true", help="write the baseline instead of comparing")
    sweep.add_argument(
        "--report",
        type=Path,
        metavar="FILE",
        help="one page: the gate, tornado, quantiles, Sobol indices, worst points",
    )
    sweep.add_argument("--junit", type=Path, metavar="FILE", help="the gate as JUnit XML")
    sweep.add_argument("--summary", type=Path, metavar="FILE", help="the gate as Markdown")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    speak_safely()
    chosen = vars(parser().parse_args(arguments))
    # Work is spread over processes and the matrices are tiny: more threads of linear algebra only cost time.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    command = chosen.pop("command")
    module, function = chosen.pop("function").split(".")

    def work() -> int:
        code: int = getattr(import_module(f"studies.commands.{module}"), function)(**chosen)
        return code

    return run(command, work)


if __name__ == "__main__":
    sys.exit(main())
