"""Which studies there are. A study is a module with ``STUDY``; it is imported when it is asked for."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module

from studies.study import Study
from synthesis.errors import SpecError

MODULES = {
    "corner-estimation": "studies.papers.corner_estimation.study",
    "longitudinal-speed": "studies.papers.longitudinal_speed.study",
    "resilient-velocity": "studies.papers.resilient_velocity.study",
    "ekf-ukf-lateral": "studies.papers.ekf_ukf_lateral.study",
    "smo-ekf-sideslip": "studies.papers.smo_ekf_sideslip.study",
    "drop-tolerance": "studies.beyond.drop_tolerance.study",
    "friction-floor": "studies.beyond.friction_floor.study",
    "implementability": "studies.beyond.implementability.study",
    "well-posed-design": "studies.beyond.well_posed_design.study",
}


def load_study(study_id: str) -> Study:
    """The study named ``study_id``. Raises SpecError that offers the nearest names."""
    if study_id not in MODULES:
        near = get_close_matches(study_id, MODULES, n=3) or list(MODULES)
        raise SpecError(f"study '{study_id}' does not exist; there are: {', '.join(near)}")
    study = import_module(MODULES[study_id]).STUDY
    if not isinstance(study, Study):
        raise SpecError(f"module {MODULES[study_id]}: STUDY is no Study")
    return study
