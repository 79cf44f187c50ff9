"""Every violation of the structure is refused with its place."""

from __future__ import annotations

import re
from typing import Any

import pytest

from estimators import GainSchedule, LpvVelocityObserver, ScheduleError
from estimators.schedule import check_content
from tests.support.schedule_content import schedule_content

# path to the value, new value, place and reason that the message must carry
VIOLATIONS: list[tuple[tuple[Any, ...], Any, str]] = [
    (("schema",), "gainsmith.schedule/9", "schema: 'gainsmith.schedule/9' is not understood"),
    (("name",), "", "name: expected a non-empty text"),
    (("description",), 3, "description: expected"),
    (("surplus",), 1, "surplus: unknown key"),
    (("update", "sample_time"), 0, "update.sample_time: 0 s must be positive"),
    (("update", "sample_time"), True, "update.sample_time: expected a number, got True"),
    (("update", "sample_time"), float("nan"), "update.sample_time: nan is not a finite number"),
    (("update", "kind"), "euler", "update.kind: 'euler' is not known; expected held, sampled or feedback"),
    (("update", "kind"), ["held"], "update.kind: a list is not known"),
    (("model",), [], "model: expected an object"),
    (("model", "states"), [], "model.states: a model needs at least one"),
    (("model", "states", 1, "name"), "bristle_deflection", "model.states: names are not unique"),
    (("model", "outputs", 0), {"name": "force"}, "model.outputs[0].unit: missing"),
    (("model", "constants", "sigma0", "value"), "632", "model.constants.sigma0.value: expected a number, got '632'"),
    (("model", "constants", "sigma0", "value"), 10**400, "model.constants.sigma0.value:"),
    (("model", "constants", "sigma0", "unit"), "", "model.constants.sigma0.unit: expected a non-empty text"),
    (("scheduling",), [], "scheduling: needs at least one parameter"),
    (("scheduling", 0, "max"), -1, "scheduling[0].max: range [0.0, -1.0] rad/s of wheel_speed is empty or reversed"),
    (("scheduling", 0, "rate_min"), 5, "scheduling[0].rate_min: rates [5.0, 800.0] rad/s/s of wheel_speed"),
    (("scheduling", 0, "rate_max"), -5, "scheduling[0].rate_min: rates [-800.0, -5.0]"),
    (("scheduling", 0, "absolute"), 1, "scheduling[0].absolute: expected true or false"),
    (("model", "constants", "sigma0", "source"), 5, "model.constants.sigma0.source: expected a text, got 5"),
    (("model", "inputs", 0, "name"), "a/b", "model.inputs[0].name: 'a/b' is not a name of letters, digits"),
    (("model", "inputs", 0, "name"), "1a", "model.inputs[0].name: '1a' is not a name of letters, digits"),
    (("model", "inputs", 0, "unit"), "m; s", "model.inputs[0].unit: 'm; s' is not a unit"),
    (("model", "inputs", 0, "unit"), " m", "model.inputs[0].unit: ' m' is not a unit"),
    (("model", "matrices", "A"), [["1", "1"]], "model.matrices.A: has 1 entries, expected 2"),
    (("model", "matrices", "F", 0, 2), "", "model.matrices.F[0][2]: expected a non-empty text"),
    (("model", "matrices", "F", 0, 2), 0.5, "model.matrices.F[0][2]: expected a non-empty text, got 0.5"),
    (("scheduling", 0, "min"), -3, "scheduling[0].min: -3.0 rad/s: an absolute value has no negative range"),
    (("scheduling", 0, "breakpoints", 0), 1, "scheduling[0].breakpoints: must start at min = 0.0 rad/s"),
    (("scheduling", 0, "breakpoints"), [0], "scheduling[0].breakpoints: must start at min"),
    (("scheduling", 0, "breakpoints", 2), 30, "scheduling[0].breakpoints[2]: 30.0 rad/s does not lie clearly above"),
    (("scheduling", 0, "speed"), 30, "scheduling[0].speed: unknown key"),
    (("plant", "A", "coefficients", 1), [[1, 0]], "plant.A.coefficients[1]: has 1 entries, expected 2"),
    (("plant", "A", "coefficients", 1, 0, 1), None, "plant.A.coefficients[1][0][1]: expected a number, got None"),
    (("plant", "A", "orders", 1), [1, 0], "plant.A.orders[1]: has 2 entries, expected 1"),
    (("plant", "A", "orders", 1), [-1], "plant.A.orders[1]: orders are integers from 0 to 16, got -1"),
    (("plant", "A", "orders", 1), [17], "plant.A.orders[1]: orders are integers from 0 to 16, got 17"),
    (("plant", "A", "orders", 1), [True], "plant.A.orders[1]: orders are integers from 0 to 16, got True"),
    (("plant", "A", "orders", 1), [1.0], "plant.A.orders[1]: orders are integers from 0 to 16, got 1.0"),
    (("plant", "A", "orders", 1), [0], "plant.A.orders[1]: the order [0] appears twice"),
    (("plant", "A", "orders"), [[0]], "plant.A.coefficients: has 2 entries, expected 1"),
    (("plant", "E", "coefficients"), 3, "plant.E.coefficients: expected a list"),
    (("gain", "dtype"), "float16", "gain.dtype: 'float16' is not known"),
    (("gain", "interpolation"), "cubic", "gain.interpolation: 'cubic' is not known"),
    (("gain", "unit"), [["m/s"]], "gain.unit: unknown key"),
    (("gain", "table", 3), [[1.0]], "gain.table[3]: has 1 entries, expected 2"),
    (("gain", "table", 3, 1, 0), "x", "gain.table[3][1][0]: expected a number, got 'x'"),
    (("gain", "table", 2, 1, 0), float("inf"), "gain.table[2][1][0]: inf is not a finite number"),
    (("gain", "table", 2, 1, 0), 1e101, "gain.table[2][1][0]: 1e+101 is beyond 1e+100"),
    (("gain", "table", 2, 1, 0), 2**53 + 1, "gain.table[2][1][0]: 9007199254740993 is not a finite number"),
    (("scheduling", 0, "max"), 1e-95, "scheduling[0].max: range [0.0, 1e-95] rad/s of wheel_speed is too narrow"),
    (("scheduling", 0, "min"), 140 * (1 - 1e-10), "scheduling[0].max: range [139.999999986, 140.0] rad/s of"),
    (("guarantee",), {"decay_rate": 80.0}, "guarantee: unknown key"),
    (("claims",), None, "claims: expected a list, got None"),
    (("claims",), {}, "claims: expected a list, got an object"),
    (("claims", 0), "stable", "claims[0]: expected an object, got 'stable'"),
    (("claims", 0, "kind"), 3, "claims[0].kind: expected a non-empty text, got 3"),
    (("claims", 0, "level"), 0.0, "claims[0].level: 0.0 must be positive"),
    (("claims", 0, "level"), -1, "claims[0].level: -1.0 must be positive"),
    (("claims", 0, "name"), "stable", "claims[0].name: unknown key; known: kind, level, P, channel"),
    (("claims", 0, "P", "coefficients"), [[[1.0]]], "claims[0].P.coefficients[0]: has 1 entries, expected 2"),
    (("claims", 0, "P", "orders"), [[17]], "claims[0].P.orders[0]: orders are integers from 0 to 16"),
    (("claims", 0, "channel"), {"inputs": {"friction": 1.0}}, "claims[0].channel.errors: missing"),
    (("claims", 0, "channel"), {"inputs": {}, "errors": ["a"]}, "claims[0].channel: needs at least one input and one"),
    (("claims", 0, "channel"), {"inputs": {"a": 1.0}, "errors": ["a", "a"]}, "claims[0].channel: needs at least one"),
    (("claims", 0, "channel"), {"inputs": {"a": 0.0}, "errors": ["a"]}, "claims[0].channel.inputs.a: 0.0 must be"),
    (("claims", 0, "channel"), {"inputs": {"a b": 1.0}, "errors": ["a"]}, "claims[0].channel.inputs: 'a b' is not a"),
    (("claims", 0, "channel"), {"inputs": ["a"], "errors": ["a"]}, "claims[0].channel.inputs: expected an object"),
    (("provenance",), None, "provenance: expected an object"),
    (("provenance", "created"), float("inf"), "provenance.created: inf is not a finite number"),
    (("provenance", "created"), 2**53 + 1, "provenance.created: 9007199254740993 is not a finite number that"),
    (("provenance", "created"), b"today", "provenance.created: expected a number, got bytes"),
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


def test_two_parameters_are_a_valid_file_that_what_follows_one_refuses_clearly() -> None:
    content = schedule_content()
    content["scheduling"].append(
        {
            **{"name": "load", "unit": "N", "min": 0, "max": 1, "rate_min": 0, "rate_max": 0, "absolute": False},
            "breakpoints": [0, 1],
        }
    )
    for matrix in (*(content["plant"][key] for key in "ABCDEF"), content["claims"][0]["P"]):
        matrix["orders"] = [[*orders, 0] for orders in matrix["orders"]]
    content["gain"]["table"] = [[entry, entry] for entry in content["gain"]["table"]]
    check_content(content, "here")
    schedule = GainSchedule.from_content(content)
    assert schedule.table.shape == (4, 2, 2, 1)
    with pytest.raises(
        ScheduleError, match=r"follows 2 parameters \(wheel_speed, load\), what uses it here follows one; take"
    ):
        LpvVelocityObserver(schedule)
