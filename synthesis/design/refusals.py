"""Models for which no gain helps, refused before anything is solved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from flint import fmpq, fmpq_mat

from estimators.arrays import FloatArray
from synthesis.certificate.refute import undetectable_place
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.errors import ProblemError
from synthesis.loop.from_model import plant_of
from synthesis.loop.plant import Plant
from synthesis.models.lpv import LpvModel
from synthesis.models.numeric import NumericModel
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import as_float


def refuse_undetectable(model: LpvModel, measured: Sequence[int] | None = None) -> None:
    """Raise ProblemError where an unstable mode does not show in the output (or in some of its rows): no gain helps there."""
    plant, rows = plant_of(model), range(len(model.outputs)) if measured is None else measured
    if measured is not None:
        pieces = tuple(_of_rows(piece, rows) for piece in plant.pieces)
        plant = replace(plant, pieces=pieces) if pieces else _of_rows(plant, rows)
    place = undetectable_place(plant)
    if place is not None:
        here = _here(model, place)
        raise ProblemError(
            f"model '{model.name}' is undetectable at {_where(model, place)}: a mode that does not decay "
            f"({_mode(here.A[0], here.C[0][list(rows)])}) does not show in the output(s) "
            f"{', '.join(model.outputs[i].name for i in rows)}; measure it, or shrink the range"
        )


def _of_rows(plant: Plant, rows: Sequence[int]) -> Plant:
    """The plant with some of its outputs."""
    C = plant.matrices["C"]
    chosen = {
        powers: fmpq_mat([[entries[i, j] for j in range(C.shape[1])] for i in rows])
        for powers, entries in C.terms.items()
    }
    seen = PolynomialMatrix(chosen, (len(rows), C.shape[1]), C.variables)
    return replace(plant, matrices={**plant.matrices, "C": seen})


def refuse_unstabilisable(model: LpvModel) -> None:
    """Raise ProblemError where no input moves an unstable mode: no feedback helps there."""
    if not model.inputs:
        raise ProblemError(f"model '{model.name}' has no input; a feedback law needs one")
    place = undetectable_place(plant_of(model).dual)
    if place is not None:
        here = _here(model, place)
        raise ProblemError(
            f"model '{model.name}' is not stabilisable at {_where(model, place)}: a mode that does not decay "
            f"({_mode(here.A[0].T, here.B[0].T)}) is moved by none of the input(s) "
            f"{', '.join(u.name for u in model.inputs)}; give it an input, or shrink the range"
        )


def refuse_feedthrough(model: LpvModel, channel: FeedbackChannel, Z: FloatArray, W: FloatArray) -> None:
    """Raise ProblemError where a disturbance acts at once on a signal whose peak or impulse energy is asked for.

    W (nd, k) and Z (m, nx + ny + nu) as `synthesis.design.feedback_channel.feedback_channel_matrices` has them.
    """
    nx, ny = len(model.states), len(model.outputs)
    sizes = [
        np.abs(Z[:, nx : nx + ny] @ piece.polynomial.F @ W).max(axis=tuple(range(len(model.parameters))))
        for piece in model.pieces
    ]
    through = np.max(sizes, axis=0)
    if through.any():
        i, j = np.argwhere(through)[0]
        raise ProblemError(
            f"channel '{channel.name}': the disturbance '{channel.disturbances[j]}' acts on '{channel.performance[i]}' at once "
            f"(F), so its {channel.norm} norm is infinite in continuous time; leave one of them out, or take a sampled law"
        )


def _values(model: LpvModel, place: tuple[fmpq, ...]) -> list[float]:
    return [p.middle + p.half_width * as_float(u) for p, u in zip(model.parameters, place, strict=True)]


def _where(model: LpvModel, place: tuple[fmpq, ...]) -> str:
    values = [f"{p.name} = {x:.6g} {p.unit}" for p, x in zip(model.parameters, _values(model, place), strict=True)]
    return ", ".join(values) or "its only point"


def _here(model: LpvModel, place: tuple[fmpq, ...]) -> NumericModel:
    return model.on(np.array(_values(model, place)).reshape(1, -1))


def _mode(A: FloatArray, C: FloatArray) -> str:
    """The pole, of those that do not decay, that shows least."""
    poles, vectors = np.linalg.eig(A)
    late = poles.real < -1e-9 * max(float(np.abs(A).max()), 1e-300)
    pole = poles[int(np.argmin(np.linalg.norm(C @ vectors, axis=0) + np.where(late, np.inf, 0.0)))]
    turning = "" if abs(pole.imag) <= 1e-9 * abs(pole) else f" +- {abs(pole.imag):.4g}j"
    return f"pole {pole.real:.4g}{turning} 1/s"
