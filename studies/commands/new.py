"""Output of `gainsmith new`: first files of a user's own, commented, that run as they are."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path

from estimators.errors import GainsmithError
from studies.execution.files import ready_folder, whole_file, write_bytes
from studies.spec import OBSERVER

NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,50}")
PLACEHOLDER = "my-plant"
TEMPLATES = {"model.toml": "{name}.toml", "observer.toml": f"{{name}}{OBSERVER}.toml"}
DRIVE_TEMPLATES = {"drive.toml": "{name}-drive.toml"}
DRIVEN = "p2-acceleration-in-turn-dry"  # what the simulated car of the drive's log does
SECONDS = 8.0  # of it: straight, into the turn, full throttle, none, full again


def run_new(name: str, out: Path | None, drive: bool, as_json: bool) -> int:
    """Write a model and its specification, or a drive file and its log; nothing that is there already is replaced."""
    if not NAME.fullmatch(name):
        raise GainsmithError(
            f"'{name}' is no name for files; use lower-case letters, digits and hyphens, such as my-plant"
        )
    folder = out or Path()
    templates = DRIVE_TEMPLATES if drive else TEMPLATES
    written = [folder / target.format(name=name) for target in templates.values()]
    log = folder / f"{name}-log.csv"
    for path in [*written, log] if drive else written:
        if path.exists():
            raise GainsmithError(f"{path} exists; choose another name or folder, nothing was written")
    ready_folder(folder)
    texts = [_text(template, name) for template in templates]
    if drive:
        with whole_file(written[0]) as beside:  # there once its log is
            beside.write_bytes(texts[0])
            _simulate_log(beside, log)
        written.append(log)
    else:
        for path, text in zip(written, texts, strict=True):
            write_bytes(path, text)
    kinds = ("drive", "log") if drive else ("model", "specification")
    if as_json:
        print(json.dumps({kind: str(path) for kind, path in zip(kinds, written, strict=True)}))
        return 0
    first, second = written
    if drive:
        print(f"{second}: a log, of a simulated car")
        print(f"{first}: what its columns are; estimate with     gainsmith run {second} --drive {first} --out out/run")
        return 0
    print(f"{first}: a model; see it with     gainsmith model {first}")
    print(f"{second}: what is asked of its gains; design and prove them with     gainsmith schedules {second}")
    return 0


def _text(template: str, name: str) -> bytes:
    text = (resources.files("studies") / "templates" / template).read_text(encoding="utf-8")
    return text.replace(PLACEHOLDER, name).encode()


def _simulate_log(drive: Path, log: Path) -> None:
    """The log that the drive file describes, of a car with the errors of usual sensors."""
    from studies.drives.drive_file import read_drive
    from studies.truth import Sensors, draw, load_manoeuvre, simulate_manoeuvres
    from studies.truth.export import write_log

    manoeuvre = load_manoeuvre(DRIVEN).model_copy(update={"duration": SECONDS})
    write_log(log, read_drive(drive), draw(simulate_manoeuvres([manoeuvre]), Sensors(), seeds=[0]))
