"""No run may beat a certified level, the worst found comes close to it, and a level that is a little better is beaten."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

from analysis.simulation.amplification import amplification, replayed
from estimators.schedule import SHIPPED, GainSchedule, read_content
from estimators.schedule.files import write_content
from studies.cli import main
from synthesis import deploy, schedule_content
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback
from tests.support.lmi_cases import parameter, small_model

P = sp.Symbol("p")
SCHEDULE = "corner-estimation-lateral"


def few_claims(name: str) -> dict[str, Any]:
    """A shipped schedule with three of its claims: decay and last gain of its update, last gain of its error equation."""
    content = dict(read_content(SHIPPED / f"{name}.json"))
    del content["sha256"], content["section_sha256"]
    last = {claim["kind"]: claim for claim in content["claims"]}
    return content | {"claims": [last[kind] for kind in ("internal update", "sampled gain", "gain")]}


def test_runs_stay_below_the_certified_level_and_reach_nearly_all_of_it() -> None:
    content = few_claims(SCHEDULE)
    for one in amplification(content, runs=6, samples=200):
        assert one.proved and not one.beaten
        assert 0.9 < one.share <= 1.0
        if one.kind == "sampled gain":  # the runtime does what was searched; force noise does not move the plant
            schedule = GainSchedule.from_content(content)
            run = replayed(schedule, one)
            energy = np.linalg.norm(run.error[0][:, [run.states.index(name) for name in one.errors]])
            assert energy / np.linalg.norm(one.inputs) == pytest.approx(one.worst, rel=1e-9)


def test_a_feedback_law_stays_below_its_level_and_not_below_a_better_one() -> None:
    """x1' = x2 + d, x2' = p x1 + u with 1 <= p <= 4: unstable, and a gain that follows p. The runtime does what was searched."""
    model = small_model(
        [[0, 1], [P, 0]], [[1, 0]], (parameter("p", 1.0, 4.0, 3.0),), B=[[0], [1]], E=[[1], [0]]
    )  # fmt: skip
    channel = FeedbackChannel(("d1",), ("x1", "u1"), sizes=(1.0, 5.0))
    gains = design_state_feedback(model, StateFeedbackDesign((channel,), fastest_pole=20.0))
    content = schedule_content(deploy(gains, DeploySettings(0.05)), "small")
    decay, gain = amplification(content, runs=6, samples=150)
    for one in (decay, gain):
        assert one.proved and not one.beaten
    assert 0.9 < gain.share <= 1.0
    schedule = GainSchedule.from_content(content)
    run = replayed(schedule, gain)
    last = schedule.gain(run.parameter[0, -1:, 0])[0] @ run.state[0, -1]  # the command that the runtime would give next
    shown = np.stack([run.of("x1")[0], np.append(run.of("u1")[0], last) / 5.0])
    assert np.linalg.norm(shown) / np.linalg.norm(gain.inputs) == pytest.approx(gain.worst, rel=1e-9)
    content["claims"][1]["level"] *= 0.9
    assert amplification(content, runs=6, samples=150)[1].beaten


def test_a_level_that_is_too_good_is_beaten_by_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content = copy.deepcopy(few_claims(SCHEDULE))
    content["claims"][0]["level"] *= 1.1  # decay
    for claim in content["claims"][1:]:  # gains
        claim["level"] *= 0.9
    write_content(tmp_path / "wrong.json", content)
    assert main(["simulate", str(tmp_path / "wrong.json"), "--runs", "3", "--samples", "200"]) == 1
    assert capsys.readouterr().out.count("BEATEN") == 3
    assert main(["simulate", str(tmp_path / "wrong.json"), "--runs", "0"]) == 2
