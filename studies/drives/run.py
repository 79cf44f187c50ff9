"""Replay a recorded drive and write what came of it: estimates, metrics against references and baselines, plots."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from estimators.arrays import AnyArray
from studies.drives.chain import Chain, pipeline_of, run_chain
from studies.drives.drive_file import read_drive
from studies.drives.evaluation import DriveData, evaluate
from studies.drives.frames import FrameReport, check_frames, read_checked
from studies.drives.log import read_log
from studies.drives.plots import figures
from studies.drives.prepare import corner_inputs_of
from studies.drives.quantities import CORNERS
from studies.drives.replay import Progress, replay
from studies.drives.schedules import corner_observer, load_schedules
from studies.execution.files import check_folder, only_run, ready_folder, write_csv, write_json
from studies.plots.save import write_figures

Columns = dict[str, AnyArray]


@dataclass(frozen=True)
class RunResult:
    """What a run produced: ``metrics`` as written to metrics.json, the files, and the arrays.

    ``replaced``: the drive whose results were in the folder before; empty if there were none.
    """

    metrics: dict[str, Any]
    paths: tuple[Path, ...]
    data: DriveData
    replaced: str = ""


def run_drive(
    logs: Sequence[Path], drive: Path, out: Path, *, check: bool = True, progress: Progress = lambda _done: None
) -> RunResult:
    """Run the pipeline and the four-corner longitudinal observers over the ``logs`` that the ``drive`` file describes.

    Writes estimates.csv, metrics.json and the plots (svg and png) to ``out``, each whole or not at all. ``progress``
    is called with the fraction done. Raises SpecError (drive file, schedule, another run into ``out``) or LogError (logs,
    ``out``), one line each, before anything is written; so it does where signals contradict one another, unless ``check`` is
    False here or in the drive file.

    >>> result = run_drive([Path("log.csv")], Path("drive.toml"), Path("out"))  # doctest: +SKIP
    >>> [path.name for path in result.paths]  # doctest: +SKIP
    """
    check_folder(out)
    data = replay_drive(logs, drive, check=check, progress=lambda done: progress(0.4 * done))
    metrics = evaluate(data)
    ready_folder(out)
    paths = [out / "estimates.csv", out / "metrics.json"]
    with only_run(out):
        replaced = _drive_of(paths[1])
        write_csv(paths[0], estimate_columns(data))
        write_json(paths[1], metrics)
        paths += write_figures(figures(data), out, lambda done: progress(0.4 + 0.6 * done))
    progress(1.0)
    return RunResult(metrics, tuple(paths), data, replaced)


def _drive_of(metrics: Path) -> str:
    """The drive that an earlier run into this folder was about."""
    if not metrics.exists():
        return ""
    try:
        found = json.loads(metrics.read_bytes())
    except (OSError, ValueError):
        return "unknown"
    return str(found.get("drive", "unknown")) if isinstance(found, dict) else "unknown"


def check_drive(logs: Sequence[Path], drive: Path) -> FrameReport:
    """Read the ``logs`` as :func:`run_drive` does and compare their signals with one another; nothing is estimated.

    Raises SpecError (drive file) or LogError (logs), one line; what contradicts is in the report.

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from studies.truth.export import write_drive
    >>> truth = simulate_manoeuvres([load_manoeuvre("p2-step-steer-dry").model_copy(update={"duration": 2.0})])
    >>> with TemporaryDirectory() as folder:
    ...     log, drive = write_drive(Path(folder), draw(truth, Sensors(), seeds=[0]))
    ...     print(check_drive([log], drive).complaint)
    None
    """
    description = read_drive(drive)
    log = read_log(logs, description)
    return check_frames(log.signals, description, log.files, log.reference)


def replay_drive(
    logs: Sequence[Path], drive: Path, *, check: bool = True, progress: Progress = lambda _done: None
) -> DriveData:
    """As :func:`run_drive`, but the arrays are returned and nothing is written.

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from studies.truth.export import write_drive
    >>> truth = simulate_manoeuvres([load_manoeuvre("p2-step-steer-dry").model_copy(update={"duration": 2.0})])
    >>> with TemporaryDirectory() as folder:
    ...     log, drive = write_drive(Path(folder), draw(truth, Sensors(), seeds=[0]))
    ...     print(replay_drive([log], drive).log.time.shape)
    (401,)
    """
    description = read_drive(drive)
    schedule, lateral, assumed = load_schedules(description, drive.parent)
    observer, of_pipeline = (
        None if schedule is None else corner_observer(description, drive.parent, schedule) for _ in range(2)
    )
    pipeline, assumptions = pipeline_of(description, of_pipeline, lateral)
    log, unchecked = read_checked(logs, description, check)
    progress(0.2)
    inputs = corner_inputs_of(log, description)
    replayed = None if observer is None else replay(inputs, observer, lambda done: progress(0.2 + 0.1 * done))
    chain = run_chain(log, inputs, pipeline, assumptions, lambda done: progress(0.3 + 0.7 * done))
    return DriveData(description, schedule, log, inputs, replayed, chain, assumed + unchecked)


def estimate_columns(data: DriveData) -> Columns:
    """The columns of estimates.csv, SI, the unit in every name."""
    ran = data.replay
    columns: Columns = {"time_s": data.log.time}
    columns |= {} if ran is None else {"vx_mps": ran.velocity}
    columns |= {f"vx_{name}_mps": value for name, value in data.baselines.items()}
    corners: Columns = {
        "slip_{}": data.slip, "force_x_{}_N": data.inputs.force, "force_z_{}_N": data.inputs.vertical_load,
        "normalised_force_{}": data.inputs.normalised_force,
    }  # fmt: skip
    if ran is not None:
        estimated = {"vx_{}_mps": ran.corner_velocity, "relative_velocity_{}_mps": ran.relative_velocity}
        corners = {**estimated, **corners, "innovation_{}": ran.innovation, "flags_{}": ran.flags}
    columns |= _by_corner(corners)
    if data.chain is not None:
        columns |= chain_columns(data.chain)
    units = {"v": "mps", "a": "mps2", "y": "radps", "f": "N"}
    columns |= {f"reference_{name}_{units[name[0]]}": value for name, value in data.log.reference.items()}
    return columns


def chain_columns(chain: Chain) -> Columns:
    """The pipeline's columns of estimates.csv; those of parts that a drive did not ask for are left out."""
    columns: Columns = {
        "pipeline_vx_mps": chain.vx, "pipeline_vy_mps": chain.vy, "pipeline_sideslip_rad": chain.sideslip,
        "pipeline_force_y_front_N": chain.axle_force_y[:, 0], "pipeline_force_y_rear_N": chain.axle_force_y[:, 1],
        "pipeline_flags": chain.flags, "pipeline_checks": chain.checks,
    }  # fmt: skip
    parts = {
        "sideslip_part_rad": chain.sideslip_part, "corner_observers_vy_mps": chain.corner_vy,
        "pipeline_vx_deviation_mps": chain.vx_deviation, "pipeline_vy_deviation_mps": chain.vy_deviation,
    }  # fmt: skip
    columns |= {name: value for name, value in parts.items() if np.isfinite(value).any()}
    columns |= _by_corner({
        "pipeline_force_x_{}_N": chain.force_x, "pipeline_force_z_{}_N": chain.force_z, "pipeline_slip_{}": chain.slip,
        "pipeline_slip_angle_{}_rad": chain.slip_angle,
    })  # fmt: skip
    return columns


def _by_corner(per_corner: Mapping[str, AnyArray]) -> Columns:
    """One column a corner of each (n, 4)."""
    return {
        pattern.format(corner): values[:, k]
        for pattern, values in per_corner.items()
        for k, corner in enumerate(CORNERS)
    }
