"""P4-y4 and P4-dugoff: for each, the printed form fails and the corrected one holds."""

from __future__ import annotations

from studies.claim import ClaimVerdict, Finding, judged
from studies.papers.ekf_ukf_lateral.equations import SPEED, acceleration_mismatch, straight_poles
from studies.papers.ekf_ukf_lateral.observability import corrected_model, printed_output_model
from synthesis.models.nonlinear import NonlinearModel


def lateral_output(printed: NonlinearModel | None = None) -> Finding:
    """Both forms of y_4 against the acceleration that the states of (11) have."""
    wrong = acceleration_mismatch(printed or printed_output_model())
    right = acceleration_mismatch(corrected_model())
    erratum = wrong != 0 and right == 0
    computed = {"printed_minus_true": str(wrong), "corrected_minus_true": str(right), "term": "x8 sin(u1)"}
    reading = (
        "By the force balance (1) the term is F_x1 sin(delta) = x_8 sin(u_1). With it y_4 equals the acceleration "
        "of the states identically; with the printed x_6 the two differ by (F_y21 - F_x1) sin(delta) / m."
    )
    return Finding(
        computed, judged(wrong == 0, ClaimVerdict.ERRATUM if erratum else ClaimVerdict.NOT_REPRODUCED), reading
    )


def tire_sign(printed_sign: int = -1) -> Finding:
    """Is driving straight ahead at 20 m/s stable with the sign of (3), and with the other one?"""
    printed, corrected = straight_poles(printed_sign), straight_poles(1)
    computed = {
        "speed_m_s": SPEED,
        "poles_printed_1_s": printed.quasi_static.tolist(),
        "poles_corrected_1_s": corrected.quasi_static.tolist(),
        "largest_pole_printed_with_relaxation_1_s": float(printed.lagged.max()),
        "largest_pole_corrected_with_relaxation_1_s": float(corrected.lagged.max()),
    }
    reading = (
        "With the slip angles of (2) a left turn has positive slip and needs a positive force. The printed minus "
        f"turns every restoring force around: both poles of the single track at {SPEED:g} m/s are unstable. The plus "
        "sign gives two stable ones."
    )
    erratum = corrected.stable and not printed.stable
    return Finding(
        computed, judged(printed.stable, ClaimVerdict.ERRATUM if erratum else ClaimVerdict.NOT_REPRODUCED), reading
    )


CLAIMS = {"P4-y4": lateral_output, "P4-dugoff": tire_sign}
