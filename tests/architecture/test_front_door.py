"""What users import: one line from a package's door, or everything from `gainsmith`; a hidden package is told in one line."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOORS = ("estimators", "synthesis", "analysis", "studies")


def run(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("package", DOORS)
def test_every_name_of_a_door_is_there_and_described(package: str) -> None:
    door = import_module(package)
    assert len(door.__all__) > 10
    for name in door.__all__:
        found = getattr(door, name)
        assert not isinstance(found, type(sys)), (
            f"{package}.{name} is a module: a submodule hides what the door promises"
        )
        assert found.__doc__, f"{package}.{name} says nothing of itself"
    with pytest.raises(AttributeError):
        _ = door.no_such_name


@pytest.mark.parametrize("package", DOORS)
def test_no_name_of_a_door_is_that_of_a_submodule(package: str) -> None:
    """`import analysis.norms.hinf` would put the module in the place of a function `norms`."""
    folder = Path(import_module(package).__file__ or "").parent
    modules = {path.stem for path in folder.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert not modules & set(import_module(package).__all__)


def test_gainsmith_is_the_same_door() -> None:
    import gainsmith

    assert gainsmith.__version__ == version("gainsmith")
    names = [name for package in DOORS for name in import_module(package).__all__]
    assert sorted(set(names)) == dir(gainsmith) == gainsmith.__all__
    everything: dict[str, object] = {}
    exec("from gainsmith import *", everything)
    assert everything["design_observer"] is gainsmith.design_observer
    for package in DOORS:
        for name in import_module(package).__all__:
            assert getattr(gainsmith, name) is getattr(import_module(package), name)
    with pytest.raises(AttributeError, match="gainsmith has no 'no_such_name'; there are: "):
        _ = gainsmith.no_such_name


def test_a_door_imports_nothing_before_it_is_asked(tmp_path: Path) -> None:
    code = (
        "import sys, synthesis, analysis, studies, gainsmith; print({'sympy', 'scipy', 'clarabel'} & set(sys.modules))"
    )
    assert run(code, ROOT).stdout.strip() == "set()"


@pytest.mark.parametrize("init", [True, False])
def test_a_folder_that_hides_a_package_is_named(tmp_path: Path, init: bool) -> None:
    """With an __init__.py it hides ours wherever Python looks there first; without one only where ours is not found itself."""
    (tmp_path / "analysis").mkdir()
    if init:
        (tmp_path / "analysis" / "__init__.py").write_text("")
    code = f"import sys; sys.path = [{str(tmp_path)!r}, *sys.path, {str(ROOT)!r}]; import gainsmith; print('found')"
    done = run(code, ROOT.parent)
    if init:
        last = done.stderr.strip().splitlines()[-1]
        assert done.returncode == 1
        assert last.startswith(f"ImportError: {tmp_path / 'analysis'} hides gainsmith's package 'analysis': rename")
    else:
        assert done.stdout.strip() == "found", done.stderr


def test_the_module_is_the_command_line() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "gainsmith", "--version"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == f"gainsmith {version('gainsmith')}"
