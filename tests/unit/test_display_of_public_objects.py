"""Everything that the public doors hand out shows itself in five lines and 600 characters, in a terminal and in a notebook."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass, make_dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
import pytest
import sympy as sp

import analysis
import estimators
import synthesis
from estimators.display import Display, displayed
from studies.spec import load_spec

LINES, CHARACTERS = 5, 600
DOORS = ("estimators", "synthesis", "analysis", "studies")


def classes() -> Iterator[type]:
    """Every class of the doors that is no error and no list of names."""
    for door in DOORS:
        module = import_module(door)
        for name in dir(module):
            found = getattr(module, name)
            if inspect.isclass(found) and not issubclass(found, Exception | Enum):
                yield found


def filled(kind: type) -> Any:
    """An object with large contents in every field, whatever the class would say of them."""
    shown = object.__new__(kind)
    for field in fields(kind):  # type: ignore[arg-type]
        object.__setattr__(shown, field.name, _large(str(field.type)))
    return shown


def _large(kind: str) -> Any:
    if "Array" in kind or "ndarray" in kind or "ArrayLike" in kind:
        return np.linspace(-1e5, 1e5, 12_000).reshape(30, 20, 20)
    if kind.startswith(("dict", "Mapping")):
        return {f"parameter_{k}": 0.123456789 * k for k in range(60)}
    if kind.startswith(("tuple[str", "list[str", "Sequence[str")):
        return ("a_name_of_thirty_characters_abc",) * 40
    if kind.startswith(("tuple", "list", "Sequence")):
        return tuple(0.123456789 * k for k in range(200))
    if "sp." in kind:
        return sp.Matrix(12, 12, lambda i, j: sp.Symbol(f"a_{i}_{j}") ** 2)
    return {"float": 1.23456789e-7, "int": 20_000, "bool": True}.get(
        kind, "a name of forty characters, or a little more "
    )


def chooses(kind: type) -> bool:
    """Whether it says itself what is essential: then it is looked at as a real object."""
    return inspect.isfunction(kind.__dict__.get("summary"))


@pytest.mark.parametrize(
    "kind", [k for k in classes() if is_dataclass(k) and not chooses(k)], ids=lambda k: k.__qualname__
)
def test_data_classes_are_short_whatever_they_hold(kind: type) -> None:
    assert short(filled(kind))


def test_what_chooses_is_looked_at() -> None:
    elsewhere = {"LpvBounds", "Detectability", "Memory"}  # test_display
    assert {k.__name__ for k in classes() if chooses(k)} <= set(REAL) | elsewhere


def test_no_class_shows_an_address() -> None:
    plain = [k.__qualname__ for k in classes() if k.__repr__ is object.__repr__ and not issubclass(k, Display)]
    assert plain == []


@cache
def gains() -> Any:
    spec, folder = load_spec("longitudinal-speed")
    model = spec.plant(folder).model
    channel = synthesis.Channel(("force_noise",), ("relative_velocity",))
    return synthesis.design_observer(
        model, synthesis.ObserverDesign((channel,), degree=0, decay_rate=80.0, fastest_pole=600.0)
    )


@cache
def deployment() -> Any:
    return synthesis.deploy(gains())


@cache
def problem() -> Any:
    made = synthesis.LmiProblem(
        (synthesis.SchedulingParameter("speed", "m/s", 0.0, 1.0, -1.0, 1.0),), maximise_margin=True
    )
    P = made.symmetric("P", 40, degree=1)
    made.require("P > I", P)
    return made


def signals() -> Any:
    return estimators.VehicleSignals(np.full((50, 4), 30.0), np.zeros(50), torque=np.zeros((50, 4)))


@cache
def pipeline() -> Any:
    return estimators.EstimationPipeline(
        estimators.VehicleParameters.published_suv(), sample_time=0.005, batch_shape=(50,)
    )


def step() -> Any:
    return pipeline().step(signals())


def schedule(name: str = "longitudinal-speed") -> Any:
    return estimators.GainSchedule.shipped(name)


REAL: dict[str, Any] = {
    "GainSchedule": (schedule, ("scheduling: wheel_speed 0 to 140 rad/s, -800 to 800 rad/s^2", "0.6731 to 0.7878 m/s", "5 ms")),
    "LpvVelocityObserver": (lambda: estimators.LpvVelocityObserver(schedule()), ("longitudinal-speed",)),
    "LpvObserver": (lambda: estimators.LpvObserver(schedule(), batch_shape=(9,)), ("longitudinal-speed", "(9,)")),
    "LpvStep": (lambda: estimators.LpvVelocityObserver(schedule()).step(0.0, 0.01, 25.0), ("innovation", "parameter")),
    "EstimationPipeline": (pipeline, ("(50,)", "sample time [s]: 0.005")),
    "VehicleSignals": (signals, ("m/s^2", "rad/s")),
    "PipelineStep": (step, ("50 cars", "m/s", "F_z", "N", "unknown_force")),
    "LpvModel": (lambda: gains().model, ("wheel_speed 0 to 140 rad/s",)),
    "LookupTable": (
        lambda: synthesis.LookupTable("V", "bench", ("charge",), (tuple(range(99)),), np.arange(99.0)),
        ("0 to 98 V", "charge 0 to 98, 99 points"),
    ),
    "ObserverDesign": (lambda: gains().design, ("decay rate 80",)),
    "ObserverGains": (gains, ("certified", "gamma: 0.64", "m/s, at least", "force_noise -> relative_velocity")),
    "LmiResult": (lambda: gains().result, ("certified", "tightest of", "solver (no evidence)")),
    "Margin": (lambda: gains().result.tightest, ("value", "proved")),
    "LmiProblem": (problem, ("P (40, 40)", "speed 0 to 1 m/s", "maximise margin")),
    "Deployment": (deployment, ("float64", "every 5 ms", "% allowed", "drop probability")),
    "ParameterSet": (lambda: synthesis.load_parameter_set("corner-estimation"), ("corner-estimation",)),
    "MarkovJumpSystem": (lambda: analysis.MarkovJumpSystem(np.zeros((3, 2, 4, 4)), np.full((2, 2), 0.5)), ("(3, 2, 4, 4)",)),
    "Detectability": (lambda: analysis.detectable([[0, 1], [0, 0]], [[0, 1]], False), ("refuted",)),
    "DelayMargin": (lambda: analysis.DelayMargin(0.1, 0.2, 0.4), ("lower: 0.1 s", "upper: 0.2 s")),
    "HinfNorm": (lambda: analysis.hinf_norm(-np.eye(2), np.eye(2), np.eye(2)), ("norm: 1",)),
}  # fmt: skip


@pytest.mark.parametrize("name", REAL)
def test_real_objects_say_the_essential_with_units(name: str) -> None:
    make, words = REAL[name]
    shown = make()
    assert type(shown).__name__ == name and short(shown)
    for word in words:
        assert word in repr(shown), word


def short(shown: Any) -> bool:
    """Whether the text is, and the page of a notebook says the same."""
    text, page = repr(shown), shown._repr_html_() if hasattr(shown, "_repr_html_") else ""
    if not text.startswith(type(shown).__name__) or " at 0x" in text:
        return False
    if hasattr(shown, "_repr_html_") and not page.startswith(f"<strong>{type(shown).__name__}"):
        return False
    return len(text.splitlines()) <= LINES and len(text) <= CHARACTERS


def test_the_check_sees_a_long_text_and_units_stand_behind_numbers() -> None:
    @dataclass
    class Long:
        values: list[float]

    assert not short(Long([0.123456789] * 200))

    wide = make_dataclass("Wide", [f"a_field_with_a_long_name_{k}" for k in range(40)], bases=(Display,), repr=False)
    assert short(wide(*["a text of fifty-five characters that no line holds twice"] * 40))

    @displayed({"speed": "m/s"})
    @dataclass(repr=False)
    class Named:
        name: str
        speed: float
        left_out: float | None = None

    assert repr(Named("one", 1.5)) == "Named 'one'\n  speed: 1.5 m/s\n  left out: none"
    assert [f.default is MISSING for f in fields(Named)] == [True, True, False]
