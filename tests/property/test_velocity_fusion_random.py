"""Whatever the signals, the fusion answers with finite, flagged estimates and keeps its covariances positive."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.vehicle import VehicleParameters
from estimators.velocity import VelocityFusion

CAR = VehicleParameters.published_suv()
ANY = st.one_of(st.floats(-200, 200), st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 1e300, -1e12]))


@settings(max_examples=30, deadline=None)
@given(st.lists(st.lists(ANY, min_size=15, max_size=15), min_size=1, max_size=15), st.integers(1, 30))
def test_anything_at_all(rows: list[list[float]], repeats: int) -> None:
    fusion = VelocityFusion(CAR, 0.005)
    with np.errstate(all="raise", under="ignore"):
        for row in rows:
            for _ in range(repeats):
                step = fusion.step(row[:4], row[4:8], row[8], row[9], row[10], row[11:15])
    for value in (step.vx, step.vy, step.vx_deviation, step.vy_deviation, step.slip, step.slip_angle, step.radius):
        assert np.isfinite(value).all()
    for part in (fusion.longitudinal_filter, fusion.lateral_filter):
        scale = np.sqrt(np.diagonal(part.covariance[0]))
        assert np.linalg.eigvalsh(part.covariance[0] / np.outer(scale, scale)).min() > -1e-9
