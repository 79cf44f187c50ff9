"""The velocity error on a drive: the runtime's own replay, and a plain integration of every corner, as independent checks."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import studies.truth
from estimators import GainSchedule
from estimators.pipeline import ScheduledCorners
from estimators.schedule import write_content
from studies.drives.drive_file import read_drive
from studies.drives.evaluation import deviation
from studies.drives.log import read_log
from studies.drives.prepare import CornerInputs, corner_inputs_of
from studies.drives.replay import replay
from studies.drives.run import replay_drive
from studies.errors import LogError
from studies.execution.processes import Finished, Serial
from studies.sweeps.engine import run_sweep
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Batch, Observer
from studies.sweeps.spec import MEASURES, ObserverSpec, build_sweep
from studies.trials.estimation import TEST_CAR
from studies.truth import draw, load_manoeuvre, simulate_manoeuvres, write_drive
from synthesis.errors import SpecError
from synthesis.toml_file import read_table
from tests.support.schedule_content import schedule_content
from tests.support.sweep_cases import contents, small
from tests.support.sweep_integrated import Integrated
from tests.support.synthetic_drive import DRIVE, TORQUES, columns, write_log
from tests.support.synthetic_drive import write_drive as write_drive_file

NAME = "corner-estimation-longitudinal"
SCHEDULE = GainSchedule.shipped(NAME)
DESIGNS = {
    "sigma0": np.array([632.1, 500.0, 632.1]),
    "kappa": np.array([8.32, 9.5, 8.32]),
    "effective_radius": np.array([0.33, 0.33, 0.34]),
}
ACCELERATION = """
schema = "gainsmith.manoeuvre/1"
name = "pull"
title = "Pull at once"
duration = "1 s"
speed = "8 m/s"
torque = [{ kind = "ramp", to = "1500 N*m", time = "0.2 s" }]
[vehicle]
parameters = "corner-estimation"
"""


@pytest.fixture(scope="module")
def observer() -> Observer:
    return ObserverSpec(schedule=NAME, parameters="corner-estimation").build(Path())


def measure(folder: Path, **options: Any) -> Measure:
    found = read_table(MEASURES["estimator_nrms"], {"id": "estimator_nrms", **options}, "measures[0]")
    return found.beside(folder).build()


def uneven_log(folder: Path) -> tuple[Path, Path]:
    """Wheels that differ, a wheel and all wheels missing for a while, a torque missing, a wheel above the range."""
    table = columns(duration=1.0)
    wobble = 0.05 * np.sin(9.0 * table["t"])
    for corner, sign in (("fl", 1.0), ("rr", -1.0)):
        table[f"w_{corner}"] = table[f"w_{corner}"] * (1.0 + sign * wobble)
    table["w_fr"][40:60] = np.nan
    table["w_rl"][90:120] = 150.0
    for corner in ("fl", "fr", "rl", "rr"):
        table[f"w_{corner}"][140:150] = np.nan
    table["T_fl"][70:80] = np.nan
    text = DRIVE.replace('derivative_lag = "0 s"', 'derivative_lag = "20 ms"')
    return write_log(folder / "log.csv", table), write_drive_file(
        folder, text.replace("[reference]", TORQUES + "[reference]")
    )


def inputs_of(log: Path, description: Path) -> tuple[CornerInputs, np.ndarray]:
    found = read_drive(description)
    logged = read_log([log], found)
    return corner_inputs_of(logged, found), logged.reference["vx"]


def nrms(velocity: np.ndarray, reference: np.ndarray) -> float:
    found = deviation(velocity, reference, "m/s").nrms_percent
    assert found is not None and found > 0.01
    return found


def test_every_design_is_that_of_its_own_observers(observer: Observer, tmp_path: Path) -> None:
    log, description = uneven_log(tmp_path)
    found = measure(tmp_path, drive="drive.toml", logs=["log.csv"])
    found.check(observer)
    values = found(observer.at(DESIGNS, observer.grid(2)))
    inputs, reference = inputs_of(log, description)
    runtime = replay(inputs, ScheduledCorners(SCHEDULE)).velocity
    assert values[0] == pytest.approx(nrms(runtime, reference), rel=1e-9)
    for row in range(3):
        constants = {name: p.nominal for name, p in observer.plant.parameters.items()}
        constants |= {name: float(column[row]) for name, column in DESIGNS.items()}
        own = replace(inputs, radius=inputs.radius * constants["effective_radius"] / 0.33)
        plain: Any = Integrated(constants)
        assert values[row] == pytest.approx(nrms(replay(own, plain).velocity, reference), rel=1e-8)
    assert len({round(v, 6) for v in values}) == 3
    alone = found(observer.at({name: column[1:2] for name, column in DESIGNS.items()}, observer.grid(2)))
    assert alone[0] == pytest.approx(values[1], rel=1e-12)  # whoever else is in the batch


def test_gains_that_correct_once_a_sample_are_replayed_as_the_runtime_does(tmp_path: Path) -> None:
    log, description = uneven_log(tmp_path)
    content = schedule_content(
        update="sampled", gains=[(1.18e-3, 0.048), (8.8e-4, 0.076), (5.9e-4, 0.134), (4.2e-4, 0.217)]
    )
    write_content(tmp_path / "own.json", content)
    found = measure(tmp_path, drive="drive.toml", logs=["log.csv"])
    own = ObserverSpec(schedule="own.json", parameters="corner-estimation").build(tmp_path)
    found.check(own)
    values = found(own.at({"gain_factor_relative_velocity": np.array([1.0, 1.3])}, own.grid(2)))
    inputs, reference = inputs_of(log, description)
    for value, factor in zip(values, (1.0, 1.3), strict=True):
        content["gain"]["table"] = [
            [first, [factor * gain for gain in second]] for first, second in content["gain"]["table"]
        ]
        runtime = replay(inputs, ScheduledCorners(GainSchedule.from_content(content))).velocity
        assert value == pytest.approx(nrms(runtime, reference), rel=1e-9)
    assert values[0] != pytest.approx(values[1], rel=1e-3)


def test_a_diverging_design_is_infinite_and_touches_no_other(observer: Observer, tmp_path: Path) -> None:
    write_log(tmp_path / "log.csv", columns(duration=1.0))
    write_drive_file(tmp_path)
    found = measure(tmp_path, drive="drive.toml", logs=["log.csv"])
    factors = np.array([1.0, -2e4])
    values = found(observer.at({"gain_factor_relative_velocity": factors}, observer.grid(2)))
    (alone,) = found(observer.at({"sigma0": np.array([632.1])}, observer.grid(2)))
    assert np.isinf(values[1]) and values[0] == pytest.approx(alone, rel=1e-9)


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short manoeuvre."""
    folder = tmp_path_factory.mktemp("pull")
    (folder / "pull.toml").write_text(ACCELERATION)
    return folder


