"""The examples that `help()` shows of public names are run, and print what stands below them."""

from __future__ import annotations

import doctest
import inspect
import re
from importlib import import_module

import pytest

import gainsmith

DOORS = ("estimators", "synthesis", "analysis", "studies")
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
LOGS = {"read_drive", "run_drive", "identify_drive"}  # shown, and not run: they need a file, or long


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


def names() -> set[str]:
    """Every public function and class, but errors and what the functions and methods return: results are read, not built."""
    found = {n: getattr(gainsmith, n) for door in DOORS for n in import_module(door).__all__}
    public = {n: x for n, x in found.items() if inspect.isclass(x) or inspect.isfunction(x)}
    errors = {n for n, x in public.items() if inspect.isclass(x) and issubclass(x, Exception)}
    words = {
        word
        for x in public.values()
        for member in (x, *(vars(x).values() if inspect.isclass(x) else ()))
        for word in re.findall(r"\w+", str(returned(member)))
    }
    fields = {
        word
        for n, x in public.items()
        if n in words and inspect.isclass(x)
        for kind in getattr(x, "__annotations__", {}).values()
        for word in re.findall(r"\w+", str(kind))
    }
    results = {n for n, x in public.items() if inspect.isclass(x) and n in words | fields}
    return public.keys() - errors - results


def returned(member: object) -> object:
    """The annotation of what a function, method or property returns."""
    for way in ("fget", "func", "__func__"):
        member = getattr(member, way, member)
    return getattr(member, "__annotations__", {}).get("return", "") if callable(member) else ""


def test_every_public_function_and_class_has_an_example() -> None:
    shown = {test.name for test in TESTS}
    assert not names() - shown
    assert {"deploy", "hinf_norm", "LpvController", "KalmanFilter", "run_drive"} <= names()
    assert {test.name for test in TESTS if all(e.options.get(doctest.SKIP) for e in test.examples)} == LOGS


def test_a_wrong_example_is_seen() -> None:
    wrong = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, 0)
    assert doctest.DocTestRunner().run(wrong, out=lambda _: None).failed == 1
