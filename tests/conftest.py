"""One thread of linear algebra for each test process: thousands of tiny matrices lose time with more."""

import gc
import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")


def pytest_collection_finish() -> None:
    """Thousands of collected tests and modules stay to the end: looking through them again and again took 8 % of all time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)
