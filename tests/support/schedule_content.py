"""Content of small schedules with the published values, for tests that need one without solving anything."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

# P1 Table I and the fixed gains of (29), (41); P3 Table I and its road-test gains.
PUBLISHED: dict[str, dict[str, Any]] = {
    "longitudinal": {"constants": (632.1, 0.76, 0.0016, 8.32), "gains": (0.68, 183.1), "source": "P1 (18)-(26)"},
    "lateral": {"constants": (181.5, 0.81, 0.001, 12.84), "gains": (1.11, 16.7), "source": "P1 (36)-(39)"},
    "resilient-longitudinal": {"constants": (641.0, 0.85, 0.0016, 8.1), "gains": (1.18, 387.0), "source": "P3 (3)-(8)"},
    "resilient-lateral": {"constants": (131.5, 0.82, 0.001, 13.4), "gains": (1.21, 16.8), "source": "P3 (11)-(13)"},
}
EFFECTIVE_RADIUS = 0.33


def schedule_content(
    direction: str = "longitudinal",
    gains: Any = None,
    breakpoints: Any = (0.0, 30.0, 80.0, 140.0),
    dtype: str = "float64",
    update: str = "held",
    sample_time: float = 0.005,
) -> dict[str, Any]:
    """Unsealed content: `gains` is one pair (L1, L2) for all breakpoints or a pair for each."""
    values = PUBLISHED[direction]
    pairs = values["gains"] if gains is None else gains
    if not isinstance(pairs[0], (list, tuple)):
        pairs = [pairs] * len(breakpoints)
    units = {"sigma0": "1/m", "sigma1": "s/m", "sigma2": "s/m", "kappa": "1/m"}
    constants = {name: {"value": value, "unit": units[name]} for name, value in zip(units, values["constants"])}  # noqa: B905
    constants["effective_radius"] = {"value": EFFECTIVE_RADIUS, "unit": "m"}
    sigma0, sigma1, sigma2, kappa = map(decimal, values["constants"])
    decay = kappa * decimal(EFFECTIVE_RADIUS)
    found = {
        "schema": "gainsmith.schedule/2",
        "name": f"test-{direction}",
        "description": "published values, nothing proved",
        "model": {
            "id": f"corner-velocity-{direction}",
            "source": values["source"],
            "states": [{"name": "bristle_deflection", "unit": "m"}, {"name": "relative_velocity", "unit": "m/s"}],
            "inputs": [{"name": "relative_acceleration", "unit": "m/s^2"}],
            "outputs": [{"name": "normalised_force", "unit": "1"}],
            "disturbances": [
                {"name": "friction", "unit": "m/s"},
                {"name": "acceleration_error", "unit": "m/s^2"},
                {"name": "force_noise", "unit": "1"},
            ],
            "constants": constants,
            "matrices": {
                "A": [["-kappa*effective_radius*wheel_speed", "1"], ["0", "0"]],
                "B": [["0"], ["1"]],
                "C": [["sigma0 - sigma1*kappa*effective_radius*wheel_speed", "sigma1 + sigma2"]],
                "D": [["0"]],
                "E": [["1", "0", "0"], ["0", "1", "0"]],
                "F": [["sigma1", "0", "0.5"]],
            },
        },
        "scheduling": [
            {
                "name": "wheel_speed",
                "unit": "rad/s",
                "min": breakpoints[0],
                "max": breakpoints[-1],
                "rate_min": -800,
                "rate_max": 800,
                "absolute": True,
                "breakpoints": list(breakpoints),
            }
        ],
        "update": {"kind": update, "sample_time": sample_time},
        "plant": {},
        "gain": {
            "dtype": dtype,
            "interpolation": "linear",
            "table": [[[first], [second]] for first, second in pairs],
        },
        "claims": [
            {"kind": "decay rate", "level": 80.0, "P": {"orders": [[0]], "coefficients": [[[1.0, 0.0], [0.0, 1.0]]]}}
        ],
        "provenance": {"created": "2024-01-01"},
    }
    powers: dict[str, list[Any]] = {
        "A": [[[0, 1], [0, 0]], [[-decay, 0], [0, 0]]],
        "B": [[[0], [1]]],
        "C": [[[sigma0, sigma1 + sigma2]], [[-sigma1 * decay, 0]]],
        "D": [[[0]]],
        "E": [[[1, 0, 0], [0, 1, 0]]],
        "F": [[[sigma1, 0, 0.5]]],
    }
    for key, coefficients in powers.items():
        found["plant"][key] = chebyshev(breakpoints[0], breakpoints[-1], *coefficients)
    return found


def with_matrix(content: dict[str, Any], key: str, *coefficients: Any) -> None:
    """Puts another matrix into unsealed content, from its coefficients of 1, p, p^2, ...: in numbers and as formulas."""
    entry = content["scheduling"][0]
    content["plant"][key] = chebyshev(entry["min"], entry["max"], *coefficients)
    content["model"]["matrices"][key] = [
        [
            " + ".join(f"({value!r})*{entry['name']}**{power}" for power, value in enumerate(cell))
            for cell in zip(*rows, strict=True)
        ]
        for rows in zip(*coefficients, strict=True)
    ]


def chebyshev(low: float, high: float, *coefficients: Any) -> dict[str, Any]:
    """The stored form, T_0(u), T_1(u), ..., of a matrix polynomial in p on [low, high]: exact, rounded once at the end.

    Horner's scheme over Chebyshev series, p = middle + half u and u T_k = (T_k+1 + T_|k-1|)/2.
    """
    middle, half = (decimal(low) + decimal(high)) / 2, (decimal(high) - decimal(low)) / 2

    def series(powers: list[Any]) -> list[Fraction]:
        found: list[Fraction] = []
        for value in reversed(powers):
            moved = [middle * c for c in found] + [Fraction(0)]
            for k, c in enumerate(found):
                moved[k + 1] += half * c / 2
                moved[abs(k - 1)] += half * c / 2
            moved[0] += decimal(value)
            found = moved
        return found[: len(powers)]

    cells = [[series(list(cell)) for cell in zip(*rows, strict=True)] for rows in zip(*coefficients, strict=True)]
    orders = range(len(coefficients))
    return {
        "orders": [[order] for order in orders],
        "coefficients": [[[float(cell[order]) for cell in row] for row in cells] for order in orders],
    }


def decimal(value: float | Fraction) -> Fraction:
    """The number that is written."""
    return value if isinstance(value, Fraction) else Fraction(repr(float(value)))
