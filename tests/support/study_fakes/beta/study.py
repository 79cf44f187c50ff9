"""A part that raises until the test mends it."""

from __future__ import annotations

from collections.abc import Callable

from studies.claim import Claim, Finding, reproduced
from studies.papers.published import published_claims
from studies.study import Part, PartResult, Scope, Study
from tests.support.study_fakes.trace import computed, present


def _claim(name: str, value: int) -> Callable[[Scope], PartResult]:
    def run(_scope: Scope) -> PartResult:
        computed(f"beta-{name}")
        if name == "P2-lost" and not present("mended"):
            raise ZeroDivisionError("no number\nto divide by")
        return PartResult([Claim(published_claims(__package__ or "")[name], Finding(value, reproduced(True), ""))])

    return run


STUDY = Study("beta", "Beta: a part that fails", "P2", "One good part, one bad.",
              (Part("lost", "Lost", _claim("P2-lost", 4)), Part("sum", "Sum", _claim("P2-sum", 3))))  # fmt: skip
