"""What a loop itself does where the parameters stand still: enough to refute a claim, whatever P was tried.

A constant parameter is one of the admissible motions, so a frozen pole, a static gain or a frozen second moment on the wrong side
of a claimed level refutes the claim. Signs are exact (`synthesis.polynomials.stable`); floats only choose where to look.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, product

import numpy as np
from flint import arb, arb_mat, fmpq, fmpq_mat, fmpq_poly

from synthesis.certificate.claims import ERROR_EQUATION, GAINS, Claim
from synthesis.certificate.poles import CONTINUOUS, DISCRETE, pole_outside
from synthesis.certificate.refute_energy import energy_exceeds, entries_of
from synthesis.certificate.verify import Verifier
from synthesis.loop.loop import Loop
from synthesis.loop.plant import Plant
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials.definite import is_positive_definite
from synthesis.polynomials.enclosure import Entries, PolynomialMatrix
from synthesis.polynomials.half_spaces import corners_of
from synthesis.polynomials.rational import Matrix, decimal, multiply, transpose
from synthesis.polynomials.stable import is_hurwitz, is_schur

Point = tuple[fmpq, ...]
PARTS = 8  # of every cell, along every parameter, but 1 to 2 where a table has many cells
MOST_POINTS = 500
CLIMBS, HALVINGS = 2, 12  # places from which an unstable pole is sought between grid points, and halvings of the step
MOST_STATES = 4  # for the second moment, whose matrix has the square of the size


def refuting_place(verifier: Verifier, claim: Claim, first: Iterable[Point] = ()) -> Point | None:
    """Scaled parameters u of the set at which the frozen loop certainly breaks the claim; `first` are tried before a grid."""
    time: Time = "continuous" if claim.kind in ERROR_EQUATION else "discrete"
    count = len(verifier.loop.plant.axes)
    plant = verifier.loop.plant
    for number, point in enumerate([*(place[:count] for place in first), *grid(verifier.loop)]):
        if number > MOST_POINTS:
            break
        if not plant.admits(point):
            continue
        system = verifier.loop.system(_standing(point), time)
        if system is not None and _breaks(verifier, claim, system):
            return point
    return None


def unstable_place(loop: Loop, decay_rate: fmpq, first: Iterable[Point] = ()) -> Point | None:
    """Where the frozen error equation has a pole that is not left of -decay_rate, exactly; None if nowhere looked at."""
    ranked = sorted(dict.fromkeys(grid(loop)), key=lambda point: -_slowest(loop, point))
    climbed = (_climbed(loop, point) for point in ranked[:CLIMBS])
    for point in filter(loop.plant.admits, chain(first, ranked[:8], climbed)):
        system = loop.system(_standing(point), "continuous")
        if system is not None and is_hurwitz(_shifted(_frozen(system), decay_rate)) is False:
            return point
    return None


def _climbed(loop: Loop, point: Point) -> Point:
    """A place near by with a pole further right, by steps that are halved: what is unstable may lie between grid points."""
    height, step = _slowest(loop, point), fmpq(1, PARTS)
    for _ in range(HALVINGS):
        for axis, sign in product(range(len(point)), (-1, 1)):
            moved = min(max(point[axis] + sign * step, fmpq(-1)), fmpq(1))
            there = (*point[:axis], moved, *point[axis + 1 :])
            if loop.plant.admits(there) and (higher := _slowest(loop, there)) > height:
                point, height = there, higher
        step = step / 2
    return point


def undetectable_place(plant: Plant, parts: int = 8) -> Point | None:
    """Where a mode that is not stable does not show in the output, the parameters standing still; exact.

    Looked for on a grid and, with one parameter, wherever in the range the observability matrix loses rank at a rational number.
    """
    lines = [[fmpq(2 * k - parts, parts) for k in range(parts + 1)]] * len(plant.axes)
    for offset, factor, piece in plant.cells:
        inside = [
            tuple(o + f * x for o, f, x in zip(offset, factor, local, strict=True))
            for local in (product(*lines) if not plant.pieces else product((-1, 0, 1), repeat=len(lines)))
        ]
        for number, point in enumerate(chain(_corners(plant) if not plant.pieces else (), inside, _hiding(piece))):
            if number > MOST_POINTS:
                break
            in_cell = all(abs(u - o) <= f for u, o, f in zip(point, offset, factor, strict=True))
            if not in_cell or not plant.admits(point):
                continue
            A, C = (piece.matrices[key].at(point) for key in "AC")
            below = piece.denominator.at(point)[0, 0]
            hidden = _hidden(A * (1 / below), C)
            if hidden is not None and is_hurwitz(hidden) is False:
                return point
    return None


def _hiding(plant: Plant) -> Iterator[Point]:
    """Rational zeros of det(O'O) in the range, O = [C; C A; C A^2; ..]; a positive denominator does not change its rank."""
    if len(plant.axes) != 1 or plant.states > MOST_STATES:
        return
    A, C = (_in_one_variable(plant.matrices[key]) for key in "AC")
    rows, power = list(C), C
    for _ in range(plant.states - 1):
        power = multiply(power, A)
        rows += power
    size = _determinant(multiply(transpose(rows), rows))
    for root, _ in size.roots() if size.degree() > 0 else ():
        if abs(root) <= 1:
            yield (root,)


def _in_one_variable(matrix: PolynomialMatrix) -> Matrix:
    rows, columns = matrix.shape
    powers = range(matrix.degrees[0] + 1)
    return [
        [fmpq_poly([matrix.terms[k,][i, j] if (k,) in matrix.terms else 0 for k in powers]) for j in range(columns)]
        for i in range(rows)
    ]


def _determinant(matrix: Matrix) -> fmpq_poly:
    if not matrix:
        return fmpq_poly([1])
    minors = ([row[1:] for k, row in enumerate(matrix) if k != i] for i in range(len(matrix)))
    terms = (row[0] * _determinant(rest) * (-1) ** i for i, (row, rest) in enumerate(zip(matrix, minors, strict=True)))
    return sum(terms, fmpq_poly([0]))


def grid(loop: Loop) -> Iterator[Point]:
    """Points of every cell that are in the set, the corners of cells and set among them."""
    yield from _corners(loop.plant)
    cells = list(loop.cells())
    count = len(loop.plant.axes)
    parts = next((n for n in (PARTS, 4, 2) if len(cells) * n**count <= 2 * MOST_POINTS), 1) if count > 1 else PARTS
    for cell in cells:
        steps = [[fmpq(2 * k - parts, parts) for k in range(parts + 1)]] * count
        for local in product(*steps):
            point = cell.point((*local, *(0,) * count))[:count]
            if loop.plant.admits(point):
                yield point


def _corners(plant: Plant) -> list[Point]:
    """Those that inequalities between the parameters make."""
    count = len(plant.axes)
    return corners_of((fmpq(0),) * count, (fmpq(1),) * count, plant.half_spaces) if plant.half_spaces else []


def _standing(point: Point) -> Region:
    return Region((*point, *(fmpq(0),) * len(point)), (fmpq(0),) * (2 * len(point)))


def _frozen(system: System) -> Entries:
    matrix = entries_of(system.A)
    return matrix if system.denominator is None else matrix * (1 / entries_of(system.denominator)[0, 0])


def _shifted(matrix: Entries, rate: fmpq | arb) -> Entries:
    n = matrix.nrows()
    return matrix + arb_mat(n, n, [rate if i == j else 0 for i in range(n) for j in range(n)])


def _slowest(loop: Loop, point: Point) -> float:
    system = loop.system(_standing(point), "continuous")
    if system is None:
        return -np.inf
    n = system.A.shape[0]
    return float(
        np.linalg.eigvals(np.array([float(x.mid()) for x in _frozen(system).entries()]).reshape(n, n)).real.max()
    )


def _breaks(verifier: Verifier, claim: Claim, system: System) -> bool:
    A, level = _frozen(system), decimal(claim.level)
    if claim.kind == "decay rate":
        return is_hurwitz(_shifted(A, level)) is False
    if claim.kind == "fastest pole":
        return is_hurwitz(_shifted(A * -1, -level)) is False
    if claim.kind in (*CONTINUOUS, *DISCRETE):
        A = A if claim.centre is None else _shifted(A, -decimal(claim.centre))
        return pole_outside(claim.kind, level, verifier.loop.sample_time, A)
    if claim.channel is not None and claim.kind not in GAINS:
        stable = is_hurwitz(A) if system.time == "continuous" else is_schur(A)
        return stable is False or energy_exceeds(verifier.question(claim), system)
    if system.time == "continuous":
        return is_hurwitz(A) is False or _static_gain_exceeds(verifier, claim, system, A * -1)
    if claim.channel is not None:
        n = A.nrows()
        rest = arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)]) - A
        return is_schur(A) is False or _static_gain_exceeds(verifier, claim, system, rest)
    period = verifier.loop.sample_time
    if claim.kind != "drop probability":
        return is_schur(A * arb(level * period).exp()) is False
    if A.nrows() > MOST_STATES:
        return False
    received, lost = (_kronecker(matrix) for matrix in (A, entries_of(system.coasting)))
    return is_schur(received * (1 - level) + lost * level) is False


