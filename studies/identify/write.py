"""An identification on disk: identified.toml, identification.json and the residual pictures, each whole or not at all."""

from __future__ import annotations

from pathlib import Path

from studies.drives.output import ready_folder, whole_file, write_json
from studies.identify.identify import Identification
from studies.identify.parameter_file import parameter_file
from studies.identify.plots import figures
from studies.identify.result import content
from studies.plots.save import save_as
from synthesis.models.parameter_set import load_parameter_set


def write_identification(found: Identification, out: Path) -> tuple[Path, ...]:
    """Write everything to ``out`` and return the paths; the parameter file is read back before it gets its name.

    Raises LogError when ``out`` cannot be written.
    """
    ready_folder(out)
    paths = [out / "identified.toml", out / "identification.json"]
    with whole_file(paths[0]) as beside:
        beside.write_text(parameter_file(found), encoding="utf-8")
        load_parameter_set(beside)
    write_json(paths[1], content(found))
    for figure in figures(found):
        svg, png = (out / f"{figure.name}{suffix}" for suffix in (".svg", ".png"))
        with whole_file(svg) as first, whole_file(png) as second:
            save_as(figure, first, second)
        paths += [svg, png]
    return tuple(paths)
