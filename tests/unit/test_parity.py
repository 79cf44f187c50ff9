"""What can be told apart: the table recomputed from the formulas of the monitor, and from the steps of a fusion."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from estimators.velocity import VelocityFusion, signal_monitor
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.isolability import SIGNALS, Residual, isolability, signature, table
from estimators.velocity.parity import PULL, TURN, Rule
from tests.support.fusion_course import CAR, STEP

GUIDE = Path(__file__).parents[2] / "docs" / "pages" / "why" / "faults.md"
PLACES = ("wheel fl", "wheel fr", "wheel rl", "wheel rr")


def told(faults: dict[str, float]) -> dict[str, list[float]]:
    """The witnesses of `turn` and `pull` by their own formulas, each signal off by what `faults` says."""
    fusion = VelocityFusion(CAR, STEP)
    for k in range(30):
        fusion.step(np.full(4, 60.0 + 1e-3 * (k % 7)), 0.02, 1.0 + 1e-3 * (k % 5), 2.0 + 1e-3 * k, 0.1 + 1e-4 * k)
    off = {name: faults.get(name, 0.0) for name in SIGNALS}
    wheels = [60.0 + off[name] for name in PLACES]
    steer = (0.02 + 0.01 * off["steer"],) * 2 + (0.0, 0.0)
    blank = ConditionedInputs(*[None] * len(ConditionedInputs._fields))
    seen = blank._replace(
        inertial=(1.0 + off["ax"] - off["pitch"], 2.0 + off["ay"] - off["roll"], 0.1 + 0.1 * off["yaw_rate"]), steer=steer,
        wheel_speed=wheels, gap=(STEP,) * 4,
    )  # fmt: skip
    monitor = fusion.signal_monitor
    six, _ = monitor.turn.witnesses.say(seen, monitor.turn.yaw_acceleration, 0.3 + off["roll"])
    force, _ = monitor.pull._forces([0.1 + 0.1 * off["torque"]] * 4, seen)
    slope = [1.0 + off[name] for name in PLACES]
    return {
        "turn": list(six[: len(TURN.witnesses)]),
        "pull": [seen.inertial[0], force, monitor.pull._wheels(slope, seen)],
    }


def responds(group: tuple[str, ...], rng: np.random.Generator) -> frozenset[Residual]:
    """Residuals that change with faults of random sizes, of several draws."""
    found = set()
    nominal = told({})
    for _ in range(3):
        given = told({name: rng.uniform(0.5, 1.0) for name in group})
        for relation in (TURN, PULL):
            change = np.subtract(given[relation.name], nominal[relation.name])
            names = [witness.name for witness in relation.witnesses]
            for i, k in combinations(range(len(names)), 2):
                if (
                    abs(change[i] - change[k]) > 1e-3
                ):  # the smallest change is 0.1; scale errors that were learned are below 1e-5
                    found.add((relation.name, names[i], names[k]))
    return frozenset(found)


def test_signatures_are_those_of_the_formulas() -> None:
    """All single and double faults: every residual of the two relations that are voted on."""
    rng = np.random.default_rng(0)
    for size in (1, 2):
        for group in combinations(SIGNALS, size):
            own = frozenset(entry for entry in signature(group) if entry[0] in ("turn", "pull"))
            assert own == responds(group, rng), group


def test_sets_that_look_alike_are_found_by_comparing_all_of_them() -> None:
    found = {faults.signals: faults for faults in isolability()}
    assert len(found) == len(SIGNALS) * (len(SIGNALS) + 1) // 2
    for one, two in combinations(found.values(), 2):
        alike = two.signals in one.alike or one.signals in two.alike
        assert alike == (one.signature == two.signature)
    assert found["ay",].alike == (("slide",),)
    assert found["steer",].alike == (("front grip",),)
    assert found["pitch",].alike == (("ax",),)


def test_what_is_reported() -> None:
    """Nobody is accused but those at fault, or who look like it; and of single faults only that of a torque is not named."""
    for levelled in (True, False):
        for faults in isolability(2, levelled):
            like = [set(group) for group in (faults.signals, *faults.alike)]
            assert any(set(faults.live) <= group for group in like)
            assert any(set(faults.repeating) <= group for group in like)
            assert set(faults.small) <= set(faults.live)
            if len(faults.signals) == 1 and faults.signals != ("torque",):
                assert faults.live == (faults.signals if faults.signals != ("pitch",) else ("ax",))
    assert not any("pitch" in faults.signals for faults in isolability(2, levelled=False))
    assert "ay" not in next(f for f in isolability(1) if f.signals == ("ay",)).small


def test_a_rule_that_accuses_the_wrong_one_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """The negative control: a yaw rate that two wheels may outvote."""
    from estimators.velocity import isolability as module

    hasty = Rule("yaw_rate", TURN.rules[0].witness, live=((2,),))
    changed = TURN._replace(rules=(hasty, *TURN.rules[1:]))
    monkeypatch.setattr(module, "RELATIONS", (changed,))
    monkeypatch.setattr(module, "TURN", changed)
    assert any(set(faults.live) - set(faults.signals) for faults in isolability(1))


def test_a_wheel_at_fault_is_gated_alone() -> None:
    """Relation `speed`, that the filter votes on: one or two wheels that are off, and the others stay."""
    for bad in ((0,), (3,), (0, 1), (1, 2)):
        fusion, rng = VelocityFusion(CAR, STEP), np.random.default_rng(1)
        for k in range(120):
            wheels = 60.0 + 0.05 * rng.normal(size=4)
            if k >= 80:
                wheels[list(bad)] += 5.0
            step = fusion.step(wheels, 0.0, 0.05 * rng.normal(), 0.05 * rng.normal(), 0.002 * rng.normal())
        assert sorted(np.flatnonzero(step.gated | step.high_slip)) == list(bad)


def test_the_monitor_says_this_table() -> None:
    assert table() in (signal_monitor.__doc__ or "")


@pytest.mark.skipif(not GUIDE.is_file(), reason="the guide is not beside the tests")
def test_the_guide_shows_this_table() -> None:
    text = GUIDE.read_text(encoding="utf-8")
    assert table() in text
    assert table(most=2) in text
