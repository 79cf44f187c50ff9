"""Formulas as they stand in plain text, ``sigma0/(sigma0 + sigma2 a)``: read by a small grammar, never evaluated.

::

    relation = sum {("=" | "<" | ">" | "<=" | ">=") sum}
    sum      = ["-" | "+"] product {("+" | "-" | "+-") product}
    product  = power {["*" | "/"] power}
    power    = atom {"'"} [("^" | "**") ["-"] atom]
    atom     = number | symbol | function group | "(" list ")" | "[" list "]" | "|" sum "|"

Text and formulas stand side by side, so reading stops before the first thing that fits no more and keeps what it has.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from studies.report.tokens import Token, tokens_of

GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ",
    "kappa": "κ", "lambda": "λ", "mu": "μ", "xi": "ξ", "pi": "π", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ",
    "chi": "χ", "psi": "ψ", "omega": "ω", "Gamma": "Γ", "Delta": "Δ", "Sigma": "Σ", "Phi": "Φ", "Omega": "Ω",
}  # fmt: skip
FUNCTIONS = ("exp", "diag", "rank", "sin", "cos", "tan", "sqrt", "det", "sup", "log", "atan")
RELATIONS = ("<=", ">=", "=", "<", ">")
UNITS = frozenset("smNghx")  # letters that are units, or "times", where a number stands before them
_LETTER, _INDEX = f"(?:{'|'.join(GREEK)})", r"(?:\d[a-z\d]*|(?:_(?:\w+|\([^()]*\)))+)"
INDEXED = re.compile(rf"d?{_LETTER}{_INDEX}?|d?[A-Za-z]{_INDEX}|[A-Za-z]|d(?!o)[A-Za-z]")
DEEPEST = 8  # brackets inside brackets
COUNTED = re.compile("(?:Prop|The|Rem|Ex|Tab|Fig|Test|Sec)[a-z]*")  # Proposition 1 and their like
PAPER = re.compile(r"P[1-5]")
LABEL = re.compile(r"\(\s*[A-Z]\d+\s*\)")  # of an equation in an appendix: (A4)


@dataclass(frozen=True)
class Node:
    """``kind`` says how ``parts`` stand together; ``text`` is a number, a name or the mark between them."""

    kind: str
    text: str = ""
    parts: tuple[Node, ...] = field(default=())

    def walk(self) -> Iterator[Node]:
        """This node and all below."""
        yield self
        for part in self.parts:
            yield from part.walk()


class Unreadable(Exception):  # noqa: N818  # how reading stops, no error
    """What stands here is no formula."""


def formulas(text: str) -> Iterator[tuple[int, int, Node]]:
    """Where formulas stand in ``text``, and what they are."""
    tokens = tokens_of(text)
    at = 0
    while at < len(tokens):
        if (label := LABEL.match(text, tokens[at].start)) is not None:
            at = next((k for k, token in enumerate(tokens) if token.start >= label.end()), len(tokens))
            continue
        try:
            reader = Reader(text, tokens, at)
            node = reader.relation()
        except Unreadable:
            at += 1
            continue
        if is_formula(node) and node.text != "()" and not _is_word(text, tokens, at):
            yield tokens[at].start, tokens[reader.at - 1].end, node
            at = reader.at
        else:
            at += 1


def _is_word(text: str, tokens: list[Token], at: int) -> bool:
    """A unit after its number, the number of a Proposition, or the sigma of sigma points."""
    before = tokens[at - 1] if at else None
    unit = tokens[at].text in UNITS and before is not None and before.kind == "number"
    counted = tokens[at].kind == "number" and before is not None and COUNTED.fullmatch(before.text)
    return unit or bool(counted) or re.match("[sS]igma points?", text[tokens[at].start :]) is not None


def whole_formula(text: str) -> Node | None:
    """The formula that ``text`` is from its beginning to its end, or None."""
    found = list(formulas(text))
    return found[0][2] if len(found) == 1 and found[0][:2] == (0, len(text)) else None


def is_formula(node: Node) -> bool:
    """Whether it is worth setting: an indexed or Greek symbol, or plain letters that something relates."""
    nodes = list(node.walk())
    names = [each.text for each in nodes if each.kind == "symbol"]
    if any(_strong(name) for name in names):
        return True
    if any(each.kind == "relation" for each in nodes):
        return bool(names)
    joined = any(each.kind in ("sum", "power", "function", "group", "product") for each in nodes)
    return joined and bool(set(names) - UNITS) and (len(names) > 1 or len(nodes) > 2) and not _unit(node)


def _strong(name: str) -> bool:
    return INDEXED.fullmatch(name) is not None and len(name) > 1 and not PAPER.fullmatch(name) and name != "dt"


def _unit(node: Node) -> bool:
    return node.kind in ("product", "fraction") and all(len(n.text) < 2 and not n.text.isdigit() for n in node.walk())


class Reader:
    """Reads one formula from the token ``at`` on; a rule leaves ``at`` behind what it could read."""

    def __init__(self, text: str, tokens: list[Token], at: int) -> None:
        self.text, self.tokens, self.at, self.begin = text, tokens, at, at
        self.depth = self.bars = 0

    @property
    def next(self) -> Token:
        """The token that comes, empty where the text goes on with something else."""
        if self.at < len(self.tokens):
            token = self.tokens[self.at]
            between = self.text[self.tokens[self.at - 1].end : token.start] if self.at > self.begin else ""
            if between.strip() == "":
                return token
        return Token("", "", 0, 0, spaced=True)

    def relation(self) -> Node:
        """A chain of sums."""
        return self._chain("relation", self.sum, RELATIONS)

    def sum(self) -> Node:
        """Products with signs between them."""
        if self.next.text in ("-", "+", "−"):
            sign = self._take()
            return self._chain("sum", self.product, ("+", "-", "+-", "−"), Node("signed", sign.text, (self.product(),)))
        return self._chain("sum", self.product, ("+", "-", "+-", "−"))

    def _chain(self, kind: str, rule: Callable[[], Node], marks: tuple[str, ...], first: Node | None = None) -> Node:
        parts = [first or rule()]
        between = []
        while self.next.text in marks:
            before = self.at
            mark = self._take()
            lopsided = mark.spaced != self.next.spaced  # "P -chi" is a hyphen or a dash of prose
            try:
                if lopsided:
                    raise Unreadable
                parts.append(rule())
            except Unreadable:
                self.at = before
                break
            between.append(mark.text)
        return parts[0] if len(parts) == 1 else Node(kind, " ".join(between), tuple(parts))

    def product(self) -> Node:
        """Powers side by side, or with a mark between them."""
        made = self.power()
        while True:
            before, mark = self.at, self.next.text
            if mark in ("*", "/"):
                self._take()
            elif not self._joins(made):
                return made
            try:
                right = self.power()
            except Unreadable:
                self.at = before
                return made
            made = Node("fraction" if mark == "/" else "product", "", (made, right))

    def _joins(self, left: Node) -> bool:
        token, last = self.next, list(left.walk())[-1]
        if token.text in ("(", "["):
            return not token.spaced or token.text == "[" or last.kind == "number" or self._long_group()
        if token.text == "|":
            after = self.tokens[self.at + 1 :]
            return self.bars == 0 and after != [] and not after[0].spaced
        if token.kind != "name" or (left.kind == "function" and left.text == "diag"):
            return False
        return not (last.kind == "number" and token.text in UNITS)

    def _long_group(self) -> bool:
        """Whether the bracket after a space holds a sum: ``sigma_1 (sigma_1 + sigma_2)``, and no remark such as ``(28)``."""
        before = self.at
        try:
            return self._group("(", ")").parts[0].kind == "sum"
        except Unreadable:
            return False
        finally:
            self.at = before

    def power(self) -> Node:
        """An atom, perhaps transposed and raised."""
        base = self.atom()
        while self.next.text == "'" and not self.next.spaced:
            self._take()
            base = Node("primed", "", (base,))
        if self.next.text in ("^", "**"):
            before = self.at
            self._take()
            try:
                sign = self._take().text if self.next.text == "-" else ""
                raised = self.atom()
                return Node("power", "", (base, Node("signed", "-", (raised,)) if sign else raised))
            except Unreadable:
                self.at = before
        return base

    def atom(self) -> Node:
        """A number, a symbol, a function of a group, or a group."""
        token = self.next
        if token.kind == "number":
            return Node("number", self._take().text)
        if token.kind == "name":
            return self._named()
        if token.text in ("(", "["):
            return self._group(token.text, {"(": ")", "[": "]"}[token.text])
        if token.text == "|":
            return self._group("|", "|")
        raise Unreadable

    def _named(self) -> Node:
        name = self._take()
        if name.text in FUNCTIONS:
            if self.next.text in ("(", "|") and not self.next.spaced:
                return Node("function", name.text, (self.atom(),))
            if self.next.kind == "name" and name.text in ("sin", "cos", "tan"):
                return Node("function", name.text, (self._named(),))
        elif self._is_symbol(name):
            return Node("symbol", name.text)
        self.at -= 1
        raise Unreadable

    def _is_symbol(self, name: Token) -> bool:
        before, after = self.text[: name.start][-1:], self.text[name.end :]
        if name.text in ("a", "I"):  # words, unless something stands beside them
            return self.depth > 0 or before in ("*", "/") or re.match(r"\s?[=<>/*^]| [-+] ", after) is not None
        multiplied = before in ("*", "/") or after[:1] == "*"  # effective_radius*kappa
        related = "_" in name.text and (
            self.text[: name.start].endswith(("- ", "+ ", "(")) or re.match(r" [-+=] ", after)
        )
        return INDEXED.fullmatch(name.text) is not None or multiplied or bool(related)

    def _group(self, left: str, right: str) -> Node:
        if self.depth == DEEPEST:
            raise Unreadable
        before = self.at
        self._take()
        self.depth += 1
        self.bars += left == "|"
        try:
            parts = [self.relation()]
            while self.next.text != right:
                if self.next.text in (",", ";"):
                    self._take()
                elif left != "[":
                    raise Unreadable
                parts.append(self.relation())
            self._take()
        except Unreadable:
            self.at = before
            raise
        finally:
            self.depth -= 1
            self.bars -= left == "|"
        if left == "[" and len(parts) == 1 and parts[0].text in UNITS:  # force [N]
            self.at = before
            raise Unreadable
        return Node("group", left + right, tuple(parts))

    def _take(self) -> Token:
        token = self.next
        if not token.kind:
            raise Unreadable
        self.at += 1
        return token
