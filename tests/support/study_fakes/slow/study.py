"""Parts that wait for the test; no claims."""

from __future__ import annotations

from studies.study import Part, PartResult, Scope, Study, Table
from tests.support.study_fakes.trace import computed, hold_until


def first(_scope: Scope) -> PartResult:
    computed("slow-first")
    return PartResult(tables=[Table("first", "Large.", ("value [1]",), [(i,) for i in range(20_000)])])


def second(_scope: Scope) -> PartResult:
    computed("slow-second")
    hold_until("released")
    return PartResult(measures={"done": 1.0})


STUDY = Study("slow", "Slow", "", "Two parts, the second waits.",
              (Part("second", "Second", second, 1.0), Part("first", "First", first, 9.0)))  # fmt: skip
