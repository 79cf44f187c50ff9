r"""H-infinity gain synthesis for LPV state feedback that runs once a sample, in discrete time.

    x+ = (Phi + Gamma K(p)) x + Gamma_E d,    Phi = e^(TA), Gamma = T phi(TA) B, Gamma_E = T phi(TA) E, d held over a sample

With V = x'Q(p)^-1 x, Q+ = Q one sample later, a slack matrix G(p) and Y = K G (de Oliveira, Geromel, Bernussou 2002)

    decay a      [exp(-2 a T) Q+, Phi G + Gamma Y; *, G + G' - Q] > 0                    |x|_P falls by exp(-a T) in every sample
    channel      [Q+, Phi G + Gamma Y, Gamma_E W, 0; *, G + G' - Q, 0, (Cz G + Dz Y)'; *, *, g I, (Fz W)'; *, *, *, g I] > 0
    limit        as in `synthesis.design.state_feedback`, with G + G' - Q in the place of Q below Y_i

prove an l2 gain below g. Other norms have a pair of their own in the place of the last, and levels of continuous time
(`synthesis.design.norms`). K needs no Q+, which is not known when it is used. Phi and the Gammas are fitted by Chebyshev
polynomials (`synthesis.design.fitted_update`); what comes out is proved for the exact ones (`synthesis.certificate`). Of a
rational model a power of its denominator multiplies every inequality. Where samples are long against the loop, this is the design
to take: the one in continuous time knows nothing of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.feedback_channel import feedback_channel_matrices
from synthesis.design.feedback_scale import FeedbackScale, feedback_scale
from synthesis.design.fitted_update import fitted_update, power_below
from synthesis.design.kinked import KinkedUnknown
from synthesis.design.norms import ChannelSizes, levels, per_sample, require_sampled_energy
from synthesis.design.refusals import refuse_unstabilisable
from synthesis.design.sampled_regions import require_discs, sampled_discs
from synthesis.design.state_feedback import (
    StateFeedbackDesign,
    StateFeedbackGains,
    check_limits,
    performance,
    require_limits,
)
from synthesis.design.three_solves import problem_for, three_solves
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.loop.from_model import plant_of
from synthesis.loop.motion import one_sample_later, rates
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block, variable
from synthesis.polynomials.rational import as_float

POINTS = 40  # for each parameter; what holds between them is proved for the table that is deployed


def design_sampled_state_feedback(
    model: LpvModel, design: StateFeedbackDesign, sample_time: float, weights: int = 0
) -> StateFeedbackGains:
    """K(p) for the given sample time (s); `gamma` is the l2 gain over samples.

    The last states are of `weights` that run once a sample.

    Raises ProblemError for regions that are none of an update's poles (`synthesis.design.sampled_regions`), for a model whose
    update over a sample no polynomial fits, and as `design_state_feedback`.

    >>> import sympy as sp
    >>> one = {key: (Signal(name, "1"),) for key, name in zip(("states", "inputs", "outputs", "disturbances"), "xuyw")}
    >>> A, B = sp.Matrix([[sp.Symbol("p")]]), sp.Matrix([[1]])
    >>> p = SchedulingParameter("p", "1", 1.0, 2.0, -1.0, 1.0)
    >>> plant = LpvModel(name="unstable", source="example", parameters=(p,), A=A, B=B, C=B, E=B, **one)
    >>> asked = StateFeedbackDesign((FeedbackChannel(("w",), ("x", "u")),), backoff=0.3)
    >>> print(design_sampled_state_feedback(plant, asked, sample_time=0.05).verdict)
    certified
    """
    if not sample_time > 0.0:
        raise ProblemError(f"sample time {sample_time} s must be positive")
    given = next((name for name in ("fastest_pole", "damping") if getattr(design, name) is not None), None)
    if given is not None:
        raise ProblemError(
            f"a sampled design has no {given}: leave it out; sizes of inputs in channels bound its gains"
        )
    sampled_discs(design.regions, sample_time)
    refuse_unstabilisable(model)
    check_limits(model, design.limits)
    design = replace(design, settings=replace(design.settings, points=min(design.settings.points, POINTS)))
    plain = feedback_scale(model, design.channels)
    # Sums over samples in the place of integrals: what a state costs is divided by the sample time.
    states = plain.states * np.sqrt(plain.clock / sample_time)
    scale = replace(plain, states=states, disturbance=plain.disturbance * np.sqrt(plain.clock * sample_time), clock=1.0)
    updates = [fitted_update(model, piece, states, sample_time, weights) for piece in model.pieces]

    def problem(gamma: float | None, maximise_margin: bool = True, floor: float = 0.0) -> LmiProblem:
        return _problem(model, design, scale, sample_time, updates, gamma, maximise_margin, floor)

    def level(objective: float) -> float:
        found = scale.disturbance * float(np.sqrt(objective) if design.compact else objective)
        return found / per_sample(design.minimised.norm, sample_time)

    found = three_solves(model.name, problem, level, design.backoff, design.settings)
    return StateFeedbackGains(
        design, model, found.gamma_lower, found.gamma, found.result, found.optimum, scale, sample_time=sample_time
    )


def _problem(
    model: LpvModel,
    design: StateFeedbackDesign,
    scale: FeedbackScale,
    period: float,
    updates: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    gamma: float | None,
    maximise_margin: bool,
    floor: float,
) -> LmiProblem:
    problem = problem_for(model, gamma, maximise_margin, floor)
    nx, nu, count = len(model.states), len(model.inputs), len(model.parameters)
    whole = problem.symmetric("Q", nx, tuple(0 if p.may_jump else design.degree for p in model.parameters) or 0)
    slacks = problem.matrix("G", nx, nx, design.degree)
    gains = KinkedUnknown.of(problem, model, "Y", (nu, nx), design.degree)
    one = problem.constant(np.ones((1, 1)))
    speeds = rates(plant_of(model).axes, whole, one, lambda i: variable(count + i, 2 * count), as_float)
    moved = one_sample_later(whole, speeds, period)
    sizes: dict[str, tuple[MatrixPolynomial, MatrixPolynomial]] = {}
    discs = sampled_discs(design.regions, period, design.reserve)
    problem.require("Q > 0", whole)
    for number, (piece, update) in enumerate(zip(model.pieces, updates, strict=True)):
        problem.on_cell(number, piece.box)
        applied = scale.applied(piece.polynomial)
        known = {key: problem.here(problem.scaled(getattr(applied, key))) for key in ("C", "D", "F", "denominator")}
        Phi, Gamma, Gamma_E = (problem.scaled(array) for array in (update[0], update[1] * scale.inputs, update[2]))
        Q, later, G, Y = *(problem.here(m) for m in (whole, moved, slacks)), gains.on(piece)
        closed, slack = Phi @ G + Gamma @ Y, G + G.T - Q
        power = power_below(piece)  # closed is over d^power, the performance over d

        def over(
            matrix: MatrixPolynomial, times: int = power, d: MatrixPolynomial = known["denominator"]
        ) -> MatrixPolynomial:
            return matrix.scaled_by(d, times)

        if design.decay_rate > 0.0:
            kept = float(np.exp(-2.0 * design.decay_rate * (1.0 + design.reserve) * period))
            problem.require("decay over a sample", symmetric_block([[over(later) * kept, closed], [None, over(slack)]]))
        require_discs(problem, discs, design.degree, closed, G, over)
        if design.limits is not None:
            require_limits(problem, model, design.limits, design.reserve, scale, Q, slack, Y)
        for channel in design.channels:
            W, Z = feedback_channel_matrices(model, channel)
            W = W / scale.disturbance
            seen = over(performance(problem, Z, known, G, Y, model, scale), max(power - 1, 0))
            through = problem.constant(Z[:, nx : len(Z.T) - nu]) @ known["F"] @ problem.constant(W)
            driven = Gamma_E @ problem.constant(W)
            level, bounded = channel.bound or gamma, channel.bound is not None
            if channel.name not in sizes:
                ratio = None if level is None else level * per_sample(channel.norm, period) / scale.disturbance
                sizes[channel.name] = levels(problem, channel.name, bounded, ratio, design.compact)
            near, far = sizes[channel.name]
            if design.compact:
                driven, through = driven.scaled_by(near), through.scaled_by(near)
            through = over(through, max(power - 1, 0))
            if channel.norm != "H-infinity":
                own = ChannelSizes(channel.name, channel.norm, design.degree, near, far)
                require_sampled_energy(problem, own, over(later), closed, over(slack), driven, seen, through, over)
                continue
            inner, outer = (
                problem.constant(np.eye(k)).scaled_by(size) for k, size in ((W.shape[1], near), (len(Z), far))
            )
            rows: list[list[MatrixPolynomial | None]] = [
                [over(later), closed, driven, None],
                [None, over(slack), None, seen.T],
                [None, None, over(inner), through.T],
                [None, None, None, over(outer)],
            ]
            problem.require(f"gain {channel.name}", symmetric_block(rows))
    problem.on_cell()
    return problem
