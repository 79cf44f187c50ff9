"""The pages of the guide by their place in the site: those that are written, and those made from the examples."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs/pages"
EXAMPLES = ROOT / "docs/examples"
PICTURES = {"assets/corner-estimation-longitudinal.svg": ROOT / ".readme/corner-estimation-longitudinal.svg"}
"""Place in the site -> picture that the read-me shows, too."""


def page_texts() -> dict[str, str]:
    """Place in the site -> Markdown."""
    found = {str(path.relative_to(PAGES)): path.read_text(encoding="utf-8") for path in sorted(PAGES.rglob("*.md"))}
    for path in sorted(EXAMPLES.glob("*.py")):
        found[f"examples/{path.stem}.md"] = as_page(path.read_text(encoding="utf-8"), path.name)
    return found


def as_page(percent: str, file: str) -> str:
    """A notebook in the percent format (`# %%` starts a cell of code, `# %% [markdown]` one of text) as a page."""
    parts = re.split(r"^# %%(.*)\n", percent, flags=re.M)
    page = []
    for kind, body in zip(parts[1::2], parts[2::2], strict=True):
        if "[markdown]" in kind:
            page.append(re.sub(r"^# ?", "", body.strip("\n"), flags=re.M))
        elif body.strip():
            page.append(f"```python\n{body.strip()}\n```" + _figures(body))
    source = f"This page is the file `docs/examples/{file}`: a Python script, and a notebook for Jupyter with jupytext."
    return "\n\n".join([*page, "---", source]) + "\n"


def _figures(body: str) -> str:
    return "".join(
        f"\n\n![What the code above draws]({name})" for name in re.findall(r'savefig\("([\w-]+\.svg)"', body)
    )
