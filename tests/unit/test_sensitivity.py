"""Designs, indices with closed forms, worst cases that sampling misses, and labelled results."""

from __future__ import annotations

import json

import numpy as np
import pytest
import sympy as sp

from analysis.errors import AnalysisError
from analysis.labelled import Axis, LabelledArray, load_labelled
from analysis.perturbed import PerturbedModel, error_measure
from analysis.sensitivity import (
    Box,
    Corners,
    LatinHypercube,
    Sobol,
    around,
    evaluate,
    one_at_a_time,
    one_by_one,
    sample,
    sample_grid,
    variance_indices,
    worst_case,
)  # fmt: skip
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, SchedulingParameter, Signal
from synthesis.models.parameter_set import load_parameter_set

PI = {"x1": (-np.pi, np.pi), "x2": (-np.pi, np.pi), "x3": (-np.pi, np.pi)}


def ishigami(s):
    return np.sin(s["x1"]) + 7.0 * np.sin(s["x2"]) ** 2 + 0.1 * s["x3"] ** 4 * np.sin(s["x1"])


def test_sobol_indices_of_the_ishigami_function() -> None:
    """Ishigami, Homma 1990: a = 7, b = 0.1, all indices in closed form."""
    a, b = 7.0, 0.1
    v1, v2, v13 = 0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, b**2 * np.pi**8 * 8 / 225
    total = v1 + v2 + v13
    found = variance_indices(ishigami, PI, samples=8192, seed=3)
    np.testing.assert_allclose(found.first_order.values, np.array([v1, v2, 0.0]) / total, atol=0.01)
    np.testing.assert_allclose(found.total.values, np.array([v1 + v13, v2, v13]) / total, atol=0.01)
    assert found.evaluations == 5 * 8192
    again = variance_indices(ishigami, PI, samples=8192, seed=3)
    np.testing.assert_array_equal(found.total.values, again.total.values)
    assert (variance_indices(ishigami, PI, samples=8192, seed=4).total.values != found.total.values).any()


def test_indices_of_an_additive_measure_with_several_outputs() -> None:
    ranges = {"a": (0.0, 1.0), "b": (-2.0, 2.0)}

    def measure(s):
        return np.stack([3.0 * s["a"] + s["b"], s["a"], np.ones_like(s["a"])], axis=-1)

    found = variance_indices(measure, ranges, samples=4096, seed=0)
    share = 9.0 / (9.0 + 16.0)  # variances 9/12 and 16/12
    np.testing.assert_allclose(found.first_order.values[:, :2], [[share, 1.0], [1.0 - share, 0.0]], atol=0.01)
    np.testing.assert_allclose(found.total.values[:, :2], [[share, 1.0], [1.0 - share, 0.0]], atol=0.01)
    assert np.isnan(found.total.values[:, 2]).all()  # a constant has no variance to share


def test_designs_fill_their_ranges() -> None:
    ranges = {"a": (2.0, 4.0), "b": (-1.0, 0.0)}
    box = Box.of(ranges)
    cube = LatinHypercube(samples=50, seed=1).everywhere(box)
    slices = np.floor((cube - [2.0, -1.0]) / [2.0, 1.0] * 50).astype(int)
    assert (np.sort(slices, axis=0) == np.arange(50)[:, None]).all()  # one sample in every slice
    points = Sobol(samples=256, seed=1).everywhere(box)
    quarter = np.floor((points - [2.0, -1.0]) / [2.0, 1.0] * 16).astype(int)
    assert (
        np.unique(quarter[:, 0] * 16 + quarter[:, 1], return_counts=True)[1] == 1
    ).all()  # balanced: one in each cell
    for design in (cube, points):
        assert ((design >= [2.0, -1.0]) & (design <= [4.0, 0.0])).all()
    np.testing.assert_array_equal(points, Sobol(samples=256, seed=1).everywhere(box))
    assert Corners().everywhere(box).tolist() == [[2, -1], [4, -1], [2, 0], [4, 0]]
    assert around({"k": -10.0}, 0.2) == {"k": (-12.0, -8.0)}


def test_a_grid_keeps_its_axes() -> None:
    found = sample_grid(
        lambda s: 10.0 * s["a"] + s["b"], {"a": [1.0, 2.0, 3.0], "b": [0.5, 0.25]}, name="sum", unit="m"
    )
    assert [axis.name for axis in found.axes] == ["a", "b"]
    assert found.at(a=2.0, b=0.25).item() == 20.25
    cloud = sample(lambda s: np.stack([s["a"], -s["a"]], -1), LatinHypercube(samples=7), {"a": (0.0, 1.0)})
    assert cloud.values.shape == (7, 2)
    np.testing.assert_array_equal(cloud.notes["samples"]["a"], cloud.values[:, 0])


def test_one_at_a_time_moves_one() -> None:
    found = one_at_a_time(lambda s: s["a"] * s["b"] ** 2, {"a": 2.0, "b": 3.0}, factors=(0.5, 1.0, 2.0))
    assert found.nominal.item() == 18.0
    np.testing.assert_allclose(found.values.values, [[9.0, 18.0, 36.0], [4.5, 18.0, 72.0]])
    assert found.ranking() == [("b", 54.0), ("a", 18.0)]


