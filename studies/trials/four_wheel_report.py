"""Table I of P4 and its Figs. 6 to 9 on a truth drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import Spread, known_spread, sample_errors, sample_spreads
from studies.trials.driven import LUGRE, driven
from studies.trials.first_block import LEAST_SPEED, SAMPLE_TIME, START
from studies.trials.four_wheel import AT_REST, EKF, UKF, FourWheelRun, run_four_wheel
from studies.trials.four_wheel_figures import error_dots, force_history, sideslip_history, used_friction_history
from studies.trials.sensors import TEST_CAR
from studies.trials.tire_curve import USE
from studies.truth import draw

Array = npt.NDArray[np.float64]
QUICK_SECONDS = 6.5


class PrintedRow(Protocol):
    """A row of the paper's table: mean and deviation by "ekf" and "ukf", %."""

    @property
    def quantity(self) -> str: ...  # noqa: D102
    @property
    def largest(self) -> float: ...  # noqa: D102
    @property
    def unit(self) -> str: ...  # noqa: D102
    @property
    def mean(self) -> dict[str, float]: ...  # noqa: D102
    @property
    def deviation(self) -> dict[str, float]: ...  # noqa: D102


def four_wheel_part(
    name: str, manoeuvre: str, printed: Sequence[PrintedRow], scope: Scope, tire: str = LUGRE
) -> PartResult:
    """Drive, observe with both filters, judge; ``printed`` are four force rows in the order of the corners, then sideslip."""
    truth = driven((manoeuvre,), tire, scope, QUICK_SECONDS)
    run = run_four_wheel(draw(truth, TEST_CAR, range(scope.seeds), SAMPLE_TIME))
    found = [quantity_errors(run, k) for k in range(len(printed))]
    rows: list[list[Cell]] = []
    measures: dict[str, float] = {}
    for k, (row, errors) in enumerate(zip(printed, found, strict=True)):
        peak = float(np.abs(_pair(run, k, EKF)[1]).max())
        for who, (mean, deviation) in errors.items():
            rows.append(
                [
                    row.quantity, row.unit, row.largest, round(peak, 4) if peak < 1.0 else round(peak), who,
                    row.mean.get(who.lower()), mean.text(), row.deviation.get(who.lower()), deviation.text(),
                    round(mean.worst, 2),
                ]
            )  # fmt: skip
            measures[f"{row.quantity}, {who}, mean"] = mean.mean
            measures[f"{row.quantity}, {who}, deviation"] = deviation.mean
    about = _about(run, scope)
    tables = [
        Table(
            f"{name}-errors", f"Errors (13) of lateral forces and sideslip, in % of the peak. {about}", COLUMNS, rows
        ),
        _difference(name, run, printed, about),
    ]
    drawings = [
        error_dots(f"{name}-errors", printed, found),
        force_history(f"{name}-forces", run),
        sideslip_history(f"{name}-sideslip", run),
        used_friction_history(f"{name}-used-friction", run),
    ]
    return PartResult(tables=tables, drawings=drawings, measures=measures)


COLUMNS = (
    "quantity", "unit", "printed peak", "peak", "estimate", "printed mean [%]", "mean [%]", "printed std [%]", "std [%]",
    "worst mean of a draw [%]",
)  # fmt: skip


def quantity_errors(run: FourWheelRun, k: int) -> Mapping[str, tuple[Spread, Spread]]:
    """Mean and standard deviation by estimate: of the force of corner k, of the sideslip for k = 4."""
    return {who: sample_spreads(*_pair(run, k, who)) for who in (run.forces if k < 4 else run.sideslip)}


def _pair(run: FourWheelRun, k: int, who: str) -> tuple[Array, Array]:
    """Estimate (S, m) and truth (m,) at the samples that are judged."""
    if k < 4:
        return run.forces[who][:, run.counted, k], run.true_forces[run.counted, k]
    return run.sideslip[who][:, run.counted], run.true_sideslip[run.counted]


def _difference(name: str, run: FourWheelRun, printed: Sequence[PrintedRow], about: str) -> Table:
    """How much worse the extended filter is, draw by draw: what both share cancels."""
    rows: list[list[Cell]] = []
    for k, row in enumerate(printed):
        errors = [sample_errors(*_pair(run, k, who)) for who in (EKF, UKF)]
        mean, deviation = (known_spread(f(errors[0]) - f(errors[1])) for f in (_mean, _deviation))
        rows.append(
            [
                row.quantity, round(row.mean["ekf"] - row.mean["ukf"], 2), mean.text(3),
                round(row.deviation["ekf"] - row.deviation["ukf"], 2), deviation.text(3),
            ]
        )  # fmt: skip
    return Table(
        f"{name}-difference",
        "How much larger the error of the extended filter is than that of the unscented one with the same model, noise and "
        f"start, in percentage points, compared draw by draw. {about}",
        ("quantity", "printed mean [points]", "mean [points]", "printed std [points]", "std [points]"),
        rows,
    )


def _mean(errors: Array) -> Array:
    return np.asarray(errors.mean(axis=1))


def _deviation(errors: Array) -> Array:
    return np.asarray(errors.std(axis=1))


def _about(run: FourWheelRun, scope: Scope) -> str:
    tire, truth = run.tire, run.drawn.truth
    return (
        f"Truth vehicle on {truth.tires[0]} tires, {truth.time[-1]:.0f} s at 100 Hz: means over {scope.seeds} "
        "draws of the sensor errors with "
        f"95 % confidence intervals, judged from {START:g} s on above {LEAST_SPEED:g} m/s. The filters "
        "believe the truth's masses and "
        f"lengths, its relaxation length ({tire.relaxation[0]:.3g} m), its greatest friction ({np.mean(tire.peak):.2f}), and "
        f"the secant of its tire at {USE:g} of the static load ({tire.secant[0] / 1e3:.1f} and "
        f"{tire.secant[1] / 1e3:.1f} kN/rad a "
        f"tire)"
        f"{AT_REST}: the slope at no slip instead ({tire.slope[0] / 1e3:.1f} and {tire.slope[1] / 1e3:.1f} kN/rad). "
        "Printed values are those of the paper's road test with another driver, road and car."
    )
