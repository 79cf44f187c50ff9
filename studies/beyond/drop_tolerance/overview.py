"""All observers beside each other, predicted."""

from __future__ import annotations

import numpy as np

from analysis.drops.schedule import frozen_critical_probability
from studies.beyond.drop_tolerance.observers import NAMES, PACKAGE, SPEED_LABEL, observer
from studies.beyond.drop_tolerance.prediction import boundary, critical, critical_bursts, harmless_from
from studies.papers.topic import Topic
from studies.plots import DASHES, Axis, Figure, Line, Mark, Panel
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE
from studies.study import PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
LOSS_RATES = (0.1, 0.2, 0.3, 0.5)
SPEEDS = np.linspace(0.0, 40.0, 401)
SEARCH = (0.0, 1.0, 3.0, 10.0)  # rad/s, where the shortest critical burst is looked for
COLOURS = {"corner-estimation": BLUE, "longitudinal-speed": GREEN, "resilient-velocity": PURPLE, "printed": ORANGE}


@TOPIC.part("overview", "What each observer survives, predicted", 3.0)
def overview(_: Scope) -> PartResult:
    """Curves of all observers, and a table of what each survives."""
    rows, measures = [], {}
    for name in NAMES:
        tested = observer(name)
        frozen = frozen_critical_probability(tested.schedule)
        held = frozen_critical_probability(tested.schedule, "hold").smallest
        found = np.array([critical_bursts(tested.schedule, w, LOSS_RATES) for w in SEARCH], float)
        shortest = np.where(np.isnan(found), np.inf, found).min(axis=0)
        bursts = [float(b) * tested.step if np.isfinite(b) else None for b in shortest]
        rows.append([tested.title, frozen.smallest, frozen.place, harmless_from(tested.schedule), held, *bursts])
        measures[f"critical_{name}"] = frozen.smallest
    shipped, printed = (100.0 * measures[f"critical_{n}-longitudinal"] for n in ("resilient-velocity", "printed"))
    lateral = min(value for key, value in measures.items() if key.endswith("lateral"))
    note = (
        f"On the P3 vehicle the shipped longitudinal schedule survives the loss of {shipped:.0f} % of the force samples at "
        f"standstill and the printed gain {printed:.0f} %: smaller gains buy the difference. Lateral observers survive at "
        f"least {lateral:.1%} at any wheel speed. The reason is one and the same: without the force the deflection error "
        "integrates the velocity error, and the next sample received corrects the velocity by gain times that deflection; "
        "slow rolling does not let the deflection relax meanwhile. A runtime that used the last force again instead of "
        "coasting would never open its loop (column hold), but its error would follow the motion of the car."
    )
    table = Table(
        "drop-tolerance",
        "What each observer survives in the mean square, wheel speed held: the smallest critical drop probability "
        "over 0 to 140 rad/s and where it is taken, the wheel speed from which every loss below 100 % is survived, "
        "the smallest probability if the last force were used again (hold), and the mean length of loss bursts at "
        "which stability is lost, at the worst wheel speed, by share of lost samples (empty: above 300 samples).",
        ("observer", "critical drop probability [1]", "at [rad/s]", "1 from [rad/s]", "hold [1]",
         *(f"burst at {pi:.0%} loss [ms]" for pi in LOSS_RATES)), rows,
    )  # fmt: skip
    return PartResult((), [table], _figures(), [note], measures)


def _figures() -> list[Figure]:
    """Critical probabilities over the wheel speed and critical bursts at standstill; lateral observers are dashed."""
    curves, edges, tested = list[Mark](), list[Mark](), [observer(name) for name in NAMES]
    for each in tested:
        color = next(color for begin, color in COLOURS.items() if each.name.startswith(begin))
        dash = DASHES[each.name.endswith("lateral")]
        curves.append(Line(SPEEDS, critical(each.schedule, SPEEDS), each.title, color, dash, 1.7))
        loss, length = boundary(each.schedule, 0.0)
        edges.append(Line(loss, length * each.step, each.title, color, dash, 1.7))
    last = max(harmless_from(each.schedule) for each in tested)
    x, y = Axis(SPEED_LABEL, 0.0, SPEEDS[-1]), Axis("critical drop probability [1]", 0.5, 1.02)
    share, bursts = Axis("share of lost samples [1]", 0.0, 1.0), Axis("critical mean burst length [ms]", scale="log")
    return [
        Figure(
            "critical-drop-probability",
            "Critical drop probability of the force over the wheel speed, predicted, for the five shipped schedules and the "
            "gains that P3 prints. Below its curve an observer's error falls in the mean square. Beyond "
            f"{last:.0f} rad/s ({0.33 * last:.0f} m/s) all of them survive any loss below 100 %.",
            "Seven rising curves; the printed longitudinal gain is lowest, from 0.58 at standstill to 1 at 28 rad/s; "
            "shipped longitudinal ones start near 0.74, lateral ones near 0.96.",
            Panel(curves, x, y, legend="lower right"), (8.4, 4.2)),
        Figure(
            "critical-burst-length",
            "Losses in bursts (Gilbert-Elliott channel) at standstill, the worst wheel speed: mean burst length at which the "
            "mean square of the error starts to grow, over the share of lost samples, predicted, for the same seven observers. "
            "Short bursts at the same loss rate are survived: it is the length of the gap that the deflection error integrates "
            "over.",
            "Seven falling curves on a logarithmic scale, lateral observers four to six times above longitudinal ones, "
            "the printed longitudinal gain lowest.",
            Panel(edges, share, bursts, legend="upper right"), (8.4, 4.2)),
    ]  # fmt: skip
