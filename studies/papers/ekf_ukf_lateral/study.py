"""The study of P4: its equations, its observability and its table."""

from __future__ import annotations

from studies.papers.ekf_ukf_lateral import claims_equations, claims_observability, claims_table, experiments
from studies.papers.ekf_ukf_lateral.figures_observability import rank_map, twin_motions
from studies.papers.ekf_ukf_lateral.figures_table import printed_errors
from studies.papers.ekf_ukf_lateral.figures_tire import dugoff_curves, sign_of_the_force
from studies.papers.ekf_ukf_lateral.tables_observability import rank_table
from studies.papers.ekf_ukf_lateral.tables_printed import output_table, printed_table
from studies.papers.published import computed_claims
from studies.study import Part, PartResult, Scope, Study

PACKAGE = "studies.papers.ekf_ukf_lateral"
SUBSTITUTES_NOTE = (
    "P4 prints no vehicle, tire, covariance or initial values. Mass, yaw inertia, axle distances and stiffnesses "
    "are those that P5 prints for the same car (halved per tire); track 1.5 m, relaxation lengths 0.5 m and "
    "friction 1 are chosen."
)


def observability(scope: Scope) -> PartResult:
    """The claim, and a map of the rank."""
    claims = computed_claims(PACKAGE, claims_observability.CLAIMS)
    return PartResult(claims, (), [rank_map(41 if scope.quick else 161)], [SUBSTITUTES_NOTE])


def hidden_split(_: Scope) -> PartResult:
    """What each variant of the model hides, and two motions that measure the same."""
    note = (
        "The paper sets lateral forces and sideslip to zero where it takes the model as unobservable. That is not "
        "needed: what is hidden decays with V / sigma by itself, so a filter stays bounded."
    )
    return PartResult((), [rank_table()], [twin_motions()], [note])


def output_equation(_: Scope) -> PartResult:
    """The last output of (12)."""
    return PartResult(computed_claims(PACKAGE, {"P4-y4": claims_equations.lateral_output}), [output_table()])


def tire(_: Scope) -> PartResult:
    """The Dugoff tire and its sign."""
    claims = computed_claims(PACKAGE, {"P4-dugoff": claims_equations.tire_sign})
    return PartResult(claims, (), [dugoff_curves(), sign_of_the_force()], [SUBSTITUTES_NOTE])


def errors(_: Scope) -> PartResult:
    """Table I against the text."""
    return PartResult(computed_claims(PACKAGE, claims_table.CLAIMS), [printed_table()], [printed_errors()])


STUDY = Study(
    id="ekf-ukf-lateral",
    title="Lateral tire forces: extended against unscented Kalman filter",
    paper="P4",
    summary=(
        "Doumiati, Victorino, Charara, Lechner (2009): an eight-state four-wheel model with Dugoff tires behind a "
        "relaxation lag. Its equations, its observability and its table are checked here."
    ),
    parts=(
        Part("observability", "Is the eight-state model observable?", observability, cost=2.0),
        Part("hidden-split", "What no sensor tells apart", hidden_split, cost=1.0, quick=False),
        Part("tire", "The Dugoff tire and the sign of its force", tire, cost=1.0),
        Part("output-equation", "The measured lateral acceleration", output_equation, cost=1.5),
        Part("table-1", "Table I against the text", errors, cost=0.2),
        *experiments.PARTS,
    ),
)
