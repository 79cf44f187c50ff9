"""Covariance update of three states in plain numbers: one numpy call costs as much as twenty multiplications."""

from __future__ import annotations

from math import sqrt

Six = tuple[float, float, float, float, float, float]
"""A symmetric matrix: 11, 21, 22, 31, 32, 33."""
_EPS = 1e-16


def informed(covariance: Six, information: Six) -> Six:
    """P+ = (P^-1 + G)^-1 = L (I + L'GL)^-1 L' with P = L L' and G = C'R^-1 C: nothing is subtracted from P.

    I + L'GL = U U', U upper triangular, and S = L U^-T is the factor of P+.
    Source: Kaminski, Bryson, Schmidt (1971), square-root form of the information update.
    """
    p11, p21, p22, p31, p32, p33 = covariance
    g11, g21, g22, g31, g32, g33 = information
    l11 = sqrt(p11)
    l21, l31 = p21 / l11, p31 / l11
    l22 = sqrt(max(p22 - l21 * l21, _EPS * p22))  # rounding must not turn a pivot negative
    l32 = (p32 - l31 * l21) / l22
    l33 = sqrt(max(p33 - l31 * l31 - l32 * l32, _EPS * p33))
    # G L, then L' G L + I
    first = g11 * l11 + g21 * l21 + g31 * l31
    second = g21 * l11 + g22 * l21 + g32 * l31
    third = g31 * l11 + g32 * l21 + g33 * l31
    below = g32 * l22 + g33 * l32
    m11 = 1.0 + l11 * first + l21 * second + l31 * third
    m21, m31 = l22 * second + l32 * third, l33 * third
    m22, m32 = 1.0 + l22 * (g22 * l22 + g32 * l32) + l32 * below, l33 * below
    # rows of U^-1: (v1 v12 v13), (v2 v23), v3
    v3 = 1.0 / sqrt(1.0 + l33 * g33 * l33)
    u13, u23 = m31 * v3, m32 * v3
    v2 = 1.0 / sqrt(m22 - u23 * u23)
    u12 = (m21 - u13 * u23) * v2
    v1 = 1.0 / sqrt(m11 - u12 * u12 - u13 * u13)
    v12, v23 = -u12 * v1 * v2, -u23 * v2 * v3
    v13 = (u12 * u23 * v2 - u13) * v1 * v3
    s11, s21, s22 = l11 * v1, l21 * v1 + l22 * v12, l22 * v2
    s31, s32, s33 = l31 * v1 + l32 * v12 + l33 * v13, l32 * v2 + l33 * v23, l33 * v3
    return (
        s11 * s11,
        s21 * s11,
        s21 * s21 + s22 * s22,
        s31 * s11,
        s31 * s21 + s32 * s22,
        s31 * s31 + s32 * s32 + s33 * s33,
    )
