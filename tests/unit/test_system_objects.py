"""Doors that take python-control and scipy.signal systems, matrices as python-control accepts them, and truth values alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from scipy import signal

from analysis import LabelledArray, h2_norm, hautus_test, hinf_norm, load_labelled, pair_margin, stability_margin
from analysis.errors import AnalysisError
from analysis.labelled import Axis

A, B, C, D = np.array([[-1.0, 2.0], [0.0, -3.0]]), np.array([[0.5], [1.0]]), np.array([[1.0, 0.3]]), np.array([[0.2]])
E = np.array([[0.5, 0.2], [0.0, -0.3]])
SYSTEMS = {
    "control, continuous": (control.ss(A, B, C, D), (A, B, C, D), False),
    "control, discrete": (control.ss(E, B, C, D, 0.1), (E, B, C, D), True),
    "control, discrete without a period": (control.ss(E, B, C, D, True), (E, B, C, D), True),
    "scipy, continuous": (signal.StateSpace(A, B, C, D), (A, B, C, D), False),
    "scipy, discrete": (signal.StateSpace(E, B, C, D, dt=0.1), (E, B, C, D), True),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_an_object_is_its_matrices_and_its_time(name: str) -> None:
    system, (a, b, c, d), discrete = SYSTEMS[name]
    assert hinf_norm(system).norm == hinf_norm(a, b, c, d, discrete).norm
    assert stability_margin(system) == stability_margin(a, discrete)
    np.testing.assert_array_equal(hautus_test(system).eigenvalues, hautus_test(a, c, discrete).eigenvalues)
    np.testing.assert_array_equal(hautus_test(system).decays, hautus_test(a, c, discrete).decays)
    assert h2_norm(system) == h2_norm(a, b, c, d, discrete)
    assert hinf_norm(system).norm != hinf_norm(a, b, c, d, not discrete).norm or discrete
    with pytest.raises(AnalysisError, match=f"contradicts discrete={not discrete}"):
        stability_margin(system, discrete=not discrete)
    with pytest.raises(AnalysisError, match="brings its own B, C and D; give it alone"):
        hinf_norm(system, b)


def test_the_norm_is_that_of_python_control() -> None:
    system = SYSTEMS["control, continuous"][0]
    assert hinf_norm(system).norm == pytest.approx(control.linfnorm(system)[0], rel=1e-9)
    proper = control.ss(A, B, C, 0.0)
    assert h2_norm(proper) == pytest.approx(control.norm(proper, 2), rel=1e-9)


def test_a_system_that_does_not_say_its_time_is_asked() -> None:
    system = control.ss(E, B, C, D, None)
    with pytest.raises(AnalysisError, match="dt = None: say discrete=True or discrete=False"):
        stability_margin(system)
    assert stability_margin(system, discrete=True) == stability_margin(E, True)


def test_columns_rows_and_plain_numbers_of_one_system() -> None:
    assert hinf_norm(A, B[:, 0], C[0], 0.2).norm == hinf_norm(A, B, C, D).norm
    with pytest.raises(AnalysisError, match="C is missing"):
        hinf_norm(A, B)


@pytest.mark.parametrize("word", ["continuous", "discrete", 1, 0.0, []])
def test_a_word_is_no_truth_value(word: Any) -> None:
    for call in (
        lambda: hinf_norm(A, B, C, D, word), lambda: h2_norm(A, B, C, discrete=word), lambda: stability_margin(A, word),
        lambda: hautus_test(A, C, word), lambda: pair_margin(A, A, word),
    ):  # fmt: skip
        with pytest.raises(AnalysisError, match="is not a truth value; give True or False"):
            call()


def test_labels_tell_themselves_apart_at_any_size(tmp_path: Path) -> None:
    tiny = Axis("width", np.array([1e-14, 2e-14, 3e-14]), "m")
    array = LabelledArray("gain", np.array([1.0, 2.0, 3.0]), (tiny,), notes={"count": np.int64(3), "most": np.inf})
    assert [array.at(width=w).item() for w in (1e-14, 2e-14, 3e-14)] == [1.0, 2.0, 3.0]
    with pytest.raises(AnalysisError, match="unknown label"):
        array.at(width=1.5e-14)
    array.save(tmp_path / "found")
    back = load_labelled(tmp_path / "found")
    assert back.at(width=2e-14).item() == 2.0 and back.notes == {"count": 3, "most": "inf"}
    grid = LabelledArray("gain", np.arange(3.0), (Axis("speed", np.array([0.0, 0.1 + 0.2, 140.0]), "rad/s"),))
    assert grid.at(speed=0.3).item() == 1.0 and grid.at(speed=0.0).item() == 0.0
