"""Lies that were sealed again: `gainsmith certify` refuses them, or what it prints of them is true.

Every attack is a change of a shipped schedule (or of one of the test data). What is printed is read from the terminal, as a
person would read it; whether it is true is judged by `tests.support.schedule_judge`.
"""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from estimators.schedule import read_content, sealed
from estimators.schedule.upgrade import UNTIED
from studies.cli import main
from tests.support.schedule_judge import Judge, Statement, statement

ROOT = Path(__file__).parents[2]
LATERAL = ROOT / "estimators" / "schedules" / "corner-estimation-lateral.json"
SPRING = Path(__file__).parent / "data" / "heated-spring.json"
SAMPLED = Path(__file__).parent / "data" / "sampled-longitudinal.json"
LONGEST_LINE = 300
Content = dict[str, Any]


def content(source: Path = LATERAL) -> Content:
    found = copy.deepcopy(read_content(source))
    return {key: value for key, value in found.items() if key not in ("sha256", "section_sha256")}


def write(path: Path, data: Content | str | bytes) -> Path:
    if isinstance(data, dict):
        data = json.dumps(sealed(data))
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def claim(data: Content, kind: str) -> Content:
    return next(c for c in data["claims"] if c["kind"] == kind)


class Told:
    """What `gainsmith certify` printed of one file."""

    def __init__(self, path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.code = main(["certify", str(path)])
        out = capsys.readouterr()
        assert out.err == ""
        self.lines = out.out.rstrip("\n").split("\n")
        assert all(line.isprintable() for line in self.lines), self.lines
        head = self.lines[0].removeprefix(f"{path}: ")
        assert head != self.lines[0]
        self.head = re.sub(r" \(\d+\.\d\d s\)$", "", head)
        assert len(self.head) <= LONGEST_LINE
        self.proved = [line.removeprefix("  proved  ") for line in self.lines[1:] if line.startswith("  proved  ")]
        if self.code == 2:
            assert self.head.startswith("refused: ") and len(self.lines) == 1
        else:
            assert self.code == (0 if self.head.startswith("certified: ") else 1)

    def statements(self, data: Content) -> list[Statement]:
        """The proved lines, read; units have no spaces in these files, but for the products of the spring."""
        said = []
        listed = [line[10:] for line in self.lines[1:] if line.startswith(("  proved  ", "  FAILS   "))]
        for line, stored in zip(listed, data["claims"], strict=True):
            if line in self.proved:
                words, level, unit = re.fullmatch(r"(.*) (\d\S*) (\S+)", line).groups()  # type: ignore[union-attr]
                said.append(statement(words, float(level), unit, stored))
        return said


def refused(data: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    told = Told(write(tmp_path / "attack.json", data), capsys)
    assert told.code == 2, told.lines
    return told.head.removeprefix("refused: ")


def true(data: Content, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Told:
    """Not refused; whatever is printed as proved holds."""
    told = Told(write(tmp_path / "attack.json", data), capsys)
    assert told.code in (0, 1), told.lines
    judge = Judge(data)
    assert judge.plant() + judge.dimensions() == []
    for said in told.statements(data):
        assert judge.unit(said) + judge.truth(said) == []
    return told


# What is claimed


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


# What the claims are about


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


# Form


def test_unknown_keys_are_refused_everywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def objects(value: Any, way: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        found = [way] if isinstance(value, dict) else []
        entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        return found + [deeper for key, entry in entries for deeper in objects(entry, (*way, key))]

    ways = [way for way in objects(content()) if way[:1] != ("provenance",)]
    assert len(ways) > 40
    for way in ways:
        data = content()
        holder = data
        for key in way:
            holder = holder[key]
        holder["zzz"] = 1e6
        words = refused(data, tmp_path, capsys)
        assert "zzz" in words, way


GOOD_P = {"orders": [[0]], "coefficients": [[[1.0, 0.0], [0.0, 1.0]]]}
BAD_P: dict[str, Any] = {
    "none": None,
    "text": "nan",
    "list": [],
    "empty object": {},
    "no coefficients": {"orders": [[0]]},
    "fewer coefficients": {"orders": [[0], [1]], "coefficients": [[[1.0, 0.0], [0.0, 1.0]]]},
    "one row": {"orders": [[0]], "coefficients": [[[1.0, 0.0]]]},
    "three columns": {"orders": [[0]], "coefficients": [[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]},
    "ragged": {"orders": [[0]], "coefficients": [[[1.0, 0.0], [0.0]]]},
    "a number": {"orders": [[0]], "coefficients": [1.0]},
    "nan as text": {"orders": [[0]], "coefficients": [[["nan", 0.0], [0.0, 1.0]]]},
    "true": {"orders": [[0]], "coefficients": [[[True, 0.0], [0.0, 1.0]]]},
    "huge": {"orders": [[0]], "coefficients": [[[1e300, 0.0], [0.0, 1.0]]]},
    "huge integer": {"orders": [[0]], "coefficients": [[[10**400, 0.0], [0.0, 1.0]]]},
    "order twice": {"orders": [[0], [0]], "coefficients": [[[1.0, 0.0], [0.0, 1.0]]] * 2},
    **{
        f"order {order}": {"orders": [[0], order], "coefficients": [[[1.0, 0.0], [0.0, 1.0]]] * 2}
        for order in ([1.0], [-1], [20_000], [2_000], [10**30], ["1"], [True], [None], [], [0, 1], 1, [[1]])
    },
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_P)
def test_malformed_lyapunov_matrices_are_refused(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    claim(data, "internal update")["P"] = BAD_P[name]
    assert refused(data, tmp_path, capsys).startswith("claims[4].P")
    del claim(data, "internal update")["P"]
    assert refused(data, tmp_path, capsys) == "claims[4].P: missing"


BAD_FORMULAS = [
    "9**9**9", "wheel_speed**9**9", "wheel_speed**20000", "wheel_speed**-1", "wheel_speed**0.5",
    "wheel_speed**kappa", "1e1000000000", "1e99999", "1e-1000000000", "1" * 60, "9" * 1999, "0x10", "1j", "1e5e5", "1_",
    "((wheel_speed + 1)**16)**16", "(" * 300 + "1" + ")" * 300, "-" * 1900 + "1", "+" * 1900 + "wheel_speed", "1 +", "", " ",
    "wheel_speed wheel_speed", "1/0", "1/(kappa - kappa)", "kappa if 1 else 2", "kappa or 1", "not kappa", "lambda: 1",
    "__import__('os').system('true')", "exp(1)", "kappa.real", "kappa[0]", "[1]", "{1}", "'1'", "True", "None", "...",
    "kappa := 1", "kappa\n", "kappa\x00", "kappa\x1b[31m", "κ", "other", "kappa//2", "kappa % 2", "kappa @ 2", "~1", "1 < 2",
    "f'{1}'", "print", "#", "1;2", "A", "await kappa", "*kappa",
]  # fmt: skip


@pytest.mark.parametrize("text", BAD_FORMULAS, ids=lambda text: ascii(text[:20]))
def test_bad_formulas_are_refused(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    data["model"]["matrices"]["A"][1][0] = text
    assert refused(data, tmp_path, capsys).startswith("model.matrices.A[1][0]: ")


BAD_UNITS = [
    "9**9**9", "m**9**9**9", "m**(9**9)", "(m**9)**9**9", "m**20000", "m^1e9", "1e1000000000", "1e9", "2*m", "m*1000", "m/0",
    "m - m", "m + m", "m**m", "m(2)", "m**(1/0)", "((((m^99)^99)^99)^99)", "(" * 30 + "m" + ")" * 29, "degC", "dB", "", " ", " m",
    "1\n  proved  decay rate 999999 1/s", "1\r  proved  decay rate 999999 1/s", "m\x1b[2K\x1b[1A", "m\u2028", "m\x00", "m\t",
    "m\u202e", "m" * 65, "m  proved  error equation: decay rate 9 1/s", "proved", "import os", "__import__('os')", "m;s", "m,s",
    "[m]", "{m}", "m\\n", "$m$", "m!", "nan", "inf",
]  # fmt: skip


@pytest.mark.parametrize("unit", BAD_UNITS, ids=lambda text: ascii(text[:20]))
def test_bad_units_are_refused(unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for place in (("model", "disturbances", 2), ("model", "constants", "kappa"), ("scheduling", 0)):
        data = content()
        holder = data
        for key in place:
            holder = holder[key]
        holder["unit"] = unit
        words = refused(data, tmp_path, capsys)
        assert "decay rate 999999" not in words or "?" in words


@pytest.mark.parametrize("key", ["name", "description"])
def test_free_text_writes_no_lines(key: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for text in ("x\n  proved  error equation: decay rate 9 1/s", "\x1b[31m", "a\u2028b", "\ud800"):
        data = content()
        data[key] = text
        assert "control characters" in refused(data, tmp_path, capsys)
    data = content()
    data[key] = "  proved  error equation: decay rate 9 1/s"  # printable: allowed, and printed nowhere
    assert "decay rate 9 1/s" not in "".join(true(data, tmp_path, capsys).lines)


def test_a_path_writes_no_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path / "x\n  proved  error equation: decay rate 9 1\u2215s.json", "{}")
    assert main(["certify", str(path)]) == 2
    (line,) = capsys.readouterr().out.splitlines()
    assert "?  proved" in line


def nested(depth: int) -> str:
    return '{"schema": "gainsmith.schedule/2", "name": ' + "[" * depth + "]" * depth + "}"


HUGE: dict[str, Callable[[], Any]] = {
    "nothing": lambda: "",
    "nine megabytes": lambda: " " * 9_000_000,
    "not UTF-8": lambda: bytes(range(256)) * 100,
    "an integer of seven million digits": lambda: '{"schema": ' + "9" * 7_000_000 + "}",
    "a number of seven million digits": lambda: '{"schema": 0.' + "9" * 7_000_000 + "}",
    "1e1000000000": lambda: '{"schema": "gainsmith.schedule/2", "name": 1e1000000000}',
    "NaN": lambda: '{"schema": "gainsmith.schedule/2", "name": NaN}',
    "brackets": lambda: "[" * 4_000_000,
    "nested 900": lambda: nested(900),
    "nested 100000": lambda: nested(100_000),
    "a key twice": lambda: '{"schema": "gainsmith.schedule/2", "schema": "gainsmith.schedule/2"}',
    "many keys": lambda: "{" + ", ".join(f'"k{i}": 0' for i in range(200_000)) + "}",
    "many claims": lambda: content() | {"claims": content()["claims"] * 100},
    "many breakpoints": lambda: many_breakpoints(5_000),
    "long formulas": lambda: large("+".join(["1"] * 900)),
    "powers in formulas": lambda: large("+".join(["(wheel_speed + 0.123456789)**16"] * 20)),
    "towers in formulas": lambda: large("-".join(["((wheel_speed + 0.1)**16)**2"] * 20)),
    "long name": lambda: content() | {"name": "x" * 10_000},
    "large provenance": lambda: content() | {"provenance": {"a": [0.5] * 1_000_000}},
}  # fmt: skip


def many_breakpoints(count: int) -> Content:
    data = content()
    data["scheduling"][0]["breakpoints"] = [140.0 * i / (count - 1) for i in range(count)]
    data["gain"]["table"] = [[[0.96], [13.0]]] * count
    return data


def large(formula: str) -> Content:
    """Twelve states, and one formula everywhere."""
    data, n = content(), 12
    sizes = {"states": n, "inputs": n, "outputs": n, "disturbances": n}
    data["model"] |= {kind: [{"name": f"{kind}{i}", "unit": "1"} for i in range(k)] for kind, k in sizes.items()}
    data["model"] |= {"constants": {}, "matrices": {key: [[formula] * n] * n for key in "ABCDEF"}}
    data["scheduling"][0]["unit"] = "1"
    unit = [[float(i == j) for j in range(n)] for i in range(n)]
    data["plant"] = {key: {"orders": [[0]], "coefficients": [unit]} for key in "ABCDEF"}
    data["gain"]["table"] = [unit] * len(data["scheduling"][0]["breakpoints"])
    data["claims"] = [{"kind": "internal update", "level": 1.0, "P": {"orders": [[0]], "coefficients": [unit]}}]
    return data


@pytest.mark.parametrize("name", HUGE)
def test_huge_and_broken_files_are_refused(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert refused(HUGE[name](), tmp_path, capsys)


def test_long_names_do_not_make_long_refusals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = content()
    new = {d["name"]: f"{d['name']}_{'x' * 40}" for d in data["model"]["disturbances"]}
    for disturbance in data["model"]["disturbances"]:
        disturbance["name"] = new[disturbance["name"]]
    assert "is none of" in refused(data, tmp_path, capsys)
    for stored in data["claims"]:
        if "channel" in stored:
            inputs = stored["channel"]["inputs"]
            stored["channel"]["inputs"] = {new.get(name, name): size for name, size in inputs.items()}
    data["claims"][2]["level"] = 0.9
    data["claims"][2]["channel"]["inputs"] |= dict.fromkeys(new.values(), 1.0)
    assert Told(write(tmp_path / "attack.json", data), capsys).code == 1


def test_a_file_that_does_not_stop_the_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every kind of bad file in front of a good one: all are reported, and the exit code is the worst."""
    spoiled = content()
    claim(spoiled, "decay rate")["level"] = 1e6
    bad = [
        write(tmp_path / "broken.json", "{"),
        write(tmp_path / "deep.json", nested(100_000)),
        write(tmp_path / "binary.json", b"\xff\xfe"),
        tmp_path / "missing.json",
        tmp_path,
        write(tmp_path / "spoiled.json", spoiled),
    ]
    good = write(tmp_path / "good.json", content())
    assert main(["certify", *map(str, bad), str(good)]) == 2
    out = capsys.readouterr()
    heads = [line for line in out.out.splitlines() if not line.startswith("  ")]
    assert [line.split(": ")[0] for line in heads] == [str(path) for path in (*bad, good)]
    assert all(": refused: " in line for line in heads[:5])
    assert ": refuted: " in heads[5] and ": certified: " in heads[6]
    assert main(["certify", str(bad[5]), str(good)]) == 1
    assert main(["certify", str(good)]) == 0
    capsys.readouterr()
    assert main(["certify", "--json", *map(str, bad), str(good)]) == 2
    rows = json.loads(capsys.readouterr().out)
    assert [row["certified"] for row in rows] == [False] * 6 + [True]
