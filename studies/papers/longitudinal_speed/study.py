"""The study of P2: parts that run, are stored and resumed one by one."""

from __future__ import annotations

from functools import partial

from studies.claim import Claim, ClaimFunction
from studies.papers.longitudinal_speed import (
    claims_accuracy,
    claims_appendix,
    claims_bounds,
    claims_model,
    claims_observability,
    claims_slip,
    claims_unknown_start,
    experiments,
    figures_filter,
    figures_observability,
    tables,
)
from studies.papers.longitudinal_speed.inputs import PACKAGE
from studies.papers.parameter_table import parameter_part
from studies.papers.published import computed_claims
from studies.study import Part, PartResult, Scope, Study

CLAIMS: dict[str, ClaimFunction] = {
    **claims_model.CLAIMS, **claims_observability.CLAIMS, **claims_unknown_start.CLAIMS, **claims_appendix.CLAIMS,
    **claims_bounds.CLAIMS, **claims_slip.CLAIMS, **claims_accuracy.CLAIMS,
}  # fmt: skip


def _computed(*ids: str) -> list[Claim]:
    return computed_claims(PACKAGE, {name: CLAIMS[name] for name in ids})


def model(scope: Scope) -> PartResult:
    """The model as printed, the patch constant and the radius."""
    return PartResult(_computed("P2-19M", "P2-kappa", "P2-Re"))


def observability(scope: Scope) -> PartResult:
    """Rank of (24), and Fig. 1."""
    drawings = [
        figures_observability.rank_figure(),
        figures_observability.determinant_figure(81 if scope.quick else 201),
    ]
    return PartResult(_computed("P2-O3"), [tables.rank_table()], drawings)


def first_test(scope: Scope) -> PartResult:
    """Figs 2 and 3, and when M is zero."""
    claims = _computed("P2-test1")
    return PartResult(claims, [tables.test_1_table(claims[0].finding)], [figures_observability.unknown_start_figure()])


def second_test(scope: Scope) -> PartResult:
    """Whether N is bounded."""
    claims = _computed("P2-test2")
    return PartResult(claims, [tables.test_2_table(claims[0].finding)])


def appendix(scope: Scope) -> PartResult:
    """The recursions of the appendix."""
    return PartResult(_computed("P2-A"), drawings=[figures_filter.appendix_figure()])


def covariances(scope: Scope) -> PartResult:
    """What the printed scalar covariances can mean."""
    drawings = [figures_filter.covariance_figure(10 if scope.quick else 28)]
    return PartResult(tables=[tables.covariance_table()], drawings=drawings)


def unknown_input(scope: Scope) -> PartResult:
    """Theorem 1."""
    return PartResult(_computed("P2-uio"), drawings=[figures_filter.theorem_figure()])


def high_slip(scope: Scope) -> PartResult:
    """The adaptive slip threshold."""
    return PartResult(_computed("P2-29"), drawings=[figures_filter.threshold_figure()])


def accuracy(scope: Scope) -> PartResult:
    """Table II against the text."""
    return PartResult(
        _computed("P2-tab2"), [tables.force_table_2(), tables.load_table_2()], [figures_filter.table_figure()]
    )


PARAMETERS = (
    "Vehicle and tire constants of P2, as every result of this study uses them; of the two radii that it prints, 0.35 m in "
    "the text and 0.33 m in Table I, that of the text."
)

STUDY = Study(
    "longitudinal-speed",
    "Longitudinal speed estimation robust to road conditions",
    "P2",
    "Wheel forces from a simple unknown-input observer or a UKF, normalised and fed to a three-state time-varying "
    "Kalman filter at each wheel. Recomputed: the model, its observability, what an unknown initial state does to "
    "the filter, the recursions of the appendix, the bound of the force observer, the slip threshold and the "
    "accuracy that the text claims.",
    (
        Part("parameters", "Table I: vehicle and tire", partial(parameter_part, "longitudinal-speed", PARAMETERS), 0.1),
        Part("model", "Model, patch constant and radius", model, 1.0),
        Part("observability", "Observability of the three-state model (Fig. 1)", observability, 4.0),
        Part("first-test", "Forgetting an unknown start (Figs 2 and 3)", first_test, 2.0),
        Part("second-test", "Bounded covariance after an unknown start", second_test, 5.0),
        Part("appendix", "Recursions of the appendix", appendix, 1.0),
        Part("covariances", "What the printed covariances can mean", covariances, 2.0),
        Part("unknown-input", "Error bound of the unknown-input observer", unknown_input, 1.0),
        Part("high-slip", "Adaptive slip threshold", high_slip, 1.0),
        Part("accuracy", "Accuracy claims", accuracy, 1.0),
        *experiments.PARTS,
    ),
)
