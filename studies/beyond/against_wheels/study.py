"""The study against the wheels: a row for every shipped manoeuvre on both kinds of tires."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from studies.beyond.against_wheels.runs import Errors, errors
from studies.study import Cell, Part, PartResult, Scope, Study, Table
from studies.trials.simulations import LUGRE, MAGIC_FORMULA, SIMULATIONS, simulated_truth
from studies.truth import shipped_manoeuvres

SEEDS = 12  # each costs 35 cars
COLUMNS = (
    "manoeuvre", "pipeline [m/s]", "radii given [m/s]", "mean wheel speed [m/s]", "corner observers, mean [m/s]",
    "best corner observer [m/s]", "which", "behind", "pipeline minus the best of these [m/s]",
)  # fmt: skip


def against_part(scope: Scope, tire: str) -> PartResult:
    """The table, those first where the pipeline is furthest ahead, and how often it is behind."""
    truth = simulated_truth(tuple(sorted(shipped_manoeuvres())), tire, scope)
    found = sorted(errors(truth, range(min(scope.seeds, SEEDS))), key=lambda one: one.pipeline / one.best)
    caption = (
        f"RMS error of V_x on {tire} tires, mean of {min(scope.seeds, SEEDS)} sensor draws. The wheels of the truth have exactly "
        "the radii that are assumed: the mean wheel speed and the corner observers rely on it, the pipeline does not; 'radii "
        "given' is the pipeline that does. The best corner observer is picked afterwards. 'behind': what is nearer. The "
        "last column is beside its 95 % confidence interval (Student's t) over the sensor draws: where 0 lies in it, they do not "
        "tell which is nearer."
    )
    table = Table(f"against-wheels-{tire}", caption, COLUMNS, [_row(one) for one in found])
    return PartResult(tables=[table], measures=counted(found, tire))


def counted(found: Sequence[Errors], tire: str) -> dict[str, float]:
    """How many manoeuvres the pipeline loses, and to what."""
    behind = {
        "the mean wheel speed": [one.pipeline > one.wheels for one in found],
        "the best corner observer": [one.pipeline > min(one.alone) for one in found],
        "any of them": [one.pipeline > one.best for one in found],
        "any of them beyond sampling error": [one.gap.low > 0.0 for one in found],
        "any of them, radii given": [one.known_radii > one.best for one in found],
    }
    return {f"{tire}: manoeuvres behind {name}": float(sum(lost)) for name, lost in behind.items()}


def _row(one: Errors) -> list[Cell]:
    others = {"wheels": one.wheels, "corners": one.corners, "best corner": min(one.alone)}
    behind = ", ".join(name for name, value in others.items() if one.pipeline > value)
    speeds = (one.pipeline, one.known_radii, one.wheels, one.corners, min(one.alone))
    return [one.manoeuvre, *(round(value, 4) for value in speeds), one.best_corner, behind, one.gap.text(4)]


STUDY = Study(
    "against-wheels",
    "V_x of the pipeline beside the wheels and the corner observers",
    "",
    "RMS errors of V_x of the default pipeline on every shipped manoeuvre, beside the mean wheel speed, the corner observers and "
    "the best of these, with the radii unknown to the pipeline and given to it.",
    tuple(
        Part(
            tire,
            f"Every manoeuvre on {tire} tires",
            partial(against_part, tire=tire),
            cost=120.0,
            needs=(SIMULATIONS[tire],),
            quick=tire == LUGRE,
        )
        for tire in (LUGRE, MAGIC_FORMULA)
    ),
)
