"""Figs. 10 and 12 on truth vehicles: forces and velocities with and without the suspension compliance (14), (15)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from estimators.vehicle import CORNERS
from estimators.velocity.slip import LEAST_SPEED
from studies.papers.resilient_velocity.compliance_figures import residual_history, wheel_history
from studies.papers.resilient_velocity.compliance_trial import (
    INSIDE,
    PRINTED_WAY,
    WAYS,
    WITHOUT,
    ComplianceTrial,
    run_trial,
)
from studies.papers.resilient_velocity.setting import DIRECTIONS
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import known_spread, nrms
from studies.trials.driven import LUGRE, driven
from studies.trials.play import measured, run_of
from studies.trials.sensors import TEST_CAR

Array = npt.NDArray[np.float64]
QUICK_SECONDS = 4.0
HARD = 500.0
"""N m at all wheels together, from which on traction counts as hard: the paper's word for where compliance helps."""


@dataclass(frozen=True)
class Shown:
    """A test of the paper, what it says of it, and the corners and the direction (0: along, 1: across) of its figure."""

    manoeuvre: str
    title: str
    said: str
    corners: tuple[int, ...]
    direction: int


TESTS = (
    Shown("p3-launch-split", "harsh launch (Fig. 10)", "smaller with, in hard traction", (0, 1, 2, 3), 0),
    Shown("p3-acceleration-in-turn-dry", "acceleration in a turn (Fig. 12)", "curves alone", (0, 1), 1),
)
BOUNDS = (5.8, 7.5)
"""%, of V_x and V_y: the text of the paper."""


def compliance_part(name: str, tests: Sequence[Shown], scope: Scope, tire: str = LUGRE) -> PartResult:
    """Play every test with the three ways and judge forces and velocities."""
    truth = driven(tuple(test.manoeuvre for test in tests), tire, scope, QUICK_SECONDS)
    trial = run_trial(measured(truth, range(scope.seeds), TEST_CAR))
    forces, measures = residual_table(f"{name}-forces", trial, tests)
    drawings = [residual_history(f"{name}-{test.manoeuvre}", trial, test) for test in tests]
    drawings += [wheel_history(f"wheels-{test.manoeuvre}", trial, test) for test in tests if test.direction == 0]
    return PartResult(
        tables=[forces, _velocity_table(f"{name}-velocities", trial, tests)],
        drawings=drawings,
        notes=[_note(trial, tests)],
        measures=measures,
    )


def hard_traction(trial: ComplianceTrial, test: Shown) -> tuple[int, npt.NDArray[np.bool_]]:
    """Row of the test, and its samples (n,) under drive torque and above the speed from which on slips mean something."""
    truth = trial.drawn.truth
    row, _ = run_of(truth, test.manoeuvre)
    fast = np.abs(truth["vx"][row]) >= LEAST_SPEED
    return row, truth.valid[row] & fast & (truth["torque"][row].sum(axis=-1) >= HARD)


def residual_table(name: str, trial: ComplianceTrial, tests: Sequence[Shown]) -> tuple[Table, dict[str, float]]:
    """Measured minus calculated F/F_z by corner and way, and how the two ways with compliance compare draw by draw."""
    rows: list[list[Cell]] = []
    measures: dict[str, float] = {}
    for test in tests:
        row, hard = hard_traction(trial, test)
        for corner in test.corners:
            at = (row, hard, corner, test.direction)
            peak = float(np.abs(_true_use(trial, at)).max())
            error = {way: 100.0 * _rms(_taken(trial.residual[way], at)) / peak for way in WAYS}
            give = trial.true_give[row][hard, corner, test.direction]
            missed = _rms(_taken(trial.give, at) - give)
            against = {way: known_spread(error[way] - error[WITHOUT]) for way in (PRINTED_WAY, INSIDE)}
            rows.append(
                [
                    test.title, f"{DIRECTIONS[test.direction]}, {CORNERS[corner]}", round(peak, 3), test.said,
                    *(known_spread(error[way]).text() for way in WAYS),
                    *(cell for way in against for cell in (against[way].text(), against[way].high < 0.0)),
                    round(float(np.sqrt(np.mean(give**2))), 4), round(float(missed.mean()), 4),
                ]
            )  # fmt: skip
            measures |= {f"{test.manoeuvre} {CORNERS[corner]} {way}": float(error[way].mean()) for way in WAYS}
    caption = (
        "Measured minus calculated normalised force, RMS in % of the peak of F/F_z under hard traction (drive torque above "
        f"{HARD:g} N m, V_x above {LEAST_SPEED:g} m/s): mean over {len(trial.drawn.seeds)} sensor draws with its 95 % "
        "confidence interval. Measured: the estimated forces; calculated: LuGre tire (1), (2) with Table I and the road's "
        "true friction at the observers' slip velocity - without compliance, with psi' taken from it as (15) is printed, and "
        "with psi'' in the input of the observers. Change: draw by draw, in percentage points; smaller: the interval lies "
        "below zero. The paper prints curves without numbers."
    )
    columns = (
        "test", "force", "peak of F/F_z [1]", "the paper says", "without [%]", "as (15) is printed [%]", "in the input [%]",
        "change by (15) [points]", "smaller by (15)", "change by the input [points]", "smaller by the input",
        "RMS of psi' [m/s]", "RMS error of psi' [m/s]",
    )  # fmt: skip
    return Table(name, caption, columns, rows), measures


