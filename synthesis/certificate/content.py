"""From the content of a schedule file to the loop that it is about: everything rebuilt from formulas, constants and the table.

The plant that the runtime uses (Chebyshev coefficients in float64) must be the plant of the formulas, to the last digit that
float64 can hold; units must fit; every constant must matter. Then loop and claims are data about one and the same thing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import prod
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly_ctx

from estimators.errors import ScheduleError
from estimators.schedule.check import HIGHEST_ORDER, SHAPES, SIGNALS
from estimators.schedule.gain_signals import gain_signals
from estimators.schedule.upgrade import UNTIED
from synthesis.certificate.claims import KINDS, KINDS_OF, UPDATE_OF, WITH_CHANNEL, Claim, ClaimChannel
from synthesis.certificate.units import check_dimensions
from synthesis.certificate.verify import Names
from synthesis.errors import ModelError, ProblemError
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.observer import ObserverLoop
from synthesis.loop.plant import Axis, Plant
from synthesis.models.formula import parse, read, used
from synthesis.models.param import check_unit
from synthesis.polynomials.chebyshev import from_chebyshev, to_chebyshev
from synthesis.polynomials.enclosure import PolynomialMatrix, identity
from synthesis.polynomials.rational import decimal, rational

LAST_DIGIT = fmpq(1, 2**51)  # of the sum of an entry's coefficients: what rounding them to float64 can change
MOST_TERMS, MOST_BITS, MOST_DEGREE = 2000, 20_000, 2 * HIGHEST_ORDER  # of what a formula multiplies out to on its way
MOST_PARAMETERS = 3  # of a proof: polynomials of order 8 in more of them have too many terms
MOST_DENSE = 1100  # terms of P one sample later, in parameters and rates, if none is left out
MOST_WORK = 400_000  # products of terms, those of many digits counted by their length, in all formulas together
MOST_TEXT = 100_000  # characters of all formulas together


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
        plant = Plant(axes, _rebuilt(content, axes, where, tied), identity(1, len(axes)))
        if tied:
            check_dimensions(model, content["scheduling"], where)
        else:  # words only, but still units: they are printed
            for named in (*(signal for kind in SIGNALS for signal in model[kind]), *content["scheduling"]):
                check_unit(named["unit"], f"{where}: unit of {named['name']}")
    except ModelError as error:
        raise ScheduleError(str(error)) from None
    for key, matrix in plant.matrices.items():
        _check_stored(content["plant"][key], matrix, f"{where}: plant.{key}")
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
        found.append(Claim(kind, claim["level"], from_chebyshev(P), channel))
    said = [(c.kind, repr(c.channel)) for c in found]
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


def _rebuilt(content: Mapping[str, Any], axes: tuple[Axis, ...], where: str, tied: bool) -> dict[str, PolynomialMatrix]:
    """The matrices from formulas and constants, exactly, in powers of u."""
    model = content["model"]
    context = fmpq_mpoly_ctx.get(tuple(f"u{i}" for i in range(len(axes))), "lex")
    if sum(len(text) for rows in model["matrices"].values() for row in rows for text in row) > MOST_TEXT:
        raise ScheduleError(f"{where}: model.matrices: formulas of more than {MOST_TEXT} characters together")
    work = Work(MOST_WORK)
    values = {
        axis.name: ExactPolynomial(context.gens()[i] * axis.half + axis.middle, work) for i, axis in enumerate(axes)
    }
    for name, constant in model["constants"].items():
        if name in values:
            raise ScheduleError(f"{where}: model.constants.{name}: is the name of a scheduling parameter, too")
        values[name] = ExactPolynomial(context.constant(decimal(constant["value"])), work)
    mentioned: set[str] = set()
    matrices = {}
    for key, rows in model["matrices"].items():
        shape = _shape(content, key)
        cells: dict[tuple[int, ...], list[fmpq]] = {}
        for i, row in enumerate(rows):
            for j, text in enumerate(row):
                place = f"{where}: model.matrices.{key}[{i}][{j}]"
                tree = parse(text, place)
                mentioned |= used(tree)
                number = lambda x: ExactPolynomial(context.constant(fmpq(x.numerator, x.denominator)), work)  # noqa: E731
                try:
                    entry = read(tree, text.strip(), values, number, place)
                except ModelError as error:
                    words = str(error)
                    raise ModelError(words if words.startswith(where) else f"{place}: {words}") from None
                for powers, coefficient in entry.value.to_dict().items():
                    if max(powers, default=0) > HIGHEST_ORDER:
                        raise ModelError(f"{place}: has a power above {HIGHEST_ORDER} of a scheduling parameter")
                    cells.setdefault(powers, [fmpq(0)] * (shape[0] * shape[1]))[i * shape[1] + j] = coefficient
        terms = {powers: fmpq_mat(*shape, entries) for powers, entries in cells.items()}
        matrices[key] = PolynomialMatrix(terms, shape, len(axes))
    idle = sorted(set(model["constants"]) - mentioned)
    if idle and tied:
        raise ScheduleError(
            f"{where}: model.constants.{idle[0]}: appears in no formula; what it says is tied to nothing"
        )
    return matrices


def _shape(content: Mapping[str, Any], key: str) -> tuple[int, int]:
    above, beside = SHAPES[key]
    return len(content["model"][above]), len(content["model"][beside])


@dataclass
class Work:
    """What is left to be worked out for one file."""

    left: int

    def spend(self, amount: int) -> None:
        """Refuse what would take too long."""
        self.left -= amount
        if self.left < 0:
            raise ModelError("the formulas up to here multiply out to too much work")


@dataclass(frozen=True)
class ExactPolynomial:
    """A polynomial with rational coefficients that refuses to grow without bound while a formula is read."""

    value: Any  # fmpq_mpoly
    work: Work

    def __add__(self, other: ExactPolynomial) -> ExactPolynomial:
        return self._small(self.value + other.value)

    def __sub__(self, other: ExactPolynomial) -> ExactPolynomial:
        return self._small(self.value - other.value)

    def __mul__(self, other: ExactPolynomial) -> ExactPolynomial:
        products = len(self.value) * len(other.value)
        self.work.spend(products)
        found = self.value * other.value
        self.work.spend(products * (_bits(found) // 1000))
        return self._small(found)

    def __truediv__(self, other: ExactPolynomial) -> ExactPolynomial:
        if not other.value.is_constant():
            raise ModelError("divides by a scheduling parameter; schedule files hold polynomial plants")
        below = other.value.leading_coefficient() if len(other.value) else fmpq(0)
        if below == 0:
            raise ZeroDivisionError
        return self._small(self.value * (1 / below))

    def _small(self, value: Any) -> ExactPolynomial:
        self.work.spend(1 + len(value))
        if len(value) > MOST_TERMS or _bits(value) > MOST_BITS or max(value.degrees(), default=0) > MOST_DEGREE:
            raise ModelError("the formula multiplies out to too many terms or digits")
        return ExactPolynomial(value, self.work)


def _bits(value: Any) -> int:
    return max((c.numer().bit_length() + c.denom().bit_length() for c in value.coeffs()), default=0)


def _check_stored(stored: Mapping[str, Any], exact: PolynomialMatrix, place: str) -> None:
    """The stored float64 coefficients are the exact ones, rounded."""
    wanted = to_chebyshev(exact)
    given = {
        tuple(orders): fmpq_mat(*exact.shape, [rational(number) for row in matrix for number in row])
        for orders, matrix in zip(stored["orders"], stored["coefficients"], strict=True)
    }
    zero = fmpq_mat(*exact.shape, [fmpq(0)] * (exact.shape[0] * exact.shape[1]))
    for i in range(exact.shape[0]):
        for j in range(exact.shape[1]):
            size = sum((abs(m[i, j]) for m in wanted.terms.values()), fmpq(0))
            for orders in {*wanted.terms, *given}:
                target, is_ = wanted.terms.get(orders, zero)[i, j], given.get(orders, zero)[i, j]
                if abs(is_ - target) > size * LAST_DIGIT:
                    raise ScheduleError(
                        f"{place}: entry [{i}][{j}] of order {list(orders)} is {_float(is_):.17g}, "
                        f"the formula and the constants give {_float(target):.17g}"
                    )


def _float(number: fmpq) -> float:
    return float(Fraction(int(number.p), int(number.q)))
