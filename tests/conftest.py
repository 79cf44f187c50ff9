"""One thread of linear algebra for each test process: thousands of tiny matrices lose time with more."""

import gc
import os
from pathlib import Path

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")


def pytest_collectstart() -> None:
    gc.disable()


def pytest_collection_finish() -> None:
    """Thousands of collected tests and modules stay to the end: looking through them again and again took 8 % of all time,
    and a third of that of the collection.
    """
    gc.enable()
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


@pytest.fixture
def blank_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures as empty files, for tests that look at none: drawing is nearly all the time of a short run."""

    def blank(_figure: object, *paths: Path) -> None:
        for path in paths:
            path.touch()

    monkeypatch.setattr("studies.plots.save.save_as", blank)
