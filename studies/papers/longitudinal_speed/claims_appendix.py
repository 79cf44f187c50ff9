"""P2-A: three misprints of the appendix, each shown to fail as printed and to hold corrected."""

from __future__ import annotations

import numpy as np

from studies.claim import ClaimFunction, Finding
from studies.papers.longitudinal_speed.appendix import first_split, fixed_gain, remainder_errors, setting
from studies.papers.verdicts import erratum

EXACT = 1e-9  # relative
CLOSE = 1e-4  # relative, for a first-order formula at a remainder of 1e-6


def appendix(corrected_noise: float = 1.0) -> Finding:
    """(A4) without Q and with `corrected_noise` times Q, (A6), (A7) with both transitions, (A8) with both signs."""
    s = setting()
    fixed, split, errors = fixed_gain(s, corrected_noise=corrected_noise), first_split(s), remainder_errors(s)
    smallest = min(errors)
    sums_agree = float(np.abs(fixed.corrected / fixed.summed - 1.0).max())
    missing, complete = fixed.printed_limit / fixed.filter, fixed.corrected_limit / fixed.filter
    computed = {
        "A4_printed_over_filter_covariance": missing,
        "A4_with_Q_over_filter_covariance": complete,
        "A4_with_Q_against_A5": sums_agree,
        **split,
        "A8_error_with_printed_sign": errors[smallest][0],
        "A8_error_with_corrected_sign": errors[smallest][1],
    }
    reading = (
        f"(A4) lacks + Q: as printed it ends at {missing:.3g} of the covariance of the very filter that it bounds, "
        f"with Q at {complete:.6f}, and it then equals (A5). (A6) holds. (A7) "
        f"needs phi_(k+1,0) in M_(k+1): with phi_(k,0) M_1 is off by {100 * split['M1_of_A7_as_printed']:.0f} %. "
        f"The first bracket of (A8) needs - T/psi: the printed plus is off by {100 * errors[smallest][0]:.0f} %, "
        f"the minus by {errors[smallest][1]:.0e}."
    )
    printed_holds = (
        abs(missing - 1.0) <= EXACT and split["M1_of_A7_as_printed"] <= EXACT and errors[smallest][0] <= CLOSE
    )
    corrected_holds = (
        sums_agree <= EXACT
        and abs(complete - 1.0) <= EXACT
        and split["M1_of_A6"] <= EXACT
        and split["N1_of_A6"] <= EXACT
        and errors[smallest][1] <= CLOSE
    )
    return Finding(computed, erratum(printed_holds, corrected_holds), reading)


CLAIMS: dict[str, ClaimFunction] = {"P2-A": appendix}
