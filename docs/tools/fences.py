"""Blocks of code in a page: what each is, and what is done with it.

    ```python            run, all blocks of a page in one namespace; what it prints is shown below it
    ```sh                run line by line; `gainsmith` is the command line of this checkout
    ```toml title="x"    written to the file x of the page's folder (any language with a title)
    ```console           shown only, for what a page cannot do (installing, an hour's work); its gainsmith lines must parse

Options after the language: `quiet` shows no output, `head=N` only its first N lines, `hide` runs the block and shows only what it
prints. Other languages are shown only.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from textwrap import dedent

FENCE = re.compile(
    r"^(?P<indent>[ ]*)```(?P<language>\w+)(?P<options>[^\n]*)\n(?P<code>.*?)^(?P=indent)```[ ]*$", re.M | re.S
)
RUN = ("python", "sh")


@dataclass(frozen=True)
class Block:
    """One block of a page; `line` is where it starts."""

    language: str
    code: str
    title: str | None
    quiet: bool
    hide: bool
    head: int | None
    line: int


def block_of(match: re.Match[str]) -> Block:
    """The block that `FENCE` found."""
    options = match["options"]
    title, head = re.search(r'title="([^"]+)"', options), re.search(r"head=(\d+)", options)
    return Block(
        match["language"], dedent(match["code"]), title[1] if title else None, bool(re.search(r"\bquiet\b", options)),
        bool(re.search(r"\bhide\b", options)),
        int(head[1]) if head else None, match.string.count("\n", 0, match.start()) + 1,
    )  # fmt: skip


def blocks(text: str) -> list[Block]:
    """All blocks of a page, in order."""
    return [block_of(match) for match in FENCE.finditer(text)]


def with_outputs(text: str, outputs: list[str]) -> str:
    """The page with what each of its blocks printed; options that only concern the run are dropped."""
    left = iter(outputs)

    def shown(match: re.Match[str]) -> str:
        block, output = block_of(match), next(left)
        title = f' title="{block.title}"' if block.title else ""
        lines = [] if block.hide else [f"```{block.language}{title}", *block.code.splitlines(), "```"]
        if output and not block.quiet:
            said = output.rstrip("\n").splitlines()
            if block.head is not None and len(said) > block.head:
                said = [*said[: block.head], f"... ({len(said) - block.head} more lines)"]
            lines += [*([""] if lines else []), "```{ .text .output }", *said, "```"]
        return "\n".join(match["indent"] + line for line in lines)

    return FENCE.sub(shown, text)