@pytest.fixture(scope="module")
def driven(pull: Path) -> Measure:
    found = measure(pull, manoeuvre="pull.toml", seed=3)
    found.prepare()
    return found


def test_manoeuvre_is_the_drive_that_one_would_write_and_run(observer: Observer, pull: Path, driven: Measure) -> None:
    truth = simulate_manoeuvres([load_manoeuvre(pull / "pull.toml")])
    log, description = write_drive(pull / "written", draw(truth, TEST_CAR, [3]), longitudinal=NAME)
    data = replay_drive([log], description)
    driven.check(observer)
    (value,) = driven(observer.at({"kappa": np.array([8.32])}, observer.grid(2)))
    assert value == pytest.approx(nrms(data.replay.velocity, data.log.reference["vx"]), rel=1e-9)


def test_a_worse_radius_is_worse(observer: Observer, driven: Measure) -> None:
    radius = 0.33 * np.array([1.0, 1.02, 1.05, 1.1])
    values = driven(observer.at({"effective_radius": radius}, observer.grid(2)))
    assert (np.diff(values) > 1.0).all() and values[0] < 2.0


def test_workers_are_given_the_drive_and_the_bytes_are_the_same(
    pull: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A sweep from a file; what is pickled for a worker brings its drive along, made once."""
    asked = {"id": "estimator_nrms", "name": "nrms", "manoeuvre": "pull.toml"}
    content = small(measures=[asked], vary={"effective_radius": {"relative": 0.05}}, grid={"points": 2}, chunk=4)
    whole = build_sweep(content | {"designs": [{"kind": "one at a time", "levels": 9}]}, pull)
    counted = []

    def once(*given: Any) -> Any:
        counted.append(given)
        return simulate_manoeuvres(*given)

    monkeypatch.setattr(studies.truth, "simulate_manoeuvres", once)
    summary = run_sweep(whole, tmp_path / "here", Serial()).summary
    assert len(counted) == 1
    worst = summary.of(NAME, "nrms", "worst")
    assert worst is not None and abs(worst.at["effective_radius"] / 0.33 - 1.0) == pytest.approx(0.05)

    class Elsewhere:
        def run(self, function: Any, given: Any, chunks: Any) -> Any:
            sent = pickle.loads(pickle.dumps(given))
            return (Finished(chunk, function(sent, chunk)) for chunk in reversed(list(chunks)))

    run_sweep(whole, tmp_path / "there", Elsewhere())
    assert contents(tmp_path / "there") == contents(tmp_path / "here") and len(counted) == 1


def test_another_drive_is_another_measure(tmp_path: Path) -> None:
    write_log(tmp_path / "log.csv", columns(duration=0.5))
    write_drive_file(tmp_path)
    first = measure(tmp_path, drive="drive.toml", logs=["log.csv"]).definition
    assert measure(tmp_path, drive="drive.toml", logs=["log.csv"]).definition == first
    write_log(tmp_path / "log.csv", columns(duration=0.6))
    assert measure(tmp_path, drive="drive.toml", logs=["log.csv"]).definition != first
    launch = [
        measure(tmp_path, manoeuvre="p1-launch-split", **options).definition
        for options in ({}, {"seed": 1}, {"seconds": 2.0})
    ]
    assert launch[0] != launch[1] != launch[2] != launch[0]
    assert measure(tmp_path, manoeuvre="p1-launch-split", seconds=99.0).definition == launch[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"manoeuvre": "p1-launch-spilt"}, "did you mean p1-launch-split"),
        ({"manoeuvre": "absent.toml"}, "absent.toml: cannot be read"),
        ({"manoeuvre": "p1-launch-split", "seconds": 0.0}, "seconds"),
        ({"drive": "absent.toml", "logs": ["log.csv"]}, "absent.toml: cannot be read"),
        ({"drive": "blind.toml", "logs": ["log.csv"]}, "needs [reference] vx"),
        ({"drive": "drive.toml", "logs": ["absent.csv"]}, "absent.csv"),
        ({"drive": "drive.toml"}, "either manoeuvre, or drive with logs"),
        ({}, "either manoeuvre, or drive with logs"),
        ({"drive": "drive.toml", "logs": ["log.csv"], "seed": 1}, "seed and seconds belong to a manoeuvre"),
    ],
)
def test_bad_drives_are_refused_in_one_line(tmp_path: Path, options: dict[str, Any], words: str) -> None:
    write_log(tmp_path / "log.csv", columns(duration=0.5))
    write_drive_file(tmp_path)
    blind = DRIVE.replace('[reference]\nvx = { column = "v", unit = "m/s" }\n', "")
    (tmp_path / "blind.toml").write_text(blind)
    with pytest.raises((SpecError, LogError)) as refused:
        measure(tmp_path, **options)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_a_reference_at_rest_is_refused(tmp_path: Path) -> None:
    table = columns(duration=0.5)
    write_log(tmp_path / "log.csv", {**table, "v": 0.0 * table["v"]})
    write_drive_file(tmp_path)
    with pytest.raises(SpecError, match="the reference vx is 0 m/s"):
        measure(tmp_path, drive="drive.toml", logs=["log.csv"])


def test_other_observers_are_refused(observer: Observer, pull: Path) -> None:
    found = measure(pull, manoeuvre="pull.toml")
    lateral = ObserverSpec(name="tire", schedule="corner-estimation-lateral", parameters="corner-estimation")
    with pytest.raises(SpecError, match="longitudinal corner observers"):
        found.check(lateral.build(Path()))
    with pytest.raises(SpecError, match=r"0\.01 s, that of the drive of estimator_nrms is 0\.005 s"):
        found.check(replace(observer, sample_time=0.01))


def test_a_batch_is_needed_for_nothing_but_its_columns(observer: Observer, driven: Measure) -> None:
    """The grid of the sweep does not enter: the drive has its own wheel speeds."""
    batches: list[Batch] = [observer.at({"sigma0": np.array([600.0])}, observer.grid(n)) for n in (2, 9)]
    assert driven(batches[0])[0] == driven(batches[1])[0]
