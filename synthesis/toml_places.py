"""Where every value of a TOML file stands: line and column, which the reader of the standard library does not tell."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

Step = int | str
Path = tuple[Step, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY = re.compile(r"""[ \t]*([A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')[ \t]*(\.?)""")
_STRING = re.compile(r'''"""(?:[^\\]|\\.)*?"""{1,3}|\'\'\'.*?\'\'\'\'{0,2}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*\'''', re.DOTALL)
_WORD = re.compile(r"[^,\]}\n#]*")  # numbers, dates, true and false


@dataclass
class Places:
    """Offsets of the values in a text that `tomllib` has read; `path` is made of keys and indices, as in the data."""

    text: str
    offsets: dict[Path, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        position = self._blank(0)
        table: Path = ()
        lengths: dict[Path, int] = {}  # of the arrays of tables
        while position < len(self.text):
            start = position
            if self.text[position] == "[":
                many = self.text.startswith("[[", position)
                keys, position = self._keys(position + 1 + many)
                table = self._header(keys, many, lengths)
                self.offsets.setdefault(table, start)
                position += 1 + many
            else:
                position = self._pair(position, table)
            position = self._blank(position)

    def at(self, path: Path, inside: int = 0) -> str:
        """'line:column', counted from 1, of the value at `path`, or of the nearest table around it.

        `inside` counts characters of a text between its quotes.
        """
        while path and path not in self.offsets:
            path, inside = path[:-1], 0
        offset = self.offsets.get(path, 0)
        if inside or self.text[offset : offset + 1] in ("'", '"'):
            offset += inside + (3 if self.text[offset : offset + 3] in ("'''", '"""') else 1)
        line = self.text.count("\n", 0, offset)
        return f"{line + 1}:{offset - self.text.rfind(chr(10), 0, offset)}"

    def _blank(self, position: int) -> int:
        found = _BLANK.match(self.text, position)
        return found.end() if found else position

    def _keys(self, position: int) -> tuple[Path, int]:
        keys: list[Step] = []
        while found := _KEY.match(self.text, position):
            position = found.end()
            keys.append(found[1][1:-1] if found[1][0] in "\"'" else found[1])
            if not found[2]:
                break
        return tuple(keys), position

    def _header(self, keys: Path, many: bool, lengths: dict[Path, int]) -> Path:
        """The path of a table header: inside an array of tables it is about its last element."""
        path: Path = ()
        for key in keys[:-1]:
            path = (*path, key)
            if path in lengths:
                path = (*path, lengths[path] - 1)
        path = (*path, keys[-1])
        if many:
            lengths[path] = lengths.get(path, 0) + 1
        return (*path, lengths[path] - 1) if path in lengths else path

    def _pair(self, position: int, table: Path) -> int:
        start = position
        keys, position = self._keys(position)
        for depth in range(1, len(keys)):  # tables that dotted keys make
            self.offsets.setdefault((*table, *keys[:depth]), start)
        return self._value(self._blank(position + 1), (*table, *keys))  # 1 for the equals sign

    def _value(self, position: int, path: Path) -> int:
        self.offsets[path] = position
        first = self.text[position : position + 1]
        if first in ("[", "{"):
            position, count = self._blank(position + 1), 0
            while self.text[position : position + 1] not in ("]", "}", ""):
                position = self._value(position, (*path, count)) if first == "[" else self._pair(position, path)
                position, count = self._blank(position), count + 1
                if self.text[position : position + 1] == ",":
                    position = self._blank(position + 1)
            return position + 1
        found = _STRING.match(self.text, position) or _WORD.match(self.text, position)
        return max(found.end(), position + 1) if found else position + 1
