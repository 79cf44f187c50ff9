"""Symbols are known by their names alone."""

from __future__ import annotations

import sympy as sp


def plain(matrix: sp.Matrix) -> sp.ImmutableMatrix:
    """The matrix with every symbol as ``Symbol(name)``.

    To sympy a symbol that was declared real or positive is another one than the plain symbol of that name, so that
    derivatives by it and values for it would be lost without a word.
    """
    return sp.ImmutableMatrix(matrix).xreplace({s: sp.Symbol(s.name) for s in matrix.free_symbols})
