"""MDF, bags, MCAP and MATLAB: the same drive in each gives the same signals, and what is wrong is one line."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.drives.drive_file import read_drive
from studies.drives.frames import check_frames
from studies.drives.guess import write_guess
from studies.drives.log import DriveLog, read_log
from studies.errors import LogError
from tests.support.synthetic_drive import write_drive
from tests.support.turning_drive import TURNING, turning, write_table

CHANNELS = ("v", "ax", "ay", "az", "r", "d", "w_fl", "w_fr", "w_rl", "w_rr")
UNITS = ("m/s", "m/s²", "m/s²", "m/s²", "rad/s", "rad", *4 * ("rad/s",))
LIBRARY = {".mf4": "asammdf", ".mcap": "rosbags", "folder": "rosbags", ".mat": "scipy"}


def write_mdf(folder: Path, table: dict[str, Any]) -> Path:
    """Wheels in a group of their own, 2 ms later and at half the rate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from asammdf import MDF, Signal

        with MDF(version="4.10") as file:
            late = slice(0, None, 2)
            for names, rows, delay in ((CHANNELS[:6], slice(None), 0.0), (CHANNELS[6:], late, 0.002)):
                stamps = table["t"][rows] + delay
                of = {name: np.interp(stamps, table["t"], table[name]) for name in names}
                unit = dict(zip(CHANNELS, UNITS, strict=True))
                file.append([Signal(of[name], stamps, name=name, unit=unit[name]) for name in names])
            file.append([Signal(np.array([b"on", b"off"]), np.array([0.0, 1.0]), name="gear", encoding="utf-8")])
            return Path(file.save(folder / "log.mf4", overwrite=True))


def write_bag(folder: Path, table: dict[str, Any]) -> Path:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    number = store.types["std_msgs/msg/Float64"]
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        topics = {n: bag.add_connection(f"/car/{n}", number.__msgtype__, typestore=store) for n in CHANNELS}
        for k, t in enumerate(table["t"]):
            for name, connection in topics.items():
                raw = store.serialize_cdr(number(data=float(table[name][k])), number.__msgtype__)
                bag.write(connection, 1_772_366_400_000_000_000 + round(1e9 * t), raw)
    return folder / "bag"


def write_mat(folder: Path, table: dict[str, Any]) -> Path:
    from scipy.io import savemat

    savemat(folder / "log.mat", {"t": table["t"], "log": {name: table[name] for name in CHANNELS}, "note": "text"})
    return folder / "log.mat"


def written(folder: Path, ending: str, table: dict[str, Any]) -> tuple[Path, str]:
    """The log, and the drive file that describes it."""
    pytest.importorskip(LIBRARY[ending])
    if ending == ".mf4":
        return write_mdf(folder, table), TURNING.replace('time = "t"\n', "")
    if ending == ".mat":
        text = TURNING
        for name in CHANNELS:
            text = text.replace(f'column = "{name}"', f'column = "log.{name}"')
        return write_mat(folder, table), text
    text = TURNING.replace('time = "t"\n', "")
    for name in CHANNELS:
        text = text.replace(f'column = "{name}"', f'column = "/car/{name}.data"')
    bag = write_bag(folder, table)
    return (bag if ending == "folder" else next(bag.glob("*.mcap"))), text


def read(folder: Path, log: Path, text: str) -> DriveLog:
    return read_log([log], read_drive(write_drive(folder, text)))


@pytest.mark.parametrize("ending", LIBRARY)
def test_every_format_gives_the_signals_of_the_csv_log(tmp_path: Path, ending: str) -> None:
    table = turning(4.0)
    other = read(tmp_path, write_table(tmp_path / "log.csv", table), TURNING)
    log, text = written(tmp_path, ending, table)
    if ending == ".mf4":
        text = text.replace('rate = "100 Hz"', 'rate = "50 Hz"')
    found = read(tmp_path, log, text)
    assert not np.isnan(found.signals["ax"][2:-5]).any()
    for name, value in other.signals.items():
        on_grid = np.interp(other.time[5:-8], found.time, found.signals[name])
        # every other sample of a noisy wheel; the rounding of stamps of an epoch
        slack = 0.3 if ending == ".mf4" and name.startswith("wheel") else 1e-4
        np.testing.assert_allclose(on_grid, value[5:-8], atol=slack, err_msg=name)
    drive = read_drive(tmp_path / "drive.toml")
    assert check_frames(found.signals, drive, found.files).complaint is None
    with pytest.raises(LogError) as caught:
        read(
            tmp_path,
            log,
            text.replace('/car/ax.data"', '/car/axe.data"').replace('ax"', 'axe"').replace("log.axe", "log.axe"),
        )
    assert "signals.ax: unknown column" in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) <= 300


@pytest.mark.parametrize("ending", [".mf4", ".mat"])
def test_a_guess_reads_them_too(tmp_path: Path, ending: str) -> None:
    table = turning(4.0)
    table = {("time" if name == "t" else name): value for name, value in table.items()} | {"t": table["t"]}
    log, _ = written(tmp_path, ending, table)
    target, guessed = write_guess([log], None)
    assert guessed.missing == ()
    found = read_log([log], read_drive(target))
    assert found.time.size > 390


