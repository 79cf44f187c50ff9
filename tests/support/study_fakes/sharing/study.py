"""Two parts that read what one preparation wrote, one that needs another that can fail, and one that needs nothing."""

from __future__ import annotations

from pathlib import Path

from studies.study import Part, PartResult, Preparation, Scope, Study
from tests.support.study_fakes.trace import computed, present


def _number(scope: Scope, folder: Path) -> None:
    computed("number")
    (folder / "number.txt").write_text("7" if scope.quick else "70")


def _broken(_scope: Scope, folder: Path) -> None:
    computed("broken")
    (folder / "half.txt").write_text("half")
    if not present("mended"):
        raise ZeroDivisionError("nothing to share")


def _read(scope: Scope) -> PartResult:
    assert scope.prepared is not None
    computed("read")
    return PartResult(measures={"number": float((scope.prepared / "number" / "number.txt").read_text())})


def _alone(_scope: Scope) -> PartResult:
    computed("alone")
    return PartResult(measures={"number": 1.0})


NUMBER, BROKEN = Preparation("number", _number), Preparation("broken", _broken)
STUDY = Study("sharing", "Sharing", "", "Parts that share what is computed once.",
              (Part("one", "One", _read, 3.0, (NUMBER,)), Part("two", "Two", _read, 2.0, (NUMBER,)),
               Part("three", "Three", _alone, 1.0, (NUMBER, BROKEN)), Part("alone", "Alone", _alone)))  # fmt: skip
