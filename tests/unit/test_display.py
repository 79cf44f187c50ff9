"""What a terminal and a notebook show of an object: the essential in five lines."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from analysis.lpv.bounds import LpvBounds
from analysis.observability.detectability import detectable
from estimators.display import LONGEST, Display
from estimators.schedule import GainSchedule
from estimators.velocity import LpvVelocityObserver
from studies.spec import load_spec


def observer() -> Display:
    return LpvVelocityObserver(GainSchedule.shipped("longitudinal-speed"), batch_shape=(3, 4))


def model() -> Display:
    spec, folder = load_spec("longitudinal-speed")
    return spec.plant(folder).model


SHOWN: list[tuple[Callable[[], Display], tuple[str, ...]]] = [
    (observer, ("LpvVelocityObserver", "longitudinal-speed", "(3, 4)")),
    (model, ("corner-velocity-longitudinal", "relative_velocity [m/s]", "wheel_speed 0 to 140 rad/s")),
    (lambda: detectable([[0, 1], [0, 0]], [[0, 1]], False), ("refuted", "exact arithmetic", "0 to 0")),
    (lambda: LpvBounds("gain", 1.0, 1.25, "m/s", None, None), ("1 <= gain <= 1.25 m/s", "25 %", "certificate: none")),
    (lambda: LpvBounds("gain", 0.0, float("inf"), "1", None, None), ("0 <= gain <= inf", "gap: open")),
]


@pytest.mark.parametrize(("make", "words"), SHOWN)
def test_the_essential_in_five_lines(make: Callable[[], Display], words: tuple[str, ...]) -> None:
    shown = repr(make())
    assert len(shown.splitlines()) <= 5 and all(len(line) <= LONGEST + 2 for line in shown.splitlines())
    page = make()._repr_html_()
    for word in words:
        assert word in shown
        assert word.replace("<", "&lt;").partition(": ")[2] in page or word.replace("<", "&lt;") in page


def test_foreign_text_is_escaped_and_long_lines_are_cut() -> None:
    class Foreign(Display):
        def summary(self) -> tuple[str, ...]:
            return ("<script>", "name: " + "x" * 500)

    assert "<script>" not in Foreign()._repr_html_()
    assert len(repr(Foreign()).splitlines()[1]) == LONGEST + 2
