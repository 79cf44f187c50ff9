"""Output of `gainsmith new`: a first model and its specification, commented, that run as they are."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path

from estimators.errors import GainsmithError
from studies.execution.files import ready_folder, write_bytes
from studies.spec import OBSERVER

NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,50}")
PLACEHOLDER = "my-plant"
TEMPLATES = {"model.toml": "{name}.toml", "observer.toml": f"{{name}}{OBSERVER}.toml"}


def run_new(name: str, out: Path | None, as_json: bool) -> int:
    """Write both files; refuses a name that cannot be one and files that are there already."""
    if not NAME.fullmatch(name):
        raise GainsmithError(
            f"'{name}' is no name of a model; use lower-case letters, digits and hyphens, such as my-plant"
        )
    folder = out or Path()
    written = [folder / target.format(name=name) for target in TEMPLATES.values()]
    for path in written:
        if path.exists():
            raise GainsmithError(f"{path} exists; choose another name or folder, nothing was written")
    ready_folder(folder)
    for template, path in zip(TEMPLATES, written, strict=True):
        text = (resources.files("studies") / "templates" / template).read_text(encoding="utf-8")
        write_bytes(path, text.replace(PLACEHOLDER, name).encode())
    model, specification = written
    if as_json:
        print(json.dumps({"model": str(model), "specification": str(specification)}))
        return 0
    print(f"{model}: a model; see it with     gainsmith model {model}")
    print(
        f"{specification}: what is asked of its gains; design and prove them with     gainsmith schedules {specification}"
    )
    return 0
