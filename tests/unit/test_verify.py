"""The verifier on loops whose truth is known by hand: what fails inside a cell only, in one cell only, for one rate only."""

from __future__ import annotations

from fractions import Fraction

import pytest
from flint import fmpq, fmpq_mat

from synthesis.certificate.claims import Claim, ClaimChannel
from synthesis.certificate.refute import refuting_place
from synthesis.certificate.verify import Names, Outcome, Verifier
from synthesis.errors import ProblemError
from synthesis.loop.motion import one_sample_later, rates, time_derivative
from synthesis.loop.observer import ObserverLoop, Update
from synthesis.loop.plant import Axis, Plant
from synthesis.polynomials.enclosure import PolynomialMatrix, constant, identity, variable

NAMES = Names(("x",), ("d",))
PERIOD = fmpq(1, 10)


def rational(x: float | Fraction) -> fmpq:
    exact = x if isinstance(x, Fraction) else Fraction(repr(float(x)))
    return fmpq(exact.numerator, exact.denominator)


def scalar(*powers: float | Fraction) -> PolynomialMatrix:
    return PolynomialMatrix({(k,): fmpq_mat([[rational(c)]]) for k, c in enumerate(powers)}, (1, 1), 1)


def loop_of(
    A: PolynomialMatrix,
    gains: tuple[float, ...] = (0.0, 0.0),
    rate: float = 1.0,
    update: Update = "held",
    rounded: bool = False,
) -> Verifier:
    """x' = A(u) x + d, y = x, with u = p in [-1, 1] and |dp/dt| <= rate; gains at equidistant breakpoints."""
    axis = Axis("p", "1", fmpq(-1), fmpq(1), rational(-rate), rational(rate))
    matrices = {"A": A, "B": scalar(0.0), "C": scalar(1.0), "D": scalar(0.0), "E": scalar(1.0), "F": scalar(0.0)}
    points = tuple(fmpq(2 * k, len(gains) - 1) - 1 for k in range(len(gains)))
    table = {(k,): fmpq_mat([[rational(gain)]]) for k, gain in enumerate(gains)}
    plant = Plant((axis,), matrices, identity(1, 1))
    return Verifier(ObserverLoop(plant, (points,), table, update, PERIOD, rounded), NAMES)


def prove(verifier: Verifier, kind: str, level: float | Fraction, P: PolynomialMatrix | None = None) -> Outcome:
    channel = ClaimChannel({"d": 1.0}, ("x",)) if kind in ("gain", "sampled gain") else None
    return verifier.prove(Claim(kind, level, P or scalar(1.0), channel))  # type: ignore[arg-type]


def u_of(outcome: Outcome) -> float:
    return int(outcome.place[0].p) / int(outcome.place[0].q)


DIP = scalar(2.0, 0.0, -3.0)  # A = 2 - 3 u^2: -1 at both ends, unstable for |u| < 0.82


@pytest.mark.parametrize("kind", ["decay rate", "internal update", "gain", "sampled gain", "drop probability"])
def test_what_is_unstable_inside_a_cell_only_is_not_proved(kind: str) -> None:
    verifier, level = loop_of(DIP), 1e6 if "gain" in kind else 0.01
    outcome = prove(verifier, kind, level, scalar(100.0))
    assert not outcome.proved and abs(u_of(outcome)) < 0.83
    channel = ClaimChannel({"d": 1.0}, ("x",)) if "gain" in kind else None
    place = refuting_place(verifier, Claim(kind, level, scalar(100.0), channel))
    assert place is not None and abs(int(place[0].p) / int(place[0].q)) < 0.83


