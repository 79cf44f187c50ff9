r"""H-infinity gain synthesis for an observer that corrects once a sample, in discrete time.

    xhat+ = e^(TA) xhat + T phi(TA) B u + K(p) (y - C xhat - D u),    e+ = (Phi - K C) e + (Gamma - K F) d

with Phi = e^(TA), Gamma = T phi(TA) E, d held over a sample. V = e'P(p)e, P+ = P one sample later. With a slack matrix G(p) and
X = G K (de Oliveira, Bernussou, Geromel 1999) K needs no P+, which is not known when it is used, and

    decay a    [exp(-2 a T) P, *; G Phi - X C, G + G' - P+] > 0          |e|_P falls by exp(-a T) in every sample
    channel    [P, *, *, *; 0, g I, *, *; G Phi - X C, (G Gamma - X F) W, G + G' - P+, *; Z, 0, 0, g I] > 0

prove an l2 gain below g (with inputs and errors both weighted by sqrt(T) it is that of continuous signals). Other norms have a
pair of their own in the place of the last, and levels of continuous time (`synthesis.design.norms`). One P and one G serve
all channels, so channel i is weighed by 1/g_i. Phi and Gamma are fitted by Chebyshev polynomials in the parameters
(`synthesis.design.fitted_update`); what comes out is proved for the exact ones (`synthesis.certificate`). Of a rational model a
power of its denominator multiplies every inequality.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.fitted_update import fitted_update, power_below
from synthesis.design.hinf_observer import (
    ObserverDesign,
    ObserverGains,
    channel_matrices,
    design_scale,
    error_unit,
    minimised,
    outputs_of,
)
from synthesis.design.kinked import KinkedUnknown
from synthesis.design.norms import ChannelSizes, levels, per_sample, require_sampled_energy
from synthesis.design.sampled_regions import require_discs, sampled_discs
from synthesis.design.three_solves import problem_for
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.loop.from_model import plant_of
from synthesis.loop.motion import one_sample_later, rates
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block, variable
from synthesis.polynomials.rational import as_float

POINTS = 40  # for each parameter; what holds between them is proved for the table that is deployed


def design_sampled_observer(model: LpvModel, design: ObserverDesign, sample_time: float) -> ObserverGains:
    """K(p) for the given sample time; `gain` of the result gives K in the units state/output.

    Raises ProblemError for a bound on the fastest pole (an update has none), for regions that are none of its poles
    (`synthesis.design.sampled_regions`), and as `design_observer`.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> wanted = Channel(("friction", "force_noise"), ("relative_velocity",), weights=(1.0, 0.1))
    >>> gains = design_sampled_observer(model, ObserverDesign((wanted,)), sample_time=0.005)
    >>> print(gains.verdict, gains.update, gains.sample_time)
    certified sampled 0.005
    """
    if not sample_time > 0.0:
        raise ProblemError(f"sample time {sample_time} s must be positive")
    if design.fastest_pole is not None:
        raise ProblemError("a sampled design has no fastest pole: leave it out; noise channels bound its gains")
    sampled_discs(design.regions, sample_time)
    settings = replace(design.settings, points=min(design.settings.points, POINTS))
    design = replace(design, settings=settings)
    scale = design_scale(model, design) / np.sqrt(sample_time)  # errors in their size if time is counted in samples
    updates = [fitted_update(model, piece, scale, sample_time) for piece in model.pieces]

    def problem(gamma: float | None, maximise_margin: bool = True, floor: float = 0.0) -> LmiProblem:
        return _problem(model, design, scale, sample_time, updates, gamma, maximise_margin, floor)

    return minimised(model, design, scale, problem, "sampled", sample_time)


def _problem(
    model: LpvModel,
    design: ObserverDesign,
    scale: FloatArray,
    period: float,
    updates: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    gamma: float | None,
    maximise_margin: bool,
    floor: float,
) -> LmiProblem:
    problem = problem_for(model, gamma, maximise_margin, floor)
    nx, ny, count = len(model.states), len(model.outputs), len(model.parameters)
    degree = tuple(0 if p.may_jump else design.degree for p in model.parameters)
    whole = problem.symmetric("P", nx, degree or 0)
    slacks = problem.matrix("G", nx, nx, design.degree)
    gains = KinkedUnknown.of(problem, model, "X", (nx, ny), design.degree)
    one = problem.constant(np.ones((1, 1)))
    speeds = rates(plant_of(model).axes, whole, one, lambda i: variable(count + i, 2 * count), as_float)
    moved = one_sample_later(whole, speeds, period)
    unit, outputs = error_unit(model, design, scale), outputs_of(model, design, scale)[:, None]
    sizes: dict[str, tuple[MatrixPolynomial, MatrixPolynomial]] = {}
    discs = sampled_discs(design.regions, period, design.reserve)
    problem.require("P > 0", whole)
    for number, (piece, (Phi, _, Gamma)) in enumerate(zip(model.pieces, updates, strict=True)):
        problem.on_cell(number, piece.box)
        scaled = piece.polynomial.with_states_scaled(scale)
        given = {"C": scaled.C / outputs, "F": scaled.F / outputs, "denominator": scaled.denominator}
        known = {key: problem.here(problem.scaled(array)) for key, array in given.items()}
        P, later, G, X = *(problem.here(m) for m in (whole, moved, slacks)), gains.on(piece)
        power = power_below(piece)  # what Phi and Gamma are over; C and F are over d

        def over(
            matrix: MatrixPolynomial, times: int = power, d: MatrixPolynomial = known["denominator"]
        ) -> MatrixPolynomial:
            return matrix.scaled_by(d, times)

        C, F = (over(known[key], max(power - 1, 0)) for key in ("C", "F"))
        closed, slack = G @ problem.scaled(Phi) - X @ C, over(G + G.T - later)
        if design.decay_rate > 0.0 or not design.channels:
            kept = float(np.exp(-2.0 * design.decay_rate * (1.0 + design.reserve) * period))
            problem.require("decay over a sample", symmetric_block([[over(P) * kept, closed.T], [None, slack]]))
        require_discs(problem, discs, design.degree, closed.T, G.T, over)
        for channel in design.channels:
            d, z = channel_matrices(model, channel)
            z = z / unit / scale
            forced = (G @ problem.scaled(Gamma) - X @ F) @ problem.constant(d)
            level, bounded = channel.bound or gamma, channel.bound is not None
            if channel.name not in sizes:
                ratio = None if level is None else level * per_sample(channel.norm, period) / unit
                sizes[channel.name] = levels(problem, channel.name, bounded, ratio, design.compact)
            near, far = sizes[channel.name]
            if channel.norm != "H-infinity":
                own = ChannelSizes(channel.name, channel.norm, design.degree, far, near)
                seen = over(problem.constant(z).scaled_by(near))
                require_sampled_energy(problem, own, slack, closed, over(P), forced, seen, over=over)
                continue
            inputs = over(problem.constant(np.eye(d.shape[1])).scaled_by(far))
            if design.compact:
                top = over(P - problem.constant(z.T @ z).scaled_by(near))
                rows = [[top, None, closed.T], [None, inputs, forced.T], [None, None, slack]]
            else:
                output, errors = over(problem.constant(z.T)), over(problem.constant(np.eye(len(z))).scaled_by(near))
                rows = [
                    [over(P), None, closed.T, output], [None, inputs, forced.T, None], [None, None, slack, None],
                    [None, None, None, errors],
                ]  # fmt: skip
            problem.require(f"gain {channel.name}", symmetric_block(rows))
    problem.on_cell()
    return problem
