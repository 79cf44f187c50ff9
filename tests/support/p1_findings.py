"""The findings of the study of P1, computed once a process, and the printed decimals that independent computations start from."""

from __future__ import annotations

from functools import cache

from studies.claim import Finding
from studies.papers.corner_estimation.study import CLAIMS

# sigma0, sigma1, sigma2, kappa, L1, L2 of P1 section IV and the text after (28), (40); R_e of Table I.
PRINT: dict[str, tuple[str, ...]] = {
    "longitudinal": ("632.1", "0.76", "0.0016", "8.32", "0.68", "183.1"),
    "lateral": ("181.5", "0.81", "0.001", "12.84", "1.11", "16.7"),
}
RADIUS = "0.33"


@cache
def finding(name: str) -> Finding:
    """Our half of a claim."""
    return CLAIMS[name]()
