"""Labels of axes: a number names the label that it is, whatever the size of the labels, and never a neighbour."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.labelled import Axis, LabelledArray


def along(labels: list[float]) -> LabelledArray:
    """Values 0, 1, 2, ... along one axis x."""
    return LabelledArray("places", np.arange(float(len(labels))), (Axis("x", np.array(labels)),))


@pytest.mark.parametrize("size", [1e-30, 1e-12, 1.0, 1e12])
def test_labels_are_told_apart_at_any_size(size: float) -> None:
    array = along([size, 1.001 * size, 1.002 * size])
    for place, label in enumerate((1.0, 1.001, 1.002)):
        assert array.at(x=label * size * (1.0 + 1e-13)).item() == place
        assert array.at(x=label * size + 1e-10 * size).item() == place  # a ten-millionth of the gap
    for between in (1.0005, 1.0009, 1.00101, 0.999, 1.1, 0.0, -1.0, np.inf, np.nan):
        with pytest.raises(AnalysisError, match="axis 'x'"):
            array.at(x=between * size)


def test_zero_among_labels_and_a_label_that_is_alone() -> None:
    steps = along(np.linspace(-1.0, 1.0, 21).tolist())
    assert steps.at(x=0.0).item() == 10.0 and steps.at(x=0.3).item() == 13.0 and steps.at(x=1e-9).item() == 10.0
    alone = along([5.0])
    assert alone.at(x=5.0 * (1.0 + 1e-13)).item() == 0.0
    for other in (5.0005, 5.0 + 1e-9, 0.0):
        with pytest.raises(AnalysisError, match="axis 'x'"):
            alone.at(x=other)


def test_words_are_no_numbers() -> None:
    words = LabelledArray("w", np.array([1.0, 2.0]), (Axis("kind", np.array(["1", "dry"])),))
    assert words.at(kind="1").item() == 1.0
    for label in (1.0, "2", "Dry"):
        with pytest.raises(AnalysisError, match="axis 'kind'"):
            words.at(kind=label)
    with pytest.raises(AnalysisError, match="axis 'x'"):
        along([1.0, 2.0]).at(x="1")
