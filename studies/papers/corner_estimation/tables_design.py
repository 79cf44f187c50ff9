"""Tables of the H-infinity optimum, and of the gains that each reading of it returns."""

from __future__ import annotations

from collections.abc import Mapping

from studies.claim import Finding
from studies.papers.corner_estimation.inputs import DIRECTIONS
from studies.study import Cell, Table


def gamma_table(finding: Finding) -> Table:
    """Least gamma and largest returned gain by degree."""
    found = finding.computed
    rows = [
        [degree, *(found[key][d][k] for d in DIRECTIONS for key in ("gamma", "largest_L2_returned"))]
        for k, degree in enumerate(found["degrees"])
    ]
    columns = ["degree f"]
    for d in DIRECTIONS:
        columns += [f"{d} gamma [1]", f"{d} largest L2 returned [m/s^2]"]
    caption = (
        "Least gamma of (30) (sign corrected, C_e = I, both disturbances) on 140 wheel speeds in [0, 140] rad/s at "
        "wheel accelerations of +-800 rad/s^2. The exact infimum is 1; the returned gains are the solver's, not "
        "the problem's."
    )
    return Table("least-gamma", caption, columns, rows)


def gain_table(finding: Finding) -> Table:
    """Gains at both ends of the range for every reading of C_e, and for the Kalman filter."""
    rows = []
    for direction in DIRECTIONS:
        for name, entry in finding.computed[direction].items():
            if isinstance(entry, dict) and "L1" in entry:
                rows.append([direction, name, *entry["L1"], *entry["L2"], all(entry["on_the_axes"])])
    caption = (
        "Gains at 0 and 140 rad/s that minimising gamma returns for three readings of the unprinted performance "
        "output C_e, and those of the steady Kalman filter that passes through the printed gains at 70 rad/s; "
        "whether all stay on the axes of Figs 3 and 4."
    )
    columns = [
        "direction",
        "problem",
        "L1 at 0 [m/s]",
        "L1 at 140 [m/s]",
        "L2 at 0 [m/s^2]",
        "L2 at 140 [m/s^2]",
        "on the axes",
    ]
    return Table("gains-by-reading", caption, columns, rows)


def size_table(finding: Finding) -> Table:
    """Unknowns, rows and cones of (30) point by point and in its exact form."""
    found = finding.computed
    names = {"conic_problem": f"{found['points']} points, one by one", "exact_relaxation": "exact relaxation"}
    rows: list[list[Cell]] = []
    for key, name in names.items():
        size = found[key]
        cones = ", ".join(f"{number} of {shape}" for shape, number in size["cones"].items())
        rows.append([name, size["unknowns"], size["rows"], sum(size["cones"].values()), cones])
    caption = (
        f"(30) as the solver sees it, degree {found['degree']}, longitudinal: unknowns, rows and positive semidefinite "
        "cones. The exact relaxation holds between the points, too, and does not grow with their number."
    )
    return Table("solve-size", caption, ["form", "unknowns [1]", "rows [1]", "cones [1]", "their sizes"], rows)


def time_table(points: int, measured: Mapping[str, Mapping[str, float]]) -> Table:
    """Preparation and solver time on both roads."""
    roads = {"cvxpy": "cvxpy, then Clarabel", "direct": "conic data assembled directly, Clarabel"}
    rows: list[list[Cell]] = [
        [name, measured[key]["preparation_s"], measured[key]["solver_s"]] for key, name in roads.items()
    ]
    caption = (
        f"Seconds of one solve of (30), {points} points, degree 1, longitudinal, measured in this run on this machine, "
        "which may be doing other things: information, and no part of any claim."
    )
    return Table("solve-time", caption, ["road", "preparation [s]", "solver [s]"], rows)
