"""Blind changes of a schedule's content: any number, text, key or list anywhere."""

from __future__ import annotations

import copy
import re
from typing import Any

import numpy as np

Content = dict[str, Any]
FOREIGN: tuple[Any, ...] = (
    None, True, "nan", "", "0", [], {}, [0], {"a": 1}, 1e308, -0.0, 10**30, 1e-320, 0, 1, -1, 0.5, "a\nb", "\x1b[31m", [[]], "é",
)  # fmt: skip
FACTORS = (
    -1.0,
    0.0,
    1.0 + 1e-12,
    1.0 - 1e-9,
    1.0 + 1e-6,
    0.999,
    1.001,
    0.99,
    1.01,
    0.9,
    1.1,
    0.5,
    2.0,
    10.0,
    1e3,
    1e-3,
    1e6,
)


def places(value: Any, way: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [way] if way else []
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in entries:
        found += places(entry, (*way, key))
    return found


def at(data: Any, way: tuple[Any, ...]) -> Any:
    for key in way:
        data = data[key]
    return data


def pick(rng: np.random.Generator, items: Any) -> Any:
    items = list(items)
    return items[int(rng.integers(len(items)))]


def _numbers(data: Any) -> list[tuple[Any, ...]]:
    return [way for way in places(data) if type(at(data, way)) in (int, float)]


def changed(x: float, rng: np.random.Generator) -> float:
    way = int(rng.integers(4))
    if way == 0:
        digits = repr(x)
        spots = [i for i, c in enumerate(digits) if c.isdigit()]
        i = pick(rng, spots)
        try:
            return float(digits[:i] + str(int(rng.integers(10))) + digits[i + 1 :])
        except ValueError:
            return x
    if way == 1:
        return float(np.nextafter(x, pick(rng, (-np.inf, np.inf))))
    if way == 2:
        return x * float(1.0 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-9.0, 0.0))
    return x * pick(rng, FACTORS)


def number(data: Content, rng: np.random.Generator) -> str:
    way = pick(rng, _numbers({k: v for k, v in data.items() if k != "provenance"}))
    at(data, way[:-1])[way[-1]] = new = changed(at(data, way), rng)
    return f"{way} = {new!r}"


def foreign(data: Content, rng: np.random.Generator) -> str:
    way = pick(rng, places(data))
    at(data, way[:-1])[way[-1]] = new = copy.deepcopy(pick(rng, FOREIGN))
    return f"{way} = {new!r}"


def dropped(data: Content, rng: np.random.Generator) -> str:
    way = pick(rng, places(data))
    del at(data, way[:-1])[way[-1]]
    return f"{way}"


def doubled(data: Content, rng: np.random.Generator) -> str:
    way = pick(rng, [way for way in places(data) if isinstance(at(data, way[:-1]), list)])
    at(data, way[:-1]).insert(way[-1], copy.deepcopy(at(data, way)))
    return f"{way}"


def added(data: Content, rng: np.random.Generator) -> str:
    way = pick(rng, [(), *(way for way in places(data) if isinstance(at(data, way), dict))])
    name = pick(rng, ("note", "weights", "guarantee", "level", "unit", "channel", "P", "source", "denominator"))
    at(data, way)[name] = copy.deepcopy(pick(rng, FOREIGN))
    return f"{way}.{name}"


def swapped(data: Content, rng: np.random.Generator) -> str:
    holder = pick(
        rng, [(), *(w for w in places(data) if isinstance(at(data, w), (dict, list)) and len(at(data, w)) > 1)]
    )
    entries = at(data, holder)
    one, other = rng.permutation(len(entries))[:2]
    keys = list(entries) if isinstance(entries, dict) else range(len(entries))
    a, b = keys[int(one)], keys[int(other)]
    entries[a], entries[b] = entries[b], entries[a]
    return f"{holder} {a} {b}"


def copied(data: Content, rng: np.random.Generator) -> str:
    ways = places({k: v for k, v in data.items() if k != "provenance"})
    to = pick(rng, ways)
    source = pick(rng, [way for way in ways if type(at(data, way)) is type(at(data, to))])
    at(data, to[:-1])[to[-1]] = copy.deepcopy(at(data, source))
    return f"{source} to {to}"


def text(data: Content, rng: np.random.Generator) -> str:
    way = pick(rng, [way for way in places(data) if isinstance(at(data, way), str)])
    old = at(data, way)
    i = int(rng.integers(len(old) + 1))
    new = (
        old[:i]
        + pick(rng, ("", " ", "\n", "1", "*", "x", "°", "\x1b[2K", "**2", "-", "(", "  proved  "))
        + old[i + int(rng.integers(2)) :]
    )
    at(data, way[:-1])[way[-1]] = new
    return f"{way} = {new!r}"


def renamed(data: Content, rng: np.random.Generator) -> str:
    """One name, everywhere or only where it is declared."""
    names = [s["name"] for key in ("states", "inputs", "outputs", "disturbances") for s in data["model"][key]]
    names += [*data["model"]["constants"], data["scheduling"][0]["name"]]
    old, new = pick(rng, names), pick(rng, [*names, "x1", "other", "decay_rate", "exp", "pi", "E"])
    everywhere = bool(rng.integers(2))

    def walk(value: Any) -> Any:
        if isinstance(value, dict):
            return {walk(k) if everywhere else k: walk(v) for k, v in value.items()}
        if isinstance(value, list):
            return [walk(v) for v in value]
        if isinstance(value, str):
            return re.sub(rf"\b{old}\b", new, value) if everywhere else new if value == old else value
        return value

    data["model"] = walk(data["model"])
    if everywhere:
        data["scheduling"], data["claims"] = walk(data["scheduling"]), walk(data["claims"])
    return f"{old} -> {new} {'everywhere' if everywhere else ''}"
