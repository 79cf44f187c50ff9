"""Parts whose process dies, and results that cannot be stored."""

from __future__ import annotations

import os
import signal
from typing import Any

from studies.study import Part, PartResult, Scope, Study, Table


def killed(_scope: Scope) -> PartResult:
    os.kill(os.getpid(), signal.SIGKILL)
    return PartResult()


def ragged(_scope: Scope) -> PartResult:
    return PartResult(tables=[Table("ragged", "Row two is short.", ("a", "b"), [(1, 2), (3,)])])


def escaping(_scope: Scope) -> PartResult:
    return PartResult(tables=[Table("../../escape", "A name that is a path.", ("a",), [(1,)])])


def unstorable(_scope: Scope) -> PartResult:
    cells: Any = [({1, 2},)]
    return PartResult(tables=[Table("sets", "A set is no cell.", ("a",), cells)])


def good(_scope: Scope) -> PartResult:
    return PartResult(notes=["well"])


STUDY = Study("crash", "Crash", "", "Ways to fail.",
              tuple(Part(run.__name__, run.__name__, run) for run in (killed, ragged, escaping, unstorable, good)))  # fmt: skip
