"""Content of small schedules with the published values, for tests that need one without solving anything."""

from __future__ import annotations

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
) -> dict[str, Any]:
    """Unsealed content: `gains` is one pair (L1, L2) for all breakpoints or a pair for each."""
    values = PUBLISHED[direction]
    sigma0, sigma1, sigma2, kappa = values["constants"]
    decay = kappa * EFFECTIVE_RADIUS
    pairs = values["gains"] if gains is None else gains
    if not isinstance(pairs[0], (list, tuple)):
        pairs = [pairs] * len(breakpoints)
    units = {"sigma0": "1/m", "sigma1": "s/m", "sigma2": "s/m", "kappa": "1/m"}
    constants = {name: {"value": value, "unit": units[name]} for name, value in zip(units, values["constants"])}  # noqa: B905
    constants["effective_radius"] = {"value": EFFECTIVE_RADIUS, "unit": "m"}
    return {
        "schema": "gainsmith.schedule/1",
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
        "sample_time": 0.005,
        "plant": {
            "abs": ["wheel_speed"],
            "A": polynomial([[0, 1], [0, 0]], [[-decay, 0], [0, 0]]),
            "B": polynomial([[0], [1]]),
            "C": polynomial([[sigma0, sigma1 + sigma2]], [[-sigma1 * decay, 0]]),
            "D": polynomial([[0]]),
            "E": polynomial([[1, 0, 0], [0, 1, 0]]),
            "F": polynomial([[sigma1, 0, 0.5]]),
        },
        "gain": {
            "unit": [["m/s"], ["m/s^2"]],
            "dtype": dtype,
            "interpolation": "linear",
            "table": [[[first], [second]] for first, second in pairs],
        },
        "guarantee": {"decay_rate": 80.0},
        "certificate": {"method": "none"},
        "provenance": {"created": "2024-01-01"},
    }


def polynomial(*coefficients: Any) -> dict[str, Any]:
    """Matrix polynomial in one parameter from its coefficients of degree 0, 1, ..."""
    return {"monomials": [[power] for power in range(len(coefficients))], "coefficients": list(coefficients)}
