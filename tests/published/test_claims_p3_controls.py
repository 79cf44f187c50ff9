"""Negative controls of the claims of P3: another input or another formula, another verdict."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

from studies.claim import ClaimVerdict
from studies.papers.resilient_velocity import (
    discretisation,
    drops,
    error_dynamics,
    sensitivity,
    study,
    switching,
    vehicle,
)
from studies.papers.resilient_velocity.inputs import PRINTED, Setting
from studies.papers.verdicts import among_readings, derived, erratum, open_choice


def with_gain(
    longitudinal: tuple[float, float] = (1.18, 387.0), lateral: tuple[float, float] = (1.21, 16.8)
) -> Setting:
    return replace(PRINTED, gains={"longitudinal": longitudinal, "lateral": lateral})


def with_tire(direction: str, **factors: float) -> Setting:
    tire = PRINTED.parameters.tire[direction]
    scaled = {k: getattr(tire, k).model_copy(update={"value": getattr(tire, k).value * f}) for k, f in factors.items()}
    tires = {**PRINTED.parameters.tire, direction: tire.model_copy(update=scaled)}
    return replace(PRINTED, parameters=PRINTED.parameters.model_copy(update={"tire": tires}))


def with_vehicle(**values: float) -> Setting:
    vehicle = PRINTED.parameters.vehicle
    changed = {k: vehicle[k].model_copy(update={"value": v}) for k, v in values.items()}
    return replace(PRINTED, parameters=PRINTED.parameters.model_copy(update={"vehicle": {**vehicle, **changed}}))


FLIPS = [
    ("P3-ex1-eig", error_dynamics.eigenvalue, with_gain((1.18, 385.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-ex1-eig", error_dynamics.eigenvalue, with_tire("longitudinal", sigma1=1.001), ClaimVerdict.NOT_REPRODUCED),
    ("P3-ex1-sym", error_dynamics.symmetric, replace(PRINTED, example_speed=33.5293), ClaimVerdict.REPRODUCED),
    ("P3-ex1-T", error_dynamics.transformed, replace(PRINTED, example_speed=30.0), ClaimVerdict.REPRODUCED),
    ("P3-ex1-Topt", error_dynamics.best_transform, with_gain((0.1, 387.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-prop1-young", error_dynamics.young, with_gain((-1.18, -387.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-fig2-x", error_dynamics.longitudinal, with_tire("longitudinal", sigma2=2.0), ClaimVerdict.NOT_REPRODUCED),
    ("P3-fig2-y", error_dynamics.lateral, with_gain(lateral=(1.21, 2.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-fig2-nonexp", error_dynamics.non_expansive, with_gain((1.18, 1e5), (1.21, 5e3)), ClaimVerdict.REPRODUCED),
    ("P3-fig345", sensitivity.small_deviations, with_gain(lateral=(1.4, 16.8)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-obs", sensitivity.rank_of_observability, with_tire("lateral", sigma1=0.2), ClaimVerdict.REPRODUCED),
    ("P3-20", switching.common_decay, replace(PRINTED, high_slip=(1.18, 380.0)), ClaimVerdict.REPRODUCED),
    ("P3-ex2-arb", switching.arbitrary_switching, replace(PRINTED, high_slip=(0.22, 1.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-fig6", switching.markov_margin, replace(PRINTED, high_slip=(-0.22, -0.1)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-kron", switching.orientation, with_gain((0.0, 0.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-ex3", drops.twenty_percent, replace(PRINTED, example_drop=0.8), ClaimVerdict.UNDER_SPECIFIED),
    ("P3-ex3-arb", drops.any_pattern, with_gain((0.3, 1.0)), ClaimVerdict.REPRODUCED),
    ("P3-pcr", drops.critical_probability, replace(PRINTED, example_drop=0.6), ClaimVerdict.NOT_REPRODUCED),
    ("P3-pcr", drops.critical_probability, with_gain((-1.18, -387.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-rem4", drops.detectable_mixture, with_gain((0.3, 387.0)), ClaimVerdict.NOT_REPRODUCED),
    ("P3-zoh", discretisation.zero_order_hold_reading, replace(PRINTED, sample_time=1e-4), ClaimVerdict.REPRODUCED),
    ("P3-susp", vehicle.modes, with_vehicle(suspension_damping=3e4), ClaimVerdict.NOT_REPRODUCED),
]  # fmt: skip


@pytest.mark.parametrize(
    ("claim", "setting", "verdict"), [row[1:] for row in FLIPS], ids=[f"{row[0]}-{k}" for k, row in enumerate(FLIPS)]
)
def test_a_changed_input_changes_the_verdict(claim: Any, setting: Setting, verdict: ClaimVerdict) -> None:
    assert claim().verdict is not verdict
    assert claim(setting).verdict is verdict


def test_a_changed_formula_changes_the_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    """Claims without an input that could break them: break the statement instead."""
    other = with_tire("longitudinal", sigma2=3.0)
    other.__dict__["models"] = PRINTED.models  # the floor of one tire, the norm of another
    assert error_dynamics.any_gain(other).verdict is ClaimVerdict.NOT_REPRODUCED
    flat = np.ones(10**6)
    flat[0] = 0.0
    assert study.normalised_errors({"longitudinal": flat, "lateral": flat}).verdict is ClaimVerdict.REPRODUCED
    with monkeypatch.context() as patch:
        patch.setattr(drops, "FIG8_DROPS", (0.2, 0.2))
        assert drops.radius_under_drops().verdict is ClaimVerdict.REPRODUCED
        patch.setattr(drops, "bisected", lambda A0, A1: np.full(len(A0), 0.7))
        assert drops.exact_critical_probability().verdict is ClaimVerdict.NOT_REPRODUCED
        patch.setattr(vehicle, "residual", lambda formula: (sp.S(0),) * 3)
        assert vehicle.loads().verdict is ClaimVerdict.REPRODUCED
        patch.setattr(vehicle, "PRINTED_UNITS", vehicle.CORRECTED_UNITS)
        assert vehicle.steady_curve().verdict is ClaimVerdict.NOT_REPRODUCED
        patch.setattr(sensitivity, "CHANGE", 3.0)
        assert sensitivity.small_deviations().verdict is ClaimVerdict.REPRODUCED


def test_the_comparisons_behind_the_verdicts() -> None:
    assert erratum(True, False) is ClaimVerdict.REPRODUCED  # a printed form that holds is no erratum
    assert erratum(False, False) is ClaimVerdict.NOT_REPRODUCED  # nor is one whose correction fails
    assert derived(False) is ClaimVerdict.NOT_REPRODUCED
    assert among_readings([0.9, 1.1], 1.0, 0.05) is ClaimVerdict.UNDER_SPECIFIED
    assert among_readings([1.0, 1.01], 1.0, 0.05) is ClaimVerdict.REPRODUCED
    assert among_readings([0.9, 0.8], 1.0, 0.05) is ClaimVerdict.NOT_REPRODUCED
    assert among_readings([float("nan")], 1.0, 0.05) is not ClaimVerdict.REPRODUCED
    assert open_choice([[1.0, 2.0], [1.0, 2.0]], 0.0) is ClaimVerdict.REPRODUCED
    assert open_choice([[1.0, 2.0], [1.0, 2.1]], 0.05) is ClaimVerdict.UNDER_SPECIFIED
