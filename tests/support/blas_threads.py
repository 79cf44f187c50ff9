"""How many threads linear algebra has."""

from __future__ import annotations

from threadpoolctl import threadpool_info


def blas_threads() -> dict[str, int]:
    """Of every BLAS that is loaded and can be asked, by its file."""
    found = (library for library in threadpool_info() if library["user_api"] == "blas")
    return {library["filepath"]: library["num_threads"] for library in found}
