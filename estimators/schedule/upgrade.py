"""Files of format 1 read as format 2: the same table and the same plant, its claims under the names of what they say.

Format 1 held the plant in powers of the parameter and no formulas: the formulas written here are those powers, so constants and
units of such a file are tied to nothing, and say so (`model.source`). Its `guarantee` is left behind: nothing in it is believed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from estimators.errors import ScheduleError, printable
from estimators.schedule.check import (
    HIGHEST_ORDER,
    MOST,
    MOST_CLAIMS,
    SCHEMA,
    SEALS,
    SHAPES,
    SIGNALS,
    check_content,
    check_depth,
)
from estimators.schedule.checker import Checker, quoted

FIRST_FORMAT = "gainsmith.schedule/1"
FIRST_SECTIONS = (
    *("schema", "name", "description", "model", "scheduling", "sample_time", "plant", "gain"),
    *("guarantee", "certificate", "provenance"),
)
UNTIED = "format 1, constants and units not tied to the plant: "
MOST_NUMBERS = 5000  # in plant and claims together: each is converted exactly, which takes its time
_KINDS = {
    "decay": "decay rate", "fastest pole": "fastest pole", "gain": "gain", "sampled": "internal update",
    "drops": "drop probability",
}  # fmt: skip
_FAULTS = (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError, ZeroDivisionError)

Powers = list[list[list[Fraction]]]  # coefficient matrices of 1, p, p^2, ...


def upgraded(content: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Unsealed content of format 2 from content of format 1.

    Raises:
        ScheduleError: something in it cannot be read, or would not be allowed in format 2.
    """
    check_depth(content, where)
    try:
        found = _converted(content, Checker(where))
    except ScheduleError:
        raise
    except _FAULTS as error:
        words = printable(f"{type(error).__name__}: {error}", 120)
        raise ScheduleError(f"{where}: not a whole file of format 1 ({words})") from None
    check_content(found, where)
    return found


def _converted(content: Mapping[str, Any], check: Checker) -> dict[str, Any]:
    check.keys(content, "", FIRST_SECTIONS, SEALS)
    (parameter,) = check.items(content["scheduling"], "scheduling", 1)
    check.keys(parameter, "scheduling[0]", ("name", "min", "max", "absolute"), closed=False)
    name = check.name(parameter["name"], "scheduling[0].name")
    low, high = (_decimal(check.number(parameter[key], f"scheduling[0].{key}")) for key in ("min", "max"))
    if not low < high:
        check.fail("scheduling[0].max", f"range [{float(low)}, {float(high)}] is empty or reversed")
    model = content["model"]
    check.keys(model, "model", ("id", "source", *SIGNALS, "constants"), closed=False)
    check.mapping(model["constants"], "model.constants")
    signals = {kind: _signals(check, model[kind], f"model.{kind}", MOST[kind]) for kind in SIGNALS}
    check.keys(content["plant"], "plant", ("abs", *SHAPES))
    if content["plant"]["abs"] != [name] * (parameter["absolute"] is True):
        check.fail("plant.abs", "does not agree with scheduling[0].absolute")
    convert = _Conversion(check, low, high)
    plant, formulas = {}, {}
    for key, (rows, columns) in SHAPES.items():
        shape = (len(signals[rows]), len(signals[columns]))
        powers = convert.powers(content["plant"][key], f"plant.{key}", shape)
        plant[key], formulas[key] = convert.chebyshev(powers, shape), _formulas(powers, name, shape)
    check.keys(content["gain"], "gain", ("unit", "dtype", "interpolation", "table"))
    check.mapping(content["certificate"], "certificate")
    claims = check.items(content["certificate"].get("claims", []), "certificate.claims", most=MOST_CLAIMS)
    return {
        "schema": SCHEMA,
        "name": content["name"],
        "description": content["description"],
        "model": {
            "id": model["id"],
            "source": UNTIED + check.text(model["source"], "model.source"),
            **signals,
            "constants": {key: _constant(check, entry, key) for key, entry in model["constants"].items()},
            "matrices": formulas,
        },
        "scheduling": content["scheduling"],
        "update": {"kind": "held", "sample_time": content["sample_time"]},
        "plant": plant,
        "gain": {key: content["gain"][key] for key in ("dtype", "interpolation", "table")},
        "claims": [_claim(convert, claim, f"certificate.claims[{i}]", signals) for i, claim in enumerate(claims)],
        "provenance": content["provenance"],
    }


def _signals(check: Checker, given: Any, place: str, most: int) -> list[dict[str, Any]]:
    found = []
    for index, signal in enumerate(check.items(given, place, most=most)):
        check.keys(signal, f"{place}[{index}]", ("name", "unit"), closed=False)
        found.append({"name": signal["name"], "unit": signal["unit"]})
    return found


def _constant(check: Checker, given: Any, name: Any) -> dict[str, Any]:
    check.keys(given, f"model.constants.{check.name(name, 'model.constants')}", ("value", "unit"), closed=False)
    return {"value": given["value"], "unit": given["unit"], "source": given.get("source", "")}


