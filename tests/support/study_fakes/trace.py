"""How the tests see what the workers did: a file for each computation, and gates that hold a part."""

from __future__ import annotations

import os
import time
from pathlib import Path

VARIABLE = "GAINSMITH_TEST_TRACE"


def computed(name: str) -> None:
    """Leave a file for this computation of ``name``."""
    if folder := os.environ.get(VARIABLE):
        (Path(folder) / f"{name}.{os.getpid()}").touch()


def present(name: str) -> bool:
    """Whether the test has put the file ``name`` into the trace folder."""
    return VARIABLE in os.environ and (Path(os.environ[VARIABLE]) / name).exists()


def hold_until(name: str, seconds: float = 600.0) -> None:
    """Wait for the file ``name``; the limit keeps a lost worker from waiting forever."""
    end = time.monotonic() + seconds
    while not present(name) and time.monotonic() < end:
        time.sleep(0.01)
