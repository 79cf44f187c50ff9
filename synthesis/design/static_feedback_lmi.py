"""The inequalities of one step of `synthesis.design.static_feedback`: for P and a given K, or for both near a given pair."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from synthesis.design.generalised_plant import ChannelPlant, GeneralisedPlant
from synthesis.design.norms import ChannelSizes, after_impulses
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult
from synthesis.polynomials.matrix import MatrixPolynomial, across, symmetric_block

HALF = 0.5**0.5
SQUARE_OF_WEIGHT = (0.1, 1e3)  # of U against V, where one of both is next to nothing

Pair = Callable[[MatrixPolynomial, MatrixPolynomial], tuple[MatrixPolynomial, MatrixPolynomial]]


@dataclass(frozen=True)
class Point:
    """P and K as known polynomials, in the coordinates of the plant."""

    P: MatrixPolynomial
    K: MatrixPolynomial


@dataclass(frozen=True)
class Structure:
    """Which entries of K may be other than zero (nu, ny), and the degree of each in the parameters."""

    entries: FloatArray
    degree: int


class StaticLoop:
    """A problem in P, with K given (`at` None) or unknown near the pair `at`; time in units of 1/clock s.

    Of a rational plant B K C is over the square of its denominator, and so is every inequality. Of a plant by cells one loop is
    made for each (`LmiProblem.on_cell`); all share P and K of the `first`.
    """

    def __init__(
        self,
        problem: LmiProblem,
        plant: GeneralisedPlant,
        clock: float,
        degree: int,
        gain: MatrixPolynomial | Structure,
        at: Point | None = None,
        first: StaticLoop | None = None,
    ) -> None:
        self.problem = problem
        self.at = None if at is None else Point(problem.here(at.P), problem.here(at.K))
        self.A, self.B, self.C = (self._known(getattr(plant, key)) for key in "ABC")  # numerators
        denominator = self._known(plant.denominator)
        self.below = denominator if any(denominator.degrees) else None
        if first is None:
            degrees = tuple(0 if p.may_jump else degree for p in problem.parameters)
            P = problem.symmetric("P", self.A.shape[0], degrees)
            self.whole = Point(P, self._unknown(gain) if isinstance(gain, Structure) else gain)
        else:
            self.whole = first.whole
        self.P, self.K = problem.here(self.whole.P), problem.here(self.whole.K)
        product, moved = self.P @ self._over(self.A), problem.here(problem.time_derivative(self.whole.P))
        self.rate = product + product.T + self._over(moved, 2) * (1.0 / clock)
        problem.require("P > 0", self.P)

    def _known(self, coefficients: FloatArray) -> MatrixPolynomial:
        return self.problem.here(self.problem.scaled(coefficients))

    def require_gain(self, part: ChannelPlant, level: MatrixPolynomial) -> None:
        """The L2 gain of a channel."""
        E, F, Cz, Dzd, Dzu = (self._known(getattr(part, key)) for key in ("E", "F", "Cz", "Dzd", "Dzu"))
        outputs, direct = self._over(Cz) + Dzu @ self.K @ self.C, self._over(Dzd) + Dzu @ self.K @ F
        level = self._over(level, 2)
        w, z = (self.problem.constant(np.eye(size)).scaled_by(level) for size in (E.shape[1], Cz.shape[0]))
        force = self.P @ self._over(E)
        own = symmetric_block([[self.rate, force, outputs.T], [None, -w, direct.T], [None, None, -z]])
        n, seen = own.shape[0], across(self.C, F)
        self._require(
            f"gain {part.channel.name}",
            own,
            lambda P, K: (self._within(self.B.T @ P, 0, n), self._within(K @ seen, 0, n)),
        )

    def require_energy(self, part: ChannelPlant, level: MatrixPolynomial) -> None:
        """The generalised H2 norm of a channel, or its H2 norm (`synthesis.design.norms`); nothing acts on it at once."""
        E, F, Cz, Dzu = (self._known(getattr(part, key)) for key in ("E", "F", "Cz", "Dzu"))
        outputs, name, n = Cz + Dzu @ self.K @ self.C, part.channel.name, self.A.shape[0]
        k, m = E.shape[1], Cz.shape[0]
        w, z = (self.problem.constant(np.eye(size)).scaled_by(level) for size in (k, m))
        if part.channel.norm == "generalised H2":
            own, seen = symmetric_block([[self.rate, self.P @ E], [None, -w]]), across(self.C, F)
            self._require(f"stored energy {name}", own, lambda P, K: (self._within(self.B.T @ P, 0, n + k), K @ seen))
            self.problem.require(f"peak {name}", symmetric_block([[self.P, outputs.T], [None, z]]))
            return
        own = symmetric_block([[self.rate, outputs.T], [None, -z]])
        self._require(
            f"observed energy {name}",
            own,
            lambda P, K: (self._within(self.B.T @ P, 0, n + m), self._within(K @ self.C, 0, n + m)),
        )
        sizes = ChannelSizes(name, part.channel.norm, 0, level, level)
        after = after_impulses(self.problem, sizes, k)
        own = symmetric_block([[-after, -(self.P @ E).T], [None, -self.P]])
        self._require(
            f"impulses {name}",
            own,
            lambda P, K: (self._within(-(self.B.T @ P), k, k + n), self._within(K @ F, 0, k + n)),
        )

    def require_decay(self, rate: float) -> None:
        """|x|_P falls at least like exp(-rate t)."""
        own = self.rate + self._over(self.P, 2) * (2.0 * rate)
        self._require("decay rate", own, lambda P, K: (self.B.T @ P, K @ self.C))

    def require_disc(self, radius: float) -> None:
        """Every frozen pole lies within the disc about zero: [r P, P A; *, r P] > 0 of the closed loop."""
        disc, n = self._over(self.P, 2) * -radius, self.A.shape[0]
        own = symmetric_block([[disc, -(self.P @ self._over(self.A))], [None, disc]])
        self._require(
            "fastest pole",
            own,
            lambda P, K: (self._within(-(self.B.T @ P), 0, 2 * n), self._within(K @ self.C, n, 2 * n)),
        )

    def _over(self, matrix: MatrixPolynomial, times: int = 1) -> MatrixPolynomial:
        """The matrix times a power of the denominator."""
        return matrix if self.below is None else matrix.scaled_by(self.below, times)

    def _within(self, matrix: MatrixPolynomial, start: int, width: int) -> MatrixPolynomial:
        """[0, matrix, 0] of the given width."""
        rows, columns = matrix.shape
        sides = (start, width - start - columns)
        blanks = [self.problem.constant(np.zeros((rows, size))) for size in sides]
        blocks = [*blanks[: int(sides[0] > 0)], matrix, *(blanks[1:] if sides[1] else [])]
        return across(*blocks)

    def _require(self, name: str, own: MatrixPolynomial, pair: Pair) -> None:
        """own + U'V + V'U < 0 with U, V = pair(P, K)."""
        U, V = pair(self.P, self.K)
        if self.at is None:
            self.problem.require(name, -(own + U.T @ V + V.T @ U))
            return
        U0, V0 = pair(self.at.P, self.at.K)
        sizes = [float(np.linalg.norm(m.coefficients)) for m in (V0, U0)]
        square = sizes[0] / max(sizes[1], 1e-300)
        weight = float(np.sqrt(np.clip(square, *SQUARE_OF_WEIGHT)))

        def apart(U: MatrixPolynomial, V: MatrixPolynomial, sign: float) -> MatrixPolynomial:
            return U * (weight * HALF) + V * (sign * HALF / weight)

        S, D, D0 = apart(U, V, 1.0), apart(U, V, -1.0), apart(U0, V0, -1.0)
        cross = D0.T @ D
        unit = self.problem.constant(np.eye(S.shape[0]))
        self.problem.require(name, symmetric_block([[cross + cross.T - D0.T @ D0 - own, S.T], [None, unit]]))

    def _unknown(self, structure: Structure) -> MatrixPolynomial:
        rows, columns = structure.entries.shape
        total = self.problem.constant(np.zeros((rows, columns)))
        for i, j in zip(*np.nonzero(structure.entries), strict=True):
            left, right = np.zeros((rows, 1)), np.zeros((1, columns))
            left[i, 0] = right[0, j] = 1.0
            entry = self.problem.matrix(f"K{i},{j}", 1, 1, structure.degree)
            placed: MatrixPolynomial = self.problem.constant(left) @ entry @ self.problem.constant(right)
            total = total + placed
        return total

    def found(self, result: LmiResult) -> Point:
        """P and K that a solve ended with."""
        K = self.whole.K
        return Point(result.values["P"], K.substitute(result.decisions) if K.decisions else K)
