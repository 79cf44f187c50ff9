"""Is what `gainsmith certify` prints of a file true of that file? Judged by `tests.support.schedule_oracle`.

A statement is read from its words, as a person would read it; its level is loosened by `LOOSE`, so that rounding in float64 is no
violation. Two ways for everything: attempts to break it without P (frozen parameters, frequencies, random motions), and its
inequality in float64 on a dense grid with the P of the file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import pint

from tests.support.schedule_oracle import SHAPES, Oracle

LOOSE = 1e-6
ROUNDING = 1e-9  # of a normalised matrix
WORDS = (  # longest first where one begins like another
    "error equation: decay rate", "error equation: fastest pole", "error equation: gain",
    "update: decay while the plant stands still", "update: decay", "update: gain of motion", "update: gain",
    "update: drop probability",
)  # fmt: skip
BOUNDS_FROM_BELOW = ("error equation: decay rate", "update: decay while the plant stands still", "update: decay")
registry = pint.UnitRegistry()


@dataclass(frozen=True)
class Statement:
    """`inputs` with their sizes; all from the printed words but `P`, which only helps to judge."""

    words: str
    level: float
    unit: str
    inputs: dict[str, float]
    sizes: dict[str, str]  # units of sizes as printed; empty for a plain input
    errors: tuple[str, ...]
    P: Mapping[str, Any]


def statement(claim: str, level: float, unit: str, stored: Mapping[str, Any]) -> Statement:
    """Reads the printed words."""
    words = next(words for words in WORDS if claim.startswith(words))
    rest = claim.removeprefix(words).strip()
    inputs, sizes, errors = {}, {}, ()
    if rest:
        left, right = rest.split(" -> ")
        errors = tuple(right.split(" + "))
        for part in left.split(" + "):
            size, per, name, mark = re.fullmatch(r"(?:(\S+) (.+) )?(\w+)('?)", part).groups()  # type: ignore[union-attr]
            assert (mark == "'") == (words == "update: gain of motion")
            inputs[name] = 1.0 if size is None else float(size)
            if size is not None:
                sizes[name] = per
    return Statement(words, level, unit, inputs, sizes, errors, stored)


class Judge:
    """Judges the statements about one content."""

    def __init__(self, content: Mapping[str, Any], seed: int = 0) -> None:
        self.oracle = Oracle(content)
        self.rng = np.random.default_rng(seed)
        self.units = {
            s["name"]: s["unit"]
            for key in ("states", "inputs", "outputs", "disturbances")
            for s in content["model"][key]
        }
        self.p = self.oracle.grid()
        self.paths = self.oracle.walks(self.rng, 6, 60)

    @cached_property
    def equation(self) -> tuple[np.ndarray, np.ndarray]:
        """The error equation on the grid."""
        return self.oracle.equation(self.p)

    @cached_property
    def update(self) -> dict[str, np.ndarray]:
        """The update on the grid."""
        return self.oracle.update(self.p)

    @cached_property
    def moving(self) -> dict[str, np.ndarray]:
        """The update along the random motions."""
        found = self.oracle.update(self.paths.ravel())
        return {key: m.reshape(*self.paths.shape, *m.shape[1:]) for key, m in found.items()}

    def plant(self) -> list[str]:
        """The stored plant is that of the formulas, at random parameters."""
        p, wrong = self.rng.uniform(self.oracle.low, self.oracle.high, 7), []
        for key in SHAPES:
            stored, size = self.oracle.stored(key, p)
            if stored.size and not (np.abs(stored - self.oracle.matrix(key, p)) <= 1e-13 * size).all():
                wrong.append(f"plant.{key} is not that of the formulas")
        return wrong

    def dimensions(self) -> list[str]:
        """Every formula, worked out with quantities in their units, gives the number that is used."""
        model, wrong = self.oracle.content["model"], []
        named = {
            self.oracle.parameter["name"]: (0.5 * (self.oracle.low + self.oracle.high), self.oracle.parameter["unit"])
        }
        named |= {name: (entry["value"], entry["unit"]) for name, entry in model["constants"].items()}
        if all(unit == "1" for unit in (*self.units.values(), *(unit for _, unit in named.values()))):
            return []
        for key, (above, beside) in SHAPES.items():
            per = "s" if key in "ABE" else "1"
            for i, row in enumerate(model["matrices"][key]):
                for j, text in enumerate(row):
                    wanted = f"({model[above][i]['unit']})/({model[beside][j]['unit']})/({per})"
                    if not _fits(text, tuple(sorted(named.items())), wanted):
                        wrong.append(f"{key}[{i}][{j}] = {text} is no quantity in {wanted}")
        return wrong

    def unit(self, s: Statement) -> list[str]:
        """Names exist; the unit of the level, and of sizes, are those of the signals."""
        group = self.oracle.names["states" if s.words == "update: gain of motion" else "disturbances"]
        wrong = [f"'{name}' is no input" for name in s.inputs if name not in group]
        wrong += [f"'{name}' is no state" for name in s.errors if name not in self.oracle.names["states"]]
        if wrong:
            return wrong
        per = "/s" if s.words == "update: gain of motion" else ""
        wrong += [f"size in {u}" for name, u in s.sizes.items() if not _same(u, f"({self.units[name]}){per}")]
        if not s.inputs:
            return wrong + [f"unit {s.unit}"] * (s.unit != ("1" if "probability" in s.words else "1/s"))
        tops = {self.units[name] for name in s.errors}
        if len(tops) > 1:
            return wrong + [f"unit {s.unit}"] * (not s.unit.startswith("mixed"))
        below = "" if s.sizes else f"/(({self.units[next(iter(s.inputs))]}){per})"
        return wrong + [f"unit {s.unit}"] * (not _same(s.unit, f"({tops.pop()}){below}"))

    def truth(self, s: Statement) -> list[str]:
        """What speaks against a statement that is called proved."""
        found = [f"{s.words}: {what}" for what in self._attempts(s, self.p, LOOSE)]
        rates = (self.oracle.parameter["rate_min"], self.oracle.parameter["rate_max"])
        for rate in np.linspace(float(rates[0]), float(rates[1]), 5):
            for what, matrix in self._inequalities(s, rate):
                found += [f"{s.words}: {what} > 0 fails"] if not _positive(matrix) else []
        return found + self._motions(s)

    def broken(self, s: Statement, place: float) -> bool:
        """Whether the frozen loop breaks a statement that is called refuted, near the printed place."""
        near = place + (self.oracle.high - self.oracle.low) * 1e-5 * np.linspace(-1.0, 1.0, 9)
        return bool(self._attempts(s, np.clip(near, self.oracle.low, self.oracle.high), -LOOSE))

    def remarks(self, lines: Sequence[str]) -> list[str]:
        """What a parameter that moves inside a sample adds, against the plant in short pieces beside the frozen one."""
        oracle, model, wrong, pieces = self.oracle, self.oracle.content["model"], [], 24
        states, inputs = oracle.names["states"], [signal["name"] for signal in model["inputs"]]
        said = np.zeros((len(states), len(states) + len(inputs)))
        for line in lines:
            state, rest = re.fullmatch(r"a parameter moving .* error of (\w+) by at most (.*)", line).groups()  # type: ignore[union-attr]
            for part in rest.split(" + "):
                bound, unit, name = re.fullmatch(r"(\S+) (.+) \|(\w+)\|", part).groups()  # type: ignore[union-attr]
                said[states.index(state), [*states, *inputs].index(name)] = float(bound)
                wrong += [] if _same(unit, f"({self.units[state]})/({self.units[name]})") else [f"remark in {unit}"]
        for rate in (float(oracle.parameter["rate_min"]), float(oracle.parameter["rate_max"])):
            start = self.rng.uniform(oracle.low, oracle.high, 5)
            start[:2] = oracle.low, oracle.high
            way = np.clip(start + rate * oracle.period, oracle.low, oracle.high) - start
            moved, frozen = None, None
            for k in range(pieces):
                piece = oracle.driven(start + way * (k + 0.5) / pieces, oracle.period / pieces)
                still = oracle.driven(start, oracle.period / pieces)
                moved, frozen = (b if a is None else b @ a for a, b in ((moved, piece), (frozen, still)))
            assert moved is not None and frozen is not None
            off = np.abs(moved - frozen)[:, : len(states)].max(0)
            size = np.abs(moved).max()
            wrong += [] if (off <= 1.02 * said + 1e-9 * size).all() else [f"remark: {off} beyond {said}"]
        return wrong

    def _attempts(self, s: Statement, p: np.ndarray, loose: float) -> list[str]:
        """Frozen parameters (and frequencies) that break the statement, its level loosened."""
        oracle, level = self.oracle, s.level * (1.0 - loose if _from_below(s) else 1.0 + loose)
        slack = 1e-12 * np.sign(loose)
        if s.words.startswith("error equation"):
            A, B = self.equation if p is self.p else oracle.equation(p)
            poles = np.linalg.eigvals(A).real
            if s.words.endswith("decay rate"):
                return _over(poles.max(-1), -level + slack * np.abs(poles).max(), p, "frozen pole")
            if s.words.endswith("fastest pole"):
                return _over(-poles.min(-1), level + slack, p, "frozen pole")
            found = _over(poles.max(-1), slack * np.abs(poles).max(), p, "frozen pole")
            omega = np.concatenate([[0.0], np.geomspace(1e-3, 1e4, 40)])
            return found + _over(_gain(1j * omega, A, B, *self._picked(s)), level, p, "frozen gain")
        update = self.update if p is self.p else oracle.update(p)
        radius = np.abs(np.linalg.eigvals(update["A"])).max(-1)
        if "decay" in s.words:
            return _over(radius, np.exp(-level * oracle.period) + slack, p, "frozen radius")
        found = _over(radius, 1.0 + slack, p, "frozen radius")
        if s.inputs:
            B = update["motion"] if "motion" in s.words else update["B"]
            z = np.exp(1j * np.concatenate([[0.0], np.geomspace(1e-4, np.pi, 40)]))
            return found + _over(_gain(z, update["A"], B, *self._picked(s)), level, p, "frozen gain")
        squares = [np.einsum("gij,gkl->gikjl", m, m).reshape(len(p), -1, m.shape[-1] ** 2)
                   for m in (update["A"], update["coasting"])]  # fmt: skip
        second = np.abs(np.linalg.eigvals((1.0 - level) * squares[0] + level * squares[1])).max(-1)
        return found + _over(second, 1.0 + slack, p, "second moment")

    def _picked(self, s: Statement) -> tuple[np.ndarray, np.ndarray]:
        """Sizes of inputs (columns) and chosen errors (rows)."""
        group = self.oracle.names["states" if s.words == "update: gain of motion" else "disturbances"]
        W = np.array([[s.inputs[name] * (name == other) for name in s.inputs] for other in group])
        return W, np.array([[float(name == error) for name in self.oracle.names["states"]] for error in s.errors])

    def _inequalities(self, s: Statement, rate: float) -> list[tuple[str, np.ndarray]]:
        oracle, p, level = self.oracle, self.p, s.level * (1.0 - LOOSE if _from_below(s) else 1.0 + LOOSE)
        P, out = oracle.lyapunov(s.P, p), []
        out.append(("P", P))
        if s.words.startswith("error equation"):
            A, B = self.equation
            P_dot, S = oracle.lyapunov(s.P, p, True) * rate, P @ A + _turned(P @ A)
            if s.words.endswith("decay rate"):
                return [*out, ("decay", -(S + P_dot + 2.0 * level * P))]
            if s.words.endswith("fastest pole"):
                return [*out, ("pole", S + 2.0 * level * P)]
            W, Z = self._picked(s)
            return [*out, ("gain", _block(-(S + P_dot + Z.T @ Z), -P @ B @ W, level**2))]
        later = oracle.lyapunov(s.P, np.clip(p + rate * oracle.period, oracle.low, oracle.high))
        update = self.update
        A = update["A"]
        fallen = _turned(A) @ later @ A
        if "decay" in s.words:
            return [*out, ("decay", np.exp(-2.0 * level * oracle.period) * P - fallen)]
        if s.inputs:
            W, Z = self._picked(s)
            BW = (update["motion"] if "motion" in s.words else update["B"]) @ W
            corner = level**2 * np.eye(W.shape[1]) - _turned(BW) @ later @ BW
            return [*out, ("gain", _block(P - Z.T @ Z - fallen, -_turned(A) @ later @ BW, corner))]
        lost = _turned(update["coasting"]) @ later @ update["coasting"]
        return [*out, ("received", P - fallen), ("drops", P - (1.0 - level) * fallen - level * lost)]

    def _motions(self, s: Statement) -> list[str]:
        """Random motions of the parameter from sample to sample, batched; everything exact over a sample."""
        oracle, p = self.oracle, self.paths
        if s.words.startswith("error equation"):
            return []
        (samples, count), level = p.shape, s.level * (1.0 - LOOSE if _from_below(s) else 1.0 + LOOSE)
        flat = self.moving
        P = oracle.lyapunov(s.P, p.ravel()).reshape(*p.shape, *flat["A"].shape[-2:])
        n = P.shape[-1]
        if s.inputs:
            B = flat["motion"] if "motion" in s.words else flat["B"]
            W, Z = self._picked(s)
            w = self.rng.normal(size=(samples, count, W.shape[1]))
            w[:, ::2] = w[:1, ::2]  # constant ones, too
            e, heard, put = np.zeros((count, n)), np.zeros(count), np.zeros(count)
            for k in range(samples):
                heard, put = heard + ((e @ Z.T) ** 2).sum(-1), put + (w[k] ** 2).sum(-1)
                e = np.einsum("cij,cj->ci", flat["A"][k], e) + np.einsum("cij,cj->ci", B[k] @ W, w[k])
            return [f"{s.words}: a motion has more"] if (heard > level**2 * put).any() else []
        X = np.broadcast_to(np.eye(n), (count, n, n))
        kept = np.exp(-2.0 * level * oracle.period) if "decay" in s.words else 1.0
        for k in range(samples - 1):
            before = np.trace(P[k] @ X, axis1=-2, axis2=-1)
            moved = flat["A"][k] @ X @ _turned(flat["A"][k])
            if "probability" in s.words:
                moved = (1.0 - level) * moved + level * flat["coasting"][k] @ X @ _turned(flat["coasting"][k])
            X = moved
            size = np.trace(np.abs(P[k + 1]) @ np.abs(X), axis1=-2, axis2=-1)
            if (np.trace(P[k + 1] @ X, axis1=-2, axis2=-1) > kept * before + 1e-12 * size).any():
                return [f"{s.words}: a motion falls less"]
            X = X / np.trace(X, axis1=-2, axis2=-1)[:, None, None]
        return []


def _from_below(s: Statement) -> bool:
    return s.words in (*BOUNDS_FROM_BELOW, "update: drop probability")


def _over(values: np.ndarray, bound: Any, p: np.ndarray, what: str) -> list[str]:
    bad = ~(values <= bound)
    return [f"{what} {values[bad][0]:.9g} at {p[bad][0]:.9g}"] if bad.any() else []


def _gain(z: np.ndarray, A: np.ndarray, B: np.ndarray, W: np.ndarray, Z: np.ndarray) -> np.ndarray:
    """Largest singular value of Z (z - A)^-1 B W over z, for every parameter; infinite at a pole."""
    resolvent = z[:, None, None, None] * np.eye(A.shape[-1]) - A
    force = np.broadcast_to(B @ W, (len(z), *B.shape[:-1], W.shape[1])).astype(complex)
    try:
        return np.linalg.norm(Z @ np.linalg.solve(resolvent, force), 2, axis=(-2, -1)).max(0)
    except np.linalg.LinAlgError:
        return np.full(len(A), np.inf)


def _block(top: np.ndarray, side: np.ndarray, corner: Any) -> np.ndarray:
    m = side.shape[-1]
    low = np.broadcast_to(corner * np.eye(m) if np.ndim(corner) == 0 else corner, (len(top), m, m))
    return np.concatenate([np.concatenate([top, side], -1), np.concatenate([_turned(side), low], -1)], -2)


def _positive(matrix: np.ndarray) -> bool:
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    if not (diagonal > 0.0).all():
        return False
    size = np.sqrt(diagonal)
    return bool((np.linalg.eigvalsh(matrix / size[..., None] / size[..., None, :]) > -ROUNDING).all())


def _turned(matrix: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrix, -2, -1)


@lru_cache(maxsize=4096)
def _same(unit: str, other: str) -> bool:
    left, right = (registry.Quantity(1.0, registry.parse_units(text)).to_base_units() for text in (unit, other))
    plain = [{k: v for k, v in dict(q.unit_items()).items() if k != "radian"} for q in (left, right)]
    return plain[0] == plain[1] and bool(np.isclose(left.magnitude, right.magnitude, rtol=1e-9))


@lru_cache(maxsize=4096)
def _fits(text: str, named: Sequence[tuple[str, tuple[float, str]]], wanted: str) -> bool:
    """With quantities for names, Python works the formula out to the number that plain floats give, in the wanted unit."""
    quantities = {name: registry.Quantity(float(value), unit).to_base_units() for name, (value, unit) in named}
    place = registry.Quantity(1.0, registry.parse_units(wanted)).to_base_units()
    plain = eval(text, {"__builtins__": {}}, {name: float(value) for name, (value, _) in named})
    if not any(re.search(rf"\b{name}\b", text) for name in quantities):
        return plain == 0 or not place.dimensionless or bool(np.isclose(place.magnitude, 1.0, rtol=1e-9))
    try:
        found = eval(text, {"__builtins__": {}}, quantities)
        ratio = (found / place).to_base_units()
    except pint.DimensionalityError:
        return False
    left = {name for name, power in ratio.unit_items() if power != 0}
    return left <= {"radian"} and bool(np.isclose(ratio.magnitude, plain, rtol=1e-7, atol=1e-12))
