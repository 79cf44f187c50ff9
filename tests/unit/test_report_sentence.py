"""Sentences about results: fields are found and written as they say, a field without a value is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from studies.claim import SENTENCE_FAILS, Claim, ClaimVerdict, Finding, Published
from studies.papers.published import published_claims
from studies.registry import SHIPPED
from studies.report.overview import overview, sentence
from studies.report.scoreboard import is_published
from studies.sentence import fill, shown
from tests.support.study_checks import check_sentence

COMPUTED = {
    "pole_1_s": -231.70421401120035, "span": [0.0, 162.2199], "good": True, "7/6 L": {"a/b": 6.857, "c": 0.5},
    "runs": {"one": {"proved": True, "weight": 67_000}, "two": {"proved": False, "weight": 51_000_000}}, "word": "x8 sin(u1)",
}  # fmt: skip


@pytest.mark.parametrize(
    ("template", "text"),
    [
        ("{pole_1_s}", "−231.7"), ("{pole_1_s:2}", "−230"), ("{span/1:3} of {span:count}", "162 of 2"), ("{good:yes|no}", "yes"),
        ("{7/6 L/a/b:2}", "6.9"), ("{7/6 L/c:% 3}", "50"), ("{runs/*/proved:tally}", "1 of 2"), ("{word}", "x8 sin(u1)"),
        ("{runs/*/weight:min} to {runs/*/weight:max}", "67\u202f000 to 51\u202f000\u202f000"), ("{span:list 2}", "0, 160"),
    ],
)  # fmt: skip
def test_fields_are_written_as_they_say(template: str, text: str) -> None:
    assert fill(template, COMPUTED) == text


def test_values_that_are_numpy_yet_are_written_alike() -> None:
    value = {"a": np.float64(2.5), "b": np.array([1.0, 3.0]), "c": np.bool_(False), "n": np.int64(7)}
    assert fill("{a} {b:max} {b/0} {c:is|is not} {n}", value) == "2.5 3 1 is not 7"
    assert fill("{.:3}", np.float64(-327.13)) == "−327"


@pytest.mark.parametrize("template", [
    "{span/2}", "{none}", "{good}", "{word:|}", "{pole_1_s:yes|no}", "{runs}", "{word/0}", "{span:max x}",
])  # fmt: skip
def test_a_field_without_a_value_is_refused(template: str) -> None:
    with pytest.raises(ValueError, match=r"^\{"):
        fill(template, COMPUTED)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(9.278398e9, 3, "9.28×10⁹"), (-2.84e-14, 1, "−3×10⁻¹⁴"), (1.0000046, 8, "1.0000046"), (0.0, 4, "0"),
     (1_473_000, 4, "1\u202f473\u202f000"),
     (105_905.2, 6, "105\u202f905"), (9999.6, 3, "10\u202f000"), (0.00031, 2, "0.00031"),
     (float("nan"), 3, "not a number"), (9.9996e-5, 4, "0.0001")],
)  # fmt: skip
def test_numbers_for_readers(value: float, digits: int, text: str) -> None:
    assert shown(value, digits) == text


@pytest.mark.parametrize("text", ["points: 40; degree: 1; direct: 0.0051.", "The value is {a}, as it stands here.", "Short.",
                                  "The root is 0.123456789 m, which is long.", "It holds everywhere: True.",
                                  "x" * 300 + "."])  # fmt: skip
def test_dumps_are_no_sentences(text: str) -> None:
    with pytest.raises(AssertionError):
        check_sentence(text)


def claim(found: dict[str, str], reading: str = "What follows. And more.", computed: Any = None) -> Claim:
    published = Published("P1-x", "P1", "(1)", "it holds", None, "exact", found)
    return Claim(published, Finding({"a": 1.5} if computed is None else computed, ClaimVerdict.REPRODUCED, reading))


def test_a_sentence_holds_for_the_verdict_it_was_written_for() -> None:
    assert sentence(claim({"reproduced": "It is {a} m."}).row()) == "It is 1.5 m."
    assert sentence(claim({"erratum": "It is off by {a} m."}).row()) == "What follows."
    assert sentence(claim({"reproduced": "It is {b} m."}).row()).startswith(
        SENTENCE_FAILS
    )  # a run of hours is not lost to a key, and the page says what is missing
    assert (
        sentence(claim({}, "word " * 100).row()).endswith("word …")
        and len(sentence(claim({}, "word " * 100).row())) <= 200
    )


def test_every_published_claim_has_a_sentence_and_derived_ones_are_told_apart() -> None:
    listed = [
        entry
        for module in SHIPPED.modules.values()
        if module.startswith("studies.papers.")
        for entry in published_claims(module.rpartition(".")[0]).values()
    ]
    assert len(listed) == 69 and sum(entry.claimed for entry in listed) == 59
    for entry in listed:
        assert entry.found and set(entry.found) <= set(ClaimVerdict), entry.id
        assert entry.claimed != (ClaimVerdict.DERIVED in entry.found), entry.id
    rows = [Claim(e, Finding(0, ClaimVerdict(next(iter(e.found))), "r.")).row() for e in listed]
    first = overview(rows)
    assert sum(len(group.claims) for group in (*first.holds, *first.does_not)) == 59
    assert sum(is_published(row) for row in rows) == 59


def test_a_sentence_that_cannot_be_filled_says_which_field_and_is_refused_by_the_check_of_claims() -> None:
    found = {ClaimVerdict.REPRODUCED: "The pole is {poel_1_s} 1/s."}
    entry = Published("P1-x", "P1", "(1)", "a pole", 1.0, "half a digit", found=found)
    said = Claim(entry, Finding(COMPUTED, ClaimVerdict.REPRODUCED, "read.")).row()["found"]
    assert said.startswith(SENTENCE_FAILS) and "{poel_1_s}" in said
    with pytest.raises(AssertionError):
        check_sentence(said)
