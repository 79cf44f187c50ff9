"""The study `drop-tolerance`: how many lost force measurements the velocity observers survive."""

from __future__ import annotations

from studies.beyond.drop_tolerance import comparison, limits, moving_speed, overview
from studies.study import Study

STUDY = Study(
    "drop-tolerance",
    "How many lost force measurements the observers survive",
    "",
    "Critical drop probability and Gilbert-Elliott region (length of loss bursts against loss rate) over the operating range "
    "for the five shipped schedules and the gains that P3 prints: predicted by second-moment analysis, and measured on the "
    "runtime observer itself in Monte Carlo populations with simultaneous intervals.",
    (*overview.TOPIC.parts, *comparison.TOPIC.parts, *moving_speed.TOPIC.parts, *limits.TOPIC.parts),
)
