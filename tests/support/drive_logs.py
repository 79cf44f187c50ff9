"""Short logs as text, and what reading them gives."""

from __future__ import annotations

from pathlib import Path

from studies.drives.drive_file import DriveFile, read_drive
from studies.drives.log import DriveLog, read_log
from tests.support.synthetic_drive import DRIVE

HEADER = "t,v,ax,w_fl,w_fr,w_rl,w_rr"


def drive(folder: Path, text: str = DRIVE) -> DriveFile:
    path = folder / "drive.toml"
    path.write_text(text, encoding="utf-8")
    return read_drive(path)


def rows(times: list[str], width: int = 7) -> str:
    return HEADER + "\n" + "".join(",".join([t, *["1.0"] * (width - 1)]) + "\n" for t in times)


def read(folder: Path, content: str, extra: str = "") -> DriveLog:
    path = folder / "log.csv"
    path.write_text(content, encoding="utf-8")
    return read_log([path], drive(folder, DRIVE.replace('time = "t"', f'time = "t"\n{extra}')))
