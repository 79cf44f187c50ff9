r"""Every claim as matrix inequalities, written once: the solver fills them with unknowns, the verifier with balls.

V = e'P(p)e, Z picks the errors of a channel, W the sizes of its inputs; S = P A + A'P, P' = dP/dt, P+ = P one sample later.
For a rational plant A and B (and C, D of a system that is given) are numerators over a positive d(p); every inequality is
multiplied by so many d that it is polynomial.

    continuous (the error equation e' = A e + B w)
    decay rate a      -(S + P' + 2 a P) > 0                                         |e|_P falls at least like exp(-a t)
    fastest pole r    S + 2 r P > 0                                                 every frozen pole has a real part above -r
    gain g            [-(S + P' + C'Z'ZC), -P B W - C'Z'ZDW; *, g^2 I - W'D'Z'ZDW] > 0
                      L2 gain from W w to Z(C e + D w) below g
    H2 norm g         -(S + P' + C'Z'ZC) > 0,  g^2 - tr(W'B'P B W) > 0
                      energies of Z C e after an impulse in each input, added up, below g^2 (D = 0)
    energy to peak g  [-(S + P'), -P B W; *, g^2 I] > 0,  P - C'Z'ZC > 0
                      the largest |Z C e| is below g |w|_2 (D = 0; generalised H2, Rotea 1993)

    discrete (the update e+ = A e + B w of one sample of length T)
    decay over a sample a  exp(-2 a T) P - A'P+A > 0                                |e|_P falls by exp(-a T) in every sample
    gain g            [P - C'Z'ZC - A'P+A, -A'P+B W - C'Z'ZDW; *, g^2 I - W'B'P+B W - W'D'Z'ZDW] > 0
                      l2 gain from W w to Z(C e + D w) below g
    drop probability q     P - (1 - q) A'P+A - q A0'P+A0 > 0,  P - A'P+A > 0        mean-square stable when every measurement is
                                                                                    lost independently with a probability up to q
    H2 norm g         P - A'P+A - C'Z'ZC > 0,  T g^2 - tr(W'B'P+B W + W'D'Z'ZDW) > 0
    energy to peak g  [P - A'P+A, -A'P+B W; *, T g^2 I - W'B'P+B W] > 0,
                      [P - C'Z'ZC, -C'Z'ZDW; *, T g^2 I - W'D'Z'ZDW] > 0
                      as above, in continuous time: w is held over a sample, |z|^2 counts for its length T, and an impulse is
                      1/T for one sample

and P > 0 with each of them, for all parameters in their range and all rates in their bounds; those about frozen poles are in
`synthesis.certificate.poles`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from synthesis.certificate.poles import CONTINUOUS, DISCRETE, pole_inequality
from synthesis.loop.system import System

POSITIVE = "P > 0"


class Arithmetic(Protocol):
    """What differs between balls and unknowns beside the operators of the ring."""

    def eye(self, size: int, like: Any) -> Any: ...  # noqa: D102
    def known(self, rows: Any, like: Any) -> Any: ...  # noqa: D102
    def block(self, rows: Any) -> Any: ...  # noqa: D102
    def trace(self, matrix: Any) -> Any: ...  # noqa: D102
    def exp(self, exponent: Any) -> Any: ...  # noqa: D102
    def cos(self, angle: Any) -> Any: ...  # noqa: D102


@dataclass(frozen=True)
class Question:
    """A claim with its numbers in the arithmetic at hand.

    `level` is a number, or for a gain that is minimised `square` an unknown 1 x 1 polynomial in the place of level^2. `W` and `Z`
    are rows of numbers; `centre` is that of a disc of poles.
    """

    kind: str
    level: Any
    group: str = ""
    W: Any = None
    Z: Any = None
    period: Any = None
    square: Any = None
    centre: Any = None


def inequalities(
    question: Question, system: System, P: Any, later: Any, arithmetic: Arithmetic
) -> list[tuple[str, Any]]:
    """Named symmetric matrices that must be positive definite; `later` is dP/dt (continuous) or P+ (discrete)."""
    named = [(POSITIVE, P)]
    if system.time == "continuous":
        return named + _continuous(question, system, P, later, arithmetic)
    return named + _discrete(question, system, P, later, arithmetic)


def _continuous(q: Question, system: System, P: Any, P_dot: Any, arithmetic: Arithmetic) -> list[tuple[str, Any]]:
    product = P @ system.A
    S = product + product.T
    if q.kind == "decay rate":
        return [("decay rate", -(S + _over(system, P_dot) + _over(system, P) * (2 * q.level)))]
    if q.kind == "fastest pole":
        return [("fastest pole", S + _over(system, P) * (2 * q.level))]
    if q.kind in CONTINUOUS:
        return [(q.kind, pole_inequality(q.kind, q.level, q.period, system.A, P, _over(system, P), arithmetic))]
    moving, still, shown = (1, 2, 0) if system.shared else (0, 1, 1)  # so many times d
    W, Z = arithmetic.known(q.W, P), arithmetic.known(q.Z, P)
    ZC, ZD, PBW = Z @ system.C, Z @ system.D[q.group] @ W, P @ (system.B[q.group] @ W)
    fall = _over(system, S, moving) + _over(system, P_dot, still)
    seen = _over(system, ZC.T @ ZC, shown)
    if q.kind == "H2 norm":
        energy = arithmetic.trace((system.B[q.group] @ W).T @ PBW)
        return [
            ("observed energy", -(fall + seen)),
            ("H2 norm", _over(system, _square(q, energy, arithmetic), 2) - energy),
        ]
    side = -_over(system, PBW, moving)
    if q.kind == "energy to peak":
        corner = _over(system, _square(q, W.T @ W, arithmetic), still)
        peak = _over(system, P, 2) - ZC.T @ ZC if system.shared else P - ZC.T @ ZC
        return [("stored energy", arithmetic.block([[-fall, side], [None, corner]])), ("peak", peak)]
    side = side - _over(system, ZC.T @ ZD, shown)
    corner = _over(system, _square(q, ZD.T @ ZD, arithmetic), still) - _over(system, ZD.T @ ZD, shown)
    return [("gain", arithmetic.block([[-(fall + seen), side], [None, corner]]))]


def _discrete(q: Question, system: System, P: Any, P_next: Any, arithmetic: Arithmetic) -> list[tuple[str, Any]]:
    if q.kind in DISCRETE:
        A = system.A
        if q.centre is not None:
            A = A - _over(system, arithmetic.eye(A.shape[0], P)) * q.centre
        return [(q.kind, pole_inequality(q.kind, q.level, q.period, A, P, _over(system, P, 2), arithmetic))]
    moved, P = system.A.T @ P_next, _over(system, P, 2)
    fallen = moved @ system.A
    if q.kind in ("internal update", "sampled error"):
        return [(q.kind, P * arithmetic.exp(-2 * q.level * q.period) - fallen)]
    if q.kind == "drop probability":
        coasted = (system.coasting.T @ P_next) @ system.coasting
        return [("received", P - fallen), ("received or lost", P - fallen * (1 - q.level) - coasted * q.level)]
    shown = 0 if system.shared else 2  # so many times d
    W, Z = arithmetic.known(q.W, P), arithmetic.known(q.Z, P)
    BW, ZC, ZD = system.B[q.group] @ W, Z @ system.C, Z @ system.D[q.group] @ W
    driven = (BW.T @ P_next) @ BW
    seen, cross, direct = (_over(system, x, shown) for x in (ZC.T @ ZC, ZC.T @ ZD, ZD.T @ ZD))
    if q.kind == "sampled H2 norm":
        energy = arithmetic.trace(driven + direct)
        bound = _over(system, _square(q, energy, arithmetic), 2) * q.period
        return [("observed energy", P - fallen - seen), ("H2 norm", bound - energy)]
    bound = _over(system, _square(q, driven, arithmetic), 2)
    if q.kind == "sampled energy to peak":
        bound = bound * q.period
        stored = arithmetic.block([[P - fallen, -(moved @ BW)], [None, bound - driven]])
        return [("stored energy", stored), ("peak", arithmetic.block([[P - seen, -cross], [None, bound - direct]]))]
    return [("gain", arithmetic.block([[P - seen - fallen, -(moved @ BW + cross)], [None, bound - direct - driven]]))]


def _over(system: System, matrix: Any, times: int = 1) -> Any:
    """The matrix times a power of the denominator."""
    for _ in range(0 if system.denominator is None else times):
        matrix = matrix.scaled_by(system.denominator)
    return matrix


def _square(q: Question, like: Any, arithmetic: Arithmetic) -> Any:
    """g^2 I."""
    unit = arithmetic.eye(like.shape[1], like)
    return unit * q.level**2 if q.square is None else unit.scaled_by(q.square)
