"""The study of well-posed design."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from studies.beyond.well_posed_design.cases import Case, all_cases, p1_cases
from studies.beyond.well_posed_design.figures import demand_figure, ill_posed, plane
from studies.beyond.well_posed_design.literal import approach, literal_design
from studies.beyond.well_posed_design.sweeps import Vary, decay_rate, friction_bound, noise_weight, pole_limit, sweep
from studies.beyond.well_posed_design.tables import comparison_table, literal_table, sweep_table
from studies.study import Part, PartFunction, PartResult, Scope, Study

DEGREES = (0, 1, 2, 3)
Demands = Callable[[Case], Sequence[float]]


def literal(scope: Scope) -> PartResult:
    """Infimum 1, approached with unbounded gains."""
    cases = p1_cases()
    found = {
        (case.name, degree): approach(case, literal_design(degree))
        for case in cases
        for degree in (DEGREES[:2] if scope.quick else DEGREES)
    }
    posed = {case.name: approach(case, case.design) for case in cases}
    note = (
        "The floor is exact: for every L the static gains from friction are -sigma0/(sigma0 + sigma2 a) to the "
        "velocity and sigma2/(sigma0 + sigma2 a) to the bristle, at standstill together sqrt(1 + "
        "(sigma2/sigma0)^2), 1 + 3e-12 for the longitudinal tire of P1."
    )
    measures = {
        f"growth per decade, {name}, degree {degree}": value.growth_per_decade
        for (name, degree), value in found.items()
    }
    return PartResult((), [literal_table(cases, found, posed)], [ill_posed(cases, found, posed)], [note], measures)


def demand(name: str, label: str, what: str, vary: Vary, demands: Demands, offset: float = 0.0) -> PartFunction:
    """A part that varies one demand for both tires of P1."""

    def run(scope: Scope) -> PartResult:
        step = 3 if scope.quick else 1
        sweeps = [sweep(case, vary, tuple(demands(case))[::step]) for case in p1_cases()]
        return PartResult(
            (), [sweep_table(name, label, sweeps)], [demand_figure(name, _less(label, offset), sweeps, what, offset)]
        )

    return run


def _less(label: str, offset: float) -> str:
    """The label of an axis from which `offset` is taken."""
    name, _, unit = label.rpartition(" ")
    return f"{name} − {offset:g} {unit}" if offset else label


def planes(scope: Scope) -> PartResult:
    """Constant gains, printed gains, shipped schedules."""
    cases = all_cases()
    return PartResult(
        (), [comparison_table(cases, 15 if scope.quick else 57)], [plane(cases, 21 if scope.quick else 61)]
    )


def _by_direction(longitudinal: Sequence[float], lateral: Sequence[float]) -> Demands:
    return lambda case: longitudinal if case.name.endswith("longitudinal") else lateral


FRICTION = (1.001, 1.002, 1.005, 1.01, 1.02, 1.05, 1.1, 1.2, 1.35, 1.5)
DECAY = ((10, 20, 40, 60, 80, 120, 160, 200, 230), (1, 2, 3, 4, 6, 8, 9, 10, 11))
POLES = ((300, 350, 400, 500, 600, 800, 1000, 1500, 2400), (150, 200, 220, 250, 300, 400, 600, 800, 1200))
WEIGHTS = (0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)

STUDY = Study(
    id="well-posed-design",
    title="What determines the gains",
    paper="",
    summary=(
        "Minimising the H-infinity gain of P1 and P3 alone has the infimum 1 and no gains. This study varies what a "
        "well-posed design adds (friction bound, decay rate, pole limit, noise weight), shows how the gains follow, "
        "and puts the printed gains on the map."
    ),
    parts=(
        Part("literal", "The literal problem has infimum 1 and unbounded gains", literal, cost=5.0),
        Part("friction-bound", "Friction bound", demand(
            "friction-bound", "bound of the friction gain [1]",
            "Gains over the bound that is asked of the friction channel (floor 1): close to the floor the bound on noise rises.",
            friction_bound, _by_direction(FRICTION, FRICTION), 1.0), cost=4.0),
        Part("decay", "Decay rate", demand(
            "decay", "decay rate that is asked for [1/s]",
            "Gains over the decay rate that is asked for: it sets L2 almost alone, and with it the broadband noise.",
            decay_rate, _by_direction(*DECAY)), cost=4.0),
        Part("pole-limit", "Pole limit", demand(
            "pole-limit", "limit of the fastest pole [1/s]",
            "Gains over the limit of the fastest pole (tied to the sample time): it sets L1.",
            pole_limit, _by_direction(*POLES)), cost=4.0, quick=False),
        Part("noise-weight", "Noise weight", demand(
            "noise-weight", "acceleration weight [m/s²]",
            "Gains over the size of acceleration errors that counts as much as one unit of normalised force noise; "
            "both share the minimised channel, whose bound is shown. A worse accelerometer asks for more L2.",
            noise_weight, _by_direction(WEIGHTS, WEIGHTS)), cost=4.0, quick=False),
        Part("gain-plane", "Printed and shipped gains on the map", planes, cost=6.0),
    ),
)  # fmt: skip
