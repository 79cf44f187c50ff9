"""The study `drop-tolerance`: how many lost force measurements the velocity observers survive."""

from __future__ import annotations

from studies.beyond.drop_tolerance import part_moving, part_observer
from studies.beyond.drop_tolerance.observers import NAMES
from studies.beyond.drop_tolerance.part_limits import any_gain, typical
from studies.beyond.drop_tolerance.part_overview import overview
from studies.study import Part, Study

WORDS = {name: name.replace("-", " ") for name in NAMES}

QUICK = ("corner-estimation-longitudinal",)
"""Observers of a quick run; the overview has all of them."""

STUDY = Study(
    id="drop-tolerance",
    title="How many lost force measurements the observers survive",
    paper="",
    summary=(
        "Critical drop probability and Gilbert-Elliott region (length of loss bursts against loss rate) over the "
        "operating range for the five shipped schedules and the gains that P3 prints: predicted by second-moment "
        "analysis, and measured on the runtime observer itself in Monte Carlo populations with simultaneous "
        "intervals."
    ),
    parts=(
        Part("overview", "What each observer survives, predicted", overview, cost=3.0),
        *(
            Part(
                f"observer-{name}",
                f"Prediction against runtime: {WORDS[name]}",
                part_observer.part(name),
                cost=5.5,
                quick=name in QUICK,
            )
            for name in NAMES
        ),
        *(
            Part(
                f"moving-{name}",
                f"Wheel speed in motion: {WORDS[name]}",
                part_moving.part(name),
                cost=6.0 if name.endswith("lateral") else 1.0,
                quick=name in QUICK,
            )
            for name in NAMES
        ),
        Part("any-gain", "The plant sets no limit", any_gain, cost=0.2),
        Part("mean-and-typical", "What a growing mean square looks like", typical, cost=1.2),
    ),
)
