"""Figs 3-5 of P3: each tire parameter scaled by 0.8 and 1.2. References: P3 notes 4, recomputed deviations."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.labelled import Axis
from analysis.norms.hinf import hinf_norm, stability_margin
from analysis.perturbed import PerturbedModel, error_measure
from analysis.sensitivity import around, one_at_a_time, worst_case
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.parameter_set import load_parameter_set

SPEEDS = np.linspace(0.0, 140.0, 141)
NAMES = ("sigma0", "sigma1", "sigma2", "kappa")


def setting(direction):
    parameters = load_parameter_set("resilient-velocity")
    family = PerturbedModel(corner_velocity_model(parameters, direction))
    return family, parameters.tire[direction].published.gains, {name: family.nominal[name] for name in NAMES}


def margin(A_e, _):
    return stability_margin(A_e)


def norm(A_e, B_e):
    return hinf_norm(A_e, B_e[..., :2], np.eye(2)).norm


# (-20 %, +20 %) at 40 rad/s, in 1/s, half a unit of the last digit of the sheet
MARGINS = {
    "longitudinal": (-327.1, {"sigma0": (0.44, -0.21), "sigma1": (-42.0, 29.0), "sigma2": (-0.06, 0.06), "kappa": (0.08, -0.08)}),
    "lateral": (-13.78, {"sigma0": (0.03, -0.02), "sigma1": (2.5, -4.0), "sigma2": (0.0, 0.0), "kappa": (-0.02, 0.02)}),
}  # fmt: skip
HALF_DIGIT = {"sigma0": 0.005, "sigma1": 0.5, "sigma2": 0.005, "kappa": 0.005}


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
def test_figs_3_and_4_deviation_of_the_stability_margin(direction) -> None:
    family, gain, nominal = setting(direction)
    found = one_at_a_time(
        error_measure(family, gain, margin, wheel_speed=SPEEDS), nominal, name="stability margin", unit="1/s",
        axes=(Axis("wheel_speed", SPEEDS, "rad/s"),),
    )  # fmt: skip
    center, deviations = MARGINS[direction]
    assert found.nominal.at(wheel_speed=40.0).item() == pytest.approx(center, abs=0.05)
    for name, pair in deviations.items():
        for factor, value in zip((0.8, 1.2), pair, strict=True):
            got = found.deviations.at(parameter=name, factor=factor, wheel_speed=40.0).item()
            half = 0.05 if (direction, name) == ("lateral", "sigma1") else HALF_DIGIT[name]
            assert got == pytest.approx(value, abs=half), (name, factor)
    ranking = found.ranking()
    assert ranking[0][0] == "sigma1"  # "only sigma1 matters"
    assert ranking[0][1] > 10.0 * ranking[1][1]
    assert (found.values.values < 0.0).all()  # no perturbation of 20 % destabilises


def test_fig_5_deviation_of_the_norm() -> None:
    """Below 3e-4 longitudinally and 6e-3 laterally, except for one case that static gains do not show: see below."""
    for direction, largest in (("longitudinal", 3e-4), ("lateral", 6e-3)):
        family, gain, nominal = setting(direction)
        found = one_at_a_time(
            error_measure(family, gain, norm, wheel_speed=SPEEDS), nominal, axes=(Axis("wheel_speed", SPEEDS, "rad/s"),)
        )

        def static(A_e, B_e):
            return np.linalg.svd(np.linalg.solve(A_e, B_e[..., :2]), compute_uv=False)[..., 0]

        again = one_at_a_time(error_measure(family, gain, static, wheel_speed=SPEEDS), nominal)
        resonant = found.values.values > again.values.values * (1 + 1e-9)
        assert np.abs(found.deviations.values[~resonant]).max() < largest
        np.testing.assert_allclose(found.values.values[~resonant], again.values.values[~resonant], rtol=1e-9)
        # Lateral observer with sigma1 20 % up, above 126 rad/s: the peak leaves zero frequency and the norm rises by 5 %.
        cases = {
            (str(found.values.axes[0].labels[i]), float(found.values.axes[1].labels[j]))
            for i, j, _ in np.argwhere(resonant)
        }
        assert cases == (set() if direction == "longitudinal" else {("sigma1", 1.2)})
        if direction == "lateral":
            deviation = found.deviations.at(parameter="sigma1", factor=1.2)
            assert SPEEDS[resonant.any(axis=(0, 1))].min() == 127.0
            A_e, B_e = family.at(wheel_speed=140.0, sigma1=1.2 * nominal["sigma1"]).error_dynamics(
                np.array(gain)[:, None]
            )
            sweep = np.linspace(0.0, 100.0, 20001)[:, None, None] * 1j  # second calculation: a dense sweep
            gains = np.linalg.svd(np.linalg.solve(sweep * np.eye(2) - A_e, B_e[:, :2] + 0j), compute_uv=False)[:, 0]
            assert gains.max() == pytest.approx(found.nominal.values[-1] + deviation.values[-1], rel=1e-6)
            assert deviation.values[-1] == pytest.approx(0.0483, abs=5e-5)


def test_the_compiled_family_is_the_model() -> None:
    family, gain, _ = setting("lateral")
    L = np.array(gain)[:, None]
    for mine, theirs in zip(
        family.at(wheel_speed=SPEEDS).error_dynamics(L), family.model.on(SPEEDS).error_dynamics(L), strict=True
    ):
        np.testing.assert_allclose(mine, theirs, rtol=1e-13, atol=1e-12)


def test_the_worst_of_all_perturbations_is_worse_than_one_at_a_time() -> None:
    family, gain, nominal = setting("lateral")
    measure = error_measure(family, gain, margin, wheel_speed=40.0)
    single = one_at_a_time(measure, nominal).values.values.max()
    found = worst_case(measure, around(nominal), seed=1)
    assert found.value > single
    assert found.value < 0.0  # still stable
    again = measure({name: np.array([value]) for name, value in found.parameters.items()})
    assert again[0] == pytest.approx(found.value, rel=1e-12)
    assert found.parameters["sigma1"] == pytest.approx(0.8 * nominal["sigma1"], rel=1e-9)
