"""Worst inputs against dense operators, gramians against closed forms, the search against parametric resonance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.simulation.channel import channel_of
from analysis.simulation.linear import Linear
from analysis.simulation.norms_along import h2_along, peak_along
from analysis.simulation.searched import ScheduleQuestion, least_decay
from analysis.simulation.worst_input import worst_inputs
from estimators.schedule.gain_schedule import SchedulingParameter as Parameter
from estimators.schedule.plant import PlantPolynomial
from synthesis.certificate.claims import ClaimChannel
from tests.support.any_size import any_schedule
from tests.unit.test_simulation import broken


def test_the_search_finds_parametric_resonance() -> None:
    """x'' + 0.1 x' + p x = d: every frozen p decays at 0.05 1/s, a p that swings about 1 at twice the frequency pumps (Mathieu).

    With nobody correcting, the error is the plant's. What swings by 0.4 in its first harmonic grows at 0.4/4 - 0.05 > 0.
    """
    A = np.array([[[0.0, 1.0], [-1.0, -0.1]], [[0.0, 0.0], [-0.5, 0.0]]])
    plant = {
        "A": A, "B": np.zeros((1, 2, 0)), "C": np.eye(2)[None, :1], "D": np.zeros((1, 1, 0)),
        "E": np.array([[[0.0], [1.0]]]), "F": np.zeros((1, 1, 1)),
    }  # fmt: skip
    schedule = replace(
        any_schedule((2, 0, 1), 1), update="sampled", sample_time=0.1, grid=(np.array([0.5, 1.5]),), table=np.zeros((2, 2, 1)),
        plant={key: PlantPolynomial(1.0, 0.5, value) for key, value in plant.items()},
        parameters=(Parameter("p", "1", 0.5, 1.5, -2.0, 2.0, False),),
    )  # fmt: skip
    question = ScheduleQuestion(schedule, "sampled gain", ClaimChannel({"d0": 1.0}, ("s0",)))
    rate, path = least_decay(question, 400)
    assert -0.2 < rate < -0.03
    assert not broken(path[:, 0], (-2.0, 2.0), 0.1, (0.5, 1.5))
    frozen = channel_of(schedule, "sampled gain", question.channel, np.linspace(0.5, 1.5, 5)[:, None]).A
    assert -np.log(np.abs(np.linalg.eigvals(frozen)).max(axis=1)) / 0.1 == pytest.approx(np.full(5, 0.05))


def test_gramians_along_a_constant_trajectory_give_the_norms_of_the_system() -> None:
    """x+ = a x + b w, z = x + d w: H2 norm and energy to peak are both sqrt(b^2/(1 - a^2) + d^2)."""
    system = [np.full((1, 400, 1, 1), value) for value in (0.9, 0.5, 1.0, 0.3)]
    wanted = np.sqrt(0.25 / (1.0 - 0.81) + 0.09)
    assert h2_along(Linear(*system)) == pytest.approx([wanted], rel=1e-12)
    assert peak_along(Linear(*system)) == pytest.approx([wanted], rel=1e-12)
    short = Linear(*(part[:, :3] for part in system))  # two samples: 0.25 (1 + 0.81) + 0.09
    assert h2_along(short) == peak_along(short) == pytest.approx([np.sqrt(0.25 * 1.81 + 0.09)], rel=1e-12)


def test_the_worst_input_is_that_of_the_dense_operator() -> None:
    """Ten samples of a time-varying system: the largest singular value of its block triangular matrix."""
    rng, N = np.random.default_rng(4), 10
    A, B, C = (
        0.5 * rng.normal(size=(1, N + 1, 2, 2)),
        rng.normal(size=(1, N + 1, 2, 2)),
        rng.normal(size=(1, N + 1, 1, 2)),
    )
    D = rng.normal(size=(1, N + 1, 1, 2))
    dense = np.zeros((N + 1, 2 * N))
    for j in range(N):
        dense[j, 2 * j : 2 * j + 2] = D[0, j]
        reach = B[0, j]
        for i in range(j + 1, N + 1):
            dense[i, 2 * j : 2 * j + 2] = C[0, i] @ reach
            reach = A[0, i] @ reach
    values = np.linalg.svd(dense, compute_uv=False)
    few, many = (worst_inputs(Linear(A, B, C, D), rng.normal(size=(1, N, 2)), rounds)[0][0] for rounds in (2, 200))
    assert many == pytest.approx(values[0], rel=1e-9)
    assert few <= values[0] * (1.0 + 1e-12)
