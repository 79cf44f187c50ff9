r"""L2 gain, H2 norms and decay rate of a given LPV system: proved from both sides, on the continuum of parameters and rates.

From above (a decay rate: from below) by a Lyapunov function x'P(p)x whose coefficients a solver finds and which is then proved
in ball arithmetic (`synthesis.certificate.verify`); from below by a periodic parameter trajectory or a frozen place, proved in
ball arithmetic as well. The gap between the two is what better trajectories and Lyapunov functions of higher degree might still
move.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.errors import AnalysisError
from analysis.lpv.bounds import LpvBounds
from analysis.lpv.frozen import climb, largest_gain, slowest_decay, unstable
from analysis.lpv.h2 import frozen_energy, proved_energy_to_peak, proved_h2
from analysis.lpv.h2_path import h2_of, proved_along
from analysis.lpv.lifted import lift, worst_input
from analysis.lpv.proved_path import ProvedPath
from analysis.lpv.question import Inputs, Question, ask, require_channel
from analysis.lpv.trajectory import Path, Trajectory
from analysis.lpv.upper import proved_decay, proved_norm
from analysis.lpv.worst_path import gain_of, growth_of, worst_path
from estimators.arrays import FloatArray
from synthesis.certificate.claims import claim_unit
from synthesis.models.lpv import LpvModel

PARTS = 8  # intervals of every piece of a trajectory whose gain is proved
CLOSED = 1.003  # bounds so near to each other need no better trajectory
SHORTER = (1.0 - 1e-9, 1.0 - 1e-6, 1.0 - 1e-3)  # of a growth rate, tried in turn until it is certain
Degree = int | tuple[int, ...]


def lpv_l2_gain(
    model: LpvModel,
    inputs: Inputs | None = None,
    outputs: Sequence[str] | None = None,
    degree: Degree = 2,
    discrete: bool = False,
) -> LpvBounds:
    r"""sup |z|_2/|w|_2 over inputs w and admissible parameter trajectories, x(0) = 0: bounds with certificate and witness.

    x' = A(p) x + B(p) w, z = C(p) x + D(p) w, or x+ = .. with `discrete`; then the rate bounds of the model's parameters are
    per sample. A rate of inf lets a parameter jump, a rate of 0 freezes it. `inputs` are names among inputs and disturbances,
    or names with the size that counts as one; `outputs` names of outputs; None: all. `degree` is that of P in the parameters,
    or one degree for each (0 for a parameter that jumps in continuous time). A system that is not stable has the gain inf.
    Raises AnalysisError for unknown names and degrees that do not fit. Sources: Wu, Yang, Packard, Becker 1996 (upper bound);
    Peni, Seiler 2016 (lower bound).

    >>> import sympy as sp
    >>> model = LpvModel(
    ...     name="lag", source="example", states=(Signal("x", "1"),), inputs=(Signal("u", "1"),), outputs=(Signal("y", "1"),),
    ...     parameters=(SchedulingParameter("p", "1/s", 1.0, 2.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[-sp.Symbol("p")]]), B=sp.Matrix([[1]]), C=sp.Matrix([[1]]),
    ... )
    >>> found = lpv_l2_gain(model)
    >>> round(found.lower, 1), round(found.upper, 1)  # at p = 1
    (1.0, 1.0)
    """
    question = _question(model, inputs, outputs, degree, discrete)
    place, gain, frequency = largest_gain(question)
    kind = "sampled gain" if discrete else "gain"
    if unstable(question, place):
        return _unstable(question, kind, place)
    best = proved_frozen_gain(question, place, frequency)
    witness = _standing(question, place).trajectory(question.axes, frequency)
    claim = proved_norm(question, kind, degree, gain) if gain > 0.0 or not _moves(question) else None
    if _moves(question) and (claim is None or claim.level > CLOSED * best):
        path, carrier = worst_path(question, gain_of(question), tuple(dict.fromkeys((0.0, frequency))), place)
        proved = _proved_ratio(question, path, carrier, PARTS)
        if proved > best:
            best, witness = proved, path.trajectory(question.axes, carrier)
        claim = claim or proved_norm(question, kind, degree, best)
    if _moves(question) and claim is None:  # is there a gain at all?
        path, _ = worst_path(question, growth_of(question), (0.0,), slowest_decay(question)[0])
        if ProvedPath(question, path, 0.0, 1).decays_no_faster(0.0):
            return LpvBounds(kind, np.inf, np.inf, _unit(question, kind), None, path.trajectory(question.axes, 0.0))
    return LpvBounds(kind, best, np.inf if claim is None else claim.level, _unit(question, kind), claim, witness)


def lpv_decay_rate(model: LpvModel, degree: Degree = 2, discrete: bool = False) -> LpvBounds:
    r"""The largest a with |x(t)| <= c e^(-a t) |x(0)| along every admissible parameter trajectory, in 1/s or 1/sample.

    `lower` is proved by x'P(p)x with P of the given degree; along `witness` (a frozen place, or a periodic trajectory with its
    monodromy matrix) the state falls no faster than `upper`, which is 0 for a trajectory that is not stable. Rates and
    `discrete` as in `lpv_l2_gain`. Raises AnalysisError for degrees that do not fit.

    >>> import sympy as sp
    >>> model = LpvModel(
    ...     name="lag", source="example", states=(Signal("x", "1"),), inputs=(Signal("u", "1"),), outputs=(Signal("y", "1"),),
    ...     parameters=(SchedulingParameter("p", "1/s", 1.0, 2.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[-sp.Symbol("p")]]), B=sp.Matrix([[1]]), C=sp.Matrix([[1]]),
    ... )
    >>> found = lpv_decay_rate(model)
    >>> round(found.lower, 1), round(found.upper, 1)  # 1/s: the slowest is p = 1
    (1.0, 1.0)
    """
    question = _question(model, (), None, degree, discrete)
    kind = "sampled error" if discrete else "decay rate"
    place, rate = slowest_decay(question)
    paths = [_standing(question, place)]
    if _moves(question) and rate > 0.0:
        path, _ = worst_path(question, growth_of(question), (0.0,), place)
        paths.append(path)
    upper, witness = np.inf, None
    score = growth_of(question)
    for path in paths:
        found = _proved_decay_along(question, path, -score(path, 0.0))
        if found < upper:
            upper, witness = found, path.trajectory(question.axes, 0.0)
    if not upper > 0.0:
        return LpvBounds(kind, 0.0, 0.0, _time_unit(question), None, witness)
    claim = proved_decay(question, degree, min(upper, rate))
    return LpvBounds(kind, 0.0 if claim is None else claim.level, upper, _time_unit(question), claim, witness)


def lpv_h2_norm(
    model: LpvModel,
    inputs: Inputs | None = None,
    outputs: Sequence[str] | None = None,
    degree: Degree = 2,
    discrete: bool = False,
    generalised: bool = False,
) -> LpvBounds:
    r"""H2 norm: energies of z after an impulse in each input, added up (square root), at most over all parameter trajectories.

    The standard deviation of z under white noise of unit intensity is no larger. `generalised`: the largest |z(t)| (Euclidean)
    per energy of w, sup |z|_inf/|w|_2 (Rotea 1993). Arguments as in `lpv_l2_gain`; `lower` comes from trajectories, or in exact
    rationals. Raises AnalysisError, too, for D other than zero in continuous time, where the norm is infinite.

    >>> import sympy as sp
    >>> model = LpvModel(
    ...     name="lag", source="example", states=(Signal("x", "1"),), inputs=(Signal("u", "1"),), outputs=(Signal("y", "1"),),
    ...     parameters=(SchedulingParameter("p", "1/s", 1.0, 2.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[-sp.Symbol("p")]]), B=sp.Matrix([[1]]), C=sp.Matrix([[1]]),
    ... )
    >>> found = lpv_h2_norm(model)
    >>> found.lower <= found.upper
    True
    """
    question = _question(model, inputs, outputs, degree, discrete)
    kind = ("sampled " if discrete else "") + ("energy to peak" if generalised else "H2 norm")
    if not discrete and any(any(x != 0 for x in m.entries()) for m in question.exact["D"].terms.values()):
        raise AnalysisError(
            f"model '{model.name}': an input acts on an output at once, so the H2 norm is infinite; choose others"
        )
    stable_at, _ = slowest_decay(question)
    if unstable(question, stable_at):
        return _unstable(question, kind, stable_at)
    place, guess = climb(question, lambda u: frozen_energy(question, u, generalised))
    proved = (proved_energy_to_peak if generalised else proved_h2)(question, place)
    witness = _standing(question, place).trajectory(question.axes, 0.0)
    claim = proved_norm(question, kind, degree, guess)
    if _moves(question) and (claim is None or claim.level > CLOSED * proved):
        path, _ = worst_path(question, h2_of(question, generalised), (0.0,), place)
        along = proved_along(question, path, generalised)
        if along > proved:
            proved, witness = along, path.trajectory(question.axes, 0.0)
    return LpvBounds(kind, proved, np.inf if claim is None else claim.level, _unit(question, kind), claim, witness)


def proved_frozen_gain(question: Question, place: FloatArray, frequency: float) -> float:
    """A float that is not above the gain at one place u and one frequency; 0 where nothing is certain."""
    return _proved_ratio(question, _standing(question, place), frequency, 1)


def _question(
    model: LpvModel, inputs: Inputs | None, outputs: Sequence[str] | None, degree: Degree, discrete: bool
) -> Question:
    question = ask(model, inputs, outputs, discrete)
    if inputs != ():
        require_channel(question)
    given = (degree,) if isinstance(degree, int) else tuple(degree)
    if min(given, default=0) < 0 or (not isinstance(degree, int) and len(given) != len(question.axes)):
        raise AnalysisError(
            f"degree {degree} of P must be one number >= 0, or one for each of {len(question.axes)} parameters"
        )
    return question


def _moves(question: Question) -> bool:
    """Whether a parameter moves at all."""
    return any(
        axis.rate_low is None or axis.rate_high is None or axis.rate_low < 0 < axis.rate_high for axis in question.axes
    )


def _standing(question: Question, place: FloatArray) -> Path:
    """A frozen place as a path: one interval about as long as the fastest time scale, or one sample."""
    A = question.frozen(place[None])[0][0]
    size = float(np.abs(A).sum(axis=-1).max())
    step = 1.0 if question.discrete or size == 0.0 else float(2.0 ** -np.round(np.log2(size)))
    return Path(place[None], np.array([step]), tuple(axis.may_jump for axis in question.axes))


def _proved_ratio(question: Question, path: Path, carrier: float, parts: int) -> float:
    """What is certain of the gain along a path, with the worst input of the floats; 0 where nothing is."""
    lifted = lift(question, path, carrier, parts)
    return 0.0 if lifted is None else ProvedPath(question, path, carrier, parts).ratio(worst_input(lifted)[1])


def _proved_decay_along(question: Question, path: Path, rate: float) -> float:
    """The least decay rate, near that of the floats, that is certain to be kept to along a path; inf if none is."""
    if not np.isfinite(rate):
        return np.inf
    proved = ProvedPath(question, path, 0.0, 1)
    if not rate > 0.0:
        return 0.0 if proved.decays_no_faster(0.0) else np.inf
    for shorter in SHORTER:
        if proved.decays_no_faster(rate / shorter):
            return rate / shorter
    return np.inf


def _unstable(question: Question, kind: str, place: FloatArray) -> LpvBounds:
    witness: Trajectory = _standing(question, place).trajectory(question.axes, 0.0)
    return LpvBounds(kind, np.inf, np.inf, _unit(question, kind), None, witness)


def _time_unit(question: Question) -> str:
    return "1/sample" if question.discrete else "1/s"


def _unit(question: Question, kind: str) -> str:
    signals = (*question.model.inputs, *question.model.disturbances, *question.model.outputs)
    unit = claim_unit("gain", question.channel, {s.name: s.unit for s in signals})
    if kind in ("gain", "sampled gain") or question.discrete:
        return unit
    return f"{unit} per root of s"
