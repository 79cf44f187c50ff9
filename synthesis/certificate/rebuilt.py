"""The plant of a schedule file from its formulas and constants, exactly; what is stored must be that, rounded to float64."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly_ctx

from estimators.errors import ScheduleError
from estimators.schedule.check import HIGHEST_ORDER, SHAPES
from synthesis.certificate.exact_fraction import MOST_WORK, ExactFraction, Work, common_denominator, numerator
from synthesis.errors import ModelError
from synthesis.loop.plant import Axis, Plant, by_cells
from synthesis.models.cells import cell_lines, on_cells
from synthesis.models.formula import parse, read, used
from synthesis.polynomials.chebyshev import to_chebyshev
from synthesis.polynomials.enclosure import PolynomialMatrix, constant
from synthesis.polynomials.quotient import least
from synthesis.polynomials.rational import as_float, decimal, rational

LAST_DIGIT = fmpq(1, 2**51)  # of the sum of an entry's coefficients: what rounding them to float64 can change
MOST_TEXT = 100_000  # characters of all formulas together
HALVINGS = 40  # towards the zero of a denominator, for the message


def rebuilt_plant(content: Mapping[str, Any], axes: tuple[Axis, ...], where: str, tied: bool) -> Plant:
    """The plant of formulas and constants in powers of u, over one common denominator that is positive on the range.

    The denominator is the least one, and one in the middle of the range. With tables the plant is a polynomial on each cell of
    their grid. Raises ScheduleError or ModelError where formulas cannot be read, where the denominator is not positive, for
    formulas that divide by a parameter or a table where there are tables, and (if `tied`) for constants and tables in no formula.
    """
    tables = content["model"].get("tables", {})
    entries = _entries(content, axes, where, tied)
    if not tables:
        _refuse_poles(entries, axes, where)
    try:
        common = common_denominator(list(entries.values()))
    except ModelError as error:
        raise ModelError(f"{where}: model.matrices: {error}") from None
    cells: dict[str, dict[tuple[int, ...], list[fmpq]]] = {key: {} for key in SHAPES}
    shapes = {key: _shape(content, key) for key in SHAPES}
    for (key, i, j), entry in entries.items():
        place, (rows, columns) = f"{where}: model.matrices.{key}[{i}][{j}]", shapes[key]
        try:
            above = numerator(entry, common)
        except ModelError as error:
            raise ModelError(f"{place}: {error}") from None
        for powers, coefficient in _powers(above, place).items():
            cells[key].setdefault(powers, [fmpq(0)] * (rows * columns))[i * columns + j] = coefficient
    count = len(axes) + len(tables)
    matrices = {
        key: PolynomialMatrix({powers: fmpq_mat(*shapes[key], entries) for powers, entries in found.items()},
                              shapes[key], count)
        for key, found in cells.items()
    }  # fmt: skip
    one = constant(fmpq_mat([[1]]), len(axes))
    if not tables:
        below = one if common is None else _scalar(common, f"{where}: model.matrices: denominator")
        return Plant(axes, matrices, below)
    if common is not None:
        raise ModelError(f"{where}: model.matrices: a formula divides by a parameter or a table; with tables none may")
    lines = cell_lines(
        tables.values(), [(p["name"], float(p["min"]), float(p["max"])) for p in content["scheduling"]], where
    )
    found = on_cells(list(tables.values()), [axis.name for axis in axes], lines, matrices, where)
    if any(max(m.degrees) > HIGHEST_ORDER for _, _, piece in found for m in piece.values()):
        raise ModelError(
            f"{where}: model.matrices: a power above {HIGHEST_ORDER} of a scheduling parameter, with tables put in"
        )
    return by_cells(axes, tuple(tuple(decimal(x) for x in line) for line in lines), [m for _, _, m in found])


def _refuse_poles(entries: Mapping[tuple[str, int, int], ExactFraction], axes: tuple[Axis, ...], where: str) -> None:
    """Raise ModelError for an entry whose denominator is not shown to keep its sign on the whole range."""
    known: list[Any] = []
    for (key, i, j), entry in entries.items():
        if entry.below is None or entry.below in known:
            continue
        known.append(entry.below)
        place = f"{where}: model.matrices.{key}[{i}][{j}]"
        below = _scalar(entry.below, place)
        middle = below.at((fmpq(0),) * len(axes))[0, 0]
        below = below * (1 / middle) if middle != 0 else below
        found = least(below)
        if found.bound is None:
            values = (
                f"{axis.name} = {as_float(axis.middle + axis.half * u):.6g} {axis.unit}"
                for axis, u in zip(axes, _zero(below, found.place), strict=True)
            )
            raise ModelError(
                f"{place}: divides by zero inside the range, at or near {', '.join(values)}; shrink the range"
            )


def _zero(below: PolynomialMatrix, place: tuple[fmpq, ...]) -> list[fmpq]:
    """From the middle of the range, where it is positive, towards a place where it is not: where it vanishes in between."""
    low, high = fmpq(0), fmpq(1)
    for _ in range(HALVINGS if below.at(place)[0, 0] < 0 else 0):
        share = (low + high) / 2
        low, high = (share, high) if below.at([share * u for u in place])[0, 0] > 0 else (low, share)
    return [high * u for u in place]


def check_stored_plant(stored: Mapping[str, Any], plant: Plant, where: str) -> None:
    """The stored float64 coefficients are the exact ones, rounded. Raises ScheduleError naming the entry."""
    if bool(plant.pieces) != ("cells" in stored):
        raise ScheduleError(
            f"{where}: plant: is {'one polynomial' if plant.pieces else 'by cells'}, the model's tables say otherwise"
        )
    if plant.pieces:
        for i, (line, given) in enumerate(zip(plant.lines, stored["breakpoints"], strict=True)):
            if [decimal(x) for x in given] != list(line):
                raise ScheduleError(
                    f"{where}: plant.breakpoints[{i}]: are not the ends and the breakpoints of the tables between"
                )
        for k, (offset, factor, piece) in enumerate(plant.cells):
            for key, matrix in piece.matrices.items():
                _check_stored(
                    stored["cells"][k][key], matrix.affine(offset, factor), f"{where}: plant.cells[{k}].{key}"
                )
        return
    for key, matrix in plant.matrices.items():
        _check_stored(stored[key], matrix, f"{where}: plant.{key}")
    place = f"{where}: plant.denominator"
    if plant.is_polynomial:
        if "denominator" in stored:
            raise ScheduleError(f"{place}: the formulas divide by no scheduling parameter; leave it out")
        return
    if "denominator" not in stored:
        raise ScheduleError(f"{place}: is missing; the formulas divide by a scheduling parameter")
    _check_stored(stored["denominator"], plant.denominator, place)


def _entries(
    content: Mapping[str, Any], axes: tuple[Axis, ...], where: str, tied: bool
) -> dict[tuple[str, int, int], ExactFraction]:
    """Every entry of every matrix, reduced, in the scaled parameters and the tables as they are."""
    model = content["model"]
    tables = model.get("tables", {})
    context = fmpq_mpoly_ctx.get(tuple(f"u{i}" for i in range(len(axes) + len(tables))), "lex")
    if sum(len(text) for rows in model["matrices"].values() for row in rows for text in row) > MOST_TEXT:
        raise ScheduleError(f"{where}: model.matrices: formulas of more than {MOST_TEXT} characters together")
    work = Work(MOST_WORK)
    values = {
        axis.name: ExactFraction(context.gens()[i] * axis.half + axis.middle, work) for i, axis in enumerate(axes)
    }
    for index, name in enumerate(tables, len(axes)):
        if name in values:
            raise ScheduleError(f"{where}: model.tables.{name}: is the name of a scheduling parameter, too")
        values[name] = ExactFraction(context.gens()[index], work)
    for name, entry in model["constants"].items():
        if name in values:
            raise ScheduleError(
                f"{where}: model.constants.{name}: is the name of a scheduling parameter or a table, too"
            )
        values[name] = ExactFraction(context.constant(decimal(entry["value"])), work)
    mentioned: set[str] = set()
    found = {}
    for key, rows in model["matrices"].items():
        for i, row in enumerate(rows):
            for j, text in enumerate(row):
                place = f"{where}: model.matrices.{key}[{i}][{j}]"
                tree = parse(text, place)
                mentioned |= used(tree)
                number = lambda x: ExactFraction(context.constant(fmpq(x.numerator, x.denominator)), work)  # noqa: E731
                try:
                    found[key, i, j] = read(tree, text.strip(), values, number, place).reduced
                except ModelError as error:
                    words = str(error)
                    raise ModelError(words if words.startswith(where) else f"{place}: {words}") from None
                _powers(found[key, i, j].above, place)
    for kind in ("constants", "tables"):
        idle = sorted(set(model.get(kind, ())) - mentioned)
        if idle and tied:
            raise ScheduleError(
                f"{where}: model.{kind}.{idle[0]}: appears in no formula; what it says is tied to nothing"
            )
    return found


def _scalar(polynomial: Any, place: str) -> PolynomialMatrix:
    """A polynomial as a 1 x 1 matrix."""
    terms = {powers: fmpq_mat([[c]]) for powers, c in _powers(polynomial, place).items()}
    count = len(polynomial.context().gens())
    return PolynomialMatrix(terms, (1, 1), count)


def _powers(polynomial: Any, place: str) -> dict[tuple[int, ...], fmpq]:
    """Coefficients by their powers of u."""
    found: dict[tuple[int, ...], fmpq] = polynomial.to_dict()
    if any(max(powers, default=0) > HIGHEST_ORDER for powers in found):
        raise ModelError(f"{place}: has a power above {HIGHEST_ORDER} of a scheduling parameter")
    return found


def _shape(content: Mapping[str, Any], key: str) -> tuple[int, int]:
    above, beside = SHAPES[key]
    return len(content["model"][above]), len(content["model"][beside])


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
                        f"{place}: entry [{i}][{j}] of order {list(orders)} is {as_float(is_):.17g}, "
                        f"the formula and the constants give {as_float(target):.17g}"
                    )
