"""Profiles, paths, friction by place and time."""

from __future__ import annotations

import numpy as np
import pytest

from studies.truth.course import Courses
from studies.truth.driver import Driver
from studies.truth.fleet import Fleet, tires_of
from studies.truth.layout import B, rolling
from studies.truth.plant import Plant, SteerAngles
from studies.truth.profile import GRID, PATH_GRID, PathPiece, Piece, curvature, sampled, to_si
from studies.truth.road import Roads, Zone
from tests.support.truth_cases import course, ramp, run, suv


def piece(**keys: object) -> Piece:
    return Piece.model_validate(keys)


def test_pieces_follow_each_other() -> None:
    pieces = [
        piece(kind="hold", time="1 s"),
        piece(kind="ramp", to="10 deg", time="500 ms"),
        piece(kind="sine", amplitude="0.1 rad", period="2 s", time="2 s"),
        piece(kind="half-sine", amplitude="0.2 rad", time="1 s"),
        piece(kind="smooth", to="0 rad", time="1 s"),
    ]
    t = GRID * np.arange(2000)
    y = sampled(pieces, "rad", 9.0)[: t.size]
    top = np.radians(10.0)

    def at(time: float) -> float:
        return float(np.interp(time, t[: y.size], y))

    assert [at(0.5), at(1.25), at(1.5)] == pytest.approx([0.0, top / 2, top])
    assert [at(2.0), at(3.0), at(3.5)] == pytest.approx([top + 0.1, top - 0.1, top], abs=1e-6)
    assert [at(4.0), at(4.5), at(5.0), at(5.5), at(8.0)] == pytest.approx([top + 0.2, top, top / 2, 0.0, 0.0], abs=1e-6)


def test_pulses_and_tables() -> None:
    y = sampled([piece(kind="pulses", amplitude="2 kN*m", period="1 s", duty=0.25, time="3 s")], "N*m", 4.0)
    assert (y[: round(3.0 / GRID)] > 0).mean() == pytest.approx(0.25, abs=0.01)
    assert y.max() == 2000.0 and y[-1] == 0.0
    table = piece(kind="table", times=[0.0, 1.0, 3.0], values=[0.0, 36.0, 0.0], unit="km/h")
    assert sampled([table], "m/s", 3.0)[[0, round(0.5 / GRID), round(2.0 / GRID)]] == pytest.approx([0.0, 5.0, 5.0])


@pytest.mark.parametrize(("text", "value"), [("0.5", 0.5), ("50 %", 0.5), ("-1", -1.0)])
def test_shares(text: str, value: float) -> None:
    assert to_si(text, "share") == value


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"kind": "ramp", "time": "1 s"}, "ramp needs to"),
        ({"kind": "hold", "time": "1 s", "amplitude": "1 rad"}, "hold takes no amplitude"),
        ({"kind": "hold", "time": "-1 s"}, "out of range"),
        ({"kind": "table", "times": [0.0, 0.0], "values": [1.0, 2.0], "unit": "rad"}, "must start at 0 and grow"),
        ({"kind": "wobble", "time": "1 s"}, "hold"),
    ],
)
def test_pieces_that_cannot_be(keys: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        piece(**keys)


def turned(row: np.ndarray) -> float:
    return float(np.degrees(row.sum() * PATH_GRID))


def test_paths_turn_and_shift_as_written() -> None:
    arc = PathPiece.model_validate({"kind": "arc", "radius": "20 m", "angle_deg": 90.0})
    straight = PathPiece.model_validate({"kind": "straight", "length": "30 m"})
    both = curvature([straight, arc, straight])
    assert turned(both) == pytest.approx(90.0, abs=0.5)
    assert both.max() == pytest.approx(1 / 20) and both[: round(25 / PATH_GRID)].max() == 0.0
    lane = PathPiece.model_validate({"kind": "lane-change", "length": "40 m", "offset": "3.5 m", "side": "right"})
    heading = np.cumsum(lane.curvature()) * PATH_GRID
    assert heading[-1] == pytest.approx(0.0, abs=1e-9)
    assert heading.sum() * PATH_GRID == pytest.approx(-3.5, rel=0.01)
    slalom = PathPiece.model_validate({"kind": "slalom", "length": "60 m", "wavelength": "30 m", "offset": "1 m"})
    assert np.abs(slalom.curvature()).max() == pytest.approx((2 * np.pi / 30) ** 2, rel=1e-2)


def test_friction_by_corner_place_and_time() -> None:
    left = Zone(0.2, (True, False, True, False), from_place=10.0, to_place=20.0, blend=1.0)
    later = Zone(0.5, from_time=2.0, blend=0.2)
    roads = Roads([1.0, 0.8], [(left,), (left, later)])
    place = np.array([[15.0, 5.0], [15.0, 5.0], [9.0, 5.0], [15.0, 5.0]])  # (4 corners, 2 cars)
    assert pytest.approx(np.array([[0.2, 1.0, 1.0, 1.0], [0.8] * 4])) == roads.friction(place, 0.0).T
    assert roads.friction(place, 3.0)[:, 1] == pytest.approx([0.5] * 4)
    edge = roads.friction(np.full((4, 2), 10.0), 2.0)  # half on, half off; on both the last word is the later zone's
    assert edge[0] == pytest.approx([0.6, 0.5 * (0.5 + 0.5)])
    assert edge[1] == pytest.approx([1.0, 0.65])


def test_each_wheel_meets_the_ice_at_its_own_place() -> None:
    patch = Zone(0.2, from_place=5.0, to_place=8.0, blend=0.1)
    truth = run(course(speed=10.0, duration=1.0, zones=(patch,)), record_time=0.001)
    on = truth["friction"][0] < 0.5
    car = truth.vehicles[0].parameters
    first = truth["distance"][0, on.argmax(axis=0)] + car.corner_x
    assert first == pytest.approx([5.0] * 4, abs=0.03)
    assert (truth["friction"][0, on].min()) == pytest.approx(0.2)


def test_friction_limits_the_force_and_nothing_else_does() -> None:
    for friction in (1.0, 0.3):
        truth = run(
            course(speed=15.0, duration=0.8, friction=friction, brake_torque=ramp(0.1, 0.2, 9000.0)), record_time=0.01
        )
        use = -truth["force_x"][0].sum(axis=1) / truth["force_z"][0].sum(axis=1)
        assert use.max() == pytest.approx(friction, rel=0.15)


def test_a_step_takes_the_road_at_its_middle() -> None:
    """Second order in place as well: half of the edge is passed when the middle of the step is on it."""
    edge = Zone(0.2, from_place=5.0, blend=0.2)
    fleet = Fleet([suv()])
    driver = Driver(Courses([course(speed=10.0, duration=1.0, zones=(edge,))]), fleet)
    state = rolling([10.0], fleet.radius)
    state[B["distance"]] = 5.0 - fleet.x[0] - 0.05
    still = SteerAngles(np.zeros((4, 1)), np.ones((4, 1)))
    moving = Plant(fleet, tires_of("lugre", [suv()])).slide(state, still)
    assert driver.act(state, moving, 0.4, 0.01).friction[:, 0] == pytest.approx([0.6, 0.6, 1.0, 1.0])
