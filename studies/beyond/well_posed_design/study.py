"""The study of well-posed design."""

from __future__ import annotations

from studies.beyond.well_posed_design import demands, gain_plane, literal
from studies.study import Study

STUDY = Study(
    "well-posed-design",
    "What determines the gains",
    "",
    "Minimising the H-infinity gain of P1 and P3 alone has the infimum 1 and no gains. This study varies what a well-posed "
    "design adds (friction bound, decay rate, pole limit, noise weight), shows how the gains follow, and puts the printed "
    "gains on the map.",
    (*literal.TOPIC.parts, *demands.TOPIC.parts, *gain_plane.TOPIC.parts),
)
