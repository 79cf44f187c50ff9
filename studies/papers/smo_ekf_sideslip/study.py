"""The study of P5: its gain conditions, its observability, its tables, and both observers on a model."""

from __future__ import annotations

from studies.papers.smo_ekf_sideslip import force_observer, observability, printed_tables, road_tests, sideslip_settings
from studies.study import Study

TOPICS = force_observer, observability, printed_tables, sideslip_settings, road_tests
STUDY = Study(
    "smo-ekf-sideslip", "Axle forces by sliding mode, sideslip with adaptive cornering stiffness", "P5",
    "Baffet, Charara, Lechner (2009): a sliding-mode observer estimates axle forces without a tire model; an extended Kalman "
    "filter on them estimates sideslip and corrects the cornering stiffness. Gain conditions, sampling, observability and "
    "tables are checked here.",
    tuple(part for topic in TOPICS for part in topic.TOPIC.parts),
)  # fmt: skip
