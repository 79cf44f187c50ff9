"""Formulas as MathML, which browsers set and screen readers read.

Where no font for mathematics is installed, indexes and exponents follow the box of what they belong to, so that box is set
(``mpadded``); a font for mathematics has places of its own, and those are as far away or farther.
"""

from __future__ import annotations

import re
from html import escape

from studies.report.formula import GREEK, Node, formulas

SIGNS = {"<=": "≤", ">=": "≥", "-": "−", "+-": "±", "*": "⋅"}
ACCENTS = {"bar": "¯", "hat": "^", "dot": "˙", "tilde": "~"}
SYMBOL = re.compile(rf"(d?)({'|'.join(sorted(GREEK, key=len, reverse=True))}|[A-Za-z])(?=\d|_|$)((?:\d[a-z\d]*)?)(.*)")


def typeset(text: str) -> str:
    """``text`` as HTML, escaped, every formula in it as MathML that keeps its source as ``alttext``."""
    pieces, end = [], 0
    for start, stop, node in formulas(text):
        source = text[start:stop]
        pieces += [_plain(text[end:start]), f'<math alttext="{escape(source)}">{mathml(node)}</math>']
        end = stop
    return "".join([*pieces, _plain(text[end:])])


def _plain(text: str) -> str:
    return escape(squared(text))


def squared(text: str) -> str:
    """``text`` with m/s^2 as m/s²."""
    return re.sub(r"(?<=/)s\^2", "s²", text)


def mathml(node: Node) -> str:
    """The elements of ``node``."""
    inside = [mathml(part) for part in node.parts]
    match node.kind:
        case "number":
            return f"<mn>{_number(node.text)}</mn>"
        case "symbol":
            return symbol(node.text)
        case "signed":
            return f"<mrow>{_mark(node.text)}{inside[0]}</mrow>"
        case "relation" | "sum":
            marks = [_mark(mark) for mark in node.text.split()] + [""]
            return f"<mrow>{''.join(part + mark for part, mark in zip(inside, marks, strict=True))}</mrow>"
        case "product":
            gap = "" if node.parts[1].kind == "group" else '<mspace width=".17em"/>'
            return f"<mrow>{inside[0]}{gap}{inside[1]}</mrow>"
        case "fraction":
            return f"<mfrac>{_bare(node.parts[0])}{_bare(node.parts[1])}</mfrac>"
        case "power":
            return f'<msup><mpadded height=".45em">{inside[0]}</mpadded>{inside[1]}</msup>'
        case "primed":
            return f'<msup><mpadded height="0">{inside[0]}</mpadded><mo>′</mo></msup>'
        case "function" if node.text == "sqrt":
            return f"<msqrt>{_bare(node.parts[0])}</msqrt>"
        case "function":
            return f"<mrow><mi>{node.text}</mi>{inside[0]}</mrow>"
        case _:
            left, right = (f'<mo stretchy="false">{mark}</mo>' for mark in node.text)
            comma = "<mo>,</mo>"
            return f"<mrow>{left}{comma.join(inside)}{right}</mrow>"


def symbol(name: str) -> str:
    """A Greek or Latin letter with its index, ``lambda_bar`` with a bar; anything longer upright, its underscores spaces."""
    found = SYMBOL.fullmatch(name)
    if found is None and re.fullmatch("d[A-Za-z]", name):
        return f"<mrow><mi>d</mi><mi>{name[1]}</mi></mrow>"
    if found is None or (found[4] and not found[4].startswith("_")):
        return f'<mi mathvariant="normal">{escape(name.replace("_", " "))}</mi>'
    letter = f"<mi>{GREEK.get(found[2], found[2])}</mi>"
    index = " ".join(filter(None, [found[3], *found[4].split("_")]))
    if index in ACCENTS:
        letter = f'<mover accent="true">{letter}<mo>{ACCENTS[index]}</mo></mover>'
    elif index:
        text = escape(index.strip("()"))
        below = f"<mn>{text}</mn>" if index.isdigit() else f'<mi mathvariant="normal">{text}</mi>'
        base = f'<mpadded depth=".25em">{letter}</mpadded>'
        letter = f"<msub>{base}{below}</msub>"
    return f"<mrow><mi>d</mi>{letter}</mrow>" if found[1] else letter


def _bare(node: Node) -> str:
    """Without the brackets that a fraction or a root makes needless."""
    return mathml(node.parts[0] if node.kind == "group" and node.text == "()" and len(node.parts) == 1 else node)


def _mark(mark: str) -> str:
    return f"<mo>{escape(SIGNS.get(mark, mark))}</mo>"


def _number(text: str) -> str:
    mantissa, _, exponent = text.partition("e")
    return f"{mantissa}</mn><mo>×</mo><msup><mn>10</mn><mn>{int(exponent)}</mn></msup><mn>" if exponent else text
