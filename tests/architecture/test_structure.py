"""The structure that the project promises: layers, what an import pulls in, small files, no machine in the text."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("estimators", "synthesis", "analysis", "studies")


def tracked() -> list[Path]:
    try:
        done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout: the list of the project's own files is not known")
    return [ROOT / line for line in done.stdout.splitlines() if (ROOT / line).is_file()]


def test_layers_hold() -> None:
    linter = Path(sys.executable).with_name("lint-imports")
    if not linter.exists():
        pytest.skip("import-linter is not installed beside this Python; `make test` installs it")
    done = subprocess.run([linter], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("module", "allowed"),
    [("estimators", {"numpy"}), ("studies.cli", set()), ("synthesis.certificate.proof", {"numpy", "flint"})],
)
def test_imports_pull_in_nothing_else(module: str, allowed: set[str]) -> None:
    code = (
        f"import sys, {module}; import importlib.metadata as m; third = m.packages_distributions();"
        "print(' '.join(sorted({name.split('.')[0] for name in sys.modules} & set(third))))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    own = set(FOLDERS) | {"_distutils_hack", "__editable___gainsmith_0_1_0_finder"}
    found = {name for name in done.stdout.split() if name not in own and not name.startswith("__editable__")}
    assert found <= allowed


def test_files_are_small() -> None:
    long = {
        str(path.relative_to(ROOT)): lines
        for path in tracked()
        if path.suffix == ".py" and (lines := len(path.read_text().splitlines())) > 400
    }
    assert not long


def test_no_machine_and_no_registry_in_the_text() -> None:
    """Absolute machine paths and registry hosts have no place in what is shipped."""
    hosts = ["py" + "pi.org", "python" + "hosted.org", "registry.npm" + "js", "deb.deb" + "ian.org"]
    pattern = re.compile(r"(?<![\w.])/(?:work|root|home|farm)/|" + "|".join(re.escape(host) for host in hosts))
    found = []
    for path in tracked():
        if (
            path.suffix in {".py", ".toml", ".md", ".json", ".cfg", ".yaml", ".yml", ""}
            and path.name != Path(__file__).name
        ):
            for number, line in enumerate(path.read_text(errors="ignore").splitlines(), 1):
                if pattern.search(line):
                    found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    assert not found


def test_dependencies_are_bounded_and_have_a_reason() -> None:
    lines = [line for line in (ROOT / "pyproject.toml").read_text().splitlines() if re.match(r'\s+"[a-z-]+[>=]', line)]
    assert len(lines) >= 15
    for line in lines:
        assert re.search(r">=[\d.]+,<[\d.]+", line), line
        assert "#" in line, line
