"""A browser for the tests of pages."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.support.browser import Page, find_chromium


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    program = find_chromium()
    if program is None:
        missing = "Chromium is not installed (Debian: apt-get install chromium)"
        if os.environ.get("GAINSMITH_CHROMIUM") == "required":
            pytest.fail(missing)
        pytest.skip(missing)
    opened = Page(program, tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()
