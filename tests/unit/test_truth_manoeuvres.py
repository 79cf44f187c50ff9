"""The manoeuvre files: all that are shipped, and what a file may not say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.truth import Manoeuvre, load_manoeuvre, load_vehicle, shipped_manoeuvres, simulate
from synthesis.errors import SpecError
from synthesis.models.parameter_set import load_parameter_set
from tests.support.truth_cases import shortened

SHIPPED = shipped_manoeuvres()
PLACES = {
    "P1": ("Fig. 6a", "Fig. 6b", "Fig. 7", "Fig. 8", *(f"Table III row {k}" for k in range(1, 9))),
    "P2": ("Fig. 6a", "Fig. 6b", "Fig. 6c", "Fig. 7", "Fig. 8", "Fig. 9 (i)", "Fig. 9 (ii)", "Fig. 10", "Fig. 12",
           "Table II columns 1, 2", "Table II columns 3, 4", "Table II columns 5, 6", "Fig. 1"),
    "P3": ("Figs. 9, 10", "Figs. 11, 12", "Figs. 13, 14"),
    "P4": ("Table I",),
    "P5": ("Tables 1, 3, 5", "Tables 2, 4"),
}  # fmt: skip
"""Every experiment of the papers' tables and figures with a manoeuvre behind it."""
PLAIN = """
schema = "gainsmith.manoeuvre/1"
name = "plain"
title = "Straight on"
duration = "2 s"
speed = "36 km/h"

[vehicle]
parameters = "corner-estimation"
"""


def read(tmp_path: Path, text: str) -> Manoeuvre:
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    return load_manoeuvre(path)


@pytest.mark.parametrize("paper", PLACES)
def test_every_experiment_has_its_manoeuvre(paper: str) -> None:
    found = " / ".join(load_manoeuvre(name).where for name in shipped_manoeuvres(paper))
    assert [place for place in PLACES[paper] if place not in found] == []


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_files_are_complete(name: str) -> None:
    one = load_manoeuvre(name)
    assert one.name == name
    assert one.chosen and (one.given or not one.paper)
    made = one.course()
    assert made.duration == one.duration and np.isfinite(made.steer).all()
    base = one.truth_vehicle().parameters
    own = load_vehicle(one.vehicle.parameters).parameters
    assert base == own


def test_all_shipped_manoeuvres_start_on_both_tires() -> None:
    """The first second of every one, all at once: finite, on its wheels, and different from one to the next."""
    manoeuvres = [load_manoeuvre(name) for name in SHIPPED]
    cars = [m.truth_vehicle() for m in manoeuvres]
    for tire in ("lugre", "magic-formula"):
        courses = [shortened(m.with_tire(tire).course(), 1.0) for m in manoeuvres]
        truth = simulate(courses, cars, step=0.002, record_time=0.02)
        assert all(bool(np.isfinite(value).all()) for value in truth.signals.values())
        assert np.abs(truth["roll"]).max() < 0.2
        assert truth["vx"][:, 0] == pytest.approx([c.initial_speed for c in courses])


def test_values_are_those_of_the_models_parameter_files() -> None:
    for name in ("corner-estimation", "longitudinal-speed", "resilient-velocity"):
        printed, car = load_parameter_set(name), load_vehicle(name)
        for key in ("mass", "yaw_inertia", "wheel_inertia", "cg_height", "front_track"):
            assert getattr(car.parameters, key) == printed.vehicle[key].value
        assert car.lugre.sigma0[0] == printed.tire["longitudinal"].sigma0.value
    assert load_vehicle("resilient-velocity").suspension.unsprung_mass == 46.0


def test_an_own_file(tmp_path: Path) -> None:
    extra = """
[road]
surface = "snow"
[[road.zone]]
corners = "right"
friction = 0.1
from_place = "20 m"
[[steer]]
kind = "ramp"
to = "3 deg"
time = "1 s"
"""
    one = read(tmp_path, PLAIN + extra)
    made = one.course()
    assert made.initial_speed == pytest.approx(10.0)
    assert made.friction == 0.35 and made.zones[0].corners == (False, True, False, True)
    assert made.steer[-1] == pytest.approx(np.radians(3.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PLAIN.replace("duration", "durration"), "unknown key 'durration'; did you mean duration"),
        (PLAIN.replace('"2 s"', "2.0"), "duration: 2.0 has no unit"),
        (PLAIN.replace("36 km/h", "36 Hz"), "speed: unit 'Hz' has another dimension"),
        (PLAIN.replace("gainsmith.manoeuvre/1", "gainsmith.manoeuvre/9"), "schema"),
        (PLAIN + '[[steer]]\nkind = "ramp"\ntime = "1 s"\n', "ramp needs to"),
        (PLAIN + '[[steer]]\nkind = "ramp"\ntime = "1 s"\nto = "3 N"\n', r"piece\[0\].to: unit 'N'"),
        (PLAIN + '[[throttle]]\nkind = "hold"\ntime = "1 s"\nto = "130 %"\n', "between -1 and 1"),
        (PLAIN + '[[hand_wheel]]\nkind = "hold"\ntime = "1 s"\n', "steering_ratio: missing"),
        (PLAIN + '[[steer]]\nkind = "hold"\ntime = "1 s"\n[[path]]\nkind = "straight"\nlength = "9 m"\n', "both steer"),
        (PLAIN + '[[path]]\nkind = "arc"\nlength = "9 m"\n', "arc needs angle_deg"),
        (PLAIN + "[road]\nfriction = 0.3\nsurface = 'ice'\n", "one of the two"),
        (PLAIN + "[[road.zone]]\ncorners = 'lft'\nfriction = 0.3\n", "did you mean"),
        (PLAIN.replace('duration = "2 s"', 'duration = "2 s"\nfree_after = "1 s"'), "no target_speed to let go of"),
        ("not toml at all [", "not a TOML file"),
    ],
)
def test_files_that_cannot_be(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value) and str(caught.value).startswith("own.toml: ")


def test_names_that_do_not_exist(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="did you mean p1-launch-split"):
        load_manoeuvre("p1-launch-splt")
    with pytest.raises(SpecError, match="give the path"):
        load_manoeuvre(tmp_path / "nowhere.toml")
    with pytest.raises(SpecError, match="unknown tire"):
        load_manoeuvre("p1-launch-split").with_tire("brush")
    with pytest.raises(SpecError, match="unknown parameter set"):
        read(tmp_path, PLAIN.replace("corner-estimation", "corner-estimaton")).truth_vehicle()
