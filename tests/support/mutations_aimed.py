"""Changes of a schedule's claims: what is claimed, of what, in which units, and with which P."""

from __future__ import annotations

import copy

import numpy as np

from tests.support.mutations_blind import FACTORS, Content, changed, pick

KINDS = (
    "decay rate", "fastest pole", "gain", "internal update", "sampled error", "sampled gain", "motion gain", "drop probability",
)  # fmt: skip
UNITS = (
    "1",
    "m",
    "ft",
    "m/s",
    "km/h",
    "1/s",
    "Hz",
    "rad/s",
    "rpm",
    "N",
    "kg",
    "%",
    "s",
    "ms",
    "m/s^2",
    "K",
    "degC",
    "",
    "mm",
)


def unit(data: Content, rng: np.random.Generator) -> str:
    model = data["model"]
    holders = [s for key in ("states", "inputs", "outputs", "disturbances") for s in model[key]]
    holder = pick(rng, [*holders, *model["constants"].values(), *data["scheduling"]])
    holder["unit"] = pick(rng, [*UNITS, *(h["unit"] for h in holders), f"{holder['unit']}*s", f"({holder['unit']})^2"])
    return f"{holder}"


def kind(data: Content, rng: np.random.Generator) -> str:
    claim = pick(rng, data["claims"])
    claim["kind"] = pick(rng, KINDS)
    if rng.integers(2):
        claim["level"] = pick(rng, (1e6, 1e-9, 0.999, claim["level"]))
    if rng.integers(2):
        claim.pop("channel", None)
    if rng.integers(2) and "channel" in data["claims"][0]:
        claim["channel"] = copy.deepcopy(data["claims"][0]["channel"])
    return f"{claim['kind']} {claim['level']}"


def level(data: Content, rng: np.random.Generator) -> str:
    claim = pick(rng, data["claims"])
    claim["level"] *= float(pick(rng, (1.0 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-7.0, 0.0), *FACTORS)))
    return f"{claim['kind']} {claim['level']!r}"


def channel(data: Content, rng: np.random.Generator) -> str:
    claim = pick(rng, [c for c in data["claims"] if "channel" in c])
    now, model = claim["channel"], data["model"]
    group = [s["name"] for s in model["states" if claim["kind"] == "motion gain" else "disturbances"]]
    way = int(rng.integers(5))
    if way == 0:
        now["inputs"] = {pick(rng, group): size for size in now["inputs"].values()}
    elif way == 1:
        now["inputs"][pick(rng, group)] = float(10.0 ** rng.uniform(-3, 1))
    elif way == 2:
        factor = float(pick(rng, (0.1, 0.5, 0.9, 1.1, 2.0, 10.0)))
        now["inputs"] = {name: size * factor for name, size in now["inputs"].items()}
        claim["level"] *= factor if rng.integers(2) else 1.0
    elif way == 3:
        now["errors"] = [pick(rng, [s["name"] for s in model["states"]])]
    else:
        now["errors"] = [str(x) for x in rng.permutation([s["name"] for s in model["states"]])]
    return f"{claim['kind']} {now} {claim['level']}"


def lyapunov(data: Content, rng: np.random.Generator) -> str:
    claim, other = pick(rng, data["claims"]), pick(rng, data["claims"])
    P, way = claim["P"], int(rng.integers(6))
    if way == 0:
        claim["P"], other["P"] = other["P"], claim["P"]
    elif way == 1:
        factor = float(pick(rng, FACTORS))
        P["coefficients"] = (np.array(P["coefficients"]) * factor).tolist()
    elif way == 2:
        pick(rng, P["orders"])[0] = int(rng.choice([0, 1, 2, 3, 16, 17, 20000]))
    elif way == 3:
        P["orders"], P["coefficients"] = P["orders"][:-1], P["coefficients"][:-1]
    elif way == 4:
        P["orders"], P["coefficients"] = [], []
    else:
        k, n = int(rng.integers(len(P["orders"]))), len(P["coefficients"][0])
        i, j = (int(x) for x in rng.integers(n, size=2))
        P["coefficients"][k][i][j] = P["coefficients"][k][j][i] = changed(P["coefficients"][k][i][j], rng)
    return f"{claim['kind']} {way}"


def claims(data: Content, rng: np.random.Generator) -> str:
    now, way = data["claims"], int(rng.integers(4))
    if way == 0:
        data["claims"] = [now[int(i)] for i in sorted(rng.permutation(len(now))[: int(rng.integers(len(now) + 1))])]
    elif way == 1:
        data["claims"] = now[::-1]
    elif way == 2:
        one = copy.deepcopy(pick(rng, now))
        one["level"] *= 1.01
        now.append(one)
    else:
        one = copy.deepcopy(pick(rng, [c for c in now if "channel" in c]))
        one["channel"]["inputs"] = {name: size * 2.0 for name, size in one["channel"]["inputs"].items()}
        one["level"] *= float(pick(rng, (1.0, 1.5, 2.0, 2.1)))
        now.append(one)
    return f"{way} {len(data['claims'])}"
