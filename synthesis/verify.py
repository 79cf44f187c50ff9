r"""Re-prove the certificate of a schedule file in exact rational arithmetic, from the file alone, without any solver.

The error of the observer is e' = A_e e + B_e d with A_e(w) = A(w) - L(w) C(w) and B_e(w) = E(w) - L(w) F(w), where L is the
stored table, linear between its breakpoints. Every number in the file is a rational number, so on each segment w = low + (high
- low) t everything below is a polynomial matrix with rational coefficients, positive definite on [0, 1] or not.
With V = e'P(w)e, S = A_e'P + P A_e, P' = dP/dw, and for both bounds q of the rate dw/dt:

    decay         P > 0,  S + q P' + 2 alpha P < 0                         |e|_P falls at least like exp(-alpha t)
    fastest pole  P > 0,  S + 2 r P > 0                                    every frozen pole has a real part above -r
    gain          P > 0,  g^2 (S + q P' + Z'Z) + (P B_e W)(P B_e W)' < 0   L2 gain from W d to Z e below g (Schur complement)
    sampled       P > 0,  S + 2 alpha P < 0,  2 beta P - q P' > 0, alpha > beta
    drops         the same, and A'P + P A - 2 g P < 0: the loop without its measurement grows at most like exp(g t)

The claim `sampled` is about the update that the runtime performs: over one sample of length T it freezes w and moves the error by
e^{A_e T}. Frozen decay gives |e^{A_e T} e|_P <= exp(-alpha T) |e|_P; while w moves on to its next value, P grows by at most
exp(2 beta T). So V falls by exp(-2 (alpha - beta) T) in every sample, for every T, however w moves within its rate.
With every measurement lost independently with probability p, the runtime coasts over that sample by e^{A T}, and the mean of V
changes by at most exp(2 beta T) ((1 - p) exp(-2 alpha T) + p exp(2 g T)): below one, the error is mean-square stable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from flint import arb, fmpq, fmpq_mat, fmpq_poly

from estimators.errors import ScheduleError
from synthesis.polynomials.rational import (
    Matrix,
    add,
    compose,
    derivative,
    first_failure,
    multiply,
    polynomial_matrix,
    rational,
    scale,
    transpose,
)

KINDS = ("decay", "fastest pole", "gain", "sampled", "drops")


@dataclass(frozen=True)
class Proof:
    """One claim: proved on the whole range and rate box, or the place where it fails.

    `refuted` says that the closed loop itself is unstable at that place, not just that this P does not prove it.
    """

    claim: str
    level: float
    unit: str
    proved: bool
    place: str = ""
    refuted: bool = False


@dataclass(frozen=True)
class Segment:
    """The closed loop between two breakpoints, in t on [0, 1]; A is the loop while it coasts."""

    low: fmpq
    high: fmpq
    inner: fmpq_poly  # w(t)
    A: Matrix
    A_e: Matrix
    B_e: Matrix


def prove(content: Mapping[str, Any], where: str = "schedule") -> list[Proof]:
    """Prove every claim of a schedule content; raises ScheduleError if the certificate does not fit the rest of the file."""
    check_consistency(content, where)
    segments = closed_loop(content)
    return [prove_claim(content, claim, segments) for claim in content["certificate"]["claims"]]


def closed_loop(content: Mapping[str, Any]) -> list[Segment]:
    """A_e and B_e of every segment of the table as it is stored and interpolated."""
    plant = {key: polynomial_matrix(**content["plant"][key]) for key in ("A", "C", "E", "F")}
    points = [rational(value) for value in content["scheduling"][0]["breakpoints"]]
    table = [[[rational(entry) for entry in row] for row in gain] for gain in content["gain"]["table"]]
    out = []
    for i, (low, high) in enumerate(pairwise(points)):
        inner = fmpq_poly([low, high - low])
        gain = [
            [fmpq_poly([first, second - first]) for first, second in zip(*rows, strict=True)]
            for rows in zip(table[i], table[i + 1], strict=True)
        ]
        local = {key: compose(matrix, inner) for key, matrix in plant.items()}
        A_e = add(local["A"], scale(multiply(gain, local["C"]), fmpq(-1)))
        B_e = add(local["E"], scale(multiply(gain, local["F"]), fmpq(-1)))
        out.append(Segment(low, high, inner, local["A"], A_e, B_e))
    return out


def prove_claim(content: Mapping[str, Any], claim: Mapping[str, Any], segments: list[Segment]) -> Proof:
    """Every inequality of one claim, on every segment, for both bounds of the rate."""
    box = content["certificate"]["box"]
    name, unit = content["scheduling"][0]["name"], content["scheduling"][0]["unit"]
    P = polynomial_matrix(**claim["P"])
    if transpose(P) != P:
        raise ScheduleError(f"certificate: P of '{claim['name']}' is not symmetric; it proves nothing")
    slope = derivative(P)
    for segment in segments:
        for rate in (box["rate_min"], box["rate_max"]):
            local, local_slope = compose(P, segment.inner), compose(slope, segment.inner)
            for inequality in inequalities(claim, segment, local, scale(local_slope, rational(rate))):
                failure = first_failure(inequality)
                if failure is not None:
                    worse = unstable_point(segment)
                    at = segment.low + (segment.high - segment.low) * (failure if worse is None else worse)
                    place = (
                        f"{name} = {float(at):.6g} {unit} "
                        f"(between breakpoints {float(segment.low):g} and {float(segment.high):g})"
                    )
                    return Proof(claim["name"], claim["level"], claim["unit"], False, place, worse is not None)
    return Proof(claim["name"], claim["level"], claim["unit"], True)


def inequalities(claim: Mapping[str, Any], segment: Segment, P: Matrix, P_dot: Matrix) -> list[Matrix]:
    """The matrices that must be positive definite (see the module docstring)."""
    product = multiply(P, segment.A_e)
    S = add(product, transpose(product))
    level = rational(claim["level"])
    if claim["kind"] == "decay":
        return [P, scale(add(S, P_dot, scale(P, 2 * level)), fmpq(-1))]
    if claim["kind"] == "fastest pole":
        return [P, add(S, scale(P, 2 * level))]
    if claim["kind"] == "sampled":
        alpha, beta = rational(claim["frozen_decay"]), rational(claim["growth"])
        return [P, scale(add(S, scale(P, 2 * alpha)), fmpq(-1)), add(scale(P, 2 * beta), scale(P_dot, fmpq(-1)))]
    if claim["kind"] == "drops":
        coasting = multiply(P, segment.A)
        growth = add(scale(P, 2 * rational(claim["open_growth"])), scale(add(coasting, transpose(coasting)), fmpq(-1)))
        return [growth, *inequalities({**claim, "kind": "sampled"}, segment, P, P_dot)]
    Z = polynomial_matrix([[0]], [claim["errors"]])
    W = polynomial_matrix([[0]], [claim["disturbances"]])
    force = multiply(multiply(P, segment.B_e), W)
    stored = scale(add(S, P_dot, multiply(transpose(Z), Z)), level * level)
    return [P, scale(add(stored, multiply(force, transpose(force))), fmpq(-1))]


def unstable_point(segment: Segment, parts: int = 32) -> fmpq | None:
    """A t at which the frozen closed loop has a pole that is not in the open left half-plane, among equidistant ones.

    A failed proof only says that this P does not do; an unstable pole (certified root enclosures) refutes the claim itself.
    """
    for k in range(parts + 1):
        t = fmpq(k, parts)
        matrix = fmpq_mat([[entry(t) for entry in row] for row in segment.A_e])
        if any(not root.real < 0 for root, _ in matrix.charpoly().complex_roots()):
            return t
    return None


def falls_in_the_mean(claim: Mapping[str, Any], sample_time: float) -> bool:
    """(1 - p) exp(-2 alpha T) + p exp(2 g T) < exp(-2 beta T), in ball arithmetic: true only if it is certain."""
    period = arb(rational(sample_time))
    alpha, beta, g, p = (arb(rational(claim[key])) for key in ("frozen_decay", "growth", "open_growth", "level"))
    mean = (1 - p) * (-2 * alpha * period).exp() + p * (2 * g * period).exp()
    return bool(p < 1) and bool(mean < (-2 * beta * period).exp())


def check_consistency(content: Mapping[str, Any], where: str) -> None:
    """The certificate must speak about the range, the rates, the table and the guarantee of the same file."""
    (parameter,) = content["scheduling"]
    certificate, guarantee = content["certificate"], content["guarantee"]
    try:
        box, claims = certificate["box"], certificate["claims"]
        for key in ("min", "max", "rate_min", "rate_max"):
            if box[key] != parameter[key]:
                raise ScheduleError(
                    f"{where}: {parameter['name']} {key} is {parameter[key]:g}, but the certificate was made for {box[key]:g}; "
                    "design and prove the schedule again for the new box"
                )
        if not claims:
            raise ScheduleError(f"{where}: the certificate claims nothing")
        for i, claim in enumerate(claims):
            check_claim(claim, f"{where}: certificate.claims[{i}]", guarantee["claims"], content["sample_time"])
        check_guarantee(content, where)
        if set(guarantee["claims"]) != {claim["name"] for claim in claims}:
            raise ScheduleError(f"{where}: the guarantee states claims that the certificate does not prove")
        if not any(claim["kind"] == "sampled" for claim in claims):
            raise ScheduleError(f"{where}: no claim about the update that the runtime performs (kind 'sampled')")
    except (KeyError, TypeError, AttributeError) as error:
        raise ScheduleError(f"{where}: the certificate or the guarantee lacks a field ({error!r})") from None


def check_guarantee(content: Mapping[str, Any], where: str) -> None:
    """Every number that the guarantee repeats elsewhere must be the one that is proved."""
    guarantee, claims = content["guarantee"], {claim["name"]: claim for claim in content["certificate"]["claims"]}
    repeated = {"decay_rate": "decay rate", "fastest_pole": "fastest pole", "sampled_decay_rate": "sampled decay rate"}
    for key, name in repeated.items():
        if name in claims and guarantee[key] != claims[name]["level"]:
            raise ScheduleError(f"{where}: guarantee.{key} = {guarantee[key]} is not what '{name}' proves")
    channels = {f"gain {channel['name']}": channel for channel in guarantee["channels"]}
    for name, claim in claims.items():
        if claim["kind"] != "gain":
            continue
        if name not in channels or channels[name]["gamma_certified"] != claim["level"]:
            raise ScheduleError(f"{where}: guarantee.channels does not state what '{name}' proves")
        words = name.removeprefix("gain ").split(" -> ")
        sizes = [claim["disturbances"], list(zip(*claim["errors"], strict=True))]
        for said, signals, rows in zip(words, ("disturbances", "states"), sizes, strict=True):
            meant = {s["name"] for s, row in zip(content["model"][signals], rows, strict=True) if any(row)}
            if set(said.split("+")) != meant:
                raise ScheduleError(
                    f"{where}: '{name}' is about {', '.join(sorted(meant)) or 'nothing'}, not about {said}"
                )
    contraction = arb(rational(guarantee["sampled_decay_rate"])) * arb(rational(content["sample_time"]))
    if not (-contraction).exp() < arb(rational(guarantee["sampled_contraction"])) + arb("1e-12"):
        raise ScheduleError(f"{where}: guarantee.sampled_contraction is better than the proved decay rate gives")


def check_claim(claim: Mapping[str, Any], place: str, stated: Mapping[str, Any], sample_time: float) -> None:
    """One claim against itself and against what the guarantee states."""
    if claim["kind"] not in KINDS:
        raise ScheduleError(f"{place}: unknown kind '{claim['kind']}'; this version proves {', '.join(KINDS)}")
    if not claim["level"] > 0.0:
        raise ScheduleError(f"{place}: level {claim['level']} must be positive")
    if stated.get(claim["name"]) != claim["level"]:
        told = stated.get(claim["name"])
        raise ScheduleError(f"{place}: proves '{claim['name']}' at {claim['level']}, but the guarantee states {told}")
    if claim["kind"] not in ("sampled", "drops"):
        return
    if not 0.0 < claim["growth"] < claim["frozen_decay"]:
        raise ScheduleError(
            f"{place}: growth {claim['growth']} must lie between 0 and frozen_decay {claim['frozen_decay']}"
        )
    if claim["kind"] == "drops":
        if not falls_in_the_mean(claim, sample_time):
            raise ScheduleError(
                f"{place}: with drop probability {claim['level']} its own rates do not make V fall in the mean"
            )
    elif rational(claim["level"]) > rational(claim["frozen_decay"]) - rational(claim["growth"]):
        raise ScheduleError(f"{place}: level {claim['level']} exceeds frozen_decay - growth")
