"""P5-100Hz: what becomes of the sign functions at 100 Hz depends on widths that are not printed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from analysis.bounds_sliding_mode import (
    OUTPUTS,
    PUBLISHED,
    linear_zone_matrix,
    sampled_radius,
    smallest_zone_widths,
)
from studies.claim import ClaimVerdict, Finding
from studies.papers.smo_ekf_sideslip.error_motion import CAR, LARGEST, error_motion
from synthesis.polynomials.matrix import FloatArray

SAMPLE_TIME = 0.01  # s
WIDE, NARROW = (0.2, 1.0, 1.0), (0.05, 0.1, 0.1)  # rad/s, m/s^2, m/s^2: two readings
SETTLED, END = 3.0, 8.0  # s
STARTS = 400


def radius(widths: Sequence[float]) -> float:
    """Spectral radius of the error inside the linear zones."""
    return sampled_radius(linear_zone_matrix(PUBLISHED, CAR, dict(zip(OUTPUTS, widths, strict=True))), SAMPLE_TIME)


def late_peaks(widths: Sequence[float] | None, starts: int = STARTS) -> FloatArray:
    """Largest |error| (starts, 4) after 3 s, from starts spread over the printed maxima."""
    start = LARGEST * np.random.default_rng(1).uniform(-1.0, 1.0, (starts, 4))
    path = error_motion(start, END, SAMPLE_TIME, widths)
    return np.asarray(np.abs(path[round(SETTLED / SAMPLE_TIME) :]).max(axis=0))


def sampled_switching(readings: Sequence[Sequence[float]] = (WIDE, NARROW)) -> Finding:
    """Chatter of the bare sign, and both answers that widths can give."""
    bare = late_peaks(None)
    zones: list[dict[str, Any]] = [
        {
            "widths": list(widths),
            "spectral_radius": radius(widths),
            "largest_force_after_3_s_N": float(late_peaks(widths)[:, 1:].max()),
        }
        for widths in readings
    ]
    limits = smallest_zone_widths(PUBLISHED, CAR, SAMPLE_TIME)
    computed = {
        "sign_peak_yaw_rate_rad_s": float(bare[:, 0].max()),
        "sign_peak_front_lateral_N": [float(bare[:, 1].min()), float(bare[:, 1].max())],
        "sign_peak_rear_lateral_N": [float(bare[:, 2].min()), float(bare[:, 2].max())],
        "sign_peak_longitudinal_N": [float(bare[:, 3].min()), float(bare[:, 3].max())],
        "zones": zones,
        "least_widths": [limits[name] for name in OUTPUTS],
    }
    stable = [zone["spectral_radius"] < 1.0 for zone in zones]
    verdict = (
        ClaimVerdict.REPRODUCED
        if all(stable)
        else ClaimVerdict.UNDER_SPECIFIED
        if any(stable)
        else ClaimVerdict.NOT_REPRODUCED
    )
    reading = (
        f"The bare sign chatters at 100 Hz by up to {bare[:, 0].max():.3f} rad/s and by force peaks that depend on "
        f"the start (front up to {bare[:, 1].max():.0f} N, longitudinal {bare[:, 3].min():.0f} to "
        f"{bare[:, 3].max():.0f} N). The widths of the linear zones are not printed and decide: each has a lower "
        f"limit (gain times half a sample: {limits['yaw_rate']:.2f} rad/s, {limits['lateral_acceleration']:.2f} and "
        f"{limits['longitudinal_acceleration']:.2f} m/s^2). Two readings: "
        + "; ".join(f"{tuple(z['widths'])} gives a spectral radius of {z['spectral_radius']:.4f}" for z in zones)
        + "."
    )
    return Finding(computed, verdict, reading)


CLAIMS = {"P5-100Hz": sampled_switching}
