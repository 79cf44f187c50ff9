"""The guide, without running its blocks (`make docs-check` does that): links, commands, names, and what its tools notice."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from docs.tools.check import outside_navigation, stored_files, unknown_commands
from docs.tools.fences import blocks, with_outputs
from docs.tools.links import broken_links
from docs.tools.pages import PAGES, as_page, page_texts
from docs.tools.reference import as_html, reference_pages, undescribed
from docs.tools.running import run_pages
from docs.tools.site import loaded_from_outside
from studies.drives.drive_file import Estimators

ROOT = Path(__file__).parents[2]
WRITTEN = page_texts()
EVERY = WRITTEN | reference_pages()
DRAWN = {place: set(re.findall(r"!\[[^\]]*\]\(([^)/]+)\)", text)) for place, text in WRITTEN.items()}


def test_links_lead_somewhere_and_every_page_is_in_the_navigation() -> None:
    assert not list(broken_links(EVERY, DRAWN, stored_files()))
    assert not outside_navigation(set(EVERY))


def test_broken_links_are_seen() -> None:
    texts = {"a/one.md": "# One\n[x](two.md) [y](two.md#here) [z](gone.md) ![p](no.svg)", "a/two.md": "# Two"}
    found = list(broken_links(texts, {}, ()))
    assert [text.rpartition(" ")[2] for text in found] == ["#here", "gone.md", "no.svg"]
    assert outside_navigation({"new.md"} | set(EVERY)) == outside_navigation(set(EVERY) | {"new.md"}) != []


def test_every_public_name_is_described() -> None:
    assert not undescribed()


def test_commands_that_are_only_shown_parse(capsys: pytest.CaptureFixture[str]) -> None:
    assert not unknown_commands(WRITTEN)
    assert unknown_commands({"x.md": "```console\n$ gainsmith schedules --no-such-option\n```"})
    assert "no-such-option" in capsys.readouterr().err


def test_a_block_that_fails_is_told_with_its_line(tmp_path: Path) -> None:
    texts = {
        "good.md": "# G\n\n```python\nprint(6 * 7)\n```\n",
        "bad.md": "# B\n\n```python\n1 / 0\n```\n",
        "wrong.md": "```sh\ngainsmith certify nowhere.json\n```\n",
    }
    runs = run_pages(texts)
    assert runs["good.md"].outputs == ["42\n"]
    assert not runs["good.md"].failure
    assert runs["bad.md"].failure.startswith("bad.md:3: ")
    assert "ZeroDivisionError" in runs["bad.md"].failure
    assert "ended with 2, not 0" in runs["wrong.md"].failure


def test_outputs_stand_below_their_blocks() -> None:
    page = (
        '```python head=1\nprint(1)\n```\n\n=== "tab"\n\n    ```sh quiet\n    ls\n    ```\n\n```python hide\nx\n```\n'
    )
    shown = with_outputs(page, ["1\n2\n", "a\n", "y\n"])
    assert "```python\nprint(1)\n```\n\n```{ .text .output }\n1\n... (1 more lines)\n```" in shown
    assert "    ```sh\n    ls\n    ```\n" in shown
    assert shown.endswith("\n```{ .text .output }\ny\n```\n")


def test_notebooks_become_pages() -> None:
    page = as_page('# %% [markdown]\n# # Title\n# words\n\n# %%\nx = 1\nfig.savefig("a.svg")\n', "a.py")
    assert page.startswith("# Title\nwords\n\n```python\nx = 1\n")
    assert "](a.svg)" in page
    assert [block.code for block in blocks(page)] == ['x = 1\nfig.savefig("a.svg")\n']


def test_docstrings_become_html() -> None:
    html = as_html("x' = A x, |e| < 1.\n\n    P > 0\n\nRaises:\n    ModelError: no.\n\n>>> 1 < 2\nTrue")
    assert "<p>x' = A x, |e| &lt; 1.</p>" in html
    assert "<pre><code>    P &gt; 0</code></pre>" in html
    assert "<li>ModelError: no.</li>" in html
    assert '<pre class="doctest"><code>&gt;&gt;&gt; 1 &lt; 2\nTrue</code></pre>' in html


def test_the_estimators_that_a_drive_file_can_choose_are_all_there() -> None:
    """The block shows the defaults, and its comments the other names: no more, no fewer."""
    text = (PAGES / "how-to/own-log.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```toml\n(\[estimators\].*?)```", text, flags=re.DOTALL)
    table = tomllib.loads(block)["estimators"]
    assert Estimators(**table) == Estimators()
    assert list(table) == list(Estimators.model_fields)
    for key, rest in re.findall(r"^(\w+) = .*?# or (.*)$", block, flags=re.MULTILINE):
        names = {table[key], *(name.strip() for name in rest.partition(":")[0].split(","))}
        with pytest.raises(ValueError, match="unknown estimator") as caught:
            Estimators(**{key: "zzz"})
        known = re.search(r"known: ([a-z, -]+)", str(caught.value))
        assert known is not None
        assert {name.strip() for name in known[1].split(",")} == names


def test_pages_run_where_the_project_is_not_on_the_path(tmp_path: Path) -> None:
    """As under MkDocs, which forgets what a hook added to the path."""
    script = tmp_path / "build.py"
    script.write_text(
        f"import sys\nsys.path.insert(0, {str(ROOT)!r})\nfrom docs.tools.running import run_pages\n"
        f"sys.path.remove({str(ROOT)!r})\nif __name__ == '__main__':\n"
        "    print(run_pages({'a.md': '```python\\nprint(6 * 7)\\n```\\n'})['a.md'].outputs)\n"
    )
    ended = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (0, "['42\\n']\n"), ended.stderr


def test_what_a_page_would_fetch_from_elsewhere_is_seen(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<link rel="canonical" href="https://x.test/a"><a href="https://x.test">x</a><script src="a.js"></script>'
        '<link rel="stylesheet" href="https://x.test/a.css"><img src=http://x.test/a.png>'
    )
    assert loaded_from_outside(tmp_path) == ["a.html: loads https://x.test/a.css", "a.html: loads http://x.test/a.png"]
