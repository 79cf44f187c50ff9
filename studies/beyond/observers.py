"""What the studies examine: the five shipped schedules, and the gains that the papers print for the same tires."""

from __future__ import annotations

from synthesis.errors import SpecError
from synthesis.models.catalogue.corner import Direction
from synthesis.models.parameter_set import ParameterSet, Published, load_parameter_set

PAPERS = {"corner-estimation": "P1", "longitudinal-speed": "P2", "resilient-velocity": "P3"}
"""The paper of each parameter set."""
SHIPPED: dict[str, tuple[str, Direction]] = {
    "corner-estimation-longitudinal": ("corner-estimation", "longitudinal"),
    "corner-estimation-lateral": ("corner-estimation", "lateral"),
    "longitudinal-speed": ("longitudinal-speed", "longitudinal"),
    "resilient-velocity-longitudinal": ("resilient-velocity", "longitudinal"),
    "resilient-velocity-lateral": ("resilient-velocity", "lateral"),
}
"""Every shipped schedule with the parameter set and direction of its tire."""


def printed(parameters: ParameterSet | str, direction: str) -> tuple[tuple[float, float], Published]:
    """(L1, L2) that the paper of a parameter set prints, and what it prints beside them. Raises SpecError if there are none."""
    found = load_parameter_set(parameters) if isinstance(parameters, str) else parameters
    published = found.tire[direction].published
    if published is None or published.gains is None:
        raise SpecError(f"parameter set '{found.id}' has no published gains ({direction}); add them with their source")
    first, second = published.gains
    return (first, second), published
