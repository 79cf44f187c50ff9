"""The study of P4: its equations, its observability and its table."""

from __future__ import annotations

from studies.papers.ekf_ukf_lateral import accuracy, bends, observability, output_equation, tire
from studies.study import Study

TOPICS = (observability.TOPIC, tire.TOPIC, output_equation.TOPIC, accuracy.TOPIC)
CLAIMS = {name: compute for topic in TOPICS for name, compute in topic.claims.items()}  # by the id of the claim

STUDY = Study(
    "ekf-ukf-lateral", "Lateral tire forces: extended against unscented Kalman filter", "P4",
    "Doumiati, Victorino, Charara, Lechner (2009): an eight-state four-wheel model with Dugoff tires behind a relaxation "
    "lag. Its equations, its observability and its table are checked here.",
    (*(part for topic in TOPICS for part in topic.parts), *bends.PARTS),
)  # fmt: skip
