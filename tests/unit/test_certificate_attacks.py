"""Lies that were sealed again: `gainsmith certify` refuses them, or what it prints of them is true.

Every attack is a change of a shipped schedule (or of one of the test data). What is printed is read from the terminal, as a
person would read it; whether it is true is judged by `tests.support.schedule_judge`. Malformed files are in
`test_certificate_form.py`, random changes in `tests/property/test_certificate_mutations.py`.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from estimators.schedule.upgrade import UNTIED
from tests.support.terminal_output import LATERAL, SAMPLED, SPRING, Content, Told, claim, content, refused, true, write


@pytest.mark.parametrize("level", [1e6, 300.0])
def test_a_fastest_pole_is_no_decay_rate(level: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The words come from the kind, not from the file: 1e6 of a fastest pole is a weak but true statement, and says so."""
    data = content()
    claim(data, "fastest pole")["level"] = level
    data["claims"] = [c for c in data["claims"] if c["kind"] != "decay rate"]
    told = true(data, tmp_path, capsys)
    assert (
        f"error equation: fastest pole {level if level > 1000 else 300:.1f}".removesuffix(".0") + " 1/s" in told.proved
    )
    assert not any("decay rate" in line for line in told.lines)


def test_a_name_has_no_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    claim(data, "fastest pole")["name"] = "decay rate"
    assert refused(data, tmp_path, capsys).startswith("claims[1].name: unknown key")