@pytest.mark.parametrize("place", [Fraction(1, 3), Fraction(-3, 7), Fraction(0)])
@pytest.mark.parametrize("width", [Fraction(1, 10), Fraction(1, 100)])
def test_a_narrow_dip_anywhere_is_not_proved(place: Fraction, width: Fraction) -> None:
    """A = width^2 - (u - place)^2 is unstable within `width` of its place; its mirror image below zero is proved."""
    dip = [width**2 - place**2, 2 * place, Fraction(-1)]
    outcome = prove(loop_of(scalar(*dip)), "decay rate", Fraction(1, 10**9))
    assert not outcome.proved and abs(u_of(outcome) - place) <= 4 * width
    below = [-(width**2) - place**2, 2 * place, Fraction(-1)]
    assert prove(loop_of(scalar(*below)), "decay rate", Fraction(1, 10**9)).proved


def test_touching_the_border_is_not_proved() -> None:
    """A = -(u - 1/3)^2 has no decay rate at all, and every cell that holds 1/3 stays open until the proof gives up."""
    touching = scalar(Fraction(-1, 9), Fraction(2, 3), Fraction(-1))
    outcome = prove(loop_of(touching), "decay rate", 1e-12)
    assert not outcome.proved and u_of(outcome) == pytest.approx(1 / 3, abs=1e-2)


@pytest.mark.parametrize("kind", ["decay rate", "internal update"])
def test_levels_are_sharp(kind: str) -> None:
    """A = -1: a decay rate of one is not exceeded, and one is not proved (it is no strict inequality)."""
    verifier = loop_of(scalar(-1.0))
    assert prove(verifier, kind, 1.0 - 1e-9).proved
    assert not prove(verifier, kind, 1.0).proved
    assert not prove(verifier, kind, 1.0 + 1e-9).proved
    assert refuting_place(verifier, Claim(kind, 1.0 + 1e-9, scalar(1.0))) is not None
    assert refuting_place(verifier, Claim(kind, 1.0 - 1e-9, scalar(1.0))) is None


def test_poles_are_sharp() -> None:
    verifier = loop_of(scalar(-3.0, 1.0))  # poles from -4 to -2
    assert prove(verifier, "fastest pole", 4.0 + 1e-9).proved and prove(verifier, "decay rate", 2.0 - 1e-9).proved
    assert (
        not prove(verifier, "fastest pole", 4.0 - 1e-9).proved and not prove(verifier, "decay rate", 2.0 + 1e-9).proved
    )


@pytest.mark.parametrize("bad", range(5))
@pytest.mark.parametrize("kind", ["decay rate", "internal update", "sampled error"])
def test_every_cell_counts(bad: int, kind: str) -> None:
    """One breakpoint of five with the wrong sign; for the sampled update, one gain far beyond two."""
    sampled = kind == "sampled error"
    gains = [0.5 if sampled else 2.0] * 5
    verifier = loop_of(
        scalar(1.0) if not sampled else scalar(-0.1), tuple(gains), update="sampled" if sampled else "held"
    )
    assert prove(verifier, kind, 0.1).proved
    gains[bad] = 5.0 if sampled else -1.0
    verifier = loop_of(
        scalar(1.0) if not sampled else scalar(-0.1), tuple(gains), update="sampled" if sampled else "held"
    )
    outcome = prove(verifier, kind, 0.1)
    assert not outcome.proved and abs(u_of(outcome) - (0.5 * bad - 1.0)) <= 0.5


@pytest.mark.parametrize("slope", [0.5, -0.5])
def test_rates_count(slope: float) -> None:
    """P = 1 + u/2 grows by up to rate/2 over P >= 1/2: with A = -1 the rate may be 2 (1 - a), and no faster."""
    P = scalar(1.0, slope)
    assert prove(loop_of(scalar(-1.0), rate=1.9), "decay rate", 0.001, P).proved
    assert not prove(loop_of(scalar(-1.0), rate=2.1), "decay rate", 0.001, P).proved
    assert prove(loop_of(scalar(-1.0), rate=100.0), "decay rate", 0.9).proved  # a constant P does not see it


