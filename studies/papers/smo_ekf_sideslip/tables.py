"""Tables of P5: as printed, and what the analysis says beside them."""

from __future__ import annotations

import numpy as np

from analysis.bounds_sliding_mode import OUTPUTS, PUBLISHED, sliding_mode_convergence, smallest_zone_widths
from studies.papers.smo_ekf_sideslip.axle_drive import AxleDrive
from studies.papers.smo_ekf_sideslip.claims_sampling import NARROW, SAMPLE_TIME, WIDE, late_peaks, radius
from studies.papers.smo_ekf_sideslip.error_motion import CAR, LARGEST
from studies.papers.smo_ekf_sideslip.observer_chain import ChainRun
from studies.papers.smo_ekf_sideslip.published_tables import MASS_SETTINGS, STIFFNESS_SETTINGS, printed
from studies.study import Cell, Table
from synthesis.polynomials.matrix import FloatArray


def gain_conditions() -> Table:
    """Each condition of Appendix A with its margin at the worst start."""
    worst = float(CAR.front_axle_distance * LARGEST[1] + CAR.rear_axle_distance * LARGEST[2])
    found = sliding_mode_convergence(PUBLISHED, CAR, yaw_moment_error=worst)
    rows: list[list[Cell]] = [
        ["(A.4) Omega_1 > |L1 x2 - L2 x3| / I_z", "rad/s^2", round(found.yaw_margin, 4), found.yaw_margin > 0],
        ["(A.4) Omega_12 > |Omega_10| + |Omega_11|", "N/s", found.longitudinal_margin, found.longitudinal_margin > 0],
        ["(A.8) Omega_5 + Omega_8 > |Omega_6| + |Omega_9|", "N/s", found.lateral_margin, found.lateral_margin > 0],
        ["(7) Omega_4 = -Omega_7", "N/s", PUBLISHED[4] + PUBLISHED[7], PUBLISHED[4] == -PUBLISHED[7]],
        [
            "(7) L1 Omega_5 = L2 Omega_8 (residual)",
            "N m/s",
            round(found.split_residual, 6),
            abs(found.split_residual) < 1e-6,
        ],
        ["(A.12) decay of the split", "1/s", round(found.split_decay_rate, 6), found.split_decay_rate > 0],
    ]
    return Table(
        "gain-conditions",
        "Conditions of Appendix A with the printed gains, at the worst start that the printed maxima of Table 1 "
        f"allow (|L1 x2 - L2 x3| = {worst / 1e3:.2f} kN m); (A.4) with the minus sign of (A.5). Margins in the unit "
        "given.",
        ("condition", "unit", "margin or value", "holds"),
        rows,
    )


def zone_table() -> Table:
    """Readings of the unprinted widths."""
    limits = smallest_zone_widths(PUBLISHED, CAR, SAMPLE_TIME)
    least = tuple(limits[name] for name in OUTPUTS)
    rows: list[list[Cell]] = []
    for name, widths in (("bare sign", None), ("at the limits", least), ("10 % above the limits", tuple(1.1 * w for w in least)),
                         ("used here", WIDE), ("too narrow", NARROW)):  # fmt: skip
        peaks = late_peaks(widths, starts=60).max(axis=0)
        cells: list[Cell] = [None] * 3 if widths is None else [round(float(w), 4) for w in widths]
        rows.append([name, *cells, None if widths is None else round(radius(widths), 4), round(float(peaks[0]), 5),
                     *(round(float(p), 2) for p in peaks[1:])])  # fmt: skip
    return Table(
        "zone-widths",
        "The observer at 100 Hz with different widths of the linear zones (P5 prints none): spectral radius inside "
        "the zones, and largest errors after 3 s over 60 starts within the printed maxima, true forces constant.",
        ("reading", "yaw width [rad/s]", "lateral width [m/s^2]", "longitudinal width [m/s^2]", "spectral radius [1]",
         "yaw rate error [rad/s]", "front force error [N]", "rear force error [N]", "longitudinal force error [N]"),
        rows,
    )  # fmt: skip


