"""Which studies there are. A study is a module with ``STUDY``; it is imported when it is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module, resources

from estimators.display import Display
from estimators.errors import unknown
from studies.study import Study
from synthesis.errors import SpecError

MODULES = {
    "corner-estimation": "studies.papers.corner_estimation.study",
    "longitudinal-speed": "studies.papers.longitudinal_speed.study",
    "resilient-velocity": "studies.papers.resilient_velocity.study",
    "ekf-ukf-lateral": "studies.papers.ekf_ukf_lateral.study",
    "smo-ekf-sideslip": "studies.papers.smo_ekf_sideslip.study",
    "against-wheels": "studies.beyond.against_wheels.study",
    "consistency": "studies.beyond.consistency.study",
    "drop-tolerance": "studies.beyond.drop_tolerance.study",
    "fault-matrix": "studies.beyond.fault_matrix.study",
    "friction-floor": "studies.beyond.friction_floor.study",
    "implementability": "studies.beyond.implementability.study",
    "well-posed-design": "studies.beyond.well_posed_design.study",
}


@dataclass(frozen=True, repr=False)
class Registry(Display):
    """Studies by id, each the name of a module with ``STUDY``, or ``module:NAME``.

    >>> list(Registry({"my-study": "my_study.study"}).modules)
    ['my-study']
    """

    modules: Mapping[str, str]

    def check(self, study_id: str) -> None:
        """Raises SpecError that offers the nearest names when there is no study ``study_id``."""
        if study_id not in self.modules:
            raise SpecError(unknown("study", study_id, self.modules))

    def load(self, study_id: str) -> Study:
        """The study named ``study_id``. Raises SpecError for an unknown one."""
        self.check(study_id)
        module, _, name = self.modules[study_id].partition(":")
        study = getattr(import_module(module), name or "STUDY")
        if not isinstance(study, Study):
            raise SpecError(f"module {module}: {name or 'STUDY'} is no Study")
        return study

    def claim_ids(self, study_id: str) -> tuple[str, ...]:
        """Ids of the claims in the ``claims.toml`` beside the study's module; none where there is no such file."""
        from studies.papers.published import published_claims

        package = self.modules[study_id].partition(":")[0].rpartition(".")[0]
        if not (resources.files(package) / "claims.toml").is_file():
            return ()
        return tuple(published_claims(package))


SHIPPED = Registry(MODULES)


def load_study(study_id: str) -> Study:
    """The shipped study named ``study_id``. Raises SpecError that offers the nearest names.

    >>> load_study("friction-floor").parts[0].name
    'theory'
    """
    return SHIPPED.load(study_id)