def _claim(convert: _Conversion, claim: Any, place: str, signals: Mapping[str, list[dict[str, Any]]]) -> dict[str, Any]:
    check, size = convert.check, len(signals["states"])
    check.keys(claim, place, ("kind", "level", "P"), closed=False)
    kind = claim["kind"]
    if not isinstance(kind, str) or kind not in _KINDS:
        check.fail(f"{place}.kind", f"{quoted(kind)} is not known; expected {', '.join(_KINDS)}")
    found: dict[str, Any] = {"kind": _KINDS[kind], "level": claim["level"]}
    if kind == "gain":
        check.keys(claim, place, ("disturbances", "errors"), closed=False)
        columns = check.items(claim["disturbances"], f"{place}.disturbances", len(signals["disturbances"]))
        weights = [check.items(row, f"{place}.disturbances[{i}]") for i, row in enumerate(columns)]
        inputs = [
            _single(check, column, signals["disturbances"], f"{place}.disturbances")
            for column in zip(*weights, strict=True)
        ]
        errors = [
            _single(check, row, signals["states"], f"{place}.errors")
            for row in check.items(claim["errors"], f"{place}.errors", most=size)
        ]
        if any(weight != 1 for _, weight in errors):
            check.fail(f"{place}.errors", "weighs its errors; format 2 weighs inputs only")
        if len(dict(inputs)) < len(inputs):
            check.fail(f"{place}.disturbances", "names one signal twice")
        found["channel"] = {"inputs": dict(inputs), "errors": [name for name, _ in errors]}
    powers = convert.powers(claim["P"], f"{place}.P", (size, size))
    return found | {"P": convert.chebyshev(powers, (size, size))}


def _single(check: Checker, weights: Any, signals: Sequence[Mapping[str, Any]], place: str) -> tuple[str, float]:
    """The one signal that a row of weights picks, and its weight."""
    numbers = [check.number(weight, place) for weight in check.items(weights, place, len(signals))]
    chosen = [(signal["name"], weight) for signal, weight in zip(signals, numbers, strict=True) if weight != 0]
    if len(chosen) != 1:
        check.fail(place, "mixes signals in one; format 2 cannot say that")
    return chosen[0]


class _Conversion:
    """From powers of p to Chebyshev polynomials of u = (p - middle)/half, exactly in the decimals that are written."""

    def __init__(self, check: Checker, low: Fraction, high: Fraction) -> None:
        self.check = check
        self.numbers = 0
        middle, half = (low + high) / 2, (high - low) / 2
        self.basis = [[Fraction(1)]]  # p^k in T_0(u) .. T_k(u)
        for _ in range(HIGHEST_ORDER):
            self.basis.append(_times(self.basis[-1], middle, half))

    def powers(self, stored: Any, place: str, shape: tuple[int, int]) -> Powers:
        """The coefficient matrices of {"monomials": [[0], [1]], "coefficients": [matrix, matrix]}."""
        check = self.check
        check.keys(stored, place, ("monomials", "coefficients"))
        found: list[int] = []
        for index, monomial in enumerate(
            check.items(stored["monomials"], f"{place}.monomials", most=HIGHEST_ORDER + 1)
        ):
            spot = f"{place}.monomials[{index}]"
            (power,) = check.items(monomial, spot, 1)
            if isinstance(power, bool) or not isinstance(power, int) or not 0 <= power <= HIGHEST_ORDER:
                check.fail(spot, f"powers are integers from 0 to {HIGHEST_ORDER}, got {quoted(power)}")
            if power in found:
                check.fail(spot, f"the power {power} appears twice")
            found.append(power)
        if not found:
            check.fail(f"{place}.monomials", "needs at least one")
        numbers = check.array(stored["coefficients"], f"{place}.coefficients", (len(found), *shape))
        self.numbers += len(numbers)
        if self.numbers > MOST_NUMBERS:
            check.fail(place, f"plant and claims hold more than {MOST_NUMBERS} numbers, as no file of format 1 did")
        rest = iter(numbers)
        powers = [[[Fraction(0)] * shape[1] for _ in range(shape[0])] for _ in range(max(found) + 1)]
        for power in found:
            powers[power] = [[_decimal(next(rest)) for _ in range(shape[1])] for _ in range(shape[0])]
        return powers

    def chebyshev(self, powers: Powers, shape: tuple[int, int]) -> dict[str, Any]:
        """The stored form of format 2, rounded once."""
        orders = range(len(powers))
        coefficients = [
            [
                [
                    float(sum((powers[k][i][j] * self.basis[k][order] for k in orders[order:]), Fraction(0)))
                    for j in range(shape[1])
                ]
                for i in range(shape[0])
            ]
            for order in orders
        ]
        return {"orders": [[order] for order in orders], "coefficients": coefficients}


def _decimal(number: float) -> Fraction:
    return Fraction(repr(number))


def _times(series: Sequence[Fraction], middle: Fraction, half: Fraction) -> list[Fraction]:
    """(middle + half u) times a Chebyshev series: u T_0 = T_1, 2 u T_k = T_k+1 + T_k-1."""
    out = [middle * c for c in series] + [Fraction(0)]
    for k, c in enumerate(series):
        if k == 0:
            out[1] += half * c
        else:
            out[k + 1] += half * c / 2
            out[k - 1] += half * c / 2
    return out


def _formulas(powers: Powers, name: str, shape: tuple[int, int]) -> list[list[str]]:
    """Sums of powers with the decimals that were written."""
    return [
        [
            " + ".join(
                f"({float(matrix[i][j])!r})" + f"*{name}**{power}" * (power > 0)
                for power, matrix in enumerate(powers)
                if matrix[i][j]
            )
            or "0"
            for j in range(shape[1])
        ]
        for i in range(shape[0])
    ]