def _static_gain_exceeds(verifier: Verifier, claim: Claim, system: System, rest: Entries) -> bool:
    """The gain at frequency zero, Z (C rest^-1 B + D) W, certainly has a singular value above the level."""
    question = verifier.question(claim)
    Z, W = arb_mat(question.Z), arb_mat(question.W)
    try:
        states = rest.solve(entries_of(system.B[question.group]) * W)
    except ZeroDivisionError:
        return False
    below = arb(1) if system.denominator is None else entries_of(system.denominator)[0, 0]
    response = Z * (entries_of(system.C) * states * (1 / below) + entries_of(system.D[question.group]) * W)
    if system.shared:
        response = response * (1 / below)
    size = response.nrows()
    level = arb_mat(size, size, [question.level**2 if i == j else 0 for i in range(size) for j in range(size)])
    return is_positive_definite(level - response * response.transpose()) is False


def _kronecker(matrix: Entries) -> Entries:
    rows = matrix.tolist()
    n = len(rows)
    return arb_mat(
        n * n, n * n, [rows[i][k] * rows[j][m] for i in range(n) for j in range(n) for k in range(n) for m in range(n)]
    )


def _hidden(A: fmpq_mat, C: fmpq_mat) -> fmpq_mat | None:
    """A on the largest invariant subspace in the kernel of C; None if that is {0}."""
    n = A.nrows()
    rows, power = C.tolist(), C
    for _ in range(n - 1):
        power = power * A
        rows += power.tolist()
    reduced, rank = fmpq_mat(rows).rref()
    if rank == n:
        return None
    pivots = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
    free = [j for j in range(n) if j not in pivots]
    basis = fmpq_mat(n, len(free), [fmpq(0)] * (n * len(free)))
    for k, j in enumerate(free):
        basis[j, k] = fmpq(1)
        for i, pivot in enumerate(pivots):
            basis[pivot, k] = -reduced[i, j]
    moved = A * basis  # = basis X, and the free rows of the basis are a unit matrix
    return fmpq_mat([[moved[j, k] for k in range(len(free))] for j in free])
