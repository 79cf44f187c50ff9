"""The study of implementability."""

from __future__ import annotations

from analysis.errors import AnalysisError
from studies.beyond.implementability.break_rates import break_curve
from studies.beyond.implementability.designs import printed_designs, shipped_designs
from studies.beyond.implementability.figures import break_curves, lasting_schemes, launches, maps
from studies.beyond.implementability.tables import confirmation_table, radius_table, rate_table
from studies.beyond.implementability.updates import BREAKABLE
from studies.study import Part, PartResult, Scope, Study


def rates(scope: Scope) -> PartResult:
    """Exact break rates over the wheel speeds."""
    drawing, curves = break_curves(36 if scope.quick else 141)
    designs = (*printed_designs(), *shipped_designs())
    measures = {f"break rate {name}, {scheme} [Hz]": curve.worst_rate for (name, scheme), curve in curves.items()}
    if not all(curve.connected for curve in curves.values()):
        raise AnalysisError("a discretisation becomes stable again at a lower rate: its break rate says too little")
    note = (
        "Each scheme is unstable at every rate below its break rate (down to 1 Hz) and stable at every rate above "
        "it: no second window was found. The wheel speed is held constant; what a moving wheel speed may do is "
        "proved for the shipped schedules with the exact update alone."
    )
    return PartResult((), [rate_table(designs, curves)], [drawing], [note], measures)


def printed(scope: Scope) -> PartResult:
    """Spectral radius of the printed gains."""
    return PartResult(
        (),
        [radius_table("spectral-radius-printed", printed_designs())],
        [maps(printed_designs(), "map-printed", 41 if scope.quick else 141)],
    )


def shipped(scope: Scope) -> PartResult:
    """Spectral radius of the shipped schedules."""
    note = (
        "The shipped schedules are designed and proved for the exact closed-loop update at 200 Hz, with a pole "
        "limit of 600 1/s (longitudinal) and 300 1/s (lateral). They are not meant for, and longitudinally not "
        "stable in, the simpler updates at that rate."
    )
    tables = [radius_table("spectral-radius-shipped", shipped_designs())]
    return PartResult((), tables, [maps(shipped_designs(), "map-shipped", 41 if scope.quick else 141)], [note])


def lasting(scope: Scope) -> PartResult:
    """Schemes that never break."""
    chosen = (*printed_designs()[:2], printed_designs()[2], shipped_designs()[0])
    return PartResult((), (), [lasting_schemes(chosen, 41 if scope.quick else 121)])


def confirmation(scope: Scope) -> PartResult:
    """Sample by sample on both sides of each break."""
    designs = printed_designs() if scope.quick else (*printed_designs(), *shipped_designs())
    curves = {(d.name, s): break_curve(d, s, 36 if scope.quick else 71) for d in designs for s in BREAKABLE}
    table = confirmation_table(designs, curves, 200 if scope.quick else 400)
    return PartResult((), [table], measures={"breaks confirmed": float(sum(bool(row[-1]) for row in table.rows))})


def acceleration(scope: Scope) -> PartResult:
    """A launch through the whole range at 200 Hz."""
    chosen = (printed_designs()[0], printed_designs()[2], shipped_designs()[0])
    return PartResult((), (), [launches(chosen, 3.0 if scope.quick else 8.0)])


STUDY = Study(
    id="implementability",
    title="Printed gains under the discretisations that people use",
    paper="",
    summary=(
        "The papers print continuous-time gains and run at 200 Hz. Which discretisation keeps them stable, and down "
        "to which sample rate? Break rates by root finding over all wheel speeds, spectral radius maps, and runs "
        "sample by sample, for printed gains and shipped schedules."
    ),
    parts=(
        Part("break-rates", "Sample rates at which each discretisation breaks", rates, cost=6.0),
        Part("printed", "Spectral radius of the printed gains", printed, cost=1.5),
        Part("shipped", "Spectral radius of the shipped schedules", shipped, cost=1.5, quick=False),
        Part("lasting-schemes", "What the schemes that never break cost", lasting, cost=0.3),
        Part("confirmation", "Observers run on both sides of every break", confirmation, cost=9.0, quick=False),
        Part("launch", "Accelerating through the whole range at 200 Hz", acceleration, cost=1.5, quick=False),
    ),
)
