"""The study of P3: every claim, table and figure that follows from its models and their analysis."""

from __future__ import annotations

from studies.papers.published import computed_claims
from studies.papers.resilient_velocity import (
    claims_accuracy,
    claims_drops,
    claims_example1,
    claims_example3,
    claims_friction,
    claims_loads,
    claims_markov,
    claims_norms,
    claims_sampling,
    claims_sensitivity,
    claims_suspension,
    claims_switching,
    experiments,
)
from studies.papers.resilient_velocity.figures_drops import (
    critical_figure,
    discretisation_figure,
    map_figure,
    radius_figure,
)
from studies.papers.resilient_velocity.figures_norms import norm_figure
from studies.papers.resilient_velocity.figures_sensitivity import margin_figure
from studies.papers.resilient_velocity.figures_sensitivity import norm_figure as norm_deviation_figure
from studies.papers.resilient_velocity.figures_switching import markov_figure, window_figure
from studies.papers.resilient_velocity.figures_vehicle import friction_figure, suspension_figure
from studies.papers.resilient_velocity.tables_curves import (
    chain_table,
    deviation_table,
    drop_table,
    norm_table,
    sampling_table,
)
from studies.papers.resilient_velocity.tables_parameters import table_1
from studies.study import Part, PartResult, Scope, Study

PACKAGE = "studies.papers.resilient_velocity"
UPDATE_NOTE = (
    "All sampled results use the exact closed-loop update e+ = exp((A - L C) T) e at T = 5 ms while the force is "
    "received and exp(A T) while it is lost. That is what the runtime observer does; the printed gains diverge if "
    "the innovation is sampled and held instead."
)


def example_1(_: Scope) -> PartResult:
    """Example 1 and Proposition 1."""
    return PartResult(computed_claims(PACKAGE, claims_example1.CLAIMS))


def norms(_: Scope) -> PartResult:
    """Fig. 2 and its floor."""
    return PartResult(computed_claims(PACKAGE, claims_norms.CLAIMS), [norm_table()], [norm_figure()])


def sensitivity(_: Scope) -> PartResult:
    """Figs 3 to 5."""
    claims = computed_claims(PACKAGE, {"P3-fig345": claims_sensitivity.small_deviations})
    return PartResult(claims, [deviation_table()], [margin_figure(), norm_deviation_figure()])


def observability(_: Scope) -> PartResult:
    """The rank condition (9)."""
    return PartResult(computed_claims(PACKAGE, {"P3-obs": claims_sensitivity.observability}))


def switching(_: Scope) -> PartResult:
    """Both gains in any order: (20), Example 2."""
    return PartResult(computed_claims(PACKAGE, claims_switching.CLAIMS), (), [window_figure()], [UPDATE_NOTE])


def markov(_: Scope) -> PartResult:
    """Both gains by a Markov chain: Fig. 6."""
    return PartResult(computed_claims(PACKAGE, claims_markov.CLAIMS), [chain_table()], [markov_figure()])


def drops(_: Scope) -> PartResult:
    """Lost measurements: Figs 7 and 8, Remark 4."""
    figures = [critical_figure(), radius_figure(), map_figure()]
    return PartResult(computed_claims(PACKAGE, claims_drops.CLAIMS), [drop_table()], figures, [UPDATE_NOTE])


def example_3(_: Scope) -> PartResult:
    """Example 3."""
    return PartResult(computed_claims(PACKAGE, claims_example3.CLAIMS), (), [discretisation_figure()])


def sampling(_: Scope) -> PartResult:
    """Readings of (10)."""
    return PartResult(computed_claims(PACKAGE, claims_sampling.CLAIMS), [sampling_table()])


def vehicle(_: Scope) -> PartResult:
    """Table I, loads, suspension and tire."""
    functions = {**claims_loads.CLAIMS, **claims_suspension.CLAIMS, **claims_friction.CLAIMS}
    return PartResult(computed_claims(PACKAGE, functions), [table_1()], [suspension_figure(), friction_figure()])


def accuracy(_: Scope) -> PartResult:
    """The percentages of the conclusion."""
    return PartResult(computed_claims(PACKAGE, claims_accuracy.CLAIMS))


STUDY = Study(
    id="resilient-velocity",
    title="Resilient corner-based velocity estimation",
    paper="P3",
    summary=(
        "Pirani et al.: two-state corner observers for slip velocity, their boundedness, H∞ norms and sensitivity, "
        "switched gains, and force measurements that are lost. Its examples, claims and figures are recomputed from "
        "Table I and the printed gains."
    ),
    parts=(
        Part("example-1", "Example 1 and the boundedness proof", example_1, cost=0.6),
        Part("norms", "H∞ norms over the wheel speed (Fig. 2)", norms, cost=1.2),
        Part("sensitivity", "Tire constants off by 20 % (Figs 3 to 5)", sensitivity, cost=0.5),
        Part("observability", "The observability rank", observability, cost=1.1),
        Part("switching", "Switching the two gains in any order", switching, cost=0.2),
        Part("markov", "Switching by a Markov chain (Fig. 6)", markov, cost=0.2),
        Part("drops", "Lost force measurements (Figs 7 and 8)", drops, cost=1.4),
        Part("example-3", "Example 3", example_3, cost=1.2),
        Part("sampling", "What the printed gains need from the discretisation", sampling, cost=0.3),
        Part("vehicle", "Table I, loads, suspension and tire", vehicle, cost=0.7),
        Part("accuracy", "The percentages of the conclusion", accuracy, cost=0.1),
        *experiments.PARTS,
    ),
)
