"""Labelled arrays can be looked at, and refuse what no figure can show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.labelled import Axis, LabelledArray
from estimators.errors import GainsmithError
from studies.plots.labelled import plot_labelled

SPEED = Axis("wheel_speed", np.linspace(0.0, 140.0, 15), "rad/s")
WORDS = Axis("parameter", np.array(["sigma0", "sigma1", "kappa"]))


@pytest.mark.parametrize("axes", [(SPEED,), (WORDS,), (WORDS, SPEED), (SPEED, WORDS)])
def test_one_and_two_axes_are_drawn(axes: tuple[Axis, ...], tmp_path: Path) -> None:
    array = LabelledArray("margin", np.random.default_rng(0).normal(size=[len(a.labels) for a in axes]), axes, "1/s")
    for ending in ("svg", "png"):
        assert plot_labelled(array, tmp_path / f"figure.{ending}").stat().st_size > 2000
    text = (tmp_path / "figure.svg").read_text()
    assert "margin" in text


def test_what_cannot_be_shown_is_refused(tmp_path: Path) -> None:
    cube = LabelledArray("cube", np.zeros((3, 15, 2)), (WORDS, SPEED, Axis("side", np.array(["low", "high"]))))
    with pytest.raises(GainsmithError, match="choose with"):
        plot_labelled(cube, tmp_path / "a.svg")
    crowd = LabelledArray("crowd", np.zeros((15, 40)), (SPEED, Axis("run", np.array([f"run {k}" for k in range(40)]))))
    with pytest.raises(GainsmithError, match="40 series"):
        plot_labelled(crowd, tmp_path / "b.svg")
