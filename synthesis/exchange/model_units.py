"""Units of a model that was built in Python: the check that model and schedule files get when they are read."""

from __future__ import annotations

from synthesis.certificate.units import PLACES, check_dimensions
from synthesis.design.export import formula
from synthesis.models.lpv import LpvModel


def check_units(model: LpvModel) -> None:
    """Every entry of every matrix has the unit of its place: A[i][j] that of state i over state j and second, and so on.

    Raises ModelError naming the entry, the unit that was found and the one that is needed. A model in which everything has the
    unit 1 is a normalised one and passes.

    >>> check_units(corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal"))  # silent where all fit
    """
    kinds = sorted({kind for above, beside, _ in PLACES.values() for kind in (above, beside)})
    content = {
        **{kind: [{"name": s.name, "unit": s.unit} for s in getattr(model, kind)] for kind in kinds},
        "constants": {name: {"unit": c.unit} for name, c in model.constants.items()},
        "tables": {name: {"unit": table.unit} for name, table in model.tables.items()},
        "matrices": {key: [[formula(e, model) for e in row] for row in getattr(model, key).tolist()] for key in PLACES},
    }
    check_dimensions(content, [{"name": p.name, "unit": p.unit} for p in model.parameters], f"model '{model.name}'")
