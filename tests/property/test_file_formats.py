"""Whatever a file holds, its reader succeeds or refuses in one short line of a known error; never a traceback.

Real files, mutated. A longer run, on its own:

    GAINSMITH_FUZZ=2000 pytest -n 0 -s tests/property/test_file_formats.py
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable
from contextlib import chdir
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, settings

from estimators.errors import GainsmithError
from estimators.schedule import GainSchedule, read_content, sealed
from studies.commands.outcome import LONGEST
from studies.drives.drive_file import read_drive
from studies.drives.run import check_drive, replay_drive
from studies.parts.results import read_result
from studies.parts.store import read_part, write_part
from studies.spec import load_spec, shipped_specs
from studies.study import PartResult, Table
from studies.sweeps.baseline import read_baseline
from studies.sweeps.spec import load_sweep, shipped_sweeps
from studies.sweeps.store import SweepFolder
from studies.sweeps.summary import read_summary
from studies.truth.manoeuvre import load_manoeuvre, shipped_manoeuvres
from studies.truth.vehicle import load_vehicle
from synthesis.exchange.model_file import load_model
from synthesis.models.parameter_set import shipped_parameter_sets
from tests.support import synthetic_drive
from tests.support.mutated_files import Change, changed, changes
from tests.support.sweep_cases import sweep

ROOT = Path(__file__).parents[2]
COUNT = int(os.environ.get("GAINSMITH_FUZZ", "0"))  # 0: a few of each, always the same
SCHEDULE = ROOT / "tests" / "unit" / "data" / "heated-spring.json"
RESULT = {"schema": "gainsmith.study/1", "id": "a", "fingerprint": "f", "claims": [{"id": "a", "value": 1.5}]}
Reader = Callable[[Path], object]


def _schedule(path: Path) -> object:
    return GainSchedule.from_content(read_content(path))


def _resealed(path: Path) -> object:
    """What passes the digests: the structure is all that refuses."""
    try:
        content = json.loads(path.read_bytes())
        path.write_text(json.dumps(sealed(content)), "utf-8")
    except (ValueError, TypeError, AttributeError, RecursionError):
        return None
    return _schedule(path)


def _spec(path: Path) -> object:
    spec, folder = load_spec(path)
    return spec.plant(folder), spec.observer_design(), spec.deploy_settings()


def _log(path: Path) -> object:
    return check_drive([path], Path("drive.toml"))


def _replayed(path: Path) -> object:
    return replay_drive([path], Path("drive.toml"))


@cache
def _sweep() -> SweepFolder:
    return SweepFolder(Path(), sweep())


def _manifest(path: Path) -> object:
    Path("manifest.json").write_bytes(path.read_bytes())
    return _sweep().begin(resume=True)


FORMATS: dict[str, tuple[str, Reader, int]] = {  # name of the file, its reader, examples
    "schedule": ("schedule.json", _schedule, 20),
    "schedule, sealed again": ("schedule.json", _resealed, 40),
    "model": ("model.toml", load_model, 40),
    "specification": ("spec.toml", _spec, 20),
    "drive": ("drive.toml", read_drive, 40),
    "log": ("log.csv", _log, 40),
    "log, replayed": ("log.csv", _replayed, 4),
    "sweep": ("sweep.toml", load_sweep, 15),
    "baseline": ("baseline.toml", read_baseline, 20),
    "vehicle and tire": ("vehicle.toml", load_vehicle, 40),
    "manoeuvre": ("manoeuvre.toml", load_manoeuvre, 40),
    "manifest of a sweep": ("manifest.json", _manifest, 15),
    "summary of a sweep": ("summary.json", read_summary, 40),
    "result of a study": ("result.json", lambda _: read_result(Path()), 40),
    "part of a study": ("part.json", lambda _: read_part(Path(), "f"), 40),
}


def originals(name: str) -> list[bytes]:
    """The real files of a format."""
    with TemporaryDirectory() as folder, chdir(folder):
        if name.startswith("schedule"):
            return [SCHEDULE.read_bytes()]
        if name == "model":
            shipped = [path for path in (ROOT / "studies").glob("*/*.toml") if "[matrices]" in path.read_text("utf-8")]
            return [path.read_bytes() for path in sorted(shipped)]
        if name == "specification":
            return [path.read_bytes() for path in shipped_specs().values()]
        if name == "drive":
            return [path.read_bytes() for path in sorted((ROOT / "tests" / "drives").glob("*.toml"))]
        if name.startswith("log"):
            return [synthetic_drive.write_log(Path("log.csv"), synthetic_drive.columns(0.5)).read_bytes()]
        if name == "sweep":
            return [path.read_bytes() for path in shipped_sweeps().values()]
        if name == "baseline":
            return [(ROOT / "studies/sweeps/baselines/gain-box.quick.toml").read_bytes()]
        if name == "vehicle and tire":
            return [path.read_bytes() for path in shipped_parameter_sets().values()]
        if name == "manoeuvre":
            return [path.read_bytes() for path in list(shipped_manoeuvres().values())[::7]]
        if name == "manifest of a sweep":
            return [json.dumps(_sweep().manifest(), indent=1).encode()]
        if name == "summary of a sweep":
            row = {"subject": "a", "measure": "m", "name": "worst", "value": 0.5, "unit": "1", "at": {"c": 1.0}}
            return [json.dumps({"sweep": "s", "form": "full", "figures": [row], "notes": ["n"]}, indent=1).encode()]
        if name.startswith("part"):
            result = PartResult(tables=[Table("t", "c", ["x"], [[1.5]])], notes=["n"], measures={"m": 1.0})
            write_part(Path("part"), result, "f")
            return [Path("part", "part.json").read_bytes()]
        return [json.dumps(RESULT, indent=1).encode()]


def outcome(name: str, data: bytes) -> str:
    """What the reader of a format makes of a file: read, or the class that refuses it. Anything else is raised."""
    file, reader, _ = FORMATS[name]
    with TemporaryDirectory() as folder, chdir(folder):
        if name.startswith("log"):
            synthetic_drive.write_drive(Path())
        Path(file).write_bytes(data)
        try:
            reader(Path(file))
        except GainsmithError as error:
            said = str(error)
            assert said.isprintable() and len(said) <= LONGEST, said[:2000]
            return type(error).__name__
    return "read"


@pytest.mark.parametrize("name", FORMATS)
def test_a_mutated_file_is_read_or_refused_in_one_line(name: str) -> None:
    bases = originals(name)
    found: Counter[str] = Counter()

    @settings(
        max_examples=COUNT or FORMATS[name][2], derandomize=not COUNT, database=None, deadline=None,
        suppress_health_check=list(HealthCheck), print_blob=False,
    )  # fmt: skip
    @given(changes())
    def attacked(todo: list[Change]) -> None:
        found[outcome(name, changed(bases[todo[0].value % len(bases)], todo))] += 1

    attacked()
    if COUNT:
        print(f"{name}: {dict(found)}")
    for base in bases:
        assert outcome(name, base) == "read"  # the real file is one
    assert set(found) - {"read"} or name.endswith("of a study")  # and mutations reach what refuses
