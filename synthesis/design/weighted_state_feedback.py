r"""State feedback with dynamic weights: what weighs states and inputs is worked out at run time, as states of the law.

The design is one of all states x and xw of the weighted plant, u = Kx(p) x + Kw(p) xw. Only x is measured; the states of the
weights need nothing else,

    xw' = A21 x + A22 xw + B2 u

so the law carries its own copy of them: Ak = A22 + B2 Kw, Bk = A21 + B2 Kx, Ck = Kw, Dk = Kx. Over a sample x and u are held,

    xw+ = e^(T A22) xw + int_0^T e^(s A22) ds (A21 x + B2 u)

and a sampled design is one for weights that are run so, exactly. Measurements are outputs of the model that is deployed, one for
each state (`states_as_outputs`); the loop that is proved has the weights in continuous time, and their copy beside them. A limit
of an input is about states and copied states in the ellipsoid of their sizes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.design.sampled_state_feedback import design_sampled_state_feedback
from synthesis.design.state_feedback import StateFeedbackDesign, StateFeedbackGains, design_state_feedback
from synthesis.errors import ProblemError
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.loop.feedback import Measured
from synthesis.models.discretise import weights_over_sample
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Signal

Law = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, repr=False)
class WeightedStateFeedback(Display):
    """The gains of all states with the `order` last ones, those of the weights, in the law."""

    gains: StateFeedbackGains
    order: int
    measured: Measured = "outputs"

    @property
    def design(self) -> StateFeedbackDesign:
        """What was asked."""
        return self.gains.design

    @property
    def model(self) -> LpvModel:
        """The weighted plant."""
        return self.gains.model

    @property
    def gamma(self) -> float:
        """The verified level: of the loop in continuous time, of a sampled design of its update."""
        return self.gains.gamma

    @property
    def gamma_lower(self) -> float | None:
        """A bound from below, where there is one."""
        return self.gains.gamma_lower

    @property
    def result(self) -> LmiResult:
        """Of the solve that the gains come from."""
        return self.gains.result

    @property
    def verdict(self) -> Verdict:
        """Of the solve that the gains come from."""
        return self.gains.verdict

    @property
    def sample_time(self) -> float | None:
        """s, of a sampled design."""
        return self.gains.sample_time

    def controller(self, points: FloatArray) -> Law:
        """Ak (g, nw, nw), Bk (g, nw, ny), Ck (g, nu, nw), Dk (g, nu, ny) in continuous time; a sampled design has none."""
        if self.sample_time is not None:
            raise ProblemError(
                f"a design for samples of {self.sample_time:g} s has no law in continuous time; take over_sample"
            )
        at = self.model.on(points)
        return self._law(points, at.A, at.B)

    def over_sample(self, points: FloatArray, sample_time: float) -> Law:
        """The same over a sample (s)."""
        at = self.model.on(points)
        return self._law(points, *weights_over_sample(at.A, at.B, self.order, sample_time))

    def _law(self, points: FloatArray, A: FloatArray, B: FloatArray) -> Law:
        K = self.gains.gain(points)
        n, ny = K.shape[2] - self.order, len(self.model.outputs)
        Kx, Kw, B = K[:, :, :n], K[:, :, n:], B[:, n:]
        wide = ((0, 0), (0, 0), (0, ny - n))
        return A[:, n:, n:] + B @ Kw, np.pad(A[:, n:, :n] + B @ Kx, wide), Kw, np.pad(Kx, wide)


def states_as_outputs(model: LpvModel) -> LpvModel:
    """The model with the outputs `state_NAME`, one for each state, before its own.

    >>> import sympy as sp
    >>> one = {key: (Signal(name, "1"),) for key, name in zip(("states", "inputs", "outputs", "disturbances"), "xuyw")}
    >>> plant = LpvModel(name="lag", source="example", parameters=(), A=-sp.eye(1), B=sp.eye(1), C=sp.eye(1), E=sp.eye(1), **one)
    >>> [output.name for output in states_as_outputs(plant).outputs]
    ['state_x', 'y']
    """
    n = len(model.states)
    return replace(
        model,
        outputs=(*(Signal(f"state_{s.name}", s.unit) for s in model.states), *model.outputs),
        C=sp.Matrix.vstack(sp.eye(n), sp.Matrix(model.C)),
        D=sp.Matrix.vstack(sp.zeros(n, len(model.inputs)), sp.Matrix(model.D)),
        F=sp.Matrix.vstack(sp.zeros(n, len(model.disturbances)), sp.Matrix(model.F)),
    )


def check_weighted_states(model: LpvModel, order: int) -> None:
    """Raise ProblemError where a state of a weight (the `order` last ones) cannot be known."""
    E = sp.Matrix(model.E)
    for i in range(len(model.states) - order, len(model.states)):
        driven = [d.name for j, d in enumerate(model.disturbances) if E[i, j] != 0]
        if driven:
            raise ProblemError(
                f"model '{model.name}': the state {model.states[i].name} of a weight is driven by '{driven[0]}', which is not "
                "measured; weigh states, inputs, or outputs without F, or take output feedback"
            )


def design_weighted_state_feedback(
    model: LpvModel, design: StateFeedbackDesign, order: int, sample_time: float | None = None
) -> WeightedStateFeedback:
    """`design_state_feedback` for a weighted model (`states_as_outputs`, then `synthesis.models.weighted.weighted`).

    With a `sample_time` (s) `design_sampled_state_feedback`. `order` is the number of states of the weights, which are the last
    ones and have sizes, too, where inputs have limits. Raises ProblemError as they do, and for a weight that depends on something
    that is not measured.

    >>> import control, sympy as sp
    >>> one = {key: (Signal(name, "1"),) for key, name in zip(("states", "inputs", "outputs", "disturbances"), "xuyd")}
    >>> plant = LpvModel(name="lag", source="example", parameters=(), A=-sp.eye(1), B=sp.eye(1), C=sp.eye(1), E=sp.eye(1), **one)
    >>> shaped = weighted(states_as_outputs(plant), {"x": control.tf([0.3, 1.2], [1, 0.04])})  # slow errors cost more
    >>> design = StateFeedbackDesign((FeedbackChannel(("d",), ("x_weighted", "u")),))
    >>> law = design_weighted_state_feedback(shaped, design, order=1)
    >>> print(law.verdict), [matrix.shape for matrix in law.controller([[]])]
    certified
    (None, [(1, 1, 1), (1, 1, 3), (1, 1, 1), (1, 1, 3)])
    """
    check_weighted_states(model, order)
    if sample_time is not None:
        return WeightedStateFeedback(design_sampled_state_feedback(model, design, sample_time, order), order)
    return WeightedStateFeedback(design_state_feedback(model, design), order)
