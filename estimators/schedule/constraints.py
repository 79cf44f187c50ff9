"""Linear inequalities between scheduling parameters: the set for which a schedule was proved, where that is no box."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.schedule.checker import LONGEST_NAME, Checker, shown

MOST = 8
ROUNDING = 2.0**-50  # of the terms of an inequality: so far beyond it counts as inside, and the proof reaches further


class ParameterSet(NamedTuple):
    """All p with normals p <= bounds (m, p) and (m,), in the parameters' units; `centre` (p,) is well inside."""

    normals: FloatArray
    bounds: FloatArray
    centre: FloatArray
    words: tuple[str, ...]

    def outside(self, p: FloatArray) -> BoolArray:
        """Where values (.., p) break an inequality by more than rounding."""
        return np.asarray(self._broken(p).any(axis=-1))

    def drawn_in(self, p: FloatArray) -> FloatArray:
        """Values (.., p) outside moved straight towards the centre, up to the border: what a clip is for a range."""
        step = p - self.centre
        reach, room = step @ self.normals.T, self.bounds - self.normals @ self.centre
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(reach > room, room / reach, 1.0).min(axis=-1)
        return np.asarray(self.centre + share[..., None] * step)

    def refusal(self, names: Sequence[str], p: FloatArray, place: str) -> str:
        """The sentence that refuses one value (p,)."""
        which = int(np.argmax(self._broken(p)))
        values = ", ".join(f"{name} = {value:.12g}" for name, value in zip(names, p, strict=True))
        return f"{values} breaks {self.words[which]}, which holds in the certified set{place}"

    def _broken(self, p: FloatArray) -> BoolArray:
        slack = ROUNDING * (np.abs(p) @ np.abs(self.normals).T + np.abs(self.bounds))
        return np.asarray(p @ self.normals.T > self.bounds + slack)


def check_constraints(check: Checker, constraints: Any, scheduling: Sequence[Mapping[str, Any]]) -> None:
    """{"inequalities": [{"coefficients": {parameter: number}, "max": number, "unit": unit}], "centre": {parameter: number}}.

    The centre satisfies all of them strictly, and lies inside the ranges: so the set is not empty.
    """
    place = "constraints"
    check.keys(constraints, place, ("inequalities", "centre"))
    names = [entry["name"] for entry in scheduling]
    check.keys(constraints["centre"], f"{place}.centre", names)
    centre = {name: check.number(constraints["centre"][name], f"{place}.centre.{name}") for name in names}
    for entry in scheduling:
        if not entry["min"] < centre[entry["name"]] < entry["max"]:
            check.fail(f"{place}.centre.{entry['name']}", f"{centre[entry['name']]} is not inside the range")
    entries = check.items(constraints["inequalities"], f"{place}.inequalities", most=MOST)
    if not entries:
        check.fail(f"{place}.inequalities", "is empty; leave the section out where the set is a box")
    for index, entry in enumerate(entries):
        spot = f"{place}.inequalities[{index}]"
        check.keys(entry, spot, ("coefficients", "max", "unit"))
        check.unit(entry["unit"], f"{spot}.unit")
        check.mapping(entry["coefficients"], f"{spot}.coefficients", len(names))
        total = 0.0
        for name, factor in entry["coefficients"].items():
            here = f"{spot}.coefficients.{shown(name, 40)}"
            if name not in names:
                check.fail(here, f"is none of the scheduling parameters {', '.join(names)}")
            if check.number(factor, here) == 0.0:
                check.fail(here, "0 says nothing; leave it out")
            total += factor * centre[name]
        if len(entry["coefficients"]) < 2:
            check.fail(f"{spot}.coefficients", "names fewer than two parameters; the range of one is in scheduling")
        if not total < check.number(entry["max"], f"{spot}.max"):
            check.fail(f"{spot}.max", f"the centre of the set gives {total:g}, which is not below {entry['max']:g}")


def parameter_set(constraints: Mapping[str, Any] | None, names: Sequence[str]) -> ParameterSet | None:
    """From a checked section; None where there is none."""
    if constraints is None:
        return None
    entries = constraints["inequalities"]
    normals = np.array([[float(entry["coefficients"].get(name, 0.0)) for name in names] for entry in entries])
    bounds = np.array([float(entry["max"]) for entry in entries])
    centre = np.array([float(constraints["centre"][name]) for name in names])
    for array in (normals, bounds, centre):
        array.flags.writeable = False
    words = tuple(constraint_words(entry["coefficients"], entry["max"], entry["unit"]) for entry in entries)
    return ParameterSet(normals, bounds, centre, words)


def constraint_words(coefficients: Mapping[str, float], maximum: float, unit: str) -> str:
    """An inequality as an engineer writes it, such as 'load + 2 speed <= 3 m/s'."""
    text = ""
    for name, factor in coefficients.items():
        size = "" if abs(factor) == 1 else f"{abs(factor):g} "
        text += (" - " if factor < 0 else " + ") + size + shown(name, LONGEST_NAME)
    text = "-" + text.removeprefix(" - ") if text.startswith(" - ") else text.removeprefix(" + ")
    return f"{text} <= {maximum:g}{'' if unit == '1' else f' {unit}'}"
