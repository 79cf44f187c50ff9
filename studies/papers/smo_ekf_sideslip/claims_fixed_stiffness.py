"""P5-orl: in which direction a fixed linear tire errs."""

from __future__ import annotations

from studies.claim import ClaimVerdict, Finding
from studies.papers.smo_ekf_sideslip.axle_drive import LINEAR, axle_drive, published_car
from studies.papers.smo_ekf_sideslip.observer_chain import run_chain
from studies.papers.smo_ekf_sideslip.published_tables import STIFFNESS_SETTINGS


def fixed_stiffness(settings: tuple[float, ...] = STIFFNESS_SETTINGS) -> Finding:
    """Rear sideslip of the observer with F = C beta over the true one, for stiffness settings below, at and above the true."""
    drive = axle_drive(seconds=9.0, friction=LINEAR)
    run = run_chain(drive, [published_car(stiffness_factor=factor) for factor in settings], adaptive=False)
    turning = drive.time > 6.0
    true = drive.rear_sideslip[turning]
    ratio = [float(estimate @ true / (true @ true)) for estimate in run.rear_sideslip[turning].T]
    low, high = ratio[0] - 1.0, ratio[-1] - 1.0
    computed = {
        "stiffness_factors": list(settings),
        "simulated_rear_sideslip_ratio": ratio,
        "steady_state_ratio": [1.0 / factor for factor in settings],
    }
    verdict = (
        ClaimVerdict.REPRODUCED
        if low > 0 and high > 0
        else ClaimVerdict.ERRATUM
        if low > 0 > high
        else ClaimVerdict.NOT_REPRODUCED
    )
    reading = (
        "The measured force fixes C beta: sideslip comes out as 1/factor. Reduced stiffness overestimates it "
        f"(factor {settings[0]:g}: {ratio[0]:.2f} times the true rear sideslip in the simulated slalom), increased "
        f"stiffness underestimates it (factor {settings[-1]:g}: {ratio[-1]:.2f} times). The text says overestimated "
        "for both; the second must read underestimated."
    )
    return Finding(computed, verdict, reading)


CLAIMS = {"P5-orl": fixed_stiffness}
