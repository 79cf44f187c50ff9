"""The examples that `help()` shows of public names are run, and print what stands below them."""

from __future__ import annotations

import doctest
from importlib import import_module

import pytest

import gainsmith

DOORS = ("estimators", "synthesis", "analysis", "studies")
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
FIRST = {  # what users call first: each shows an example
    *("Channel", "GainSchedule", "LpvModel", "LpvVelocityObserver", "ObserverDesign", "SchedulingParameter", "Signal"),
    *("affine_quadratic_stability", "certify", "corner_velocity_model", "critical_drop_probability", "deploy"),
    *("design_observer", "design_sampled_observer", "detectable", "drop_verdict", "hinf_norm", "h2_norm", "load_model"),
    *("load_spec", "prove", "save_model", "stability_margin", "worst_case"),
}


def examples() -> list[doctest.DocTest]:
    """Those of every public name; the names of all doors are there, as after `from gainsmith import *`."""
    finder = doctest.DocTestFinder(recurse=False)
    everything = {name: getattr(gainsmith, name) for name in gainsmith.__all__}
    found = []
    for door in DOORS:
        for name in import_module(door).__all__:
            found += [
                test for test in finder.find(everything[name], name, module=False, globs=everything) if test.examples
            ]
    return found


TESTS = examples()


@pytest.mark.parametrize("test", TESTS, ids=lambda test: test.name)
def test_example(test: doctest.DocTest) -> None:
    said: list[str] = []
    outcome = doctest.DocTestRunner(optionflags=OPTIONS).run(test, out=said.append, clear_globs=False)
    assert not outcome.failed, "".join(said)


def test_what_users_call_first_has_an_example() -> None:
    assert {test.name for test in TESTS} >= FIRST


def test_a_wrong_example_is_seen() -> None:
    wrong = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, 0)
    assert doctest.DocTestRunner().run(wrong, out=lambda _: None).failed == 1
