r"""Every claim as matrix inequalities, written once: the solver fills them with unknowns, the verifier with balls.

V = e'P(p)e, Z picks the errors of a channel, W the sizes of its inputs; S = P A + A'P, P' = dP/dt, P+ = P one sample later.
For a rational plant A and B are numerators, and P, P', Z'Z, g^2 are multiplied by the (positive) denominator.

    continuous (the error equation e' = A e + B w)
    decay rate a      -(S + P' + 2 a P) > 0                                         |e|_P falls at least like exp(-a t)
    fastest pole r    S + 2 r P > 0                                                 every frozen pole has a real part above -r
    gain g            [-(S + P' + Z'Z), -P B W; *, g^2 I] > 0                        L2 gain from W w to Z e below g

    discrete (the update e+ = A e + B w of one sample of length T)
    decay over a sample a  exp(-2 a T) P - A'P+A > 0                                |e|_P falls by exp(-a T) in every sample
    gain g            [P - Z'Z - A'P+A, -A'P+B W; *, g^2 I - W'B'P+B W] > 0          l2 gain from W w to Z e below g
    drop probability q     P - (1 - q) A'P+A - q A0'P+A0 > 0,  P - A'P+A > 0        mean-square stable when every measurement is
                                                                                    lost independently with a probability up to q
and P > 0 with each of them, for all parameters in their range and all rates in their bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from synthesis.loop.system import System


class Arithmetic(Protocol):
    """What differs between balls and unknowns beside the operators of the ring."""

    def eye(self, size: int, like: Any) -> Any: ...  # noqa: D102
    def known(self, rows: Any, like: Any) -> Any: ...  # noqa: D102
    def block(self, rows: Any) -> Any: ...  # noqa: D102
    def exp(self, exponent: Any) -> Any: ...  # noqa: D102


@dataclass(frozen=True)
class Question:
    """A claim with its numbers in the arithmetic at hand.

    `level` is a number, or for a gain that is minimised `square` an unknown 1 x 1 polynomial in the place of level^2. `W` and `Z`
    are rows of numbers.
    """

    kind: str
    level: Any
    group: str = ""
    W: Any = None
    Z: Any = None
    period: Any = None
    square: Any = None


def inequalities(
    question: Question, system: System, P: Any, later: Any, arithmetic: Arithmetic
) -> list[tuple[str, Any]]:
    """Named symmetric matrices that must be positive definite; `later` is dP/dt (continuous) or P+ (discrete)."""
    named = [("P > 0", P)]
    if system.time == "continuous":
        return named + _continuous(question, system, P, later, arithmetic)
    return named + _discrete(question, system, P, later, arithmetic)


def _continuous(q: Question, system: System, P: Any, P_dot: Any, arithmetic: Arithmetic) -> list[tuple[str, Any]]:
    def weighed(matrix: Any) -> Any:
        return matrix if system.denominator is None else matrix.scaled_by(system.denominator)

    product = P @ system.A
    S = product + product.T
    if q.kind == "decay rate":
        return [("decay rate", -(S + weighed(P_dot) + weighed(P) * (2 * q.level)))]
    if q.kind == "fastest pole":
        return [("fastest pole", S + weighed(P) * (2 * q.level))]
    W, Z = arithmetic.known(q.W, P), arithmetic.known(q.Z, P)
    ZC, ZD = Z @ system.C, Z @ system.D[q.group] @ W
    top = -(S + weighed(P_dot) + weighed(ZC.T @ ZC))
    side = -(P @ (system.B[q.group] @ W) + weighed(ZC.T @ ZD))
    return [("gain", arithmetic.block([[top, side], [None, weighed(_bound(q, ZD, arithmetic))]]))]


def _discrete(q: Question, system: System, P: Any, P_next: Any, arithmetic: Arithmetic) -> list[tuple[str, Any]]:
    moved = system.A.T @ P_next
    fallen = moved @ system.A
    if q.kind in ("internal update", "sampled error"):
        return [(q.kind, P * arithmetic.exp(-2 * q.level * q.period) - fallen)]
    if q.kind == "drop probability":
        coasted = (system.coasting.T @ P_next) @ system.coasting
        return [("received", P - fallen), ("received or lost", P - fallen * (1 - q.level) - coasted * q.level)]
    W, Z = arithmetic.known(q.W, P), arithmetic.known(q.Z, P)
    BW, ZC, ZD = system.B[q.group] @ W, Z @ system.C, Z @ system.D[q.group] @ W
    corner = _bound(q, ZD, arithmetic) - (BW.T @ P_next) @ BW
    return [("gain", arithmetic.block([[P - ZC.T @ ZC - fallen, -(moved @ BW + ZC.T @ ZD)], [None, corner]]))]


def _bound(q: Question, ZD: Any, arithmetic: Arithmetic) -> Any:
    """g^2 I - W'D'Z'Z D W."""
    unit = arithmetic.eye(ZD.shape[1], ZD)
    square = unit * q.level**2 if q.square is None else unit.scaled_by(q.square)
    return square - ZD.T @ ZD