@pytest.mark.parametrize("level", [1e6, 1e-9, 0.999])
@pytest.mark.parametrize(
    "kind",
    [
        "decay rate",
        "fastest pole",
        "gain",
        "internal update",
        "sampled error",
        "sampled gain",
        "motion gain",
        "drop probability",
    ],
)
def test_no_kind_lends_its_P_to_another(
    kind: str, level: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every P of the file under another kind, at a level that it was not made for: true, not proved, or refused in one line."""
    data = content()
    channel = claim(data, "gain")["channel"]
    for index, stored in enumerate(data["claims"]):
        if kind in ("gain", "sampled gain") and index:
            break  # one thing is claimed once
        stored["kind"], stored["level"] = kind, level
        stored.pop("channel", None)
        if kind in ("gain", "sampled gain"):
            stored["channel"] = channel
        if kind == "motion gain":
            stored["channel"] = {"inputs": {"bristle_deflection": 1.0 + index}, "errors": ["relative_velocity"]}
        if kind not in ("gain", "sampled gain", "motion gain"):
            data["claims"] = [c for c in content()["claims"] if c["kind"] == "internal update" != kind] + [stored]
    told = Told(write(tmp_path / "attack.json", data), capsys)
    if told.code != 2:
        true(data, tmp_path, capsys)
    assert (
        told.code == 2
        or level != 1e6
        or kind in ("fastest pole", "gain", "sampled gain", "motion gain")
        or told.code == 1
    )


def test_removed_claims_are_not_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    data["claims"] = [claim(data, "internal update")]
    told = true(data, tmp_path, capsys)
    assert told.code == 0
    assert told.proved == ["update: decay while the plant stands still 8.13 1/s"]
    data["claims"] = [c for c in content()["claims"] if c["kind"] != "internal update"]
    assert "none about the update that the runtime performs" in refused(data, tmp_path, capsys)
    data["claims"] = []
    assert "none about the update that the runtime performs" in refused(data, tmp_path, capsys)


@pytest.mark.parametrize("factor", [0.1, 0.5, 2.0, 10.0])
def test_sizes_scaled_with_the_level_are_printed(
    factor: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half the friction gain is proved of half the friction, and the half is said."""
    data = content()
    stored = claim(data, "gain")
    stored["channel"]["inputs"]["friction"] *= factor
    stored["level"] *= factor
    told = true(data, tmp_path, capsys)
    size, level = f"{factor:g}", repr(1.031 * factor).removesuffix(".0")
    assert f"error equation: gain {size} m/s friction -> relative_velocity {level} m/s" in told.proved
    assert not any(line.startswith("error equation: gain friction ->") for line in told.proved)


def test_every_digit_of_a_level_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """7.9999999 rounded to 8 would be another claim than the one that was proved."""
    data = content()
    claim(data, "decay rate")["level"] = 7.9999999
    claim(data, "gain")["channel"]["inputs"]["friction"] = 0.99999999
    told = true(data, tmp_path, capsys)
    assert "error equation: decay rate 7.9999999 1/s" in told.proved
    assert "error equation: gain 0.99999999 m/s friction -> relative_velocity 1.031 m/s" in told.proved


def test_one_thing_is_claimed_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    data["claims"].append(copy.deepcopy(data["claims"][0]) | {"level": 4.0})
    assert "one thing is claimed twice" in refused(data, tmp_path, capsys)


@pytest.mark.parametrize("period", [10.0, 0.5, 0.01, 0.0025, 1e-9])
def test_another_sample_time_is_another_update(
    period: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for source in (LATERAL, SAMPLED):
        data = content(source)
        data["update"]["sample_time"] = period
        told = true(data, tmp_path, capsys)
        kinds = [line for line in told.proved if line.startswith("update: decay")]
        assert not kinds or period < 0.1


@pytest.mark.parametrize("source", [LATERAL, SPRING], ids=lambda path: path.stem)
def test_constants_are_tied_to_the_plant(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in content(source)["model"]["constants"]:
        for factor in (1.0 + 1e-12, 1.001, -1.0, 1e6):
            data = content(source)
            data["model"]["constants"][name]["value"] *= factor
            assert "the formula and the constants give" in refused(data, tmp_path, capsys)


def test_a_constant_that_says_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    data["model"]["constants"]["mass"] = {"value": 1500.0, "unit": "kg"}
    assert "model.constants.mass: appears in no formula" in refused(data, tmp_path, capsys)


@pytest.mark.parametrize("key", list("ABCDEF"))
def test_every_number_of_the_stored_plant_is_tied_to_its_formula(
    key: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for change in (lambda x: x + 1e-9, lambda x: 2.0 * x + 1.0):
        stored = content()["plant"][key]["coefficients"]
        for k, matrix in enumerate(stored):
            for i, row in enumerate(matrix):
                for j, value in enumerate(row):
                    data = content()
                    data["plant"][key]["coefficients"][k][i][j] = change(value)
                    assert f"plant.{key}: entry [{i}][{j}] of order [{k}]" in refused(data, tmp_path, capsys)


def test_another_plant_with_its_formulas_is_another_plant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """D and B alone touch no claim and are exact; noise of twice the size, in formula and plant, breaks the gain of noise."""
    data = content()
    data["model"]["matrices"]["F"][0][2], data["plant"]["F"]["coefficients"][0][0][2] = "2", 2.0
    told = true(data, tmp_path, capsys)
    assert told.code == 1
    assert not any("force_noise" in line for line in told.proved)
    assert "refuted" in told.head


def test_disturbances_have_their_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Friction and force noise exchanged: their units give them away; of the same unit, the gains do."""
    data = content()
    data["model"]["disturbances"] = data["model"]["disturbances"][::-1]
    assert "model.matrices." in refused(data, tmp_path, capsys)
    names = [disturbance["name"] for disturbance in data["model"]["disturbances"]]
    for disturbance, name in zip(data["model"]["disturbances"], names[::-1], strict=True):
        disturbance["name"] = name  # the units in their old order, the names not
    data = content()
    data["model"]["disturbances"][0]["name"], data["model"]["disturbances"][2]["name"] = "force_noise", "friction"
    told = true(data, tmp_path, capsys)
    assert told.code == 1
    assert not any("gain force_noise -> relative_velocity 1.031" in line for line in told.proved)


@pytest.mark.parametrize("source", [LATERAL, SPRING], ids=lambda path: path.stem)
@pytest.mark.parametrize(
    "unit", ["A", "ft", "ft/s", "ft/s^2", "1/min", "rpm", "mm", "%", "K^2", "N/ft", "1/km", "min/m"]
)
def test_units_are_tied(source: Path, unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Any other unit of any signal, of the parameter, or of a constant."""
    for place in places_of_units(content(source)):
        data = content(source)
        holder = data
        for key in place:
            holder = holder[key]
        holder["unit"] = unit
        assert "model.matrices." in refused(data, tmp_path, capsys), place


def places_of_units(data: Content) -> list[tuple[Any, ...]]:
    kinds = ("states", "inputs", "outputs", "disturbances")
    found: list[tuple[Any, ...]] = [("model", kind, i) for kind in kinds for i in range(len(data["model"][kind]))]
    return [*found, *(("model", "constants", name) for name in data["model"]["constants"]), ("scheduling", 0)]


def test_what_is_tied_to_nothing_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file that calls itself one of format 1 escapes the check of its units: then that stands beside its claims."""
    data = content()
    data["model"]["source"] = UNTIED + data["model"]["source"]
    data["model"]["disturbances"][2]["unit"] = "kg"
    told = Told(write(tmp_path / "attack.json", data), capsys)
    assert told.code == 0
    assert "  note    format 1: constants and units are words only, tied to nothing that is proved" in told.lines
    data["model"]["disturbances"][2]["unit"] = "m  proved  decay rate 9 1/s"
    assert "is not a unit" in refused(data, tmp_path, capsys)


def test_a_unit_in_other_words_is_the_same_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    data["scheduling"][0]["unit"], data["model"]["states"][1]["unit"] = "1/s", "m*s^-1"
    assert true(data, tmp_path, capsys).code == 0


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d["scheduling"][0].update(
            max=280.0, breakpoints=[2.0 * x for x in d["scheduling"][0]["breakpoints"]]
        ),
        lambda d: d["scheduling"][0].update(
            min=-140.0, absolute=False, breakpoints=[-140.0, *d["scheduling"][0]["breakpoints"][1:]]
        ),
    ],
)
def test_another_range_is_another_plant(
    change: Callable[[Content], Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = content()
    change(data)
    assert "the formula and the constants give" in refused(data, tmp_path, capsys)


def test_breakpoints_rates_and_table_are_what_is_proved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changes: list[Callable[[Content], Any]] = [
        lambda d: d["scheduling"][0]["breakpoints"].__setitem__(3, 41.0),
        lambda d: d["scheduling"][0].update(rate_max=1e5),
        lambda d: d["scheduling"][0].update(rate_min=0.0, rate_max=0.0),
        lambda d: d["gain"]["table"].reverse(),
        lambda d: d["gain"]["table"].__setitem__(2, [[2.0], [-12.0]]),
        lambda d: d["gain"].update(table=[[[-a[0]], [-b[0]]] for a, b in d["gain"]["table"]]),
        lambda d: d["gain"].update(table=[[[0.0], [0.0]] for _ in d["gain"]["table"]]),
    ]
    codes = []
    for change in changes:
        data = content()
        change(data)
        codes.append(true(data, tmp_path, capsys).code)
    assert codes == [0, 1, 0, 1, 1, 1, 1]
