"""The command line. Heavy imports happen inside the commands, so that --help answers at once."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

DONE, BAD, REFUSED = 0, 1, 2


def parser() -> argparse.ArgumentParser:
    """All commands and their arguments."""
    top = argparse.ArgumentParser(
        prog="gainsmith",
        description="Observer gain schedules that carry their own proof.",
        epilog="Exit codes: 0 done and good, 1 done and bad (refuted, drift), 2 bad input.",
    )
    top.add_argument("--version", action="version", version=f"gainsmith {version('gainsmith')}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    schedules = commands.add_parser("schedules", help="design, prove and write gain schedules")
    schedules.add_argument("specs", nargs="*", metavar="SPEC", help="shipped name or .toml file (default: all shipped)")
    schedules.add_argument(
        "--out", type=Path, default=None, metavar="DIR", help="where schedules are (default: schedules)"
    )
    schedules.add_argument(
        "--check", action="store_true", help="write nothing; fail on drift against the schedules in DIR"
    )
    schedules.add_argument("--figures", type=Path, metavar="DIR", help="draw gains beside the published ranges")
    schedules.add_argument("--json", action="store_true", help="machine-readable output")

    certify = commands.add_parser("certify", help="re-prove schedule files without a solver")
    certify.add_argument("files", nargs="+", type=Path, metavar="FILE")
    certify.add_argument("--json", action="store_true", help="machine-readable output")

    run = commands.add_parser("run", help="replay a recorded drive through the observers")
    run.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="CSV log, or several that belong together")
    run.add_argument("--drive", required=True, type=Path, metavar="DRIVE.toml", help="columns, units, signs, vehicle")
    run.add_argument("--out", required=True, type=Path, metavar="DIR", help="where estimates, metrics and plots go")
    run.add_argument("--json", action="store_true", help="machine-readable output")

    listing = commands.add_parser("list", help="shipped specifications, parameter sets, models and schedules")
    listing.add_argument("--json", action="store_true", help="machine-readable output")
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    args = parser().parse_args(arguments)
    # Work is spread over processes and the matrices are tiny: more threads of linear algebra only cost time.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    from estimators.errors import EstimatorError
    from synthesis.errors import GainsmithError

    try:
        if args.command == "certify":
            from studies.commands.certify import run_certify

            return run_certify(args.files, args.json)
        if args.command == "schedules":
            from studies.commands.schedules import run_schedules

            return run_schedules(args.specs, args.out, args.check, args.figures, args.json)
        if args.command == "run":
            from studies.commands.run import run_log

            return run_log(args.logs, args.drive, args.out, args.json)
        from studies.commands.listing import run_list

        return run_list(args.json)
    except (GainsmithError, EstimatorError) as error:
        print(f"gainsmith: {error}", file=sys.stderr)
        return REFUSED
    except OSError as error:
        print(
            f"gainsmith: {error.filename or 'file'}: {error.strerror}; free space or choose another folder",
            file=sys.stderr,
        )
        return REFUSED


if __name__ == "__main__":
    sys.exit(main())
