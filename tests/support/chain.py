"""A row of masses and springs with any number of states and up to three parameters: the problem whose growth is measured."""

from __future__ import annotations

import sympy as sp

from synthesis.design.hinf_observer import Channel, ObserverDesign
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal

RANGES = {"stiffness": (8.0, 12.0, 5.0), "damping": (0.4, 0.8, 0.5), "coupling": (8.0, 12.0, 2.0)}


def chain(states: int, parameters: int = 1) -> LpvModel:
    """`states`/2 masses (an odd one is a lag beside them), each with a spring and a damper to the ground, positions at both ends
    measured, a force on the first."""
    masses, names = states // 2, list(RANGES)[:parameters]
    values = [
        sp.Symbol(name) if name in names else rest
        for name, rest in zip(RANGES, (10, sp.Rational(1, 2), 10), strict=True)
    ]
    stiffness, damping, coupling = values
    A = sp.zeros(states, states)
    for i in range(masses):
        A[i, masses + i] = 1
        A[masses + i, i] -= stiffness
        A[masses + i, masses + i] -= damping
        for j in (i - 1, i + 1):
            if 0 <= j < masses:
                A[masses + i, i] -= coupling
                A[masses + i, j] += coupling
    if states % 2:
        A[states - 1, states - 1], A[states - 1, 0], A[masses, states - 1] = -1, stiffness / 10, 1
    measured = sorted({0, masses - 1})
    C, F = sp.zeros(len(measured), states), sp.zeros(len(measured), 1 + len(measured))
    B, E = sp.zeros(states, 1), sp.zeros(states, 1 + len(measured))
    B[masses, 0] = E[masses, 0] = 1
    for row, place in enumerate(measured):
        C[row, place], F[row, 1 + row] = 1, sp.Rational(1, 100)
    signals = {"states": ("x", states), "outputs": ("y", len(measured)), "inputs": ("f", 1)}
    return LpvModel(
        name=f"chain-{states}-{parameters}", source="a row of masses, made for measurements",
        parameters=tuple(SchedulingParameter(n, "1", *RANGES[n][:2], -RANGES[n][2], RANGES[n][2]) for n in names),
        disturbances=(Signal("w", "1"), *(Signal(f"v{i}", "1") for i in range(len(measured)))),
        A=A, B=B, C=C, E=E, F=F,
        **{kind: tuple(Signal(f"{letter}{i}", "1") for i in range(n)) for kind, (letter, n) in signals.items()},  # type: ignore[arg-type]
    )  # fmt: skip


def chain_design(model: LpvModel) -> ObserverDesign:
    """The gain from force and noise to the errors of the measured positions, poles between 0.05 and 100 1/s."""
    masses, noises = len(model.states) // 2, [d.name for d in model.disturbances[1:]]
    errors = tuple(dict.fromkeys(("x0", f"x{masses - 1}")))
    return ObserverDesign((Channel(("w", *noises), errors),), degree=1, decay_rate=0.05, fastest_pole=100.0)
