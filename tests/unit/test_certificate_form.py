"""Malformed, hostile and huge schedule files: `gainsmith certify` refuses each in one short line, and goes on with the next."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studies.cli import main
from tests.support.terminal_output import Content, Told, claim, content, refused, true, write


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
    "four parameters": lambda: several(4, 1),
    "six parameters": lambda: several(6, 1),
    "order 16 in two parameters": lambda: several(2, 16),
    "order 4 in three parameters": lambda: several(3, 4),
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


def several(count: int, order: int) -> Content:
    """One state, decaying over several parameters; P has few coefficients, but as many as there can be one sample later."""
    data, none = content(), [0] * count
    data["model"] |= {
        kind: [{"name": f"{kind}0", "unit": "1"}] for kind in ("states", "inputs", "outputs", "disturbances")
    }
    data["model"] |= {"constants": {}, "matrices": {key: [[{"A": "-1", "C": "1"}.get(key, "0")]] for key in "ABCDEF"}}
    data["scheduling"] = [
        {"name": f"p{i}", "unit": "1", "min": -1.0, "max": 1.0, "rate_min": -0.1, "rate_max": 0.1, "absolute": False,
         "breakpoints": [-1.0, 1.0]}
        for i in range(count)
    ]  # fmt: skip
    data["plant"] = {
        key: {"orders": [none], "coefficients": [[[{"A": -1.0, "C": 1.0}.get(key, 0.0)]]]} for key in "ABCDEF"
    }
    table: Any = [[0.5]]
    for _ in range(count):
        table = [table] * 2
    data["gain"] |= {"dtype": "float64", "table": table}
    orders = [none, *([order * int(i == j) for j in range(count)] for i in range(count))]
    P = {"orders": orders, "coefficients": [[[1.0]], *([[[0.01]]] * count)]}
    data["claims"] = [{"kind": "internal update", "level": 0.2, "P": P}]
    return data


def test_several_parameters_are_proved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for count, order in ((1, 16), (2, 4), (3, 1)):
        assert Told(write(tmp_path / "attack.json", several(count, order)), capsys).code == 0


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
