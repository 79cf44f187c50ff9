"""Closed forms for two states against the general methods, and rank-loss speeds against exact roots."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from analysis.errors import AnalysisError
from analysis.norms.hinf import hinf_norm, stability_margin
from analysis.norms.planar import planar_hinf_norm, planar_margin
from analysis.observability.matrix import observability_matrix
from analysis.observability.rank_loss import rank_loss
from analysis.observability.rank_loss_speeds import RankLossSpeeds, real_roots
from analysis.planar_exponential import planar_exponential, planar_phi
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.parameter_set import load_parameter_set

DRAW = np.random.default_rng(3)
A = DRAW.normal(size=(400, 2, 2)) * np.array([[100.0, 1.0], [1e4, 100.0]]) - 80.0 * np.eye(2)


@pytest.mark.parametrize(("inputs", "outputs"), [(1, 1), (3, 1), (1, 2)])
def test_norm_is_that_of_the_level_search(inputs: int, outputs: int) -> None:
    B, C = DRAW.normal(size=(400, 2, inputs)), DRAW.normal(size=(400, outputs, 2))
    wanted = hinf_norm(A, B, C)
    norm, frequency = planar_hinf_norm(A, B, C)
    stable = np.isfinite(wanted.norm)
    assert 100 < stable.sum() < 400
    assert (np.isfinite(norm) == stable).all() and np.isnan(frequency[~stable]).all()
    np.testing.assert_allclose(norm[stable], wanted.norm[stable], rtol=1e-8)
    gain = C @ np.linalg.solve(1j * frequency[:, None, None] * np.eye(2) - A, B.astype(complex))
    seen = np.linalg.norm(gain[stable], 2, axis=(-2, -1))
    np.testing.assert_allclose(norm[stable], seen, rtol=1e-9)  # it is attained where it is said to be


def test_norm_of_a_known_resonance() -> None:
    """w0^2/(s^2 + 2 z w0 s + w0^2) peaks at 1/(2 z sqrt(1 - z^2)) at w0 sqrt(1 - 2 z^2)."""
    w0, z = 7.0, 0.1
    norm, at = planar_hinf_norm([[0.0, 1.0], [-w0 * w0, -2 * z * w0]], [[0.0], [w0 * w0]], [[1.0, 0.0]])
    assert norm == pytest.approx(1 / (2 * z * np.sqrt(1 - z * z)))
    assert at == pytest.approx(w0 * np.sqrt(1 - 2 * z * z))


def test_margin_and_exponential() -> None:
    np.testing.assert_allclose(planar_margin(A), stability_margin(A), rtol=1e-10)
    M = 0.005 * A
    np.testing.assert_allclose(planar_exponential(M), expm(M), rtol=1e-10, atol=1e-12 * np.abs(expm(M)).max())
    # the integral as a block of the exponential of [[M, I], [0, 0]]
    block = np.zeros((len(M), 4, 4))
    block[:, :2, :2], block[:, :2, 2:] = M, np.eye(2)
    wanted = np.stack([expm(b)[:2, 2:] for b in block])
    np.testing.assert_allclose(planar_phi(M), wanted, rtol=1e-9, atol=1e-9)
    assert np.isinf(planar_exponential([[900.0, 1.0], [0.0, 1.0]])[0, 0])


def test_other_shapes_are_refused() -> None:
    for function in (planar_margin, planar_exponential, planar_phi):
        with pytest.raises(AnalysisError, match=r"two states|2, 2"):
            function(np.eye(3))
    with pytest.raises(AnalysisError, match="use hinf_norm"):
        planar_hinf_norm(-np.eye(2), np.eye(2), np.eye(2))


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
def test_rank_loss_speed_is_the_lower_end_of_the_exact_interval(direction: str) -> None:
    from dataclasses import replace

    model = corner_velocity_model(load_parameter_set("corner-estimation"), direction)
    found = RankLossSpeeds(model)
    sigma1 = np.array([0.5, 0.81, 1.4, 2.0])
    speeds = found.lowest({"sigma1": sigma1})
    for value, speed in zip(sigma1, speeds, strict=True):
        constants = {**model.constants, "sigma1": replace(model.constants["sigma1"], value=float(value))}
        exact = rank_loss(observability_matrix(replace(model, constants=constants))).interval_over_rates("wheel_speed")
        wanted = float(exact[0][0]) if exact else np.inf
        assert speed == pytest.approx(wanted, rel=1e-9)
    assert np.isfinite(speeds).any()


def test_roots_with_a_vanishing_leading_coefficient() -> None:
    roots = real_roots(np.array([[0.0, 2.0, -6.0], [1.0, 0.0, 1.0], [1.0, -3.0, 2.0]]))
    assert roots[0, 0] == pytest.approx(3.0) and np.isnan(roots[1]).all()
    assert sorted(roots[2]) == pytest.approx([1.0, 2.0])