BROKEN = {
    ".mf4": (b"MDF     4.10    ", "is not a readable MDF file"),
    ".mcap": (b"\x89MCAP0\r\n", "is not a readable bag"),
    ".db3": (b"SQLite format 3\0", "is not a readable bag"),
    ".mat": (b"MATLAB 5.0 MAT-file", "is not a readable MATLAB file"),
}


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # destructors of the libraries
@pytest.mark.parametrize("ending", BROKEN)
@pytest.mark.parametrize("rest", [b"", b"\0" * 500, bytes(range(256)) * 4])
def test_broken_files_are_one_line(tmp_path: Path, ending: str, rest: bytes) -> None:
    pytest.importorskip(LIBRARY.get(ending, "rosbags"))
    start, words = BROKEN[ending]
    log = tmp_path / f"log{ending}"
    log.write_bytes(start + rest)
    with pytest.raises(LogError) as caught, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read(tmp_path, log, TURNING)
    message = str(caught.value)
    assert message.startswith(log.name) and len(message) <= 300 and message.isprintable()
    assert words in message or "unknown column" in message


def test_matlab_7_3_and_other_lengths(tmp_path: Path) -> None:
    from scipy.io import savemat

    log = tmp_path / "log.mat"
    log.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n")
    with pytest.raises(LogError, match=r"is a MATLAB 7\.3 file, which is HDF5; save it again with save\(name, '-v7'\)"):
        read(tmp_path, log, TURNING)
    savemat(log, turning(2.0) | {"ax": np.zeros(5)})
    with pytest.raises(LogError, match=r"signals\.ax: variable 'ax' has 5 samples, 't' has 200"):
        read(tmp_path, log, TURNING)


def test_matrices_struct_arrays_and_times_of_their_own_in_matlab_files(tmp_path: Path) -> None:
    from scipy.io import savemat

    table = turning(4.0)
    wheels = np.column_stack([table[f"w_{corner}"] for corner in ("fl", "fr", "rl", "rr")])
    entries = np.array(
        [("ax", table["ax"][::2, None]), ("engine", table["ax"][::2])], dtype=[("label", "O"), ("values", "O")]
    )
    log = tmp_path / "log.mat"
    savemat(log, {"t": table["t"], "wheelSpeed": wheels, "out": {"time": table["t"][::2], "signals": entries}})
    with pytest.raises(
        LogError, match=r"'out\.signals\.ax\.values' has 200 samples, 't' has 400; .* a \[\[log\]\] of its own"
    ):
        write_guess([log], None)
    text = TURNING.split("ay =", maxsplit=1)[0].replace('name = "log"', 'name = "log"\nfile = "log.mat"')
    for k, corner in enumerate(("fl", "fr", "rl", "rr")):
        text = text.replace(f'column = "w_{corner}"', f'log = "log", column = "wheelSpeed[{k}]"')
    text = text.replace('column = "ax"', 'log = "unit", column = "out.signals.ax.values"')
    unit = '[[log]]\nname = "unit"\nfile = "log.mat"\ntime = "out.time"\nrate = "50 Hz"\n\n[signals]'
    found = read(tmp_path, log, text.replace("[signals]", unit))
    on_grid = np.interp(table["t"][::2][:-2], found.time, found.signals["ax"])
    np.testing.assert_allclose(on_grid, table["ax"][::2][:-2], atol=1e-6)


@pytest.mark.parametrize("ending", [".mcap", ".mf4", ".mat", ".csv"])
def test_a_file_that_is_not_there_is_said_to_be(tmp_path: Path, ending: str) -> None:
    with pytest.raises(LogError, match="cannot be read"):
        write_guess([tmp_path / f"none{ending}"], None)


def test_a_guess_of_channels_that_are_in_two_groups_takes_the_first(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    table = turning(2.0)
    names = {"ax": "AccelX", **{f"w_{c}": f"v_rad_{c}" for c in ("fl", "fr", "rl", "rr")}}
    with asammdf.MDF(version="4.10") as file:
        for factor in (1.0, 2.0):
            file.append([asammdf.Signal(factor * table[a], table["t"], name=b) for a, b in names.items()])
        file.save(tmp_path / "log.mf4")
    target, guessed = write_guess([tmp_path / "log.mf4"], None)
    assert guessed.found["ax"] == "AccelX@0"
    assert "# not taken for a signal: AccelX@1, v_rad_fl@1" in guessed.text
    found = read_log([tmp_path / "log.mf4"], read_drive(target))
    np.testing.assert_allclose(found.signals["ax"][::2], np.interp(found.time[::2], table["t"], table["ax"]), atol=1e-9)


def test_a_guess_bridges_the_slowest_of_several_clocks(tmp_path: Path) -> None:
    """Wheels at half the rate of the others: five of their samples."""
    pytest.importorskip("asammdf")
    log, _ = written(tmp_path, ".mf4", turning(1.0))
    _, guessed = write_guess([log], tmp_path / "guessed.toml")
    table = turning(1.0)["t"]
    assert f'max_gap = "{1e4 * (table[1] - table[0]):.3g} ms" # five samples of the slowest signal' in guessed.text


def test_channels_of_several_groups_and_of_text(tmp_path: Path) -> None:
    pytest.importorskip("asammdf")
    log, text = written(tmp_path, ".mf4", turning(1.0))
    with pytest.raises(LogError, match=r"channel 'gear' holds no numbers"):
        read(tmp_path, log, text.replace('column = "ay"', 'column = "gear"'))


@pytest.mark.parametrize(("ending", "module"), [(".mf4", "asammdf"), (".mcap", "rosbags.highlevel")])
def test_without_the_extra_the_way_to_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, module: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)  # import of it now fails
    log = tmp_path / f"log{ending}"
    log.write_bytes(b"x")
    with pytest.raises(LogError, match=r"needs (asammdf|rosbags); pip install 'gainsmith\[logs\]'"):
        read(tmp_path, log, TURNING)
