"""What a stored result depends on: the files that its module really imports, their data, the libraries, and the scope."""

from __future__ import annotations

import ast
import platform
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache, cached_property, partial
from hashlib import sha256
from importlib.metadata import requires, version
from pathlib import Path
from typing import Any

PACKAGES = ("estimators", "synthesis", "analysis", "studies")
SOURCE_ROOT = Path(__file__).parents[2]
DATA = (".toml", ".json")
QUOTED = re.compile(r"""["'](\w+(?:\.\w+)+)["']""")
BY_NAME = re.compile(r"\b(import_module|__import__)\b")


class Sources:
    """The project's own modules below ``root`` and what imports what, from their text; every file is read once.

    An import counts wherever it stands, also inside a function, but not where it serves type checking alone. A text that
    is the name of an own module counts as its import. Who takes something from a module that imports by name depends on
    everything in that module's folder: which of it is not known before it runs.
    """

    def __init__(self, root: Path = SOURCE_ROOT, packages: Iterable[str] = PACKAGES) -> None:
        self.root, self.packages = root, tuple(packages)
        self._file = cache(self._find)
        self._digest = cache(lambda path: sha256(path.read_bytes()).hexdigest())
        self._imports = cache(self._imported)

    def fingerprint(self, scope: object, modules: Iterable[str]) -> str:
        """Hexadecimal SHA-256 over what ``modules`` reach, the libraries and ``scope``.

        Two runs with the same fingerprint compute the same results, so that a stored one can be used again.
        """
        digest = sha256(repr((scope, *_libraries())).encode())
        for path in sorted(self.reached(modules)):
            digest.update(f"\n{path.relative_to(self.root).as_posix()} {self._digest(path)}".encode())
        return digest.hexdigest()

    def reached(self, modules: Iterable[str]) -> set[Path]:
        """The files of the own ones of ``modules`` and of all that they import, and the data files beside them.

        Raises ValueError if none is own: what the result depends on is not known then.
        """
        asked = sorted(modules)
        waiting, seen = [name for name in asked if self._file(name)], set[str]()
        if not waiting:
            raise ValueError(f"none of the modules {', '.join(asked)} is below {self.root}")
        while waiting:
            name = waiting.pop()
            if name not in seen:
                seen.add(name)
                waiting += [name.rpartition(".")[0]] if "." in name else []
                waiting += self._imports(name)
        files = {file for name in seen if (file := self._file(name))}
        return files | {data for folder in {file.parent for file in files} for data in self._data(folder)}

    def _find(self, name: str) -> Path | None:
        if name.partition(".")[0] not in self.packages:
            return None
        path = self.root.joinpath(*name.split("."))
        return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)

    def _data(self, folder: Path) -> Iterator[Path]:
        for path in folder.iterdir():
            if path.suffix in DATA:
                yield path
            elif path.is_dir() and path.name[0] not in "._" and not any(path.glob("*.py")):
                yield from self._data(path)

    def _imported(self, name: str) -> frozenset[str]:
        """Own modules that a module imports."""
        found: set[str] = set()
        if (file := self._file(name)) is not None:
            text = file.read_text(encoding="utf-8")
            found.update(named for named in QUOTED.findall(text) if self._file(named))
            home = name if file.name == "__init__.py" else name.rpartition(".")[0]
            with suppress(SyntaxError):  # half-edited: its text counts, it imports nothing
                for node in _imports_of(ast.parse(text)):
                    found.update(self._targets(node, home))
        return frozenset(found)

    def _targets(self, node: ast.Import | ast.ImportFrom, home: str) -> Iterator[str]:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if self._file(alias.name))
            return
        above = home.split(".")[: len(home.split(".")) + 1 - node.level] if node.level else []
        source = ".".join([*above, *([node.module] if node.module else [])])
        for alias in node.names:
            if self._file(f"{source}.{alias.name}"):
                yield f"{source}.{alias.name}"
            elif (file := self._file(source)) is not None:
                yield source
                if BY_NAME.search(file.read_text(encoding="utf-8")):
                    yield from (
                        ".".join(path.relative_to(self.root).with_suffix("").parts).removesuffix(".__init__")
                        for path in file.parent.rglob("*.py")
                    )


def traits(function: Callable[..., Any]) -> tuple[set[str], str]:
    """The modules that define a function and what it is bound to (arguments, defaults, enclosing variables), and those values."""
    modules, values, waiting = set[str](), list[str](), list[Any]([function])
    seen: dict[int, Any] = {}  # what was looked at is held: the address of a list that is gone would be another one's
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        if isinstance(one, str | int | float | None):
            values.append(repr(one))
            continue
        seen[id(one)] = one
        modules.add(getattr(one, "__module__", None) or type(one).__module__)
        if isinstance(one, partial):
            waiting += [one.func, *one.args, one.keywords]
        elif isinstance(one, dict):
            waiting += [*one.keys(), *one.values()]
        elif isinstance(one, list | tuple):
            waiting += one
        elif isinstance(one, set | frozenset):
            waiting += sorted(one, key=repr)
        elif hasattr(one, "tolist"):
            waiting.append(one.tolist())
        elif callable(one):
            values.append(getattr(one, "__qualname__", ""))
            waiting += [cell.cell_contents for cell in getattr(one, "__closure__", None) or ()]
            waiting += [*(getattr(one, "__defaults__", None) or ()), getattr(one, "__kwdefaults__", None) or {}]
        else:
            waiting.append(_state(one) or re.sub(r" at 0x[0-9a-f]+", "", str(one)))
    return modules, " ".join(values)


def _state(one: object) -> dict[str, Any]:
    """What an object was made with: what it worked out later and remembers is no part of it."""
    if is_dataclass(one):
        return {field.name: getattr(one, field.name) for field in fields(one)}
    kept = getattr(one, "__dict__", {})
    return {
        name: value for name, value in kept.items() if not isinstance(getattr(type(one), name, None), cached_property)
    }


def _imports_of(tree: ast.Module) -> Iterator[ast.Import | ast.ImportFrom]:
    """The import statements, also inside functions, but not those for type checking alone."""
    waiting: list[Any] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        blocks: tuple[str, ...] = ("body", "orelse", "handlers", "finalbody", "cases")
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            blocks = ("orelse",)
        for block in blocks:
            waiting += getattr(node, block, ())


@cache
def _libraries() -> list[str]:
    needed = [line for line in requires("gainsmith") or [] if "extra ==" not in line]
    names = sorted(re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in needed)
    return [f"python {platform.python_version()}", *(f"{name} {version(name)}" for name in names)]