@pytest.mark.parametrize("slope", [0.5, -0.5])
def test_one_sample_later_counts(slope: float) -> None:
    """(1 + (u + T r)/2) e^(-2T) < (1 + u/2) needs T r / 2 < (e^(2T) - 1)/2 at the worst u, of any sign."""
    P = scalar(1.0, slope)
    border = (2.718281828459045**0.2 - 1.0) / 0.1
    assert prove(loop_of(scalar(-1.0), rate=0.98 * border), "internal update", 0.001, P).proved
    assert not prove(loop_of(scalar(-1.0), rate=1.02 * border), "internal update", 0.001, P).proved


def test_a_parameter_that_jumps_is_anywhere_one_sample_later() -> None:
    """P of degree 3 in u and 2 in v: what is put in for u is its next value r, and v moves with its rate."""
    axes = (
        Axis("u", "1", fmpq(-1), fmpq(1), None, None),
        Axis("v", "1", fmpq(-1), fmpq(1), fmpq(-1), fmpq(1)),
    )
    values = {(3, 1, 0, 0): 2, (1, 2, 0, 0): -3, (0, 0, 0, 0): 5}
    P = PolynomialMatrix({k: fmpq_mat([[fmpq(x)]]) for k, x in values.items()}, (1, 1), 4)
    one, place = constant(fmpq_mat([[1]]), 4), [variable(i, 4) for i in range(4)]

    def jump(i: int) -> PolynomialMatrix:
        return (place[2 + i] - place[i]) * (1 / PERIOD)

    speeds = rates(axes, P, one, lambda i: place[2 + i], lambda x: x, jump)
    later = one_sample_later(P, speeds, PERIOD)
    for u, v, r, s in ((fmpq(1, 3), fmpq(-1, 2), fmpq(1), fmpq(-1)), (fmpq(-1), fmpq(1), fmpq(1, 7), fmpq(1, 2))):
        assert later.at((u, v, r, s)) == P.at((r, v + PERIOD * s, fmpq(0), fmpq(0)))
    with pytest.raises(ProblemError, match="may jump"):
        rates(axes, P, one, lambda i: place[2 + i], lambda x: x)


def test_one_sample_later_is_the_polynomial_elsewhere() -> None:
    """P(u + T du/dt) and dP/dt of degree (3, 2) in two parameters, exactly, for rates anywhere between their bounds."""
    axes = (
        Axis("p", "1", fmpq(2), fmpq(6), fmpq(-3), fmpq(1)),
        Axis("q", "1", fmpq(-1), fmpq(0), fmpq(-1, 2), fmpq(1, 3)),
    )
    terms = {(i, j): fmpq_mat([[fmpq((7 * i + 3 * j * j + 1) % 11 - 5, i + 1)]]) for i in range(4) for j in range(3)}
    P, one = (
        PolynomialMatrix(terms, (1, 1), 2).in_variables(4),
        PolynomialMatrix({(0,) * 4: fmpq_mat([[1]])}, (1, 1), 4),
    )
    speeds = rates(axes, P, one, lambda i: variable(2 + i, 4), lambda x: x)
    later, slope = one_sample_later(P, speeds, PERIOD), time_derivative(P, speeds)
    for u, v, r, s in ((fmpq(1, 3), fmpq(-1, 2), fmpq(1), fmpq(-1)), (fmpq(-1), fmpq(1), fmpq(1, 7), fmpq(0))):
        speed = (fmpq(-1) + 2 * r) / 2, (fmpq(-1, 12) + fmpq(5, 12) * s) * 2  # (middle + half r) over half the range
        moved = (u + PERIOD * speed[0], v + PERIOD * speed[1], r, s)
        assert later.at((u, v, r, s)) == P.at(moved)
        partial = [P.derivative(i).at((u, v, r, s))[0, 0] for i in range(2)]
        assert slope.at((u, v, r, s))[0, 0] == partial[0] * speed[0] + partial[1] * speed[1]


