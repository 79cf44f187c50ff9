"""Links of pages, followed without a network: to other pages, to headings, to pictures."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection, Iterator, Mapping

from docs.tools.fences import FENCE

LINK = re.compile(r"(!?)\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} (.+?)(?:\s*\{\s*#([\w.-]+)\s*\})?\s*$", re.M)


def anchors(text: str) -> set[str]:
    """The anchors of a page's headings, as Python-Markdown's `toc` makes them."""
    found = set()
    for title, given in HEADING.findall(FENCE.sub("", text)):
        plain = re.sub(r"[^\w\s-]", "", re.sub(r"[`*]", "", title)).strip().lower()
        found.add(given or re.sub(r"[-\s]+", "-", plain))
    return found


def broken_links(
    texts: Mapping[str, str], pictures: Mapping[str, Collection[str]], stored: Collection[str]
) -> Iterator[str]:
    """What each page links to and is not there; `pictures` are those that its blocks draw, `stored` the site's other files."""
    for place, text in texts.items():
        for picture, target in LINK.findall(FENCE.sub("", text)):
            if target.startswith(("http://", "https://", "mailto:")):
                continue
            path, _, anchor = target.partition("#")
            full = posixpath.normpath(posixpath.join(posixpath.dirname(place), path)) if path else place
            there = full in stored or (path in pictures.get(place, ()) if picture else full in texts)
            if not there:
                yield f"{place}: nothing at {target}"
            elif anchor and full in texts and anchor not in anchors(texts[full]):
                yield f"{place}: {path or place} has no heading #{anchor}"
