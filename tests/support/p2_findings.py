"""The findings of the study of P2, computed once a process."""

from __future__ import annotations

from functools import cache

from studies.claim import Finding
from studies.papers.longitudinal_speed.study import CLAIMS


@cache
def finding(name: str) -> Finding:
    """Our half of a claim."""
    return CLAIMS[name]()
