"""The study against the wheels: what counts as behind, and errors calculated a second way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studies.beyond.against_wheels.runs import Errors, errors
from studies.beyond.against_wheels.study import STUDY, counted
from studies.trials.accuracy import known_spread
from studies.trials.estimation import TEST_CAR, assumed_car
from studies.truth import draw, load_manoeuvre, simulate_manoeuvres


def test_behind_is_behind_of_any() -> None:
    """The negative control: the same pipeline with a worse V_x is behind, and radii that are given may be all it lacks."""
    alone, open_gap = (0.05, 0.04, 0.011, 0.06), known_spread(np.array([-0.001, 0.003, 0.001]))
    ahead = Errors("a", "lugre", 0.01, 0.01, 0.03, 0.02, alone, known_spread(np.array([-0.001, -0.0012, -0.0008])))
    behind = Errors("b", "lugre", 0.012, 0.010, 0.03, 0.02, alone, open_gap)
    assert (ahead.best_corner, ahead.best) == ("rl", 0.011)
    found = counted([ahead, behind], "lugre")
    assert found["lugre: manoeuvres behind the mean wheel speed"] == 0.0
    assert (
        found["lugre: manoeuvres behind the best corner observer"]
        == found["lugre: manoeuvres behind any of them"]
        == 1.0
    )
    assert found["lugre: manoeuvres behind any of them, radii given"] == 0.0
    assert found["lugre: manoeuvres behind any of them beyond sampling error"] == 0.0
    sure = replace(behind, gap=known_spread(np.array([0.0009, 0.0011, 0.001])))
    assert counted([sure], "lugre")["lugre: manoeuvres behind any of them beyond sampling error"] == 1.0


def test_errors_are_those_of_the_drive() -> None:
    truth = simulate_manoeuvres([load_manoeuvre("p1-launch-split").model_copy(update={"duration": 0.1})])
    (found,) = errors(truth, range(2))
    drawn = draw(truth, TEST_CAR, range(2))
    wheels = (assumed_car(drawn).radius * drawn.signals["wheel_speed"][:, 0]).mean(axis=-1)
    assert found.wheels == pytest.approx(np.sqrt(((wheels - truth["vx"][0]) ** 2).mean(axis=1)).mean())
    rest = {found.wheels, found.corners, *found.alone}
    assert (
        found.best == min(rest) and found.gap.mean == pytest.approx(found.pipeline - found.best) and found.gap.runs == 2
    )
    assert 0.0 < found.pipeline < 0.1 and 0.0 < found.known_radii < 0.1
    assert [part.name for part in STUDY.parts] == ["lugre", "magic-formula"]
