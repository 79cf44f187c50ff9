"""Every kind of value, verdict, table and figure that a study may deliver."""

from __future__ import annotations

import math

import numpy as np

from studies.claim import Claim, ClaimVerdict, Finding
from studies.papers.published import published_claims
from studies.plots import Figure, Line, Panel, dots
from studies.study import Part, PartResult, Scope, Study, Table
from tests.support.study_fakes.trace import computed

VALUES = {
    "P1-root": (math.sqrt(2.0), ClaimVerdict.REPRODUCED, "positive root"),
    "P1-pair": ({"omega=0": np.float64(0.5), "omega=40": [1, 2.5]}, ClaimVerdict.PARTLY, "only at `omega=0`"),
    "P1-wrong": (float("nan"), ClaimVerdict.NOT_REPRODUCED, 'tags <b>& quotes" stay text'),
    "P1-sign": ("L1*p1 - 1", ClaimVerdict.ERRATUM, "the sign must be minus"),
    "P1-open": (float("inf"), ClaimVerdict.UNDER_SPECIFIED, ""),
    "P1-extra": (True, ClaimVerdict.DERIVED, "needed for `P1-root`"),
}


def numbers(scope: Scope) -> PartResult:
    computed("alpha-numbers")
    published = published_claims(__package__ or "")
    claims = [Claim(published[name], Finding(*found)) for name, found in VALUES.items()]
    wide = Table("wide", "Many columns.", [f"speed {i} [m/s]" for i in range(14)], [[i / 7 for i in range(14)]] * 3)
    mixed = Table("mixed", "Words, gaps and numbers.", ("name", "value [1]", "good"),
                  (("a, b", 1 / 3, True), ("c", None, False), ("d", float("nan"), True)))  # fmt: skip
    return PartResult(
        claims,
        (wide, mixed),
        notes=[f"{scope.seeds} seeds & <more>."],
        measures={"seeds": scope.seeds, "gap": math.nan},
    )


def curve(_scope: Scope) -> PartResult:
    computed("alpha-curve")
    time = np.linspace(0.0, 10.0, 200)
    sine = Panel([Line(time, np.sin(time), "sine")], "time [s]", "velocity [m/s]", legend="upper right")
    cloud = Panel([dots(*np.random.default_rng(1).standard_normal((2, 6_000)), marker=".", size=1.0)])
    return PartResult(
        figures=(
            Figure("sine", "A sine over time.", "A line that swings between -1 and 1 m/s.", sine, (7.2, 3.6)),
            Figure("cloud", "Many points.", "A round cloud of points.", cloud, (4.0, 3.0)),
        )
    )


STUDY = Study("alpha", "Alpha: all kinds of results", "P1", "Values, tables and figures of every kind.",
              (Part("numbers", "Numbers", numbers, 2.0), Part("curve", "Curves", curve, 5.0)))  # fmt: skip
