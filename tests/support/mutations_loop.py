"""Changes of a schedule's loop: formulas, constants, table, range, rates, sample time, order of signals.

Most of them rebuild the stored plant from the formulas, so that nothing but a proof stands between the file and its claims.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from tests.support.mutations_blind import FACTORS, Content, changed, pick
from tests.support.schedule_oracle import SHAPES, Oracle

HOSTILE = ("9**9**9", "1e1000000000", "(" * 120 + "1" + ")" * 120, "__import__('os')", "1/0", "lambda: 1", "1e-3*1e3")


def formula(data: Content, rng: np.random.Generator) -> str:
    key = pick(rng, "ABCDEF")
    i = int(rng.integers(len(data["model"]["matrices"][key])))
    j = int(rng.integers(len(data["model"]["matrices"][key][i])))
    old, names = data["model"]["matrices"][key][i][j], [*data["model"]["constants"], data["scheduling"][0]["name"]]
    way = int(rng.integers(6))
    if way == 0:
        new = re.sub(r"[-+*/]", lambda m: pick(rng, "+-*/") if rng.random() < 0.5 else m[0], old)
    elif way == 1:
        new = re.sub(r"\b[A-Za-z_]\w*", lambda m: pick(rng, names) if rng.random() < 0.5 else m[0], old)
    elif way == 2:
        new = f"({old})*{pick(rng, ('2', '1', '-1', '0', '1/3', '1.001', '1e-3', names[0], names[0] + '/' + names[0]))}"
    elif way == 3:
        new = f"{old} {pick(rng, '+-')} {pick(rng, ('0', '1', '0.25', '2*' + old, names[-1], names[-1] + '**2'))}"
    elif way == 4:
        new = pick(rng, [cell for rows in data["model"]["matrices"].values() for row in rows for cell in row])
    else:
        new = pick(rng, HOSTILE)
    data["model"]["matrices"][key][i][j] = new
    if new not in HOSTILE and rng.integers(2):
        rebuild(data)
        return f"{key}[{i}][{j}] = {new[:60]} rebuilt"
    return f"{key}[{i}][{j}] = {new[:60]}"


def constant(data: Content, rng: np.random.Generator) -> str:
    name = pick(rng, data["model"]["constants"])
    entry = data["model"]["constants"][name]
    entry["value"] = changed(entry["value"], rng)
    if rng.random() < 0.7:
        rebuild(data)
        return f"{name} = {entry['value']!r} rebuilt"
    return f"{name} = {entry['value']!r}"


def table(data: Content, rng: np.random.Generator) -> str:
    rows = np.array(data["gain"]["table"], float)
    way = int(rng.integers(5))
    if way == 0:
        rows = rows * float(pick(rng, FACTORS))
    elif way == 1:
        rows = rows[::-1]
    elif way == 2:
        rows[int(rng.integers(len(rows)))] *= 1.0 + float(rng.normal() * 10.0 ** rng.uniform(-3, 0))
    elif way == 3:
        rows = rows * (1.0 + rng.normal(size=rows.shape) * 10.0 ** rng.uniform(-4, -1))
    else:
        data["gain"]["dtype"] = pick(rng, ("float32", "float64"))
    if data["gain"]["dtype"] == "float32" and rng.random() < 0.8:
        rows = rows.astype(np.float32).astype(float)
    data["gain"]["table"] = rows.tolist()
    return f"{way}"


def points(data: Content, rng: np.random.Generator) -> str:
    """Breakpoints alone, or the range with the plant that belongs to it."""
    entry, rows = data["scheduling"][0], data["gain"]["table"]
    way, places = int(rng.integers(5)), entry["breakpoints"]
    if way == 0:
        i = int(rng.integers(1, len(places) - 1))
        places[i] += float(rng.normal()) * 0.2 * (places[i + 1] - places[i])
    elif way == 1:
        i = int(rng.integers(1, len(places) - 1))
        del places[i], rows[i]
    elif way == 2:
        i = int(rng.integers(1, len(places)))
        places.insert(i, 0.5 * (places[i - 1] + places[i]))
        rows.insert(i, (0.5 * (np.array(rows[i - 1]) + np.array(rows[i]))).tolist())
    else:
        width = float(entry["max"]) - float(entry["min"])
        shift = float(rng.normal() * 10.0 ** rng.uniform(-3, 0)) * width
        if way == 3:
            entry["max"] = places[-1] = entry["max"] + shift
        else:
            entry["min"], entry["max"] = entry["min"] + shift, entry["max"] + shift
            entry["breakpoints"] = [x + shift for x in places]
            entry["breakpoints"][0], entry["breakpoints"][-1] = entry["min"], entry["max"]
            entry["absolute"] = entry["absolute"] and entry["min"] >= 0
        if rng.random() < 0.8:
            rebuild(data)
    return f"{way} {entry['min']} {entry['max']}"


def rates(data: Content, rng: np.random.Generator) -> str:
    entry = data["scheduling"][0]
    key = pick(rng, ("rate_min", "rate_max"))
    entry[key] *= float(pick(rng, (0.0, 0.1, 0.5, 1.5, 3.0, 10.0, 1e3)))
    return f"{key} {entry[key]}"


def sampling(data: Content, rng: np.random.Generator) -> str:
    update = data["update"]
    if rng.integers(2):
        factor = float(pick(rng, (0.5, 0.9, 0.99, 1.01, 1.1, 2.0, 4.0)))
        update["sample_time"] = float(pick(rng, (10.0, 1e-9, *[update["sample_time"] * factor] * 4)))
        return f"{update}"
    update["kind"] = "held" if update["kind"] == "sampled" else "sampled"
    names = {"internal update": "sampled error", "sampled error": "internal update"}
    for claim in data["claims"]:
        claim["kind"] = names.get(claim["kind"], claim["kind"])
    if rng.integers(2):
        kept = ("sampled error", "internal update", "sampled gain", "drop probability")
        data["claims"] = [claim for claim in data["claims"] if claim["kind"] in kept]
    return f"{update}"


def ordered(data: Content, rng: np.random.Generator) -> str:
    """Disturbances (or states) in another order: their names alone, or with formulas, plant, and P."""
    model = data["model"]
    key = pick(rng, ("disturbances", "states"))
    order = [int(i) for i in rng.permutation(len(model[key]))]
    model[key] = [model[key][i] for i in order]
    if not rng.integers(2):
        return f"{key} {order}"
    for letter, (rows, columns) in SHAPES.items():
        if columns == key:
            model["matrices"][letter] = [[row[i] for i in order] for row in model["matrices"][letter]]
        if rows == key:
            model["matrices"][letter] = [model["matrices"][letter][i] for i in order]
    if key == "states":
        data["gain"]["table"] = [[row[i] for i in order] for row in data["gain"]["table"]]
        if rng.integers(2):
            for claim in data["claims"]:
                claim["P"]["coefficients"] = [
                    [[m[i][j] for j in order] for i in order] for m in claim["P"]["coefficients"]
                ]
    rebuild(data)
    return f"{key} {order} with what belongs to it"


def rebuild(data: Content) -> None:
    """The stored plant from formulas and constants, correctly rounded."""
    oracle = Oracle(data)
    for key, (rows, columns) in SHAPES.items():
        cells = [[_to_chebyshev(series) for series in row] for row in oracle.formulas_exact[key]]
        shape = (len(data["model"][rows]), len(data["model"][columns]))
        count = max((len(series) for row in cells for series in row), default=1)
        coefficients = np.zeros((count, *shape))
        for i, row in enumerate(cells):
            for j, series in enumerate(row):
                coefficients[: len(series), i, j] = series
        data["plant"][key] = {"orders": [[k] for k in range(count)], "coefficients": coefficients.tolist()}


def _to_chebyshev(powers: Sequence[Fraction]) -> list[float]:
    series: list[Fraction] = []
    for value in reversed(powers):  # Horner: u T_k = (T_k+1 + T_|k-1|) / 2
        moved = [Fraction(0)] * (len(series) + 1)
        for k, c in enumerate(series):
            moved[k + 1] += c / 2
            moved[abs(k - 1)] += c / 2
        moved[0] += value
        series = moved
    return [float(c) for c in series]