def printed_forces() -> Table:
    """Tables 1 and 2."""
    rows: list[list[Cell]] = [
        [
            test,
            name,
            row["largest"],
            row["unit"],
            row["mean"],
            row["deviation"],
            row["mean"] < 6 and row["deviation"] < 6,
        ]
        for test, tables in printed().items()
        for name, row in tables["forces"].items()
    ]
    return Table(
        "tables-1-2",
        "Tables 1 and 2 of P5 as printed: errors (8) of the force observer in the two road tests, in percent of "
        "the maximum.",
        ("test", "quantity", "max", "unit", "mean [%]", "std [%]", "below 6 %"),
        rows,
    )


def printed_settings() -> Table:
    """Tables 3 to 5."""
    found = printed()
    rows: list[list[Cell]] = []
    for number, test in ((3, "slalom"), (4, "roundabout")):
        row = found[test]["stiffness"]
        for k, factor in enumerate(STIFFNESS_SETTINGS):
            rows.append([number, test, "beta_2", f"stiffness x {factor:g}", row["mean"][k], row["deviation"][k]])
    for name, row in found["slalom"]["mass"].items():
        for k, change in enumerate(MASS_SETTINGS):
            rows.append([5, "slalom", name, f"mass {change:+g} kg", row["mean"][k], row["deviation"][k]])
    return Table(
        "tables-3-5",
        "Tables 3, 4 and 5 of P5 as printed: errors (8) with other settings of the stiffness and of the mass, in "
        "percent.",
        ("table", "test", "quantity", "setting", "mean [%]", "std [%]"),
        rows,
    )


def error_percent(estimate: FloatArray, true: FloatArray) -> tuple[float, float]:
    """Mean and standard deviation of (8) in %."""
    error = 100.0 * np.abs(estimate - true) / np.abs(true).max()
    return round(float(error.mean()), 2), round(float(error.std()), 2)


def settings_on_the_model(drive: AxleDrive, fixed: ChainRun, adaptive: ChainRun) -> Table:
    """Errors of the rear sideslip by stiffness setting, both observers."""
    after = drive.time > 5.0
    rows: list[list[Cell]] = []
    for name, run in (("fixed (ORL)", fixed), ("adaptive (EKF)", adaptive)):
        for j, factor in enumerate(STIFFNESS_SETTINGS):
            true, found = drive.rear_sideslip[after], run.rear_sideslip[after, j]
            ratio = round(float(found @ true / (true @ true)), 3)
            rows.append([name, factor, *error_percent(found, true), ratio])
    return Table(
        "stiffness-settings",
        "Error (8) of the rear sideslip in the simulated slalom (saturating axles, no noise, from 5 s on), and the "
        "size of the estimate against the true one. A model, not the road test of Tables 3 and 4.",
        ("observer", "stiffness setting [1]", "mean error [%]", "std of the error [%]", "estimate / true [1]"),
        rows,
    )


def mass_on_the_model(drive: AxleDrive, run: ChainRun) -> Table:
    """Errors of forces and sideslip by assumed mass."""
    after, true = drive.time > 5.0, drive.body_forces()
    rows: list[list[Cell]] = []
    for j, change in enumerate(MASS_SETTINGS):
        for name, found, exact in (
            ("F_y1", run.forces[:, j, 0], true[:, 0]),
            ("F_y2", run.forces[:, j, 1], true[:, 1]),
            ("beta_2", run.rear_sideslip[:, j], drive.rear_sideslip),
        ):
            ratio = float(found[after] @ exact[after] / (exact[after] @ exact[after]))
            rows.append([change, name, *error_percent(found[after], exact[after]), round(ratio, 3)])
    return Table(
        "mass-settings",
        "Error (8) in the simulated slalom by assumed mass, and the size of the estimate against the true one: "
        "forces scale with the mass (300 kg are 20.7 %), sideslip does not. A model, not the road test of Table 5.",
        ("mass change [kg]", "quantity", "mean error [%]", "std of the error [%]", "estimate / true [1]"),
        rows,
    )
