"""The structure that the content of a schedule must have: keys, shapes, units, ranges, representable numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from estimators.errors import ScheduleError

SCHEMA = "gainsmith.schedule/1"
SEALS = ("section_sha256", "sha256")
SECTIONS = (
    *("schema", "name", "description", "model", "scheduling", "sample_time", "plant", "gain"),
    *("guarantee", "certificate", "provenance"),
)
LARGEST = 1e100
CLOSEST = 1e-9  # least distance of breakpoints, as a part of the range: slopes stay finite
_SIGNALS = ("states", "inputs", "outputs", "disturbances")
_PARAMETER_KEYS = ("name", "unit", "min", "max", "rate_min", "rate_max", "absolute", "breakpoints")
_GAIN_KEYS = ("unit", "dtype", "interpolation", "table")


def check_content(content: Mapping[str, Any], where: str) -> None:
    """Checks everything the runtime relies on; digests are checked when a file is read.

    The plant is xdot = A x + B u + E d, y = C x + D u + F d with polynomial matrices; `gain.table` has the shape
    (breakpoints of each parameter, states, outputs). `guarantee`, `certificate` and `provenance` are objects whose
    content belongs to their writers.

    Raises:
        ScheduleError: names `where`, the JSON place such as `gain.table[3]`, and what was expected there.
    """
    check = _Check(where)
    check.keys(content, "", (*SECTIONS, *(key for key in SEALS if key in content)))
    if content["schema"] != SCHEMA:
        check.fail("schema", f"{content['schema']!r} is not understood; this version reads '{SCHEMA}'")
    check.text(content["name"], "name")
    check.text(content["description"], "description", empty=True)
    sizes = check.model(content["model"])
    counts = check.scheduling(content["scheduling"])
    if check.number(content["sample_time"], "sample_time") <= 0:
        check.fail("sample_time", f"{content['sample_time']} s must be positive")
    check.plant(content["plant"], content["scheduling"], sizes)
    check.gain(content["gain"], counts, sizes)
    for key in ("guarantee", "certificate", "provenance"):
        check.mapping(content[key], key)


class _Check:
    """Checks with the file name in every message."""

    def __init__(self, where: str) -> None:
        self.where = where

    def fail(self, place: str, why: str) -> NoReturn:
        raise ScheduleError(f"{self.where}: {place}: {why}")

    def mapping(self, value: Any, place: str) -> None:
        if not isinstance(value, Mapping):
            self.fail(place or "content", f"expected an object, got {type(value).__name__}")

    def keys(self, value: Any, place: str, expected: Sequence[str], closed: bool = True) -> None:
        self.mapping(value, place)
        prefix = f"{place}." if place else ""
        for key in expected:
            if key not in value:
                self.fail(f"{prefix}{key}", "missing")
        for key in value:
            if closed and key not in expected:
                self.fail(f"{prefix}{key}", f"unknown key; known: {', '.join(expected)}")

    def items(self, value: Any, place: str, count: int | None = None) -> Sequence[Any]:
        if not isinstance(value, (list, tuple)):
            self.fail(place, f"expected a list, got {type(value).__name__}")
        if count is not None and len(value) != count:
            self.fail(place, f"has {len(value)} entries, expected {count}")
        return value

    def text(self, value: Any, place: str, empty: bool = False) -> str:
        if not isinstance(value, str) or not (value or empty):
            self.fail(place, f"expected {'a' if empty else 'a non-empty'} text, got {value!r}")
        return value

    def number(self, value: Any, place: str) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fail(place, f"expected a number, got {value!r}")
        try:
            exact = float(value)
        except OverflowError:
            exact = math.inf
        if not math.isfinite(exact) or exact != value:
            self.fail(place, f"{value!r} is not a finite number that float64 holds exactly")
        return exact

    def array(self, value: Any, place: str, shape: tuple[int, ...]) -> list[float]:
        """The numbers of a nested list of this shape, in order."""
        if not shape:
            number = self.number(value, place)
            if abs(number) > LARGEST:
                self.fail(place, f"{number!r} is beyond {LARGEST:g}: no physical quantity, and products would overflow")
            return [number]
        entries = self.items(value, place, shape[0])
        found: list[float] = []
        for index, entry in enumerate(entries):
            found += self.array(entry, f"{place}[{index}]", shape[1:])
        return found

    def model(self, model: Any) -> dict[str, int]:
        """The number of states, inputs, outputs and disturbances."""
        self.keys(model, "model", ("id", "source", *_SIGNALS, "constants"), closed=False)
        self.text(model["id"], "model.id")
        self.text(model["source"], "model.source")
        for kind in _SIGNALS:
            names = []
            for index, signal in enumerate(self.items(model[kind], f"model.{kind}")):
                place = f"model.{kind}[{index}]"
                self.keys(signal, place, ("name", "unit"), closed=False)
                names.append(self.text(signal["name"], f"{place}.name"))
                self.text(signal["unit"], f"{place}.unit")
            if len(set(names)) < len(names):
                self.fail(f"model.{kind}", f"names are not unique: {', '.join(names)}")
        for kind in ("states", "outputs"):
            if not model[kind]:
                self.fail(f"model.{kind}", "an observer needs at least one")
        self.mapping(model["constants"], "model.constants")
        for name, constant in model["constants"].items():
            place = f"model.constants.{name}"
            self.keys(constant, place, ("value", "unit"), closed=False)
            self.number(constant["value"], f"{place}.value")
            self.text(constant["unit"], f"{place}.unit")
        return {kind: len(model[kind]) for kind in _SIGNALS}

    def scheduling(self, scheduling: Any) -> tuple[int, ...]:
        """The number of breakpoints of each parameter."""
        entries = self.items(scheduling, "scheduling")
        if not entries:
            self.fail("scheduling", "needs at least one parameter")
        for index, entry in enumerate(entries):
            place = f"scheduling[{index}]"
            self.keys(entry, place, _PARAMETER_KEYS)
            self.parameter(entry, place)
        names = [entry["name"] for entry in entries]
        if len(set(names)) < len(names):
            self.fail("scheduling", f"names are not unique: {', '.join(names)}")
        return tuple(len(entry["breakpoints"]) for entry in entries)

    def parameter(self, entry: Mapping[str, Any], place: str) -> None:
        name, unit = self.text(entry["name"], f"{place}.name"), self.text(entry["unit"], f"{place}.unit")
        low, high, slow, fast = (
            self.number(entry[key], f"{place}.{key}") for key in ("min", "max", "rate_min", "rate_max")
        )
        if not low < high:
            self.fail(f"{place}.max", f"range [{low}, {high}] {unit} of {name} is empty or reversed")
        if not slow <= 0 <= fast:
            self.fail(f"{place}.rate_min", f"rates [{slow}, {fast}] {unit}/s of {name} must enclose 0")
        if not isinstance(entry["absolute"], bool):
            self.fail(f"{place}.absolute", f"expected true or false, got {entry['absolute']!r}")
        if entry["absolute"] and low < 0:
            self.fail(f"{place}.min", f"{low} {unit}: an absolute value has no negative range")
        points = self.items(entry["breakpoints"], f"{place}.breakpoints")
        numbers = self.array(points, f"{place}.breakpoints", (len(points),))
        if len(numbers) < 2 or numbers[0] != low or numbers[-1] != high:
            self.fail(f"{place}.breakpoints", f"must start at min = {low} {unit} and end at max = {high} {unit}")
        for index in range(1, len(numbers)):
            if not numbers[index] - numbers[index - 1] > CLOSEST * (high - low):
                self.fail(
                    f"{place}.breakpoints[{index}]",
                    f"{numbers[index]} {unit} does not lie clearly above its predecessor {numbers[index - 1]} {unit}",
                )

    def plant(self, plant: Any, scheduling: Any, sizes: Mapping[str, int]) -> None:
        nx, nu, ny, nd = (sizes[kind] for kind in _SIGNALS)
        shapes = {"A": (nx, nx), "B": (nx, nu), "C": (ny, nx), "D": (ny, nu), "E": (nx, nd), "F": (ny, nd)}
        self.keys(plant, "plant", ("abs", *shapes))
        absolute = [entry["name"] for entry in scheduling if entry["absolute"]]
        if list(self.items(plant["abs"], "plant.abs")) != absolute:
            self.fail("plant.abs", f"{plant['abs']} does not agree with scheduling[].absolute: {absolute}")
        for key, shape in shapes.items():
            place = f"plant.{key}"
            self.keys(plant[key], place, ("monomials", "coefficients"))
            monomials = self.items(plant[key]["monomials"], f"{place}.monomials")
            seen = set()
            for index, powers in enumerate(monomials):
                spot = f"{place}.monomials[{index}]"
                for power in self.items(powers, spot, len(scheduling)):
                    if isinstance(power, bool) or not isinstance(power, int) or power < 0:
                        self.fail(spot, f"powers must be integers from 0 on, got {power!r}")
                if tuple(powers) in seen:
                    self.fail(spot, f"the monomial {list(powers)} appears twice")
                seen.add(tuple(powers))
            self.array(plant[key]["coefficients"], f"{place}.coefficients", (len(monomials), *shape))

    def gain(self, gain: Any, counts: tuple[int, ...], sizes: Mapping[str, int]) -> None:
        self.keys(gain, "gain", _GAIN_KEYS)
        if gain["interpolation"] != "linear":
            self.fail("gain.interpolation", f"{gain['interpolation']!r} is not known; expected 'linear'")
        if gain["dtype"] not in ("float32", "float64"):
            self.fail("gain.dtype", f"{gain['dtype']!r} is not known; expected 'float32' or 'float64'")
        for row, units in enumerate(self.items(gain["unit"], "gain.unit", sizes["states"])):
            for column, unit in enumerate(self.items(units, f"gain.unit[{row}]", sizes["outputs"])):
                self.text(unit, f"gain.unit[{row}][{column}]")
        shape = (*counts, sizes["states"], sizes["outputs"])
        exact = np.array(self.array(gain["table"], "gain.table", shape)).reshape(shape)
        if gain["dtype"] == "float32":
            with np.errstate(over="ignore", under="ignore"):
                wrong = np.argwhere(exact.astype(np.float32).astype(np.float64) != exact)
            if wrong.size:
                place = "gain.table" + "".join(f"[{index}]" for index in wrong[0])
                self.fail(place, f"{float(exact[tuple(wrong[0])])!r} is not a float32 number; round it before storing")
