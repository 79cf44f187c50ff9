"""`make docs-check`: every block runs, every link leads somewhere, every public name is described. No network, no MkDocs.

With `--site` (`make docs`) the site is built from the same run of the pages.
"""

from __future__ import annotations

import re
import shlex
import sys

from docs.tools.fences import blocks
from docs.tools.links import broken_links
from docs.tools.pages import PAGES, PICTURES, ROOT, page_texts
from docs.tools.reference import reference_pages, undescribed
from docs.tools.running import run_pages
from docs.tools.site import build_site


def stored_files() -> set[str]:
    """What lies in the site as it is: style sheets, stored pictures."""
    return set(PICTURES) | {
        str(path.relative_to(PAGES)) for path in PAGES.rglob("*") if path.is_file() and path.suffix != ".md"
    }


def unknown_commands(texts: dict[str, str]) -> list[str]:
    """Lines of `console` blocks that the command line would refuse."""
    from studies.cli import parser

    wrong = []
    for place, text in texts.items():
        for block in blocks(text):
            for line in block.code.splitlines() if block.language == "console" else ():
                words = shlex.split(line.removeprefix("$ "), comments=True)
                if words[:1] == ["gainsmith"]:
                    try:
                        parser().parse_args(words[1:])
                    except SystemExit as end:
                        if end.code:
                            wrong.append(f"{place}:{block.line}: {line}")
    return wrong


def outside_navigation(places: set[str]) -> list[str]:
    """Pages that the navigation lacks, and entries of it without a page."""
    listed = set(re.findall(r"[\w/-]+\.md", (ROOT / "docs/mkdocs.yml").read_text(encoding="utf-8")))
    return [
        f"docs/mkdocs.yml: {name} is in the navigation or in the pages, not in both" for name in sorted(places ^ listed)
    ]


def main() -> int:
    """Print what is wrong; 0 if nothing is."""
    written = page_texts()
    every = written | reference_pages()
    runs = run_pages(written)
    wrong = [run.failure for run in runs.values() if run.failure]
    wrong += broken_links(every, {place: run.pictures for place, run in runs.items()}, stored_files())
    wrong += [f"{name} has no docstring" for name in undescribed()]
    wrong += unknown_commands(written) + outside_navigation(set(every))
    if "--site" in sys.argv[1:]:
        wrong += build_site()
    for place, run in sorted(runs.items(), key=lambda item: -item[1].seconds):
        if run.seconds > 0.05:
            print(f"{run.seconds:6.1f} s  {place}")
    total = sum(run.seconds for run in runs.values())
    count = sum(b.language in ("python", "sh") for text in written.values() for b in blocks(text))
    print(f"{len(every)} pages, {count} blocks run in {total:.0f} s of processor time, {len(wrong)} faults")
    print("\n".join(wrong), file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
