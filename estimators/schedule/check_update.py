"""The sections `update` and `gain` of a schedule file: how gains are run, and the table that fits it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from estimators.schedule.checker import Checker, quoted

UPDATES = ("held", "sampled", "feedback")
MEASURED = ("states", "outputs")
MOST_ORDER = 32  # states of a feedback law


class LoopSizes(NamedTuple):
    """Rows and columns of the table, and how many states and outputs the loop has."""

    rows: int
    columns: int
    states: int
    outputs: int


def check_update(check: Checker, update: Any, sizes: Mapping[str, int]) -> LoopSizes:
    """The sizes that follow from how gains are run.

    `limits` of a feedback law: for every input [min, max], or null where it has none.
    """
    feedback = isinstance(update, Mapping) and update.get("kind") == "feedback"
    check.keys(
        update, "update", ("kind", "sample_time", *(("measured", "order") if feedback else ())),
        ("limits",) if feedback else (),
    )  # fmt: skip
    if update["kind"] not in UPDATES:
        check.fail(
            "update.kind", f"{quoted(update['kind'])} is not known; expected {', '.join(UPDATES[:-1])} or feedback"
        )
    if not check.number(update["sample_time"], "update.sample_time") > 0.0:
        check.fail("update.sample_time", f"{update['sample_time']} s must be positive")
    if not feedback:
        return LoopSizes(sizes["states"], sizes["outputs"], sizes["states"], sizes["states"])
    if not sizes["inputs"]:
        check.fail("model.inputs", "a feedback law needs at least one")
    if update["measured"] not in MEASURED:
        check.fail("update.measured", f"{quoted(update['measured'])} is not known; expected 'states' or 'outputs'")
    order = update["order"]
    if isinstance(order, bool) or not isinstance(order, int) or not 0 <= order <= MOST_ORDER:
        check.fail("update.order", f"{quoted(order)} is no number of states from 0 to {MOST_ORDER}")
    for i, pair in enumerate(
        check.items(update.get("limits", [None] * sizes["inputs"]), "update.limits", sizes["inputs"])
    ):
        if pair is not None:
            place = f"update.limits[{i}]"
            low, high = (check.number(value, place) for value in check.items(pair, place, 2))
            if not low < high:
                check.fail(place, f"[{low}, {high}] is empty or reversed")
    outputs = sizes["states"] + sizes["outputs"] + sizes["inputs"]
    return LoopSizes(order + sizes["inputs"], order + sizes[update["measured"]], order + sizes["states"], outputs)


def check_gain(check: Checker, gain: Any, shape: tuple[int, ...]) -> None:
    """A table of this shape, of numbers that its type can store."""
    check.keys(gain, "gain", ("dtype", "interpolation", "table"))
    if gain["interpolation"] != "linear":
        check.fail("gain.interpolation", f"{quoted(gain['interpolation'])} is not known; expected 'linear'")
    if gain["dtype"] not in ("float32", "float64"):
        check.fail("gain.dtype", f"{quoted(gain['dtype'])} is not known; expected 'float32' or 'float64'")
    exact = np.array(check.array(gain["table"], "gain.table", shape)).reshape(shape)
    if gain["dtype"] == "float32":
        with np.errstate(over="ignore", under="ignore"):
            wrong = np.argwhere(exact.astype(np.float32).astype(np.float64) != exact)
        if wrong.size:
            place = "gain.table" + "".join(f"[{index}]" for index in wrong[0])
            check.fail(place, f"{float(exact[tuple(wrong[0])])!r} is not a float32 number; round it before storing")
