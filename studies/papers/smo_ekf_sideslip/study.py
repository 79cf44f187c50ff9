"""The study of P5: its gain conditions, its observability, its tables, and both observers on a model."""

from __future__ import annotations

from studies.papers.published import computed_claims
from studies.papers.smo_ekf_sideslip import (
    claims_fixed_stiffness,
    claims_gains,
    claims_observability,
    claims_sampling,
    claims_tables,
    experiments,
    tables,
)
from studies.papers.smo_ekf_sideslip.axle_drive import AxleDrive, axle_drive, published_car, with_noise
from studies.papers.smo_ekf_sideslip.figures_force_observer import chatter, convergence, tracking, zone_widths
from studies.papers.smo_ekf_sideslip.figures_models import lateral_models, zones
from studies.papers.smo_ekf_sideslip.figures_sideslip import mass_settings, stiffness_observability, stiffness_settings
from studies.papers.smo_ekf_sideslip.observer_chain import run_chain
from studies.papers.smo_ekf_sideslip.published_tables import MASS_SETTINGS, STIFFNESS_SETTINGS
from studies.study import Part, PartResult, Scope, Study

PACKAGE = "studies.papers.smo_ekf_sideslip"
MODEL_NOTE = (
    "The drive is a single track with the printed car values and axles that saturate at friction 1 (hyperbolic "
    "tangent), at constant speed, without noise: it shows what the equations do. The road tests of the paper are "
    "regenerated elsewhere."
)


def gains(_: Scope) -> PartResult:
    """Appendix A with the printed gains."""
    return PartResult(computed_claims(PACKAGE, claims_gains.CLAIMS), [tables.gain_conditions()], [convergence()])


def sampling(scope: Scope) -> PartResult:
    """100 Hz and the widths of the linear zones."""
    claims = computed_claims(PACKAGE, claims_sampling.CLAIMS)
    return PartResult(claims, [tables.zone_table()], [chatter(), zone_widths(31 if scope.quick else 121)])


def moving_forces(_: Scope) -> PartResult:
    """The lag of the split while the true forces move."""
    return PartResult(drawings=[tracking()])


def observability(_: Scope) -> PartResult:
    """Ranks of both models."""
    return PartResult(computed_claims(PACKAGE, claims_observability.CLAIMS), (), [stiffness_observability()])


def printed(_: Scope) -> PartResult:
    """The printed tables against the text."""
    claims = computed_claims(PACKAGE, claims_tables.CLAIMS)
    return PartResult(claims, [tables.printed_forces(), tables.printed_settings()], [lateral_models()])


def fixed_stiffness(_: Scope) -> PartResult:
    """In which direction a fixed tire errs."""
    return PartResult(computed_claims(PACKAGE, claims_fixed_stiffness.CLAIMS))


def stiffness(scope: Scope) -> PartResult:
    """Three settings of the stiffness, fixed and adaptive."""
    drive, cars = _slalom(scope), [published_car(stiffness_factor=factor) for factor in STIFFNESS_SETTINGS]
    fixed, adaptive = run_chain(drive, cars, adaptive=False), run_chain(drive, cars)
    drawing = stiffness_settings(drive, fixed, adaptive)
    return PartResult((), [tables.settings_on_the_model(drive, fixed, adaptive)], [drawing], [MODEL_NOTE])


def zone_plane(scope: Scope) -> PartResult:
    """The zones of the filter along a noisy slalom."""
    drive = with_noise(_slalom(scope))
    return PartResult((), (), [zones(drive, run_chain(drive, [published_car(stiffness_factor=1.5)]))])


def mass(scope: Scope) -> PartResult:
    """Three settings of the mass."""
    drive = _slalom(scope)
    run = run_chain(drive, [published_car(mass_change=change) for change in MASS_SETTINGS])
    return PartResult((), [tables.mass_on_the_model(drive, run)], [mass_settings(drive, run)], [MODEL_NOTE])


def _slalom(scope: Scope) -> AxleDrive:
    return axle_drive(seconds=11.0 if scope.quick else 18.0)


STUDY = Study(
    id="smo-ekf-sideslip",
    title="Axle forces by sliding mode, sideslip with adaptive cornering stiffness",
    paper="P5",
    summary=(
        "Baffet, Charara, Lechner (2009): a sliding-mode observer estimates axle forces without a tire model; an "
        "extended Kalman filter on them estimates sideslip and corrects the cornering stiffness. Gain conditions, "
        "sampling, observability and tables are checked here."
    ),
    parts=(
        Part("gains", "Gain conditions of Appendix A", gains, cost=1.5),
        Part("sampling", "100 Hz: chatter and linear zones", sampling, cost=2.5),
        Part("moving-forces", "The lag of the front-rear split", moving_forces, cost=0.2),
        Part("observability", "Observability of both models", observability, cost=2.0),
        Part("tables", "Tables 1 to 5 against the text", printed, cost=0.2),
        Part("fixed-stiffness", "In which direction a fixed stiffness errs", fixed_stiffness, cost=2.0),
        Part("stiffness-settings", "Fixed and adaptive stiffness in a slalom", stiffness, cost=9.0, quick=False),
        Part("zones", "Zones of the sideslip filter", zone_plane, cost=2.0),
        Part("mass-settings", "A wrong mass in a slalom", mass, cost=5.0, quick=False),
        *experiments.PARTS,
    ),
)
