"""What importing the estimators costs and pulls in."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
FOREIGN = """
import sys
before = set(sys.modules)
import estimators
everything = [getattr(estimators, name) for name in estimators.__all__]
loaded = {name.partition(".")[0] for name in set(sys.modules) - before}
print(*sorted(loaded - set(sys.stdlib_module_names) - {"estimators"}))
"""


def python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def test_the_estimators_import_numpy_alone() -> None:
    assert python(FOREIGN).split() == ["numpy"]


def test_import_of_the_estimators(benchmark: Any) -> None:
    """Subtract the interpreter's own start, measured below."""
    benchmark.pedantic(
        python, args=("from estimators import GainSchedule, LpvVelocityObserver",), rounds=5, warmup_rounds=1
    )


def test_start_of_the_interpreter(benchmark: Any) -> None:
    benchmark.pedantic(python, args=("pass",), rounds=5, warmup_rounds=1)
