"""The structure of format 2: a closed set of keys, shapes, units, ranges, representable numbers, sizes.

What is stated here is only form. That the plant is the one of the formulas and constants, that units fit, and that claims
hold, is for `synthesis.certificate` to show.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from estimators.schedule.check_tables import check_cells, check_tables
from estimators.schedule.check_update import LoopSizes, check_gain, check_update
from estimators.schedule.checker import DEEPEST, LONGEST_NAME, Checker, quoted, shown, too_deep
from estimators.schedule.constraints import check_constraints

SCHEMA = "gainsmith.schedule/2"
SEALS = ("section_sha256", "sha256")
SECTIONS = (
    *("schema", "name", "description", "model", "scheduling", "update", "plant", "gain", "claims", "provenance"),
)
OPTIONAL = ("constraints",)  # where the set of the parameters is no box
SIGNALS = ("states", "inputs", "outputs", "disturbances")
SHAPES = {  # rows and columns of the plant's matrices, by kinds of signals
    "A": ("states", "states"), "B": ("states", "inputs"), "C": ("outputs", "states"),
    "D": ("outputs", "inputs"), "E": ("states", "disturbances"), "F": ("outputs", "disturbances"),
}  # fmt: skip
CLOSEST = 1e-9  # least distance of breakpoints as a part of the range, and least width of a range as a part of its ends
NARROWEST = 1e-90  # least width of a range in its unit: slopes stay finite
MOST = {"states": 32, "inputs": 32, "outputs": 32, "disturbances": 64}
MOST_PARAMETERS, MOST_BREAKPOINTS, MOST_CONSTANTS, MOST_CLAIMS = 6, 4096, 256, 256
MOST_PROVENANCE = 20_000  # entries at all levels
HIGHEST_ORDER = 16  # of Chebyshev polynomials, for every parameter
LONGEST_FORMULA = 2000
_PARAMETER_KEYS = ("name", "unit", "min", "max", "rate_min", "rate_max", "absolute", "breakpoints")


def check_content(content: Mapping[str, Any], where: str) -> None:
    """Checks the form of everything; digests are checked when a file is read.

    The plant is xdot = A x + B u + E d, y = C x + D u + F d, its matrices polynomials in u = (p - middle)/half of each parameter,
    over `plant.denominator` where there is one (a positive polynomial; absent: one), or a plant by cells
    (`estimators.schedule.check_tables`, of `model.tables`, which may be left out);
    `gain.table` has the shape (breakpoints of each parameter, rows, columns): an observer's states by outputs, or what
    `gain_signals` names. Rates are numbers, or both null: the parameter may jump, and no P depends on it. `constraints`, which
    may be left out, are linear inequalities between the parameters (`estimators.schedule.constraints`). `provenance` says where
    a file came from and is free (no control characters, no numbers that other readers would read otherwise); nothing in it is
    believed.

    Raises:
        ScheduleError: names `where`, the JSON place such as `gain.table[3]`, and what was expected there.
    """
    check = Checker(where)
    check_depth(content, where)
    check.keys(content, "", SECTIONS, (*OPTIONAL, *SEALS))
    if content["schema"] != SCHEMA:
        check.fail("schema", f"{quoted(content['schema'])} is not understood; this version reads '{SCHEMA}'")
    check.text(content["name"], "name", most=2 * LONGEST_NAME)
    check.text(content["description"], "description", empty=True)
    sizes = _model(check, content["model"])
    counts = _scheduling(check, content["scheduling"])
    if "constraints" in content:
        check_constraints(check, content["constraints"], content["scheduling"])
    loop = check_update(check, content["update"], sizes)
    if "tables" in content["model"]:
        check_tables(check, content["model"]["tables"], content["scheduling"], MOST_BREAKPOINTS)
    _plant(check, content["plant"], content["scheduling"], sizes)
    check_gain(check, content["gain"], (*counts, loop.rows, loop.columns))
    for index, claim in enumerate(check.items(content["claims"], "claims", most=MOST_CLAIMS)):
        _claim(check, claim, f"claims[{index}]", len(counts), loop)
    check.mapping(content["provenance"], "provenance")
    check.plain(content["provenance"], "provenance", MOST_PROVENANCE)


def check_depth(content: Any, where: str) -> None:
    """Nesting that recursion can follow, whatever is nested.

    Raises:
        ScheduleError: names the section.
    """
    if too_deep(content):
        sections = content.items() if isinstance(content, Mapping) else ()
        place = next((shown(key, 40) for key, value in sections if too_deep([value])), "content")
        Checker(where).fail(place, f"lists and objects are nested too deeply; at most {DEEPEST} levels are read")


def _plant(check: Checker, plant: Any, scheduling: Any, sizes: Mapping[str, int]) -> None:
    shapes = {key: (sizes[rows], sizes[columns]) for key, (rows, columns) in SHAPES.items()}
    if isinstance(plant, Mapping) and "cells" in plant:
        check_cells(check, plant, scheduling, shapes, HIGHEST_ORDER, CLOSEST)
        return
    check.keys(plant, "plant", tuple(SHAPES), ("denominator",))
    for key, shape in shapes.items():
        check.polynomial(plant[key], f"plant.{key}", len(scheduling), shape, HIGHEST_ORDER)
    if "denominator" in plant:
        check.polynomial(plant["denominator"], "plant.denominator", len(scheduling), (1, 1), HIGHEST_ORDER)


def _model(check: Checker, model: Any) -> dict[str, int]:
    """The number of states, inputs, outputs and disturbances."""
    check.keys(model, "model", ("id", "source", *SIGNALS, "constants", "matrices"), ("tables",))
    check.text(model["id"], "model.id", most=2 * LONGEST_NAME)
    check.text(model["source"], "model.source")
    names: list[str] = []
    for kind in SIGNALS:
        for index, signal in enumerate(check.items(model[kind], f"model.{kind}", most=MOST[kind])):
            place = f"model.{kind}[{index}]"
            check.keys(signal, place, ("name", "unit"))
            names.append(check.name(signal["name"], f"{place}.name"))
            if names.count(names[-1]) > 1:
                check.fail(f"model.{kind}", f"names are not unique: {names[-1]} stands twice")
            check.unit(signal["unit"], f"{place}.unit")
    for kind in ("states", "outputs"):
        if not model[kind]:
            check.fail(f"model.{kind}", "a model needs at least one")
    check.mapping(model["constants"], "model.constants", MOST_CONSTANTS)
    for name, constant in model["constants"].items():
        check.name(name, f"model.constants.{shown(name, 40)}")
        place = f"model.constants.{name}"
        check.keys(constant, place, ("value", "unit"), ("source",))
        check.number(constant["value"], f"{place}.value")
        check.unit(constant["unit"], f"{place}.unit")
        check.text(constant.get("source", ""), f"{place}.source", empty=True)
    sizes = {kind: len(model[kind]) for kind in SIGNALS}
    check.keys(model["matrices"], "model.matrices", tuple(SHAPES))
    for key, (above, beside) in SHAPES.items():
        place = f"model.matrices.{key}"
        for i, row in enumerate(check.items(model["matrices"][key], place, sizes[above])):
            for j, formula in enumerate(check.items(row, f"{place}[{i}]", sizes[beside])):
                check.text(formula, f"{place}[{i}][{j}]", most=LONGEST_FORMULA)
    return sizes


def _scheduling(check: Checker, scheduling: Any) -> tuple[int, ...]:
    """The number of breakpoints of each parameter."""
    entries = check.items(scheduling, "scheduling", most=MOST_PARAMETERS)
    if not entries:
        check.fail("scheduling", "needs at least one parameter")
    for index, entry in enumerate(entries):
        place = f"scheduling[{index}]"
        check.keys(entry, place, _PARAMETER_KEYS)
        _parameter(check, entry, place)
    names = [entry["name"] for entry in entries]
    for name in names:
        if names.count(name) > 1:
            check.fail("scheduling", f"names are not unique: {name} stands twice")
    return tuple(len(entry["breakpoints"]) for entry in entries)


def _parameter(check: Checker, entry: Any, place: str) -> None:
    name = shown(check.name(entry["name"], f"{place}.name"), 30)
    unit = shown(check.unit(entry["unit"], f"{place}.unit"), 30)
    low, high = check.number(entry["min"], f"{place}.min"), check.number(entry["max"], f"{place}.max")
    if not low < high:
        check.fail(f"{place}.max", f"range [{low}, {high}] {unit} of {name} is empty or reversed")
    if not high - low > max(CLOSEST * max(-low, high), NARROWEST):
        check.fail(
            f"{place}.max", f"range [{low}, {high}] {unit} of {name} is too narrow for float64 to tell values apart"
        )
    if not (entry["rate_min"] is None and entry["rate_max"] is None):  # both null: the parameter may jump
        falling = check.number(entry["rate_min"], f"{place}.rate_min")
        rising = check.number(entry["rate_max"], f"{place}.rate_max")
        if not falling <= 0.0 <= rising:
            check.fail(f"{place}.rate_min", f"rates [{falling}, {rising}] {unit}/s of {name} must contain 0")
    if not isinstance(entry["absolute"], bool):
        check.fail(f"{place}.absolute", f"expected true or false, got {quoted(entry['absolute'])}")
    if entry["absolute"] and low < 0.0:
        check.fail(f"{place}.min", f"{low} {unit}: an absolute value has no negative range")
    points = check.items(entry["breakpoints"], f"{place}.breakpoints", most=MOST_BREAKPOINTS)
    numbers = [check.number(value, f"{place}.breakpoints[{i}]") for i, value in enumerate(points)]
    if len(numbers) < 2 or numbers[0] != low or numbers[-1] != high:
        check.fail(f"{place}.breakpoints", f"must start at min = {low} {unit} and end at max = {high} {unit}")
    for i in range(1, len(numbers)):
        if not numbers[i] - numbers[i - 1] > CLOSEST * (high - low):
            words = f"{numbers[i]} {unit} does not lie clearly above its predecessor {numbers[i - 1]} {unit}"
            check.fail(f"{place}.breakpoints[{i}]", words)


def _claim(check: Checker, claim: Any, place: str, parameters: int, loop: LoopSizes) -> None:
    check.keys(claim, place, ("kind", "level", "P"), ("channel", "centre"))
    check.text(claim["kind"], f"{place}.kind", most=LONGEST_NAME)
    check.positive(claim["level"], f"{place}.level")
    check.polynomial(claim["P"], f"{place}.P", parameters, (loop.states, loop.states), HIGHEST_ORDER)
    if "centre" in claim:
        check.number(claim["centre"], f"{place}.centre")
    if "channel" in claim:
        channel = claim["channel"]
        check.keys(channel, f"{place}.channel", ("inputs", "errors"))
        _sized(check, channel["inputs"], f"{place}.channel.inputs", max(MOST.values()))
        if isinstance(channel["errors"], Mapping):
            if not channel["errors"]:
                check.fail(f"{place}.channel.errors", "is empty; a channel needs at least one error")
            _sized(check, channel["errors"], f"{place}.channel.errors", loop.outputs)
        else:
            for i, error in enumerate(check.items(channel["errors"], f"{place}.channel.errors", most=loop.outputs)):
                check.name(error, f"{place}.channel.errors[{i}]")
        if not channel["inputs"] or not channel["errors"] or len(set(channel["errors"])) < len(channel["errors"]):
            check.fail(f"{place}.channel", "needs at least one input and one error, each once")


def _sized(check: Checker, signals: Any, place: str, most: int) -> None:
    """Names with the size of each that counts as one."""
    check.mapping(signals, place, most)
    for name, size in signals.items():
        check.positive(size, f"{place}.{check.name(name, place)}")
