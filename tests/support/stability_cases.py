"""Random cases for `affine_quadratic_stability`, near the boundary of stability on purpose, checked by `exact_stability`.

`python -m tests.support.stability_cases 10000` prints counts by family and verdict, and violations (there must be none).
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

from synthesis.design.stability import GainBox, StabilityResult, _scale, affine_quadratic_stability
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from tests.support import exact_stability as oracle

NONE = Fraction(0)
ONE = (Fraction(1),)
OFFSETS = ("0 0.5", "635.15 0.5", "1 1", "70 70", "1000 1", "1e6 0.5", "-3e5 0.5", "1e6 1", "0.002 0.001")


@dataclass(frozen=True)
class Case:
    """e' = (A - L C) e with A = sum_k series[k] v^k / sum_k below[k] v^k, v = (p - centre)/half in [-1, 1]."""

    family: str
    series: list[list[list[Fraction]]]
    centre: Fraction = NONE
    half: Fraction = Fraction(1)
    rates: tuple[float, float] = (-1.0, 1.0)
    below: tuple[Fraction, ...] = ONE
    output: list[Fraction] | None = None
    gain: list[float] = field(default_factory=list)
    degree: int = 1
    form: str = "primal"
    decay: float = 0.0
    expanded: bool = False

    @property
    def states(self) -> int:
        return len(self.series[0])

    @property
    def has_parameter(self) -> bool:
        return len(self.series) > 1 or len(self.below) > 1

    @property
    def closed(self) -> list[list[list[Fraction]]]:
        """A - L C times the denominator, exact: gains are the floats that they are, everything else decimals."""
        n = self.states
        length = max(len(self.series), len(self.below))
        out = [[[NONE] * n for _ in range(n)] for _ in range(length)]
        for k, matrix in enumerate(self.series):
            for i in range(n):
                for j in range(n):
                    out[k][i][j] += matrix[i][j]
        for k, factor in enumerate(self.below):
            for i in range(n):
                for j in range(n):
                    out[k][i][j] -= factor * Fraction(self._gains[i]) * self._output[j]
        return out

    @property
    def stable(self) -> bool:
        """Frozen, decaying at the asked rate: decided exactly. The denominator is positive, so it only scales."""
        n, closed, decay = self.states, self.closed, Fraction(repr(self.decay))
        for k, factor in enumerate(self.below):
            for i in range(n):
                closed[k][i][i] += factor * decay
        return oracle.stable_on_range(closed)

    @property
    def model(self) -> LpvModel:
        p = sp.Symbol("p")
        v = (p - exactly(self.centre)) / exactly(self.half)
        n = self.states
        denominator = sum(exactly(c) * v**k for k, c in enumerate(self.below))

        def entry(i: int, j: int) -> sp.Expr:
            value = sum(exactly(m[i][j]) * v**k for k, m in enumerate(self.series) if m[i][j]) / denominator
            return sp.expand(value) if self.expanded and len(self.below) == 1 else value

        low, high = (float(self.centre + sign * self.half) for sign in (-1, 1))
        parameters = (SchedulingParameter("p", "1", low, high, *self.rates),) if self.has_parameter else ()
        return LpvModel(
            name=self.family,
            source="drawn at random",
            states=tuple(Signal(f"x{i + 1}", "1") for i in range(n)),
            outputs=(Signal("y", "1"),),
            parameters=parameters,
            A=sp.Matrix(n, n, lambda i, j: entry(int(i), int(j))),
            C=sp.Matrix([[exactly(c) for c in self._output]]),
        )

    @property
    def _output(self) -> list[Fraction]:
        return self.output or [Fraction(int(j == 0)) for j in range(self.states)]

    @property
    def _gains(self) -> list[float]:
        return self.gain or [0.0] * self.states


def exactly(x: Fraction) -> sp.Rational:
    return sp.Rational(x.numerator, x.denominator)


def decimal(x: float, digits: int = 4) -> Fraction:
    """The number in few digits, as a decimal."""
    return Fraction(f"{x:.{digits - 1}e}")


# ---- families ------------------------------------------------------------------------------------------------------------


def offset(draw: np.random.Generator) -> dict[str, Any]:
    """Where the range lies, and how fast the parameter may fall and rise."""
    centre, half = OFFSETS[draw.integers(len(OFFSETS))].split()
    return {"centre": Fraction(centre), "half": Fraction(half), "rates": rates(draw, float(half), -2.0, 1.0)}