def test_measures_without_arrays_can_be_wrapped() -> None:
    found = evaluate(one_by_one(lambda s: s["a"] + 1.0), {"a": np.array([1.0, 2.0])})
    np.testing.assert_array_equal(found, [2.0, 3.0])


def test_the_worst_corner_is_found_where_sampling_misses_it() -> None:
    ranges = {f"p{i}": (0.0, 1.0) for i in range(6)}

    def spike(s):
        return 1.0 / (1e-3 + sum((value - (i % 2)) ** 2 for i, value in enumerate(s.values())))

    found = worst_case(spike, ranges, seed=0)
    assert found.value == pytest.approx(1000.0, rel=1e-9)
    assert list(found.parameters.values()) == pytest.approx([0, 1, 0, 1, 0, 1], abs=1e-9)
    assert sample(spike, Sobol(samples=4096), ranges).values.max() < 100.0


def test_a_narrow_interior_peak_is_climbed_and_the_smallest_found() -> None:
    ranges = {"x": (-1.0, 3.0), "y": (0.0, 10.0)}

    def hill(s):
        return np.exp(-((s["x"] - 0.317) ** 2) - (s["y"] - 7.77) ** 2)

    found = worst_case(hill, ranges, seed=2)
    assert found.value == pytest.approx(1.0, abs=1e-12)
    assert found.value > found.sampled
    low = worst_case(hill, ranges, largest=False, seed=2)
    assert low.value == pytest.approx(np.exp(-((2.683) ** 2) - 7.77**2), rel=1e-9)


def test_an_infinite_measure_ends_the_search() -> None:
    found = worst_case(lambda s: np.where(s["x"] > 0.9, np.inf, s["x"]), {"x": (0.0, 1.0)}, seed=0)
    assert found.value == np.inf
    assert found.parameters["x"] > 0.9


def test_saved_results_read_back_bit_for_bit(tmp_path) -> None:
    rng = np.random.default_rng(0)
    axes = (Axis("parameter", np.array(["kappa", "σ0"])), Axis("speed", rng.normal(size=3), "rad/s"))
    array = LabelledArray("margin", rng.normal(size=(2, 3)), axes, "1/s", {"seed": 3})
    files = array.save(tmp_path / "result")
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(p.name for p in files) == ["result.json", "result.npz"]
    back = load_labelled(tmp_path / "result")
    np.testing.assert_array_equal(back.values, array.values)
    for mine, theirs in zip(back.axes, array.axes, strict=True):
        assert (mine.name, mine.unit) == (theirs.name, theirs.unit)
        np.testing.assert_array_equal(mine.labels, theirs.labels)
    assert back.at(parameter="σ0").values.tolist() == array.values[1].tolist()
    assert (back.unit, back.notes) == ("1/s", {"seed": 3})


def test_torn_edited_and_foreign_files_are_refused(tmp_path) -> None:
    array = LabelledArray("x", np.ones(2), (Axis("a", np.array([1.0, 2.0])),))
    npz, head = array.save(tmp_path / "r")
    good = npz.read_bytes()
    npz.write_bytes(good[:-5])
    with pytest.raises(AnalysisError, match="checksum"):
        load_labelled(tmp_path / "r")
    npz.write_bytes(good)
    head.write_text(json.dumps({"schema": "other/1"}))
    with pytest.raises(AnalysisError, match="schema"):
        load_labelled(tmp_path / "r")
    head.write_text("{")
    with pytest.raises(AnalysisError, match="not a saved labelled array"):
        load_labelled(tmp_path / "r")
    with pytest.raises(AnalysisError, match="not a saved labelled array"):
        load_labelled(tmp_path / "missing")


def test_labelled_arrays_refuse_what_does_not_fit() -> None:
    with pytest.raises(AnalysisError, match="do not fit"):
        LabelledArray("x", np.ones(3), (Axis("a", np.array([1.0, 2.0])),))
    array = LabelledArray("x", np.ones(2), (Axis("speed", np.array([1.0, 2.0])),))
    with pytest.raises(AnalysisError, match="did you mean speed"):
        array.at(sped=1.0)
    with pytest.raises(AnalysisError, match="unknown label"):
        array.at(speed=1.5)
    with pytest.raises(AnalysisError, match="unknown label"):
        array.at(speed="fast")


