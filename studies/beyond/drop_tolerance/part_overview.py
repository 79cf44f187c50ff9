"""All observers beside each other, predicted."""

from __future__ import annotations

import numpy as np

from analysis.dropout_schedule import frozen_critical_probability
from studies.beyond.drop_tolerance.observers import NAMES, observer
from studies.beyond.drop_tolerance.prediction import boundary, critical, critical_bursts, harmless_from
from studies.papers.resilient_velocity.ink import SPEED_LABEL, sheet
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE
from studies.study import Cell, Drawing, PartResult, Scope, Table

LOSS_RATES = (0.1, 0.2, 0.3, 0.5)
SPEEDS = np.linspace(0.0, 40.0, 401)
SEARCH = (0.0, 1.0, 3.0, 10.0)  # rad/s, where the shortest critical burst is looked for
STYLES = {
    "corner-estimation-longitudinal": (BLUE, "-"),
    "corner-estimation-lateral": (BLUE, (0, (5, 2))),
    "longitudinal-speed": (GREEN, "-"),
    "resilient-velocity-longitudinal": (PURPLE, "-"),
    "resilient-velocity-lateral": (PURPLE, (0, (5, 2))),
    "printed-longitudinal": (ORANGE, "-"),
    "printed-lateral": (ORANGE, (0, (5, 2))),
}


def overview(_: Scope) -> PartResult:
    """Curves of all observers, and a table of what each survives."""
    rows: list[tuple[Cell, ...]] = []
    measures: dict[str, float] = {}
    for name in NAMES:
        tested = observer(name)
        step = 1e3 * tested.schedule.sample_time
        frozen = frozen_critical_probability(tested.schedule)
        held = frozen_critical_probability(tested.schedule, "hold").smallest
        shortest = _shortest(name)
        rows.append(
            (
                tested.title,
                frozen.smallest,
                frozen.place,
                harmless_from(tested.schedule),
                held,
                *(None if b is None else b * step for b in shortest),
            )
        )
        measures[f"critical_{name}"] = frozen.smallest
    shipped, printed = (
        100.0 * measures[f"critical_{n}"] for n in ("resilient-velocity-longitudinal", "printed-longitudinal")
    )
    lateral = min(value for key, value in measures.items() if key.endswith("lateral"))
    note = (
        f"On the P3 vehicle the shipped longitudinal schedule survives the loss of {shipped:.0f} % of the force "
        f"samples at standstill and the printed gain {printed:.0f} %: smaller gains buy the difference. Lateral "
        f"observers survive at least {lateral:.1%} at any wheel speed. The reason is one and the same: without the "
        "force the deflection error integrates the velocity error, and the next sample received corrects the "
        "velocity by gain times that deflection; slow rolling does not let the deflection relax meanwhile. A "
        "runtime that used the last force again instead of coasting would never open its loop (column hold), but "
        "its error would follow the motion of the car."
    )
    return PartResult((), [_table(rows)], [_curves(), _bursts()], [note], measures)


def _shortest(name: str) -> list[float | None]:
    """The shortest critical burst over the searched wheel speeds, by loss rate."""
    found = np.array([critical_bursts(observer(name).schedule, w, LOSS_RATES) for w in SEARCH], float)
    known = np.where(np.isnan(found), np.inf, found).min(axis=0)
    return [float(b) if np.isfinite(b) else None for b in known]


def _table(rows: list[tuple[Cell, ...]]) -> Table:
    return Table(
        "drop-tolerance",
        "What each observer survives in the mean square, wheel speed held: the smallest critical drop probability "
        "over 0 to 140 rad/s and where it is taken, the wheel speed from which every loss below 100 % is survived, "
        "the smallest probability if the last force were used again (hold), and the mean length of loss bursts at "
        "which stability is lost, at the worst wheel speed, by share of lost samples (empty: above 300 samples).",
        (
            "observer",
            "critical drop probability [1]",
            "at [rad/s]",
            "1 from [rad/s]",
            "hold [1]",
            *(f"burst at {pi:.0%} loss [ms]" for pi in LOSS_RATES),
        ),
        rows,
    )


def _curves() -> Drawing:
    last = max(harmless_from(observer(name).schedule) for name in NAMES)
    figure = sheet(8.4, 4.2)
    axis = figure.subplots()
    for name, (colour, dash) in STYLES.items():
        tested = observer(name)
        axis.plot(SPEEDS, critical(tested.schedule, SPEEDS), color=colour, ls=dash, lw=1.7, label=tested.title)
    axis.set_xlabel(SPEED_LABEL)
    axis.set_ylabel("critical drop probability [1]")
    axis.set_xlim(0.0, SPEEDS[-1])
    axis.set_ylim(0.5, 1.02)
    axis.legend(loc="lower right", fontsize=7.5)
    return Drawing(
        "critical-drop-probability",
        "Critical drop probability of the force over the wheel speed, predicted, for the five shipped schedules "
        "and the gains that P3 prints. Below its curve an observer's error falls in the mean square. Beyond "
        f"{last:.0f} rad/s ({0.33 * last:.0f} m/s) all of them survive any loss below 100 %.",
        "Seven rising curves; the printed longitudinal gain is lowest, from 0.58 at standstill to 1 at 28 rad/s; "
        "shipped longitudinal ones start near 0.74, lateral ones near 0.96.",
        figure,
    )


def _bursts() -> Drawing:
    figure = sheet(8.4, 4.2)
    axis = figure.subplots()
    for name, (colour, dash) in STYLES.items():
        tested = observer(name)
        loss, length = boundary(tested.schedule, 0.0)
        axis.plot(loss, length * 1e3 * tested.schedule.sample_time, color=colour, ls=dash, lw=1.7, label=tested.title)
    axis.set_yscale("log")
    axis.set_xlabel("share of lost samples [1]")
    axis.set_ylabel("critical mean burst length [ms]")
    axis.set_xlim(0.0, 1.0)
    axis.legend(loc="upper right", fontsize=7.5)
    return Drawing(
        "critical-burst-length",
        "Losses in bursts (Gilbert-Elliott channel) at standstill, the worst wheel speed: mean burst length at "
        "which the mean square of the error starts to grow, over the share of lost samples, predicted, for the "
        "same seven observers. Short bursts at the same loss rate are survived: it is the length of the gap that "
        "the deflection error integrates over.",
        "Seven falling curves on a logarithmic scale, lateral observers four to six times above longitudinal ones, "
        "the printed longitudinal gain lowest.",
        figure,
    )
