r"""Static output feedback u = K(p) y, and PI or PID tables, whose integrators are states of the model, step by step from a start.

With V = x'P(p)x the bounded real lemma is linear in P for a given K, and in K for a given P, but not in both: the terms
U'V + V'U with U = B'P and V = K [C, F] are products. They are

    U'V + V'U = S'S - D'D,   S = (w U + V / w) / sqrt 2,   D = (w U - V / w) / sqrt 2

and -D'D is at most D0'D0 - D0'D - D'D0 whatever D0: with D0 taken from the step before, this is a linear inequality in P and K
together that promises nothing but what holds (an inner approximation, exact where the step before ended), so that the level
never rises (Dinh, Gumussoy, Michiels, Diehl 2012). Such steps are short: an analysis tries each further along its own way. What
comes out depends on the start and is no optimum over all K. The last solve is for P alone, with K as it is: its verdict is that
of an analysis of the given loop.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.design.generalised_plant import Frame, frame_of, generalised_plant
from synthesis.design.refusals import refuse_undetectable, refuse_unstabilisable
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.design.static_feedback_steps import Steps, structure
from synthesis.design.three_solves import three_solves
from synthesis.errors import ProblemError
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.loop.feedback import Measured
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import MatrixPolynomial


@dataclass(frozen=True, repr=False)
class StaticFeedback(Display):
    """K(p) with the level that its own analysis certifies; `levels` are those of the steps, in their order.

    `result` is the last solve, for P alone, `optimum` the one before it without back-off. There is no bound from below for all K.
    """

    design: StaticFeedbackDesign
    model: LpvModel
    gamma: float
    levels: tuple[float, ...]
    K: MatrixPolynomial
    result: LmiResult
    optimum: LmiResult
    frame: Frame
    gamma_lower: None = None
    measured: Measured = "outputs"
    order: int = 0

    @property
    def verdict(self) -> Verdict:
        """Of the last solve."""
        return self.result.verdict

    def gain(self, points: FloatArray) -> FloatArray:
        """K at parameter values (g,) or (g, p): array (g, nu, ny)."""
        u = self.model.scaled(points)
        still = np.hstack([u, np.zeros_like(u)])
        return np.asarray(self.K.at(still)[..., 0] * self.frame.inputs[:, None] / self.frame.outputs)

    def controller(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Ak (g, 0, 0), Bk (g, 0, ny), Ck (g, nu, 0), Dk = K (g, nu, ny): a law without states of its own."""
        K = self.gain(points)
        g, nu, ny = K.shape
        return np.zeros((g, 0, 0)), np.zeros((g, 0, ny)), np.zeros((g, nu, 0)), K


def design_static_feedback(model: LpvModel, design: StaticFeedbackDesign) -> StaticFeedback:
    """First to stability, where the start is not stable already, then down with the open channel, step by step.

    Raises ProblemError for a plant that hides an unstable mode, for outputs in use that the inputs act on at once, for
    names that are unknown, and if no step leads to a stable loop: another start may.

    >>> import sympy as sp
    >>> one = {key: (Signal(name, "1"),) for key, name in zip(("states", "inputs", "outputs", "disturbances"), "xuyw")}
    >>> A, B = sp.Matrix([[sp.Symbol("p")]]), sp.Matrix([[1]])
    >>> p = SchedulingParameter("p", "1", 1.0, 2.0, -1.0, 1.0)
    >>> plant = LpvModel(name="unstable", source="example", parameters=(p,), A=A, B=B, C=B, E=B, **one)
    >>> asked = StaticFeedbackDesign((FeedbackChannel(("w",), ("x", "u")),), backoff=0.3)
    >>> found = design_static_feedback(plant, asked)
    >>> print(found.verdict, found.gain([1.0, 2.0]).shape)
    certified (2, 1, 1)
    """
    refuse_unstabilisable(model)
    refuse_undetectable(model)
    seen = structure(model, design.uses).any(axis=0)
    if any(piece.polynomial.D[..., seen, :].any() for piece in model.pieces):
        raise ProblemError(
            f"model '{model.name}': inputs act on outputs at once (D), a static law would close an algebraic loop; leave such "
            "outputs out by `uses`, or design a law with states"
        )
    plants = [generalised_plant(model, design.channels, piece=piece) for piece in model.pieces]
    for part in (part for plant in plants for part in plant.channels):
        through = part.Dzd.any() or (part.Dzu.any() and part.F.any())
        if part.channel.norm != "H-infinity" and through:
            raise ProblemError(
                f"channel '{part.channel.name}': a disturbance acts on a performance signal at once (by F, or by F and the law), "
                f"so its {part.channel.norm} norm is infinite in continuous time; leave the noise or the inputs out of it"
            )
    frame = frame_of(plants[model.pieces.index(model.cells.middle)])
    steps = Steps(model, design, [plant.scaled(frame) for plant in plants], frame)
    point = steps.stable(steps.start())
    point, levels = steps.lowered(point)
    settled = three_solves(
        model.name, steps.analysis(point.K), lambda x: x * steps.unit(design.minimised), design.backoff, steps.settings
    )
    return StaticFeedback(design, model, settled.gamma, tuple(levels), point.K, settled.result, settled.optimum, frame)
