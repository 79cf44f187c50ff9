"""One thread of linear algebra for work on many small matrices: on several it takes many times as long, on all of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")


def one_thread(work: Callable[_Given, _Found]) -> Callable[_Given, _Found]:
    """`work` with one thread of BLAS while it runs; afterwards there are as many as before."""

    @wraps(work)
    def alone(*args: _Given.args, **kwargs: _Given.kwargs) -> _Found:
        with _libraries().limit(limits=1, user_api="blas"):
            return work(*args, **kwargs)

    return alone


@cache
def _libraries() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401  brings a BLAS of its own, which must be there to be found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
