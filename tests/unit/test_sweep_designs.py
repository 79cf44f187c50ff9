"""Designs by index: the same points as the analysis makes at once, whoever asks for which part."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.stats import qmc

from analysis.sensitivity.box import Box
from analysis.sensitivity.designs import Nominal
from analysis.sensitivity.points import latin_points, sobol_points
from studies.sweeps.spec import DESIGNS
from synthesis.errors import SpecError
from tests.support.sweep_cases import sweep

LOW, HIGH = np.array([1.0, -3.0, 0.2]), np.array([2.0, 5.0, 0.6])
BOX = Box(("a", "b", "c"), LOW, HIGH, np.array([1.5, 0.0, 0.4]))


def stage(kind: str, **options: object):
    return DESIGNS[kind].model_validate({"kind": kind, **options})


def test_sobol_is_that_of_scipy_and_may_be_entered_anywhere() -> None:
    whole = LOW + qmc.Sobol(3, rng=np.random.default_rng(7)).random_base2(9) * (HIGH - LOW)
    found = stage("sobol", samples=512, seed=7)
    np.testing.assert_array_equal(found.points(np.arange(512), BOX), whole)
    np.testing.assert_array_equal(found.points(np.array([300, 4, 511]), BOX), whole[[300, 4, 511]])
    assert not np.array_equal(stage("sobol", samples=512, seed=8).points(np.arange(512), BOX), whole)


def test_sobol_far_out_needs_no_points_before_it() -> None:
    far = np.arange(10**6, 10**6 + 64)
    points = sobol_points(far, 4, seed=3)
    np.testing.assert_array_equal(points[10:20], sobol_points(far[10:20], 4, seed=3))
    # an aligned block of 64 is a net: every coordinate has one point in each of 64 slices
    assert (np.sort(np.floor(64 * points), axis=0) == np.arange(64)[:, None]).all()


@pytest.mark.parametrize("samples", [1, 2, 7, 64, 1000])
def test_latin_hypercube_has_one_point_in_every_slice(samples: int) -> None:
    points = latin_points(np.arange(samples), 5, samples, seed=11)
    assert (np.sort(np.floor(points * samples), axis=0) == np.arange(samples)[:, None]).all()
    part = np.array([samples // 2, 0])
    np.testing.assert_array_equal(latin_points(part, 5, samples, seed=11), points[part])


def test_latin_hypercube_columns_are_independent_and_spread() -> None:
    points = latin_points(np.arange(4000), 6, 4000, seed=5)
    correlation = np.corrcoef(points.T) - np.eye(6)
    assert np.abs(correlation).max() < 5.0 / np.sqrt(4000)
    neighbours = np.corrcoef(points[:-1, 0], points[1:, 0])[0, 1]
    assert abs(neighbours) < 5.0 / np.sqrt(4000)


def test_grid_and_corners_are_all_combinations() -> None:
    levels = {"a": 3, "b": 2, "c": 4}
    lines = [np.linspace(low, high, n) for low, high, n in zip(LOW, HIGH, levels.values(), strict=True)]
    whole = np.array(list(product(*lines)))
    found = stage("grid", levels=levels)
    assert found.count(BOX) == len(whole) == 24
    np.testing.assert_allclose(found.points(np.arange(24), BOX), whole, rtol=1e-15)
    rows = stage("corners").points(np.arange(8), BOX)
    assert {tuple(r) for r in rows} == set(product(*zip(LOW, HIGH, strict=True)))


def test_one_at_a_time_moves_one_and_leaves_the_others() -> None:
    rows = stage("one at a time", levels=5).points(np.arange(15), BOX)
    nominal = Nominal().points(np.arange(1), BOX)[0]
    assert nominal.tolist() == [1.5, 0.0, 0.4]
    for i in range(3):
        own = rows[5 * i : 5 * i + 5]
        np.testing.assert_allclose(own[:, i], np.linspace(LOW[i], HIGH[i], 5))
        np.testing.assert_array_equal(np.delete(own, i, axis=1), np.delete(np.tile(nominal, (5, 1)), i, axis=1))


def test_saltelli_blocks_swap_one_column() -> None:
    found = stage("saltelli", blocks=8, seed=2)
    rows = found.points(np.arange(found.count(BOX)), BOX).reshape(8, 5, 3)
    A, B = rows[:, 0], rows[:, 1]
    for i in range(3):
        np.testing.assert_array_equal(rows[:, 2 + i, i], B[:, i])
        np.testing.assert_array_equal(np.delete(rows[:, 2 + i], i, axis=1), np.delete(A, i, axis=1))


def test_chunks_cover_every_design_once_and_cut_no_block() -> None:
    for chunk in (1, 9, 14, 1000):
        found = sweep(chunk=chunk)
        chunks = list(found.chunks())
        assert [c.number for c in chunks] == list(range(len(chunks))) and len(chunks) == found.chunk_count()
        designs = [d for c in chunks for d in range(c.design, c.design + c.stop - c.start)]
        assert designs == list(range(found.designs(found.observers[0])))
        saltelli = [c for c in chunks if found.stages[c.stage].kind == "saltelli"]
        assert all(c.start % 7 == 0 and c.stop % 7 == 0 for c in saltelli)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"designs": [{"kind": "sobl", "samples": 8}]}, "did you mean sobol"),
        ({"designs": [{"kind": "sobol", "samples": 100}]}, "64 or 128"),
        ({"designs": [{"kind": "grid", "levels": 1}]}, "two or more levels"),
        ({"designs": [{"kind": "latin hypercube", "samples": 0}]}, "samples"),
        ({"measures": [{"id": "stability_margn"}]}, "did you mean stability_margin"),
        ({"measures": [{"id": "hinf_norm", "disturbances": ["force_nois"], "errors": ["relative_velocity"]}]}, "force_noise"),
        ({"measures": [{"id": "stability_margin"}, {"id": "stability_margin"}]}, "name of its own"),
        ({"measures": [{"id": "stability_margin", "name": "sigma0"}]}, "name of a column"),
        ({"vary": {"sigm1": {"relative": 0.1}}}, "did you mean sigma1"),
        ({"vary": {"sigma1": {"range": [0.9, 0.5]}}}, "minimum < maximum"),
        ({"vary": {"sigma1": {"range": [0.9, 0.9]}}}, "minimum < maximum"),
        ({"vary": {"sigma1": {"range": [0.5, 0.9], "unit": "1/m"}}}, "'s/m'"),
        ({"vary": {"sigma1": {"relative": 0.1, "range": [0.5, 0.9]}}}, "either relative"),
        ({"vary": {"sigma1": {"relativ": 0.1}}}, "did you mean relative"),
        ({"vary": {}}, "nothing to vary"),
        ({"grid": {"points": 5, "range": {"wheel_speed": [50.0, 20.0]}}}, "empty, reversed or outside"),
        ({"grid": {"points": 5, "range": {"wheel_sped": [0.0, 20.0]}}}, "did you mean wheel_speed"),
        ({"subjects": [{"schedule": "corner-estimation-longitudinl"}]}, "did you mean corner-estimation-longitudinal"),
        ({"subjects": [{"schedule": "corner-estimation-longitudinal", "gain": [[1.0], [1.0]]}]}, "brings its own"),
        ({"subjects": [{"model": "corner-velocity-lateral"}]}, "needs parameters, gain"),
        ({"gate": {"measures": {"stability": 0.1}}}, "no measure"),
        ({"surplus": 1}, "unknown key 'surplus'"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_with_the_place_and_the_remedy(changes: dict[str, object], words: str) -> None:
    with pytest.raises(SpecError) as refused:
        sweep(**changes)
    assert words in str(refused.value) and "\n" not in str(refused.value)
