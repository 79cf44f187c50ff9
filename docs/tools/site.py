"""`make docs`: the site, built with every socket shut, from the pages as the check has run them."""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn
from unittest.mock import patch

from docs.tools.pages import ROOT

SITE = ROOT / "out/docs"
LOADED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*?\b(?:src|href)=\"?(https?://[^\"\s>]+)", re.I)
SAID = re.compile(r"<link[^>]*\brel=\"?(?:canonical|license)\b", re.I)


def build_site() -> list[str]:
    """Build it; what is wrong with it. MkDocs itself says what it warns of."""
    from mkdocs.commands.build import build
    from mkdocs.config import load_config
    from mkdocs.exceptions import MkDocsException

    os.environ.setdefault("NO_MKDOCS_2_WARNING", "1")
    with _without_network():
        try:
            config = load_config(str(ROOT / "docs/mkdocs.yml"))
            config.plugins.on_startup(command="build", dirty=False)
            build(config)
            config.plugins.on_shutdown()
        except MkDocsException as error:
            return [f"mkdocs: {error}"]
    return loaded_from_outside(SITE)


def loaded_from_outside(site: Path) -> list[str]:
    """What pages would fetch from other hosts before they look as they should; links for a reader to follow are none of it."""
    return [
        f"{path.relative_to(site)}: loads {found[1]}"
        for path in sorted(site.rglob("*.html"))
        for found in LOADED.finditer(path.read_text(encoding="utf-8"))
        if not SAID.match(found[0])
    ]


@contextmanager
def _without_network() -> Iterator[None]:
    def refuse(*_: object, **__: object) -> NoReturn:
        raise OSError("the site is built without a network")

    with patch.object(socket.socket, "connect", refuse), patch.object(socket, "getaddrinfo", refuse):
        yield
