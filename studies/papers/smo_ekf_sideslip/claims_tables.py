"""P5-tabs: the tables against the text."""

from __future__ import annotations

from typing import Any

from studies.claim import Finding, judged
from studies.papers.smo_ekf_sideslip.published_tables import force_errors, printed

LIMIT = 6.0  # %


def force_tables(tables: dict[str, dict[str, Any]] | None = None) -> Finding:
    """Largest mean and deviation of Tables 1 and 2, and how far Table 5 spreads with the assumed mass."""
    chosen = printed() if tables is None else tables
    errors = force_errors(chosen)
    means, deviations = ([pair[k] for pair in errors.values()] for k in (0, 1))
    mass = {name: (min(row["mean"]), max(row["mean"])) for name, row in chosen["slalom"]["mass"].items()}
    spread = {name: high - low for name, (low, high) in mass.items()}
    least = min(spread, key=lambda name: spread[name])
    agrees = (
        all(
            chosen["slalom"]["mass"][name]["mean"][1] == chosen["slalom"]["forces"][name]["mean"]
            for name in ("F_y1", "F_y2", "F_x1")
        )
        and chosen["slalom"]["mass"]["beta_2"]["mean"][1] == chosen["slalom"]["stiffness"]["mean"][1]
    )
    computed = {
        "largest_mean_percent": max(means),
        "largest_deviation_percent": max(deviations),
        "mean_by_mass_percent": {name: list(pair) for name, pair in mass.items()},
        "least_sensitive_to_mass": least,
        "nominal_columns_agree_between_tables": agrees,
    }
    reading = (
        f"Largest mean {max(means):g} % and largest standard deviation {max(deviations):g} % of Tables 1 and 2, both "
        f"below {LIMIT:g} %. With 300 kg more or less F_y2 runs from {mass['F_y2'][0]:g} to {mass['F_y2'][1]:g} %, "
        f"the rear sideslip from {mass['beta_2'][0]:g} to {mass['beta_2'][1]:g} %: sideslip suffers least. The "
        "nominal columns of Tables 1, 3 and 5 agree."
    )
    below = max(means) < LIMIT and max(deviations) < LIMIT
    return Finding(computed, judged(below and least == "beta_2" and agrees), reading)


CLAIMS = {"P5-tabs": force_tables}
