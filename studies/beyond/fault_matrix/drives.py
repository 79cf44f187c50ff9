"""The five drives on which signals fail: a car that goes straight, turns, pulls away, brakes, and stands."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from studies.truth import Manoeuvre, Truth, simulate_manoeuvres
from studies.truth.profile import Piece

SECONDS = 9.0
FAULT = (3.0, 5.0)  # s; every drive changes its speed within
_CAR = {"parameters": "corner-estimation", "drivetrain": "AWD", "maximum_torque": "4000 N*m", "maximum_power": "200 kW"}


def _pieces(*given: tuple[str, float, str | None]) -> list[Piece]:
    rows = [{"kind": kind, "time": f"{seconds} s"} | ({} if to is None else {"to": to}) for kind, seconds, to in given]
    return [Piece.model_validate(row) for row in rows]


def _drive(name: str, speed: float, **courses: Sequence[Piece]) -> Manoeuvre:
    table = {
        "schema": "gainsmith.manoeuvre/1", "name": name, "title": name, "duration": f"{SECONDS} s", "speed": f"{speed} m/s",
        "vehicle": _CAR, "road": {"friction": 1.0},
    }  # fmt: skip
    return Manoeuvre.model_validate(table).model_copy(update={key: list(value) for key, value in courses.items()})


def drives() -> tuple[Manoeuvre, ...]:
    """Straight on at 20 m/s; 4 m/s^2 to the left at 20 m/s; 3.5 m/s^2 from rest; 5 m/s^2 from 30 m/s; at rest."""
    held = _pieces(("hold", SECONDS, "20 m/s"))
    wheel = _pieces(("hold", 2.2, None), ("smooth", 0.5, "0.035 rad"), ("hold", 1.3, None), ("smooth", 0.5, "0 rad"))
    pull = _pieces(("hold", 2.2, None), ("ramp", 0.3, "2900 N*m"), ("hold", 1.5, None), ("ramp", 0.3, "0 N*m"))
    stop = _pieces(("hold", 2.5, None), ("ramp", 0.2, "4000 N*m"), ("hold", 1.5, None), ("ramp", 0.2, "0 N*m"))
    return (
        _drive("straight", 20.0, target_speed=held),
        _drive("turn", 20.0, target_speed=held, steer=wheel),
        _drive("launch", 0.0, torque=pull),
        _drive("brake", 30.0, brake_torque=stop),
        _drive("standstill", 0.0),
    )


@cache
def driven() -> Truth:
    """One run of each, integrated together."""
    return simulate_manoeuvres(drives())