def first(s):
    return s["a"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: sample(first, Sobol(samples=100), {"a": (0.0, 1.0)}), "64 or 128"),
        (lambda: sample(first, Sobol(samples=64), {"a": (1.0, 0.0)}), "minimum < maximum"),
        (lambda: sample(first, LatinHypercube(samples=64), {}), "no parameter"),
        (lambda: sample(first, LatinHypercube(samples=64), {"a": (0.0, np.inf)}), "not finite"),
        (lambda: sample_grid(first, {}), "no parameter"),
        (lambda: worst_case(first, {"a": (0.0, 1.0)}, samples=0), "power of two, 1"),
        (lambda: variance_indices(first, {"a": (0.0, 1.0)}, samples=1), "at least 2"),
        (lambda: around({"a": 0.0}), "no relative range"),
        (lambda: sample(first, Corners(), {f"p{i}": (0.0, 1.0) for i in range(21)}), "corners"),
        (lambda: one_at_a_time(first, {}), "nothing to vary"),
        (lambda: one_at_a_time(lambda s: np.ones(2), {"a": 1.0}), "first axis"),
        (lambda: one_at_a_time(lambda s: np.log(-s["a"] * np.nan), {"a": 1.0}), "not a number"),
        (lambda: variance_indices(lambda s: np.where(s["a"] > 0.5, np.inf, 0), {"a": (0.0, 1.0)}, 64), "infinite"),
        (lambda: worst_case(lambda s: np.ones((len(s["a"]), 2)), {"a": (0.0, 1.0)}), "one number"),
    ],
)
def test_bad_questions_are_refused(call, words) -> None:
    with pytest.raises(AnalysisError, match=words):
        call()


def test_designs_without_points_cannot_be() -> None:
    with pytest.raises(ValueError, match="greater than or equal to 1"):
        LatinHypercube(samples=0)


def test_perturbed_models_check_names_ranges_and_denominators() -> None:
    family = PerturbedModel(corner_velocity_model(load_parameter_set("resilient-velocity"), "lateral"))
    with pytest.raises(AnalysisError, match="did you mean sigma0"):
        family.at(wheel_speed=1.0, sigma_0=3.0)
    with pytest.raises(AnalysisError, match="give values of wheel_speed"):
        family.at(sigma0=3.0)
    with pytest.raises(AnalysisError, match="outside"):
        family.at(wheel_speed=141.0)
    with pytest.raises(AnalysisError, match="do not broadcast"):
        family.at(wheel_speed=np.ones(3), sigma0=np.ones(2))
    assert family.at(wheel_speed=np.ones((3, 1)), kappa=np.ones(2)).A.shape == (3, 2, 2, 2)
    p, c = sp.symbols("p c")
    model = LpvModel(
        "lag", "made up", (Signal("x", "1"),), (Signal("y", "1"),), (SchedulingParameter("p", "1", 1.0, 2.0, 0.0, 0.0),),
        A=sp.Matrix([[-p / c]]), C=sp.Matrix([[1]]), constants={"c": Constant(1.0, "1", "made up")},
    )  # fmt: skip
    with pytest.raises(AnalysisError, match="denominator"):
        PerturbedModel(model).at(p=1.0, c=[1.0, 0.0])
    measure = error_measure(PerturbedModel(model), [0.5], lambda A, B: A[..., 0, 0], p=[1.0, 2.0])
    np.testing.assert_allclose(measure({"c": np.array([1.0, 2.0, 4.0])}), [[-1.5, -2.5], [-1.0, -1.5], [-0.75, -1.0]])


def test_evaluations_are_all_counted_and_results_named() -> None:
    seen: list[int] = []

    def hill(s):
        seen.append(len(s["x"]))
        return -((s["x"] - 0.3) ** 2) - (s["y"] - 0.6) ** 4

    found = worst_case(hill, {"x": (0.0, 1.0), "y": (0.0, 1.0)}, seed=1)
    assert found.evaluations == sum(seen) > len(seen) > 1
    indices = variance_indices(hill, {"x": (0.0, 1.0), "y": (0.0, 1.0)}, samples=64)
    assert indices.first_order.name.startswith("first-order index of") and indices.total.name.startswith(
        "total index of"
    )


@pytest.mark.parametrize("value", [0.1, 1.0 / 3.0, 1e6 + 0.1])
def test_rounding_of_a_constant_is_no_variance(value: float) -> None:
    found = variance_indices(lambda s: (value + s["x"]) - s["x"], {"x": (0.0, 1.0), "y": (0.0, 1.0)}, samples=1024)
    assert np.isnan(found.first_order.values).all() and np.isnan(found.total.values).all()
    slight = variance_indices(lambda s: value * (1.0 + 1e-5 * s["x"]), {"x": (0.0, 1.0), "y": (0.0, 1.0)}, samples=1024)
    np.testing.assert_allclose(slight.first_order.values, [1.0, 0.0], atol=0.05)


def test_the_highest_of_many_peaks_is_found() -> None:
    """A shifted Rastrigin function: 1e2 local peaks, the highest, zero, at its shift."""

    def peaks(s):
        x, y = s["x"] - 1.37, s["y"] + 2.21
        return 10.0 * (np.cos(2.0 * np.pi * x) + np.cos(2.0 * np.pi * y) - 2.0) - x**2 - y**2

    found = worst_case(peaks, {"x": (-5.12, 5.12), "y": (-5.12, 5.12)}, samples=64, seed=0)
    assert found.value == pytest.approx(0.0, abs=1e-9)
    assert found.parameters == pytest.approx({"x": 1.37, "y": -2.21}, abs=1e-6)