def rates(draw: np.random.Generator, half: float, slow: float, fast: float) -> tuple[float, float]:
    """Bounds of dp/dt between half 10^slow and half 10^fast, hardly ever the same on both sides, now and then none on one."""
    found = [float(f"{half * 10 ** draw.uniform(slow, fast):.2g}") * float(draw.random() < 0.9) for _ in (0, 1)]
    return -found[0], found[1]


def near(draw: np.random.Generator, size: float = 1.0) -> Fraction:
    """A distance from the boundary, of either sign; now and then none at all."""
    return decimal(size * draw.choice([-1.0, 1.0]) * 10 ** draw.uniform(-9.0, 0.0)) if draw.random() < 0.95 else NONE


def scalar_power(draw: np.random.Generator) -> Case:
    """A = +-v^k - a with a next to the supremum: unstable at one end only (k odd), at both or in the middle."""
    k = int(draw.integers(1, 9))
    sign = Fraction(int(draw.choice([-1, 1])))
    supremum = Fraction(1) if k % 2 or sign > 0 else NONE
    a = Fraction(1, 2) if draw.random() < 0.1 else supremum + near(draw)
    series = [[[-a]]] + [[[NONE]]] * (k - 1) + [[[sign]]]
    return Case("scalar power", series, **offset(draw), degree=int(draw.integers(0, 2)), expanded=draw.random() < 0.5)


def spike(draw: np.random.Generator) -> Case:
    """-a + (1 - (v - v0)^2/4)^k: one narrow maximum of 1 - a inside the range, alone or beside a stable state."""
    k, v0 = int(draw.integers(3, 9)), decimal(draw.uniform(-0.9, 0.9), 3)
    base, found = [1 - v0 * v0 / 4, v0 / 2, Fraction(-1, 4)], [Fraction(1)]
    for _ in range(k):
        found = [sum((base[i] * found[j - i] for i in range(3) if 0 <= j - i < len(found)), NONE)
                 for j in range(len(found) + 2)]  # fmt: skip
    found[0] -= 1 + near(draw, 0.1)
    if draw.random() < 0.5:
        return Case("interior spike", [[[c]] for c in found], **offset(draw), degree=0)
    beside = [[[c, Fraction(int(k == 0))], [NONE, Fraction(-1 if k == 0 else 0)]] for k, c in enumerate(found)]
    return Case("interior spike", beside, **offset(draw), degree=int(draw.integers(0, 3)))


def resonance(draw: np.random.Generator) -> Case:
    """-a + w^2/(w^2 + (v - v0)^2): a rational model with a narrow maximum of 1 - a, alone or as the damping of a spring."""
    w, v0 = decimal(10 ** draw.uniform(-1.5, 0.0), 2), decimal(draw.uniform(-0.9, 0.9), 3)
    decay = float(f"{10 ** draw.uniform(-2.0, 0.5):.2g}") if draw.random() < 0.5 else 0.0
    a = 1 + Fraction(repr(decay)) + near(draw, 0.1)
    size = w * w + v0 * v0  # the denominator is one at v = 0
    below = tuple(c / size for c in (size, -2 * v0, Fraction(1)))
    above = [-a * c + (w * w / size if k == 0 else NONE) for k, c in enumerate(below)]
    series = [[[c]] for c in above]
    if draw.random() < 0.5:
        series = [[[c, b], [-b, c]] for c, b in zip(above, below, strict=True)]
    return Case("rational", series, **offset(draw), below=below, degree=int(draw.integers(0, 3)), decay=decay,
                form="dual" if draw.random() < 0.3 else "primal")  # fmt: skip


def some_states(draw: np.random.Generator, n: int) -> Case:
    """Random polynomials of degree 1 to 3 with random gains, shifted until the worst pole is next to the axis."""
    degree = int(draw.integers(1, 4))
    series = [[[decimal(draw.normal() * 0.6**k, 3) for _ in range(n)] for _ in range(n)] for k in range(degree + 1)]
    gain = [float(f"{draw.normal():.3g}") for _ in range(n)] if draw.random() < 0.5 else []
    decay = float(f"{abs(draw.normal()):.2g}") if draw.random() < 0.2 else 0.0
    form = "dual" if draw.random() < 0.3 else "primal"
    if draw.random() < 0.3:  # units of very different size
        size = [Fraction(10) ** int(draw.integers(-4, 5)) for _ in range(n)]
        series = [[[x * size[i] / size[j] for j, x in enumerate(row)] for i, row in enumerate(m)] for m in series]
        gain = [float(g * float(size[i] / size[0])) for i, g in enumerate(gain)]
    case = Case(f"{n} states", series, **offset(draw), gain=gain, degree=int(draw.integers(0, 3)), form=form, decay=decay,
                expanded=draw.random() < 0.3)  # fmt: skip
    return moved_to_the_boundary(case, near(draw))


