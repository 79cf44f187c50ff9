"""How objects show themselves in a terminal and in a notebook: the essential in five lines."""

from __future__ import annotations

from html import escape

LONGEST = 110  # characters of a line


class Display:
    """`summary` is the text of `repr` and of the notebook: a heading, then lines "what: how much"."""

    def summary(self) -> tuple[str, ...]:
        """At most five lines."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return "\n  ".join(shortened(line) for line in self.summary())

    def _repr_html_(self) -> str:
        heading, *lines = self.summary()
        rows = []
        for line in lines:
            what, colon, value = line.partition(": ")
            cells = (what, value) if colon else ("", line)
            rows.append(
                "<tr>" + "".join(f'<td style="text-align:left">{escape(cell)}</td>' for cell in cells) + "</tr>"
            )
        return f"<strong>{escape(heading)}</strong><table>{''.join(rows)}</table>"


def shortened(line: str) -> str:
    """Cut where a line would not fit a terminal."""
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 4]} ..."


def counted(number: int, what: str) -> str:
    """1 state, 2 states."""
    return f"{number} {what}{'' if number == 1 else 's'}"
