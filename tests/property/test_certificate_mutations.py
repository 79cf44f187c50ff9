"""Whatever is changed in a schedule and sealed again: the file is refused, or what `gainsmith certify` prints of it is true.

Every case is one number. `GAINSMITH_MUTATIONS=10000` runs so many by hand, `GAINSMITH_FIRST_MUTATION=5000` begins with that one:

    GAINSMITH_MUTATIONS=10000 pytest -n 0 -s tests/property/test_certificate_mutations.py
"""

from __future__ import annotations

import json
import os
from collections import Counter
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from estimators.errors import ScheduleError
from estimators.schedule import read_content, sealed
from studies.certification import UNTIED, Certification, certify
from tests.support.mutations_blind import Content
from tests.support.schedule_judge import Judge, statement
from tests.support.schedule_mutations import mutated

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "estimators" / "schedules").glob("*.json"))
DATA = ROOT / "tests" / "unit" / "data"
BASES = [*SHIPPED, DATA / "sampled-longitudinal.json", DATA / "heated-spring.json", DATA / "heated-spring.json"]
COUNT = int(os.environ.get("GAINSMITH_MUTATIONS", "80"))
FIRST = int(os.environ.get("GAINSMITH_FIRST_MUTATION", "0"))
SEED = 20_261_122


def case(number: int, folder: Path) -> tuple[Path, str]:
    """One mutated and sealed file, and what was done to it."""
    base: Content = json.loads(BASES[number % len(BASES)].read_text("utf-8"))
    data, done = mutated(base, np.random.default_rng([SEED, number]))
    path = folder / "mutated.json"
    path.write_text(json.dumps(sealed(data)), "utf-8")
    return path, f"{number} ({BASES[number % len(BASES)].stem}) {done}"


def outcome(path: Path, result: Certification) -> str:
    """What became of a file."""
    if result.refusal:
        try:
            read_content(path)
        except ScheduleError:
            return "refused: structure"
        return "refused: consistency"
    if any(proof.refuted for proof in result.proofs):
        return "refuted"
    return "proved" if result.certified else "not proved"


def violations(path: Path, result: Certification, seed: int) -> list[str]:
    """What is printed and not true."""
    if result.refusal:
        line = f"refused: {result.refusal}"
        return [] if result.message == line and line.isprintable() and len(line) <= 300 else [f"refusal {line!r}"]
    content = json.loads(path.read_text("utf-8"))
    judge = Judge(content, seed)
    wrong = judge.plant() + ([] if UNTIED in result.remarks else judge.dimensions())
    for proof, stored in zip(result.proofs, content["claims"], strict=True):
        said = statement(proof.claim, proof.level, proof.unit, stored)
        wrong += judge.unit(said)
        if proof.proved:
            wrong += judge.truth(said)
        elif proof.refuted and not judge.broken(said, float(proof.place.split(" = ")[1].split()[0])):
            wrong.append(f"'{proof.claim}' at {proof.level} is refuted at {proof.place}, but holds there")
    moving = [line for line in result.remarks if line != UNTIED]
    wrong += judge.remarks(moving) if moving and seed % 3 == 0 else []
    lines = [result.message, *(f"{proof.claim} {proof.unit} {proof.place}" for proof in result.proofs), *result.remarks]
    return wrong + [f"prints {line!r}" for line in lines if not line.isprintable()]


def campaign(first: int, count: int, folder: Path) -> tuple[Counter[str], list[str], list[tuple[float, str]]]:
    """Outcomes, violations, and the slowest cases in seconds of the processor."""
    tally: Counter[str] = Counter()
    wrong, slow = [], []
    for number in range(first, first + count):
        path, done = case(number, folder)
        start = process_time()
        try:
            result = certify(path)
            slow = sorted([*slow, (process_time() - start, done)], reverse=True)[:5]
            tally[outcome(path, result)] += 1
            tally["statements judged true"] += sum(proof.proved for proof in result.proofs)
            wrong += [f"{done}: {what}" for what in violations(path, result, number)]
        except Exception as error:
            wrong.append(f"{done}: {type(error).__name__}: {error}")
    return tally, wrong, slow


@pytest.mark.parametrize("base", sorted(set(BASES)), ids=lambda path: path.stem)
def test_unchanged_files_are_proved_and_true(base: Path) -> None:
    result = certify(base)
    assert result.certified, result.message
    assert violations(base, result, 0) == []


def test_what_is_printed_of_a_mutated_file_is_true(tmp_path: Path) -> None:
    tally, wrong, slow = campaign(FIRST, COUNT, tmp_path)
    print(f"\n{dict(tally)}", *(f"{seconds:.2f} s: {done[:150]}" for seconds, done in slow), sep="\n")
    assert wrong == []
    assert tally["proved"] > COUNT // 10 and tally["refuted"] + tally["not proved"] > COUNT // 10, tally


@pytest.mark.parametrize("base", sorted(set(BASES)), ids=lambda path: path.stem)
def test_the_judge_sees_what_is_overstated(base: Path) -> None:
    """Negative control: a loop that is proved, said to be half as good again (or to decay three times as fast)."""
    content, result = json.loads(base.read_text("utf-8")), certify(base)
    judge = Judge(content)
    for proof, stored in zip(result.proofs, content["claims"], strict=True):
        bounded = "gain" in proof.kind or proof.kind == "fastest pole"
        level = proof.level / 1.5 if bounded else min(3.0 * proof.level, 0.999 if "drop" in proof.kind else np.inf)
        assert judge.truth(statement(proof.claim, level, proof.unit, stored)) != [], proof.claim
