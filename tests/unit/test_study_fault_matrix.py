"""The fault matrix: a few of its cells, and that it sees what a pipeline without a monitor would do."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

from estimators.vehicle import GRAVITY
from studies.beyond.fault_matrix.drives import driven
from studies.beyond.fault_matrix.faults import FAULTS, SIGNALS
from studies.beyond.fault_matrix.matrix import Cell, cases, matrix
from studies.beyond.fault_matrix.observable import healthy, shares
from studies.beyond.fault_matrix.study import STUDY
from studies.trials.estimation import TEST_CAR
from studies.truth import draw

SINGLE = [("ay", "zero"), ("yaw_rate", "negated"), ("wheel_speed rr", "zero"), ("ax", "missing")]
SINGLE += [("ay", "frozen"), ("ay", "doubled"), ("yaw_rate", "clipped"), ("steer", "frozen"), ("torque fl", "clipped")]
SINGLE += [("yaw_rate", "doubled")]
SINGLE += [("pitch_rate", "negated")]
CHOSEN = [(), *((case,) for case in SINGLE), (("ay", "negated"), ("steer", "missing"))]


@pytest.fixture(scope="module")
def found() -> list[Cell]:
    return matrix(range(1), CHOSEN)


def test_every_cell_is_there_once(found: list[Cell]) -> None:
    assert len(cases()) == 1 + len(SIGNALS) * len(FAULTS)
    assert len({(c.signal, c.fault, c.drive) for c in found}) == len(found) == 5 * len(CHOSEN)
    assert [part.name for part in STUDY.parts] == ["matrix", "doubles"]


def test_the_chosen_cells_hold_their_bounds(found: list[Cell]) -> None:
    for cell in found:
        assert not set(cell.missed()) & set("xyrf"), cell
    turns = [c for c in found if c.drive == "turn" and (c.signal, c.fault) in SINGLE[:2] + SINGLE[4:8]]
    assert len(turns) == 6
    assert all(cell.flagged for cell in turns)
    straight = next(c for c in found if c.signal == "steer" and c.drive == "straight")
    assert straight.flagged is None  # a frozen angle of a car that goes straight reads what the healthy one does
    assert all(cell.pitch < 0.02 for cell in found if cell.signal == "none")  # the car itself pitches by 0.03
    assert not any(c.flagged is not None for c in found if c.signal == "none")


def test_an_accelerometer_of_the_wrong_sign_is_found_without_steering(found: list[Cell]) -> None:
    """12.8 m/s if only the steering may second a vote against a live a_y."""
    (turn,) = (c for c in found if c.signal == "ay and steer" and c.drive == "turn")
    assert turn.flagged
    assert turn.vy < 0.3


def test_what_no_relation_shows_is_not_missed(found: list[Cell]) -> None:
    """A pitch of 2.5 to 5 degrees makes 0.4 to 0.9 m/s^2 of a_x; forces may be off by 0.8 and 15 %."""
    cells = {c.drive: c for c in found if c.signal == "pitch_rate"}
    for drive in ("launch", "brake"):
        assert cells[drive].hidden
        assert 0.2 < cells[drive].share < 0.8


@pytest.mark.parametrize("fault", ["clipped", "doubled"])
def test_a_yaw_rate_at_fault_in_a_turn_costs_little(found: list[Cell], fault: str) -> None:
    """0.44 m/s if the tires have to answer for what it did before it was found, 0.51 with the slope of its jump; 0.25 without."""
    (turn,) = (c for c in found if (c.signal, c.fault, c.drive) == ("yaw_rate", fault, "turn"))
    assert turn.vy < 0.35


def test_a_fusion_without_its_monitor_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """The negative control: the same matrix, and nobody votes."""
    from estimators.velocity import turn_monitor
    from estimators.velocity.parity import TURN
    from estimators.velocity.signal_vote import Verdict

    def nobody(kit: object, relation: object, levels: tuple[np.ndarray, ...], *_: object) -> tuple[object, object]:
        never = np.zeros(np.shape(levels[0])[1:], dtype=np.bool_)
        return (Verdict(never, never, ~never),) * len(TURN.rules), defaultdict(lambda: never)

    monkeypatch.setattr(turn_monitor, "vote", nobody)
    cells = matrix(range(1), [(("ay", "negated"),), (("yaw_rate", "negated"),)])
    for cell in cells:
        if cell.drive == "turn":
            assert {"y", "f"} & set(cell.missed())
            assert cell.vy > 2.0
            assert not cell.hidden


def test_an_accelerometer_that_stays_too_large_is_outvoted() -> None:
    """Sensor draws in which a_y never exceeds the margin of a slide: V_y was 0.68 m/s off, and nothing flagged."""
    (turn,) = (c for c in matrix(range(202, 204), [(("ay", "doubled"),)]) if c.drive == "turn")
    assert turn.flagged
    assert turn.vy < 0.5


def test_pitch_that_takes_off_what_a_x_reads_too_much_shows_in_no_relation() -> None:
    """1 m/s^2 in a_x and the pitch of it: the forces see nothing; either alone, or the opposite pitch, they see."""
    drawn = draw(driven().until(1.0), TEST_CAR, range(1))
    of = healthy(drawn)

    def largest(more: float, pitch: float) -> float:
        signals = {**drawn.signals, "ax": drawn.signals["ax"] + more}
        return float(shares(of, signals, {"roll": of.roll, "pitch": of.pitch + pitch}).max())

    quiet = largest(1.0, 1.0 / GRAVITY)
    assert quiet < 0.9
    assert min(largest(1.0, 0.0), largest(0.0, 1.0 / GRAVITY)) > quiet + 0.3
    assert largest(1.0, -1.0 / GRAVITY) > quiet + 1.0