def test_asymmetric_rates_count() -> None:
    """P = 1 + u/2 with a parameter that only rises or only falls."""
    for low, high, proved in (
        (0.0, 1.9, True),
        (0.0, 2.1, False),
        (-9.0, 0.0, True),
        (-9.0, 1.9, True),
        (-9.0, 2.1, False),
    ):
        verifier = loop_of(scalar(-1.0))
        axis = Axis("p", "1", fmpq(-1), fmpq(1), rational(low), rational(high))
        plant = Plant((axis,), verifier.loop.plant.matrices, identity(1, 1))
        moved = ObserverLoop(plant, verifier.loop.breakpoints, verifier.loop.table, "held", PERIOD, False)
        assert prove(Verifier(moved, NAMES), "decay rate", 0.001, scalar(1.0, 0.5)).proved is proved, (low, high)


@pytest.mark.parametrize(
    ("low", "high", "proved"), [(-1.9, 0.0, True), (-2.1, 0.0, False), (0.0, 9.0, True), (-2.1, 9.0, False)]
)
def test_the_dual_form_counts_motion_with_the_other_sign(low: float, high: float, proved: bool) -> None:
    """V = e^2/Q with Q = 1 + u/2 on x' = -x: -2 Q - dQ/dt < 0 bounds how fast the parameter falls, where Q is least."""
    axis = Axis("p", "1", fmpq(-1), fmpq(1), rational(low), rational(high))
    plant = Plant((axis,), loop_of(scalar(-1.0)).loop.plant.matrices, identity(1, 1))
    verifier = Verifier(ObserverLoop.constant_gain(plant, fmpq_mat([[0]])), NAMES)
    claim = Claim("decay rate", 0.001, scalar(1.0, 0.5))
    assert verifier.prove(claim, dual=True).proved is proved


def test_an_indefinite_P_proves_nothing() -> None:
    """P = -1 satisfies every Lyapunov inequality of an unstable loop; P > 0 is asked everywhere, also between the ends."""
    unstable = loop_of(scalar(1.0))
    for kind in ("decay rate", "internal update", "drop probability"):
        outcome = prove(unstable, kind, 0.5, scalar(-1.0))
        assert not outcome.proved and outcome.inequality == "P > 0"
    inside = scalar(-0.1, 0.0, 1.0)  # negative for |u| < 0.32
    assert prove(loop_of(scalar(-1.0), rate=0.0), "decay rate", 0.5, inside).inequality == "P > 0"


def test_gains_are_sharp() -> None:
    """x' = -2 x + d has the gain 1/2; held over samples of 0.1 s it is (1 - e^-0.2)/2 / (1 - e^-0.2), the same."""
    verifier = loop_of(scalar(-2.0))
    assert prove(verifier, "gain", 0.5001, scalar(0.5)).proved  # 4 P - 1 > P^2/g^2 at P = 1/2 for every g > 1/2
    assert not prove(verifier, "gain", 0.4999, scalar(0.5)).proved
    forced = (1.0 - 2.718281828459045**-0.2) / 2.0
    best = 1.0 / (1.0 - 2.718281828459045**-0.2)  # P of the Riccati equation at the limit
    assert prove(verifier, "sampled gain", 0.501, scalar(best)).proved
    assert not prove(verifier, "sampled gain", 0.499, scalar(best)).proved
    assert forced / (1.0 - 2.718281828459045**-0.2) == pytest.approx(0.5)


@pytest.mark.parametrize("kind", ["decay rate", "internal update"])
def test_rounding_of_the_runtime_is_in_the_proof(kind: str) -> None:
    """What float64 evaluates is known to 1e-15 or so: a level closer to the truth than that is neither proved nor refuted."""
    exact, rounded = loop_of(scalar(-1.0)), loop_of(scalar(-1.0), rounded=True)
    assert prove(exact, kind, 1.0 - 1e-13).proved and prove(rounded, kind, 1.0 - 1e-13).proved
    close = 1.0 - 1.2e-16
    assert close < 1.0 and prove(exact, kind, close).proved and not prove(rounded, kind, close).proved
    for level in (close, 1.0, 1.0 + 2.3e-16):
        assert refuting_place(rounded, Claim(kind, level, scalar(1.0))) is None
    assert refuting_place(exact, Claim(kind, 1.0 + 2.3e-16, scalar(1.0))) is not None
