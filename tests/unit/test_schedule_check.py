"""Every violation of the structure is refused with its place."""

from __future__ import annotations

import re
from typing import Any

import pytest

from estimators import GainSchedule, ScheduleError
from estimators.schedule import check_content
from tests.unit.schedule_content import schedule_content

# path to the value, new value, place and reason that the message must carry
VIOLATIONS: list[tuple[tuple[Any, ...], Any, str]] = [
    (("schema",), "gainsmith.schedule/9", "schema: 'gainsmith.schedule/9' is not understood"),
    (("name",), "", "name: expected a non-empty text"),
    (("description",), 3, "description: expected"),
    (("surplus",), 1, "surplus: unknown key"),
    (("sample_time",), 0, "sample_time: 0 s must be positive"),
    (("sample_time",), True, "sample_time: expected a number"),
    (("sample_time",), float("nan"), "sample_time: nan is not a finite number"),
    (("model",), [], "model: expected an object"),
    (("model", "states"), [], "model.states: an observer needs at least one"),
    (("model", "states", 1, "name"), "bristle_deflection", "model.states: names are not unique"),
    (("model", "outputs", 0), {"name": "force"}, "model.outputs[0].unit: missing"),
    (("model", "constants", "sigma0", "value"), "632", "model.constants.sigma0.value: expected a number"),
    (("model", "constants", "sigma0", "value"), 10**400, "model.constants.sigma0.value:"),
    (("model", "constants", "sigma0", "unit"), "", "model.constants.sigma0.unit: expected a non-empty text"),
    (("scheduling",), [], "scheduling: needs at least one parameter"),
    (("scheduling", 0, "max"), -1, "scheduling[0].max: range [0.0, -1.0] rad/s of wheel_speed is empty or reversed"),
    (("scheduling", 0, "rate_min"), 5, "scheduling[0].rate_min: rates [5.0, 800.0] rad/s/s of wheel_speed"),
    (("scheduling", 0, "rate_max"), -5, "scheduling[0].rate_min: rates [-800.0, -5.0]"),
    (("scheduling", 0, "absolute"), 1, "scheduling[0].absolute: expected true or false"),
    (("scheduling", 0, "absolute"), False, "plant.abs: ['wheel_speed'] does not agree"),
    (("scheduling", 0, "min"), -3, "scheduling[0].min: -3.0 rad/s: an absolute value has no negative range"),
    (("scheduling", 0, "breakpoints", 0), 1, "scheduling[0].breakpoints: must start at min = 0.0 rad/s"),
    (("scheduling", 0, "breakpoints"), [0], "scheduling[0].breakpoints: must start at min"),
    (("scheduling", 0, "breakpoints", 2), 30, "scheduling[0].breakpoints[2]: 30.0 rad/s does not lie clearly above"),
    (("scheduling", 0, "speed"), 30, "scheduling[0].speed: unknown key"),
    (("plant", "A", "coefficients", 1), [[1, 0]], "plant.A.coefficients[1]: has 1 entries, expected 2"),
    (("plant", "A", "coefficients", 1, 0, 1), None, "plant.A.coefficients[1][0][1]: expected a number, got None"),
    (("plant", "A", "monomials", 1), [1, 0], "plant.A.monomials[1]: has 2 entries, expected 1"),
    (("plant", "A", "monomials", 1), [-1], "plant.A.monomials[1]: powers must be integers"),
    (("plant", "A", "monomials", 1), [0], "plant.A.monomials[1]: the monomial [0] appears twice"),
    (("plant", "E", "coefficients"), 3, "plant.E.coefficients: expected a list"),
    (("gain", "dtype"), "float16", "gain.dtype: 'float16' is not known"),
    (("gain", "interpolation"), "cubic", "gain.interpolation: 'cubic' is not known"),
    (("gain", "unit"), [["m/s"]], "gain.unit: has 1 entries, expected 2"),
    (("gain", "table", 3), [[1.0]], "gain.table[3]: has 1 entries, expected 2"),
    (("gain", "table", 3, 1, 0), "x", "gain.table[3][1][0]: expected a number, got 'x'"),
    (("gain", "table", 2, 1, 0), float("inf"), "gain.table[2][1][0]: inf is not a finite number"),
    (("gain", "table", 2, 1, 0), 1e101, "gain.table[2][1][0]: 1e+101 is beyond 1e+100"),
    (("gain", "table", 2, 1, 0), 2**53 + 1, "gain.table[2][1][0]: 9007199254740993 is not a finite number"),
    (("guarantee",), None, "guarantee: expected an object"),
]


@pytest.mark.parametrize(("path", "value", "message"), VIOLATIONS, ids=[entry[2][:50] for entry in VIOLATIONS])
def test_a_violation_is_refused_with_its_place(path: tuple[Any, ...], value: Any, message: str) -> None:
    content = schedule_content()
    place: Any = content
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(ScheduleError, match="^here: " + re.escape(message)):
        check_content(content, "here")


@pytest.mark.parametrize("key", sorted(schedule_content()))
def test_a_missing_section_is_refused(key: str) -> None:
    content = schedule_content()
    del content[key]
    with pytest.raises(ScheduleError, match=f"here: {key}: missing"):
        check_content(content, "here")


def test_single_precision_tables_hold_single_precision_numbers() -> None:
    check_content(schedule_content(gains=(0.5, 183.125), dtype="float32"), "here")
    with pytest.raises(ScheduleError, match=r"gain.table\[0\]\[1\]\[0\]: 183.1 is not a float32 number"):
        check_content(schedule_content(gains=(0.5, 183.1), dtype="float32"), "here")
    with pytest.raises(ScheduleError, match=r"gain.table\[0\]\[0\]\[0\]: 1e\+39 is not a float32 number"):
        check_content(schedule_content(gains=(1e39, 183.125), dtype="float32"), "here")


def test_two_parameters_are_a_valid_file_that_the_runtime_refuses_clearly() -> None:
    content = schedule_content()
    content["scheduling"].append(
        {
            **{"name": "load", "unit": "N", "min": 0, "max": 1, "rate_min": 0, "rate_max": 0, "absolute": False},
            "breakpoints": [0, 1],
        }
    )
    for matrix in "ABCDEF":
        content["plant"][matrix]["monomials"] = [[*powers, 0] for powers in content["plant"][matrix]["monomials"]]
    content["gain"]["table"] = [[entry, entry] for entry in content["gain"]["table"]]
    check_content(content, "here")
    with pytest.raises(ScheduleError, match=r"2 parameters \(wheel_speed, load\); the runtime interpolates over one"):
        GainSchedule.from_content(content)
