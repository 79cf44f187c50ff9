"""From the content of a schedule file to the loop that it is about: everything rebuilt from formulas, constants and the table.

The plant that the runtime uses (Chebyshev coefficients in float64) must be the plant of the formulas, to the last digit that
float64 can hold; units must fit; every constant must matter. Then loop and claims are data about one and the same thing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

from flint import fmpq_mat

from estimators.errors import ScheduleError
from estimators.schedule.check import SIGNALS
from estimators.schedule.gain_signals import gain_signals
from estimators.schedule.upgrade import UNTIED
from synthesis.certificate.claims import KINDS, KINDS_OF, UPDATE_OF, WITH_CHANNEL, Claim, ClaimChannel
from synthesis.certificate.rebuilt import check_stored_plant, rebuilt_plant
from synthesis.certificate.units import check_dimensions
from synthesis.certificate.verify import Names
from synthesis.errors import ModelError, ProblemError
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.observer import ObserverLoop
from synthesis.loop.plant import Axis
from synthesis.models.constraint import ParameterConstraint, half_spaces_of
from synthesis.models.param import check_unit
from synthesis.polynomials.chebyshev import from_chebyshev
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.half_spaces import HalfSpaces
from synthesis.polynomials.rational import decimal

MOST_PARAMETERS = 3  # of a proof: polynomials of order 8 in more of them have too many terms
MOST_DENSE = 1100  # terms of P one sample later, in parameters and rates, if none is left out


@dataclass(frozen=True)
class Subject:
    """What the claims of a file are about. `tied` is false for files of format 1, whose constants and units are mere words."""

    loop: ObserverLoop | FeedbackLoop
    names: Names
    units: Mapping[str, str]
    tied: bool


def subject_of(content: Mapping[str, Any], where: str) -> Subject:
    """The loop of a checked content (`estimators.schedule.check_content`).

    Raises ScheduleError if plant, formulas, constants or units do not agree.
    """
    model = content["model"]
    axes = tuple(
        Axis(
            p["name"],
            p["unit"],
            decimal(p["min"]),
            decimal(p["max"]),
            *(None if p[key] is None else decimal(p[key]) for key in ("rate_min", "rate_max")),
        )
        for p in content["scheduling"]
    )
    if len(axes) > MOST_PARAMETERS:
        raise ScheduleError(
            f"{where}: scheduling: {len(axes)} parameters; proofs are made over {MOST_PARAMETERS} at most"
        )
    tied = not model["source"].startswith(UNTIED)
    try:
        plant = rebuilt_plant(content, axes, where, tied)
        if tied:
            check_dimensions(model, content["scheduling"], where)
        else:  # words only, but still units: they are printed
            for named in (*(signal for kind in SIGNALS for signal in model[kind]), *content["scheduling"]):
                check_unit(named["unit"], f"{where}: unit of {named['name']}")
    except ModelError as error:
        raise ScheduleError(str(error)) from None
    check_stored_plant(content["plant"], plant, where)
    plant = replace(plant, half_spaces=_half_spaces(content, axes, where))
    table = {}
    counts = [len(p["breakpoints"]) for p in content["scheduling"]]
    shape = tuple(len(signals) for signals in gain_signals(content))
    for index in _indices(counts):
        rows = content["gain"]["table"]
        for i in index:
            rows = rows[i]
        table[index] = fmpq_mat(*shape, [decimal(number) for row in rows for number in row])
    breakpoints = tuple(tuple(decimal(value) for value in p["breakpoints"]) for p in content["scheduling"])
    units = {s["name"]: s["unit"] for kind in SIGNALS for s in model[kind]}
    signals = {kind: tuple(s["name"] for s in model[kind]) for kind in SIGNALS}
    update = content["update"]
    period = decimal(update["sample_time"])
    if update["kind"] != "feedback":
        loop = ObserverLoop(plant, breakpoints, table, update["kind"], period)
        return Subject(loop, Names(signals["states"], signals["disturbances"]), units, tied)
    try:
        law = FeedbackLoop(plant, breakpoints, table, update["measured"], update["order"], period)
    except ProblemError as error:
        raise ScheduleError(f"{where}: gain.table: {error}") from None
    shown = signals["states"] + signals["outputs"] + signals["inputs"]
    return Subject(law, Names(signals["states"], signals["disturbances"], shown), units, tied)


def _half_spaces(content: Mapping[str, Any], axes: tuple[Axis, ...], where: str) -> HalfSpaces:
    """The constraints between the parameters. Raises ScheduleError for a set without interior, or that is the box."""
    entries = content["constraints"]["inequalities"] if "constraints" in content else ()
    try:
        constraints = [ParameterConstraint(e["coefficients"], e["max"], e["unit"]) for e in entries]
        return half_spaces_of([(a.name, a.low, a.high) for a in axes], constraints, f"{where}: constraints")
    except ModelError as error:
        words = str(error)
        raise ScheduleError(words if words.startswith(where) else f"{where}: constraints: {words}") from None


def claims_of(content: Mapping[str, Any], subject: Subject, where: str) -> list[Claim]:
    """The claims as data; raises ScheduleError for one that cannot be about this loop."""
    update, found = content["update"]["kind"], []
    for index, claim in enumerate(content["claims"]):
        place, kind = f"{where}: claims[{index}]", claim["kind"]
        if kind not in KINDS_OF[update]:
            known = ", ".join(KINDS_OF[update])
            what = f"says nothing about the update '{update}'" if kind in KINDS else "is no kind of claim"
            raise ScheduleError(f"{place}: '{kind}' {what}; kinds: {known}")
        if (kind in WITH_CHANNEL) != ("channel" in claim):
            raise ScheduleError(
                f"{place}: a claim of the kind '{kind}' needs {'a' if kind in WITH_CHANNEL else 'no'} channel"
            )
        if (kind == "sampled disc") != ("centre" in claim):
            raise ScheduleError(
                f"{place}: a claim of the kind '{kind}' needs {'a' if kind == 'sampled disc' else 'no'} centre"
            )
        if kind == "drop probability" and not claim["level"] < 1.0:
            raise ScheduleError(f"{place}: a probability lies below 1, not at {claim['level']:g}")
        channel = None
        if "channel" in claim:
            errors = claim["channel"]["errors"]
            sizes = tuple(errors.values()) if isinstance(errors, Mapping) else ()
            channel = ClaimChannel(dict(claim["channel"]["inputs"]), tuple(errors), sizes)
            group = subject.names.disturbances if WITH_CHANNEL[kind] == "disturbances" else subject.names.states
            for names, known_names in ((channel.inputs, group), (channel.errors, subject.names.errors)):
                for name in names:
                    if name not in known_names:
                        raise ScheduleError(f"{place}.channel: '{name}' is none of {', '.join(known_names)}")
        P = _lyapunov(claim["P"], subject, f"{place}.P")
        found.append(Claim(kind, claim["level"], from_chebyshev(P), channel, claim.get("centre")))
    said = [(c.kind, repr(c.channel), c.centre) for c in found]
    if len(set(said)) < len(said):
        raise ScheduleError(f"{where}: claims: one thing is claimed twice")
    if not any(claim.kind == UPDATE_OF[update] for claim in found):
        raise ScheduleError(f"{where}: claims: none about the update that the runtime performs ('{UPDATE_OF[update]}')")
    return found


def _lyapunov(stored: Mapping[str, Any], subject: Subject, place: str) -> PolynomialMatrix:
    """P as it is written; raises ScheduleError for one that proves nothing."""
    axes = subject.loop.plant.axes
    P = stored_polynomial(stored, len(axes), (subject.loop.states,) * 2)
    if prod((degree + 1) ** 2 for degree in P.degrees) > MOST_DENSE:
        raise ScheduleError(f"{place}: orders {list(P.degrees)} are too high for {P.variables} parameters")
    jumping = [axis.name for axis, degree in zip(axes, P.degrees, strict=True) if axis.may_jump and degree]
    if jumping:
        raise ScheduleError(f"{place}: depends on {jumping[0]}, which may jump; it proves nothing")
    if any(m != m.transpose() for m in P.terms.values()):
        raise ScheduleError(f"{place}: not symmetric; it proves nothing")
    return P


def stored_polynomial(stored: Mapping[str, Any], parameters: int, shape: tuple[int, int]) -> PolynomialMatrix:
    """Chebyshev coefficients by their orders, exactly as they are written."""
    terms = {
        tuple(orders): fmpq_mat(*shape, [decimal(number) for row in matrix for number in row])
        for orders, matrix in zip(stored["orders"], stored["coefficients"], strict=True)
    }
    return PolynomialMatrix(terms, shape, parameters)


def _indices(counts: Sequence[int]) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = [()]
    for count in counts:
        found = [(*index, i) for index in found for i in range(count)]
    return found