def _velocity_table(name: str, trial: ComplianceTrial, tests: Sequence[Shown]) -> Table:
    rows: list[list[Cell]] = []
    truth = trial.drawn.truth
    for test in tests:
        row, samples = run_of(truth, test.manoeuvre)
        for k, signal in enumerate(("vx", "vy")):
            if k == 1 and test.direction == 0:
                continue  # straight ahead there is no V_y to relate an error to
            true = truth[signal][row, samples]
            found = {way: nrms(trial.centre[way][:, row, samples, k], true) for way in WAYS}
            changes = [known_spread(found[way] - found[WITHOUT]).text(3) for way in (PRINTED_WAY, INSIDE)]
            peak = round(float(np.abs(true).max()), 3)
            spreads = [known_spread(found[way]).text() for way in WAYS]
            rows.append([test.title, f"V_{signal[1]}", peak, BOUNDS[k], *spreads, *changes])
    return Table(
        name,
        "Velocity of the centre of gravity from the corner observers, NRMS in % of the peak as P1 (46): mean over "
        f"{len(trial.drawn.seeds)} sensor draws with its 95 % confidence interval. As (15) is printed, psi' is added on the way "
        "to the centre of gravity; with psi'' in the observers' input it is taken from the wheel centre's velocity. Changes "
        "against the observers without compliance, draw by draw. The paper's bounds are those of its text.",
        (
            "test", "signal", "peak [m/s]", "printed bound [%]", "without [%]", "as (15) is printed [%]", "in the input [%]",
            "change by (15) [points]", "change by the input [points]",
        ),
        rows,
    )  # fmt: skip


def _note(trial: ComplianceTrial, tests: Sequence[Shown]) -> str:
    """What the ways do, from the numbers of this run."""
    better = dict.fromkeys((PRINTED_WAY, INSIDE), 0)
    total = 0
    for test in tests:
        row, hard = hard_traction(trial, test)
        for corner in test.corners:
            at, total = (row, hard, corner, test.direction), total + 1
            error = {way: _rms(_taken(trial.residual[way], at)) for way in WAYS}
            for way in better:
                better[way] += known_spread(error[way] - error[WITHOUT]).high < 0.0
    return (
        f"Of {total} forces, (15) as it is printed makes {better[PRINTED_WAY]} agree better with the tire model, and psi'' in "
        f"the observers' input {better[INSIDE]}. (15) adds psi' to a velocity that it takes to be that of the body; but "
        "observers that are corrected by the force of the tire follow the slip of the wheel itself, so that psi' would count "
        "twice. In the input it is right for any gain."
    )


def _taken(value: Array, at: tuple[int, npt.NDArray[np.bool_], int, int]) -> Array:
    """(S, m) of (S, B, n, 4, 2)."""
    row, samples, corner, direction = at
    return value[:, row, :, corner, direction][:, samples]


def _true_use(trial: ComplianceTrial, at: tuple[int, npt.NDArray[np.bool_], int, int]) -> Array:
    row, samples, corner, direction = at
    truth = trial.drawn.truth
    force = truth[("force_x", "force_y")[direction]][row, samples, corner]
    return np.asarray(force / np.maximum(truth["force_z"][row, samples, corner], 1.0))


def _rms(error: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(error**2, axis=-1)))
