"""The error measure of P1 (46) against sums done by hand."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies.drives.evaluation import deviation


def test_by_hand() -> None:
    found = deviation(np.array([1.0, 2.0, 7.0, 0.0]), np.array([1.0, -2.0, 4.0, 0.0]), "m/s")
    assert found.samples == 4
    assert found.rms == pytest.approx(np.sqrt((16 + 9) / 4))
    assert found.max_error == 4.0
    assert found.reference_peak == 4.0
    assert found.nrms_percent == pytest.approx(100 * 2.5 / 4)


@given(st.floats(-1e3, 1e3), st.floats(0.1, 1e3), st.integers(1, 50))
def test_a_constant_offset_is_its_own_rms(offset: float, peak: float, samples: int) -> None:
    reference = np.full(samples, -peak)
    found = deviation(reference + offset, reference, "N")
    assert found.rms == pytest.approx(abs(offset), rel=1e-6, abs=1e-9)
    assert found.max_error == pytest.approx(abs(offset), rel=1e-6, abs=1e-9)
    assert found.nrms_percent == pytest.approx(100 * abs(offset) / peak, rel=1e-6, abs=1e-6)


def test_missing_samples_are_not_compared() -> None:
    nan = np.nan
    found = deviation(np.array([1.0, nan, 3.0, np.inf]), np.array([2.0, 9.0, nan, 1.0]), "N")
    assert (found.samples, found.rms, found.reference_peak) == (1, 1.0, 2.0)


def test_nothing_to_compare_is_not_zero() -> None:
    found = deviation(np.array([np.nan]), np.array([1.0]), "N")
    assert found.samples == 0
    assert json.loads(json.dumps(asdict(found), allow_nan=False))["rms"] is None


def test_reference_at_rest_has_no_nrms() -> None:
    found = deviation(np.ones(3), np.zeros(3), "m/s")
    assert (found.nrms_percent, found.rms) == (None, 1.0)


def test_lengths_must_agree() -> None:
    with pytest.raises(ValueError, match=r"estimate has shape \(2,\), reference \(3,\)"):
        deviation(np.ones(2), np.ones(3), "N")
