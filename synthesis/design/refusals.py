"""Models for which no gain helps, refused before anything is solved."""

from __future__ import annotations

from flint import fmpq

from synthesis.certificate.refute import undetectable_place
from synthesis.errors import ProblemError
from synthesis.loop.from_model import plant_of
from synthesis.models.lpv import LpvModel


def refuse_undetectable(model: LpvModel) -> None:
    """Raise ProblemError where an unstable mode does not show in the output: no gain helps there."""
    place = undetectable_place(plant_of(model))
    if place is not None:
        raise ProblemError(
            f"model '{model.name}' is undetectable at {_where(model, place)}: a mode that does not decay does not show in "
            f"the output(s) {', '.join(o.name for o in model.outputs)}; measure it, or shrink the range"
        )


def refuse_unstabilisable(model: LpvModel) -> None:
    """Raise ProblemError where no input moves an unstable mode: no feedback helps there."""
    if not model.inputs:
        raise ProblemError(f"model '{model.name}' has no input; a feedback law needs one")
    place = undetectable_place(plant_of(model).dual)
    if place is not None:
        raise ProblemError(
            f"model '{model.name}' is not stabilisable at {_where(model, place)}: a mode that does not decay is moved by none "
            f"of the input(s) {', '.join(u.name for u in model.inputs)}; give it an input, or shrink the range"
        )


def _where(model: LpvModel, place: tuple[fmpq, ...]) -> str:
    values = [
        f"{p.name} = {p.middle + p.half_width * int(u.p) / int(u.q):.6g} {p.unit}"
        for p, u in zip(model.parameters, place, strict=True)
    ]
    return ", ".join(values) or "its only point"
