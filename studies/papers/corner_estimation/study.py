"""The study of P1: parts that run, are stored and resumed one by one."""

from __future__ import annotations

from functools import partial

from studies.claim import Claim, ClaimFunction
from studies.papers.corner_estimation import (
    claims_accuracy,
    claims_conditioning,
    claims_error_matrix,
    claims_filter,
    claims_forces,
    claims_gains,
    claims_hinf,
    claims_loads,
    claims_lyapunov,
    claims_solve_size,
    claims_stability,
    experiments,
    figures_design,
    figures_forces,
    figures_stability,
    figures_velocity,
    tables_design,
    tables_forces,
    tables_stability,
)
from studies.papers.corner_estimation.hinf import POINTS
from studies.papers.corner_estimation.inputs import PACKAGE
from studies.papers.parameter_table import parameter_part
from studies.papers.published import computed_claims
from studies.study import Part, PartResult, Scope, Study

CLAIMS: dict[str, ClaimFunction] = {
    **claims_error_matrix.CLAIMS, **claims_lyapunov.CLAIMS, **claims_stability.CLAIMS, **claims_conditioning.CLAIMS,
    **claims_hinf.CLAIMS, **claims_gains.CLAIMS, **claims_solve_size.CLAIMS, **claims_forces.CLAIMS,
    **claims_filter.CLAIMS, **claims_loads.CLAIMS, **claims_accuracy.CLAIMS,
}  # fmt: skip


def _computed(*ids: str) -> list[Claim]:
    return computed_claims(PACKAGE, {name: CLAIMS[name] for name in ids})


def error_matrix(scope: Scope) -> PartResult:
    """Poles of the velocity observer, and the misprints of (26) and (23)."""
    drawings = [figures_stability.pole_figure()]
    return PartResult(_computed("P1-26", "P1-C-abs"), [tables_stability.pole_table()], drawings)


def printed_lyapunov(scope: Scope) -> PartResult:
    """What the printed Lyapunov matrices prove."""
    claims = _computed(*claims_lyapunov.CLAIMS)
    return PartResult(claims, [tables_stability.lyapunov_table()], [figures_stability.lyapunov_figure()])


def quadratic_stability(scope: Scope) -> PartResult:
    """Stability of the printed gains and gain boxes."""
    claims = _computed("P1-aqs-feas", "P1-aqs-box")
    table = tables_stability.proof_table(*(claim.finding for claim in claims))
    return PartResult(claims, [table], [figures_stability.box_figure(41 if scope.quick else 81)])


def conditioning(scope: Scope) -> PartResult:
    """Scaling of the Lyapunov search."""
    claims = _computed("P1-aqs-scale")
    table = tables_stability.conditioning_table(claims[0].finding)
    return PartResult(claims, [table], [figures_design.conditioning_figure(7 if scope.quick else 13)])


def hinf_sign(scope: Scope) -> PartResult:
    """The sign in (30)."""
    return PartResult(_computed("P1-30-sign"))


def hinf_optimum(scope: Scope) -> PartResult:
    """The optimum of (30) by degree, and how its gains run away."""
    claims = _computed("P1-hinf-gamma")
    table = tables_design.gamma_table(claims[0].finding)
    return PartResult(claims, [table], [figures_design.optimum_figure(scope.quick)])


def gain_curves(scope: Scope) -> PartResult:
    """Figs 3 and 4."""
    claims = _computed("P1-hinf-figs")
    table = tables_design.gain_table(claims[0].finding)
    return PartResult(claims, [table], [figures_design.gain_figure()])


def solve_size(scope: Scope) -> PartResult:
    """How large (30) is for a solver, counted; and the seconds of this run, for information."""
    claims = _computed("P1-hinf-time")
    points = 40 if scope.quick else POINTS
    tables = [
        tables_design.size_table(claims[0].finding),
        tables_design.time_table(points, claims_solve_size.solve_seconds(points)),
    ]
    return PartResult(claims, tables)


def wheel_force(scope: Scope) -> PartResult:
    """The longitudinal force observer."""
    drawings = [figures_forces.observer_error_figure(), figures_forces.observer_noise_figure()]
    return PartResult(_computed("P1-pid-K", "P1-prop1"), drawings=drawings)


def sigma_weights(scope: Scope) -> PartResult:
    """Sigma point weights and covariances of the lateral force filter."""
    tables = [tables_forces.weight_table(), tables_forces.filter_table()]
    return PartResult(_computed("P1-ukf"), tables, [figures_forces.weight_figure()])


def observability(scope: Scope) -> PartResult:
    """Observability of the lateral forces and of the velocities."""
    drawings = [figures_forces.force_observability_figure(), figures_velocity.observability_figure()]
    lost = figures_velocity.lost_speeds("lateral")
    notes = [
        f"The lateral velocity model loses rank at a constant wheel speed of {lost[0]:.4f} rad/s "
        f"({lost[0] * 0.33:.1f} m/s), inside the operating range; what is hidden there is the bristle deflection, "
        "which decays at kappa R_e |omega|, so the model stays detectable."
    ]
    return PartResult(_computed("P1-O3"), drawings=drawings, notes=notes)


def loads(scope: Scope) -> PartResult:
    """Vertical loads."""
    claims = _computed("P1-loads")
    return PartResult(claims, [tables_forces.load_table(claims[0].finding)], [figures_forces.load_figure()])


def accuracy(scope: Scope) -> PartResult:
    """Table III against the text, and the axle weights."""
    drawings = [figures_velocity.table_figure(), figures_velocity.axle_weight_figure()]
    return PartResult(_computed("P1-tab3", "P1-34"), [tables_forces.velocity_table_3()], drawings)


PARAMETERS = "Vehicle and tire constants of P1, as every result of this study uses them."

STUDY = Study(
    "corner-estimation",
    "Corner-based estimation of tire forces and vehicle velocities",
    "P1",
    "Forces at each wheel from spin and planar dynamics, normalised and fed to a two-state bristle observer at "
    "each corner, with gains scheduled over wheel speed. Recomputed: the error dynamics and their Lyapunov proofs, "
    "the H-infinity design and its gains, the force observers, loads, observability and the accuracy that the text "
    "claims.",
    (
        Part("parameters", "Table I: vehicle and tire", partial(parameter_part, "corner-estimation", PARAMETERS), 0.1),
        Part("error-matrix", "Error dynamics of the velocity observer", error_matrix, 2.0),
        Part("printed-lyapunov", "What the printed Lyapunov matrices prove", printed_lyapunov, 2.0),
        Part("quadratic-stability", "Stability of the printed gains and gain boxes", quadratic_stability, 3.0),
        Part("conditioning", "Units decide whether a certificate is found", conditioning, 2.0),
        Part("hinf-sign", "The sign in the H-infinity inequality", hinf_sign, 2.0),
        Part("hinf-optimum", "The optimum of the H-infinity problem", hinf_optimum, 6.0),
        Part("gain-curves", "Gains over wheel speed (Figs 3 and 4)", gain_curves, 6.0),
        Part("solve-time", "Preparing and solving the H-infinity problem", solve_size, 8.0),
        Part("wheel-force", "Longitudinal force observer", wheel_force, 2.0),
        Part("sigma-weights", "Sigma points and covariances of the lateral force filter", sigma_weights, 1.0),
        Part("observability", "Observability of forces and velocities", observability, 3.0),
        Part("loads", "Vertical loads", loads, 1.0),
        Part("accuracy", "Accuracy claims and axle weights", accuracy, 2.0),
        *experiments.PARTS,
    ),
)
