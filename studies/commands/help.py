"""What `gainsmith COMMAND --help` says beside its arguments: what the command does, what it writes, and an example."""

from __future__ import annotations

import argparse
from typing import NamedTuple


class Paragraphs(argparse.HelpFormatter):
    """Paragraphs are filled to the width of the terminal; examples stay as they are."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n\n".join(
            paragraph
            if paragraph.startswith("example")
            else super(Paragraphs, self)._fill_text(paragraph, width, indent)
            for paragraph in text.split("\n\n")
        )


class Help(NamedTuple):
    """`text` after its name in the list of commands; the rest on its own page."""

    text: str
    description: str
    example: str


HELP = {
    "new": Help(
        "write commented files to start from: a model and its specification, or a drive file",
        """\
Writes DIR/NAME.toml, a model (signals, parameters with range and rate, constants with units, matrices as formulas), and
DIR/NAME-observer.toml, a specification of its observer. With --drive: DIR/NAME-drive.toml, a drive file (columns, units
and signs of a log, and the car), and DIR/NAME-log.csv, a log of a simulated car. All run as they are, and say in comments
what to change. Files that are there are never replaced.""",
        """\
gainsmith new my-plant
gainsmith model my-plant.toml --out out/model
gainsmith schedules my-plant-observer.toml --out out/schedules
gainsmith new my-car --drive
gainsmith run my-car-log.csv --drive my-car-drive.toml --out out/run""",
    ),
    "model": Help(
        "show a model file: poles, observability, controllability over its range",
        """\
Reads a model file, checks every formula in its units, and prints the model, its poles over the range of the parameters, and
whether it is observable and controllable there: proved, or with the values at which a rank is lost.

Writes pictures of poles and rank loss into DIR if --out is given.""",
        """\
gainsmith model my-plant.toml --out out/model
gainsmith model pmsm                              a shipped example""",
    ),
    "schedules": Help(
        "design, prove and write gain schedules",
        """\
Designs the gains that each specification asks for, tabulates and rounds them, and proves every claim for that table:
for all parameter values in the range, all rates in their bounds, and the update that the runtime performs.

Writes DIR/NAME.json, a gainsmith.schedule/2 file: model, plant, breakpoints, gains, claims with their proofs,
provenance. A stored file that is proved again, and is as good as what was found now, is kept to the byte. Nothing
unproved is written.""",
        """\
gainsmith schedules                               all shipped ones into ./schedules
gainsmith schedules my-observer.toml --out out    from a specification of your own
gainsmith schedules --out out --report out/schedules.html   and one page: gains, proved levels, tightest places
gainsmith schedules --out schedules --check       in CI: exit 1 if a claim fails, or can be had better""",
    ),
    "simulate": Help(
        "run a schedule along random and worst parameter trajectories, beside its certified levels",
        """\
Proves the claims of a schedule file again, and looks at them from below: random admissible parameter trajectories, each with
the disturbance that is amplified most along it; the worst place; a periodic trajectory found by search. The worst of all is
run by the runtime beside its plant. What any run shows must stay below the certified level (above a certified decay);
a run that does not ends in exit code 1.

Writes pictures of the trajectories and of the worst run into DIR if --out is given.""",
        """\
gainsmith simulate corner-estimation-longitudinal
gainsmith simulate out/schedules/my-plant-observer.json --runs 200 --seed 1 --out out/simulation""",
    ),
    "certify": Help(
        "re-prove schedule files without a solver",
        """\
Proves every claim of a schedule from the file alone, in ball arithmetic: plant from formulas, constants and units,
gains as they are stored and interpolated. A claim that fails is named with its place; it is called refuted only where
the loop itself breaks it.

Writes nothing.""",
        """\
gainsmith certify out/my-observer.json
gainsmith certify longitudinal-speed              a shipped schedule by its name""",
    ),
    "run": Help(
        "replay a recorded drive through the observers",
        """\
Reads one log or several that belong together (CSV, MDF, ROS bag, MCAP, .mat), compares their signals with one another,
runs the pipeline of forces, velocities and sideslip over them as a car would, and compares with the references and the
baselines that the drive file names. Signs, units and sides that contradict one another are refused, with the likely
mend: --check does only that, --no-check runs in spite of it. --guess writes a first drive file from the columns' names.

Writes into DIR: estimates.csv (one row a sample: time, estimates, standard deviations, flags), metrics.json, and
plots as SVG and PNG; with --report one page that says what holds, what does not, and what was wrong with the log.
SI units, ISO axes: x forward, y left, z up.""",
        """\
gainsmith run LOG.csv --guess --drive DRIVE.toml  write a first drive file, to be edited
gainsmith run LOG.csv --drive DRIVE.toml --check  compare the signals only
gainsmith run LOG.csv --drive DRIVE.toml --out out/run --report out/run.html""",
    ),
    "identify": Help(
        "fit tire, radius and wheel inertia to a recorded drive",
        """\
Fits slip stiffness, relaxation, damping, effective radii and wheel inertia to a log, with confidence intervals. What
the log does not excite stays at its prior and is named. Signals that contradict one another are refused as by run.

Writes into DIR: identified.toml (a parameter set that a specification takes as it is), identification.json, and pictures of the
residuals.""",
        "gainsmith identify LOG.csv --drive DRIVE.toml --out out/car",
    ),
    "study": Help(
        "recompute the papers and the studies beyond them",
        """\
Recomputes every number, table and figure of a paper, and says which claims hold. Parts that are stored already, and
whose sources have not changed, are kept; an interrupted run goes on where it stopped.

Writes into DIR: report.html, claims.json, and for each study its tables (CSV), figures (SVG, PNG) and results (JSON).""",
        """\
gainsmith study P1 P3 --quick                     few seeds, coarse grids
gainsmith study --all --out out/studies""",
    ),
    "sweep": Help(
        "margins under parameter changes, against a committed baseline",
        """\
Evaluates margins of observers over many designs, draws of parameters or corners of their box, and compares each
statistic with a baseline. Same bytes for any number of workers; memory does not grow with the number of designs.

Writes into DIR: rows/*.parquet (every design), summary.json, report.md and pictures; with --junit and --summary the
gate for a CI; with --report one page: gate, tornado, quantiles, Sobol indices, worst points.""",
        """\
gainsmith sweep tire-vehicle --quick --baseline studies/sweeps/baselines/tire-vehicle.quick.toml
gainsmith sweep my-sweep.toml --workers 4 --resume --report out/sweep.html""",
    ),
    "list": Help(
        "what is shipped: specifications, parameter sets, models, schedules, studies, sweeps",
        "Lists what comes with the package, by the names that other commands take. Writes nothing.",
        "gainsmith list --json",
    ),
    "doctor": Help(
        "what is installed, and whether it works",
        """\
Shows versions, solvers and extras, solves a small problem with each solver, and re-proves a shipped schedule. Exit 1
if something that is needed does not work. Writes nothing.""",
        "gainsmith doctor",
    ),
}