def moved_to_the_boundary(case: Case, distance: Fraction) -> Case:
    """A - s I with s such that the worst frozen pole lies `distance` left of -decay, as far as floats can tell."""
    v = np.linspace(-1.0, 1.0, 2001)
    values = sum(np.array(m, float) * v[:, None, None] ** k for k, m in enumerate(case.closed))
    worst = float(np.linalg.eigvals(values).real.max())
    s = decimal(worst + case.decay, 12) + distance
    for i in range(case.states):
        case.series[0][i][i] -= s
    return case


def one_end(draw: np.random.Generator) -> Case:
    """[[0, 1], [-(1 - (1 + d) (+-v)^k), -2 z]]: the stiffness vanishes next to one end (k odd) or both."""
    k, z = int(draw.integers(1, 5)), decimal(10 ** draw.uniform(-2.0, 0.5), 3)
    sign = Fraction(int(draw.choice([-1, 1]))) ** k
    series = [[[NONE, Fraction(int(m == 0))], [Fraction(-1 if m == 0 else 0), -2 * z if m == 0 else NONE]]
              for m in range(k + 1)]  # fmt: skip
    series[k][1][0] = sign * (1 + near(draw))
    return Case("one end", series, **offset(draw), degree=int(draw.integers(0, 3)))


def rate_bounded(draw: np.random.Generator) -> Case:
    """A lightly damped spring whose stiffness moves: stable frozen, and unstable where it may move fast enough."""
    z, swing = decimal(10 ** draw.uniform(-2.5, 0.3), 3), decimal(draw.uniform(0.05, 0.95), 3)
    series = [[[NONE, Fraction(1)], [Fraction(-1), -2 * z]], [[NONE, NONE], [-swing, NONE]]]
    where = offset(draw)
    jump = draw.random() < 0.2
    bounds = (-np.inf, np.inf) if jump else rates(draw, float(where["half"]), -3.0, 1.5)
    return Case("rate-bounded", series, **(where | {"rates": bounds}), degree=0 if jump else int(draw.integers(0, 4)),
                form="dual" if draw.random() < 0.3 else "primal")  # fmt: skip


def multiple_pole(draw: np.random.Generator) -> Case:
    """S J S^-1 with one Jordan block at -1e-3 and S of integers, det S = 1; the parameter scales the nilpotent part."""
    n = int(draw.integers(2, 5))
    pole = -Fraction(1, 1000) if draw.random() < 0.5 else -decimal(10 ** draw.uniform(-6.0, 0.0), 2)
    S, inverse = [[[Fraction(int(i == j)) for j in range(n)] for i in range(n)] for _ in (0, 1)]
    for _ in range(int(draw.integers(0, 9))):
        i, j = draw.choice(n, 2, replace=False)
        c = Fraction(int(draw.choice([-1, 1])))
        S[i] = [a + c * b for a, b in zip(S[i], S[j], strict=True)]
        inverse = [[x - c * row[i] if m == j else x for m, x in enumerate(row)] for row in inverse]
    nilpotent = [[Fraction(int(j == i + 1)) for j in range(n)] for i in range(n)]
    turned = product(product(S, nilpotent), inverse)
    first = [[x + (pole if i == j else NONE) for j, x in enumerate(row)] for i, row in enumerate(turned)]
    swing = decimal(draw.uniform(0.0, 0.9), 2)
    if draw.random() < 0.5 or swing == 0:
        return Case("multiple pole", [first])
    second = [[x * swing for x in row] for row in turned]
    return Case("multiple pole", [first, second], **offset(draw), degree=int(draw.integers(0, 2)))


def product(left: Any, right: Any) -> Any:
    return [[sum((a * b for a, b in zip(row, column, strict=True)), NONE) for column in zip(*right, strict=True)]
            for row in left]  # fmt: skip


def no_parameter(draw: np.random.Generator) -> Case:
    """A constant matrix, with a decay rate next to the true one."""
    n = int(draw.integers(1, 5))
    series = [[[decimal(draw.normal(), 4) for _ in range(n)] for _ in range(n)]]
    gain = [float(f"{draw.normal():.3g}") for _ in range(n)] if draw.random() < 0.5 else []
    decay = float(f"{10 ** draw.uniform(-2.0, 1.0):.3g}") if draw.random() < 0.7 else 0.0
    case = Case("no parameter", series, gain=gain, decay=decay, form="dual" if draw.random() < 0.3 else "primal")
    return moved_to_the_boundary(case, near(draw))


