"""An identification on disk: identified.toml, identification.json and the residual pictures, each whole or not at all."""

from __future__ import annotations

from pathlib import Path

from studies.execution.files import ready_folder, whole_file, write_json
from studies.identify.identify import Identification
from studies.identify.parameter_file import parameter_file
from studies.identify.result import content
from synthesis.models.parameter_set import load_parameter_set


def write_identification(found: Identification, out: Path) -> tuple[Path, ...]:
    """Write everything to ``out`` and return the paths; the parameter file is read back before it gets its name.

    Raises LogError when ``out`` cannot be written.
    """
    from studies.report.identify_plots import figures  # matplotlib costs a second that bad input must not

    ready_folder(out)
    paths = [out / "identified.toml", out / "identification.json"]
    with whole_file(paths[0]) as beside:
        beside.write_text(parameter_file(found), encoding="utf-8")
        load_parameter_set(beside)
    write_json(paths[1], content(found))
    for name, save in figures(found).items():
        for suffix in (".svg", ".png"):
            path = out / f"{name}{suffix}"
            with whole_file(path) as beside:
                save(beside)
            paths.append(path)
    return tuple(paths)
