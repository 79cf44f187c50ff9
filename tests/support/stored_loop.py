"""The loop of a stored schedule at one parameter value, by numpy and scipy; shares no code with the prover."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import expm


def polynomial(data: dict[str, Any], stored: dict[str, Any], value: float) -> np.ndarray:
    """Chebyshev coefficients by the recursion of T_k, written out here."""
    low, high = data["scheduling"][0]["min"], data["scheduling"][0]["max"]
    u = (value - 0.5 * (low + high)) / (0.5 * (high - low))
    terms = [1.0, u]
    while len(terms) <= max(order for (order,) in stored["orders"]):
        terms.append(2.0 * u * terms[-1] - terms[-2])
    return sum(terms[order] * np.array(c) for (order,), c in zip(stored["orders"], stored["coefficients"], strict=True))


def matrices(data: dict[str, Any], value: float) -> dict[str, np.ndarray]:
    """A to F and the gain at one parameter value."""
    found = {key: polynomial(data, stored, value) for key, stored in data["plant"].items()}
    table, points = np.array(data["gain"]["table"]), data["scheduling"][0]["breakpoints"]
    found["L"] = np.array([[np.interp(value, points, column) for column in row] for row in np.moveaxis(table, 0, -1)])
    return found


def closed_loop(data: dict[str, Any], value: float) -> tuple[np.ndarray, np.ndarray]:
    """A_e and B_e of the error equation, written out independently of the code under test."""
    m = matrices(data, value)
    return m["A"] - m["L"] @ m["C"], m["E"] - m["L"] @ m["F"]


def update(data: dict[str, Any], value: float) -> dict[str, np.ndarray]:
    """e+ = A e + B d + N x' with everything held over a sample, and A while no measurement comes in: one exponential of all."""
    m, T, n = matrices(data, value), data["update"]["sample_time"], len(data["model"]["states"])

    def held(A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        size = n + B.shape[1]
        whole = np.zeros((size, size))
        whole[:n, :n], whole[:n, n:] = A, B
        return expm(whole * T)[:n, :n], expm(whole * T)[:n, n:]

    coasting, forced = held(m["A"], m["E"])
    if data["update"]["kind"] == "sampled":
        return {"A": coasting - m["L"] @ m["C"], "B": forced - m["L"] @ m["F"], "coasting": coasting}
    A_e, B_e = closed_loop(data, value)
    A, B = held(A_e, B_e)
    return {"A": A, "B": B, "motion": held(m["A"], np.eye(n))[1] - held(A_e, np.eye(n))[1], "coasting": coasting}


def values(data: dict[str, Any], number: int) -> np.ndarray:
    return np.linspace(data["scheduling"][0]["min"], data["scheduling"][0]["max"], number)


def picked(data: dict[str, Any], claim: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of the inputs of a channel as columns, its errors as rows."""
    states = [s["name"] for s in data["model"]["states"]]
    group = states if claim["kind"] == "motion gain" else [d["name"] for d in data["model"]["disturbances"]]
    inputs = claim["channel"]["inputs"]
    W = np.array([[size if name == other else 0.0 for name, size in inputs.items()] for other in group])
    return W, np.array([[float(name == error) for name in states] for error in claim["channel"]["errors"]])
