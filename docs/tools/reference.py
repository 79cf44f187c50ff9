"""Pages of the reference made from the code: the doors from their docstrings, the commands from their help."""

from __future__ import annotations

import argparse
import dataclasses
import inspect
import re
from html import escape
from importlib import import_module

from docs.tools.file_formats import files_page
from docs.tools.pages import ROOT

DOORS = {
    "synthesis": "Models, design, proofs",
    "estimators": "What runs on the target",
    "analysis": "Norms, observability, drops, jumps, sensitivity",
    "studies": "Specifications, drives, sweeps, simulated truth",
}
DOCTEST = re.compile(r"^\s*>>> ", re.M)


def reference_pages() -> dict[str, str]:
    """Place in the site -> Markdown."""
    made = {f"reference/{door}.md": _door(door) for door in DOORS}
    return made | {"reference/commands.md": _commands(), "reference/files.md": files_page()}


def entries(door: str) -> dict[str, str]:
    """Public name -> the module that it comes from, in the order of the stub."""
    stub = (ROOT / door / "__init__.pyi").read_text(encoding="ascii")
    return {name: module for module, name in re.findall(r"^from \.(\S+) import (\w+) as", stub, re.M)}


def undescribed() -> list[str]:
    """Public names, and public methods of public classes, without a docstring of their own."""
    missing = []
    for door in DOORS:
        for name in entries(door):
            found = getattr(import_module(door), name)
            if not _described(found):
                missing.append(f"{door}.{name}")
            if inspect.isclass(found):
                missing += [f"{door}.{name}.{key}" for key, method in _methods(found) if not inspect.getdoc(method)]
    return missing


def _described(found: object) -> bool:
    text = inspect.getdoc(found) or ""
    generated = inspect.isclass(found) and text.startswith(f"{found.__name__}(")  # what dataclasses write themselves
    return bool(text) and not generated


def _methods(found: type) -> list[tuple[str, object]]:
    fields = {field.name for field in dataclasses.fields(found)} if dataclasses.is_dataclass(found) else set()
    public = {key: value for key, value in vars(found).items() if not key.startswith("_") and key not in fields}
    kinds = (classmethod, staticmethod, property)
    return [
        (key, getattr(found, key))
        for key, value in public.items()
        if inspect.isfunction(value) or isinstance(value, kinds)
    ]


def _door(door: str) -> str:
    parts = [
        f"# {door}: {DOORS[door][0].lower() + DOORS[door][1:]}",
        f"`from gainsmith import NAME`, or `from {door} import NAME`. {len(entries(door))} names, from the code's docstrings.",
    ]
    groups: dict[str, list[str]] = {}
    for name, module in entries(door).items():
        groups.setdefault(module.split(".")[0], []).append(name)
    for group, names in groups.items():
        parts.append(f"## {group}")
        parts += [_entry(name, getattr(import_module(door), name)) for name in names]
    return "\n\n".join(parts) + "\n"


def _entry(name: str, found: object) -> str:
    lines = [
        f"### {name} {{ #{name} }}",
        f"```python\n{_signature(name, found)}\n```",
        as_html(inspect.getdoc(found) or ""),
    ]
    if inspect.isclass(found) and not issubclass(found, BaseException):
        for key, method in _methods(found):
            text = inspect.getdoc(method) or ""
            called = f"{key}{_arguments(method)}" if callable(method) else key
            lines.append(f'<div class="method" markdown="0"><code>.{escape(called)}</code>{as_html(text)}</div>')
    return "\n\n".join(lines)


def _signature(name: str, found: object) -> str:
    if not callable(found) or (inspect.isclass(found) and issubclass(found, BaseException)):
        return name
    line = f"{name}{_arguments(found)}"
    if len(line) <= 92:
        return line
    head, _, rest = line.partition("(")
    inside, _, after = rest.rpartition(")")
    return f"{head}(\n    " + ",\n    ".join(_split(inside)) + f",\n){after}"


def _arguments(found: object) -> str:
    try:
        text = str(inspect.signature(found))  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return "()"
    text = re.sub(r"<factory>|<object object at 0x\w+>", "...", text.replace("self, ", "").replace("(self)", "()"))
    return re.sub(r"'([^']*)'", r"\1", text.replace(" -> None", ""))


def _split(text: str) -> list[str]:
    """Arguments at the outermost commas."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def as_html(text: str) -> str:
    """A docstring as HTML: paragraphs, and lines that are indented, aligned or examples as they stand."""
    out = []
    for part in re.split(r"\n\s*\n", text.strip("\n")):
        if not part.strip():
            continue
        lines = part.splitlines()
        fixed = DOCTEST.search(part) or all(line.startswith("    ") for line in lines) or re.search(r"\S {3,}\S", part)
        if fixed:
            kind = ' class="doctest"' if DOCTEST.search(part) else ""
            out.append(f"<pre{kind}><code>{escape(part)}</code></pre>")
        elif lines[0].rstrip().endswith(":") and len(lines) > 1 and lines[1].startswith("    "):
            items = re.sub(r"\n {5,}", " ", "\n".join(lines[1:])).splitlines()
            out.append(f"<p class='heading'>{_inline(lines[0].strip())}</p>")
            out.append("<ul>" + "".join(f"<li>{_inline(item.strip())}</li>" for item in items) + "</ul>")
        else:
            out.append(f"<p>{_inline(' '.join(line.strip() for line in lines))}</p>")
    return "\n".join(out)


def _inline(text: str) -> str:
    return re.sub(r"``?([^`]+)``?", r"<code>\1</code>", escape(text, quote=False))


def _commands() -> str:
    from studies.cli import parser

    (subparsers,) = (a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    parts = [
        "# Commands",
        "What `gainsmith COMMAND --help` prints. Every command takes `--json`; exit codes stand at the end.",
    ]
    for name, command in subparsers.choices.items():
        command.prog = f"gainsmith {name}"
        parts += [f"## gainsmith {name}", f"```text\n{command.format_help().rstrip()}\n```"]
    codes = (
        ("0", "done, and good"),
        ("1", "done, and bad: a claim is refuted, a schedule drifted, a margin shrank"),
        ("2", "bad input: one line says what, where and what to do"),
        ("130, 143", "interrupted (Ctrl-C), or asked to end (SIGTERM); what is written is whole"),
    )
    table = ["| code | means |", "|---|---|", *(f"| {code} | {means} |" for code, means in codes)]
    return "\n\n".join([*parts, "## Exit codes", "\n".join(table)]) + "\n"
