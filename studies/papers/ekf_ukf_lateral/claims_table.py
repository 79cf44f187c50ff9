"""P4-tab1: the text against the table."""

from __future__ import annotations

from collections.abc import Sequence

from studies.claim import Finding, judged
from studies.papers.ekf_ukf_lateral.published_table import Row, table_1

LIMIT = 8.0  # %


def below_eight_percent(rows: Sequence[Row] | None = None) -> Finding:
    """How many means of the unscented filter exceed 8 %, their average, and where it beats the extended one."""
    table = table_1() if rows is None else rows
    ukf, ekf = ([row.mean[kind] for row in table] for kind in ("ukf", "ekf"))
    above = [row.quantity for row in table if not row.mean["ukf"] < LIMIT]
    computed = {
        "ukf_means_percent": ukf,
        "ukf_average_percent": sum(ukf) / len(ukf),
        "ekf_average_percent": sum(ekf) / len(ekf),
        "rows_above_limit": above,
        "ukf_better_means": sum(row.mean["ukf"] < row.mean["ekf"] for row in table),
        "ukf_better_deviations": sum(row.deviation["ukf"] < row.deviation["ekf"] for row in table),
        "rows": len(table),
    }
    reading = (
        f"{len(above)} of {len(table)} printed means of the unscented filter are at or above {LIMIT:g} %"
        + (f" ({', '.join(above)})" if above else "")
        + f"; their average is {computed['ukf_average_percent']:.2f} %, which is the only reading of 'globally' under which the "
        f"statement could hold. The unscented filter is better in {computed['ukf_better_means']} means and "
        f"{computed['ukf_better_deviations']} standard deviations of {len(table)}."
    )
    return Finding(computed, judged(not above), reading)


CLAIMS = {"P4-tab1": below_eight_percent}