FAMILIES: dict[str, Callable[[np.random.Generator], Case]] = {
    "scalar power": scalar_power,
    "interior spike": spike,
    "rational": resonance,
    "2 states": lambda draw: some_states(draw, 2),
    "3 states": lambda draw: some_states(draw, 3),
    "one end": one_end,
    "rate-bounded": rate_bounded,
    "multiple pole": multiple_pole,
    "no parameter": no_parameter,
}


def case_of(seed: int) -> Case:
    """The families take turns."""
    return list(FAMILIES.values())[seed % len(FAMILIES)](np.random.default_rng(seed))


# ---- judgement -----------------------------------------------------------------------------------------------------------


def asked(case: Case) -> StabilityResult:
    """The answer of the prover."""
    gain = np.array(case._gains)[:, None]
    settings = LmiSettings(points=21)
    return affine_quadratic_stability(case.model, gain, case.degree, case.form, settings, case.decay)  # type: ignore[arg-type]


def complaint(case: Case, result: StabilityResult) -> str | None:
    """What is wrong with an answer, by exact numbers; None if nothing is."""
    stable = case.stable
    if result.verdict is Verdict.REFUTED and stable:
        return f"refuted, but every frozen pole is left of -{case.decay}: {result.message}"
    if result.verdict is Verdict.CERTIFIED and not stable:
        return f"certified, but a frozen pole is not left of -{case.decay}"
    if result.verdict is Verdict.CERTIFIED and not lyapunov_proves(case, result):
        return "certified, but the Lyapunov matrix does not prove it"
    return None


def lost(case: Case, result: StabilityResult) -> bool:
    """A right Lyapunov matrix was at hand, and the verdict is not CERTIFIED: no lie, but a proof thrown away."""
    if result.verdict is not Verdict.INCONCLUSIVE or result.result.verdict is not Verdict.CERTIFIED:
        return False
    return case.stable and lyapunov_proves(case, result)


def lyapunov_proves(case: Case, result: StabilityResult) -> bool:
    """Both inequalities on the whole range, at the bounds of the rate, exactly."""
    P = lyapunov_in_v(case, result)
    finite = [rate for rate in case.rates if np.isfinite(rate)] if case.has_parameter else [0.0]
    speeds = [Fraction(repr(rate)) / case.half for rate in finite] or [NONE]
    decay = Fraction(repr(case.decay))
    return oracle.lyapunov_on_range(case.closed, P, case.below, speeds, decay, case.form == "dual")


def lyapunov_in_v(case: Case, result: StabilityResult) -> list[list[list[Fraction]]]:
    """The Lyapunov matrix found, in v and the model's own states, float for float."""
    scale = _scale(case.model, GainBox(np.array(case._gains)[:, None], np.array(case._gains)[:, None]))
    weight = [Fraction(float(s)) if case.form == "primal" else 1 / Fraction(float(s)) for s in scale]
    array = result.result.values["P"].coefficients[..., 0]
    n, variables = case.states, array.ndim - 2
    array = array.reshape(-1, n, n) if variables == 0 else array[:, 0] if variables == 2 else array
    return [
        [[Fraction(float(m[min(i, j), max(i, j)])) * weight[i] * weight[j] for j in range(n)] for i in range(n)]
        for m in array
    ]


def survey(seeds: range, show: bool = False) -> tuple[Counter[tuple[str, str]], list[str]]:
    """Verdicts by family, and complaints."""
    counts: Counter[tuple[str, str]] = Counter()
    complaints = []
    for seed in seeds:
        case = case_of(seed)
        result = asked(case)
        counts[case.family, str(result.verdict)] += 1
        counts["all", "lost"] += lost(case, result)
        found = complaint(case, result)
        if found is not None:
            complaints.append(f"seed {seed}, {case.family}: {found}")
        if show and seed % 500 == 499:
            print(seed + 1, len(complaints), flush=True)
    return counts, complaints


if __name__ == "__main__":
    first, last = (0, int(sys.argv[1])) if len(sys.argv) == 2 else (int(sys.argv[1]), int(sys.argv[2]))
    counted, wrong = survey(range(first, last), show=True)
    thrown_away = counted.pop(("all", "lost"))
    for (family, verdict), number in sorted(counted.items()):
        print(f"{family:16} {verdict:13} {number}")
    print("cases", sum(counted.values()), "violations", len(wrong), "proofs thrown away", thrown_away)
    for line in wrong[:40]:
        print(" ", line)
