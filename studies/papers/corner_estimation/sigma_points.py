"""Sigma point weights of P1 section 3 and P2 section 3 in rational numbers, as printed and corrected."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

BETA = 2  # of both papers
Form = Literal["printed", "corrected"]


@dataclass(frozen=True)
class Weights:
    """W0m, W0c and the common weight of the 2 N outer points; tau^2 = N + eta."""

    size: int
    centre_mean: Fraction
    centre_spread: Fraction
    outer: Fraction
    tau_squared: Fraction

    @property
    def total(self) -> Fraction:
        """What the weights of the mean add up to; must be one."""
        return self.centre_mean + 2 * self.size * self.outer

    @property
    def second_moment(self) -> Fraction:
        """Variance of the sigma points along one axis over that of the density, 2 W_i tau^2; must be one."""
        return 2 * self.outer * self.tau_squared


def weights(size: int, form: Form) -> Weights:
    """For N states with epsilon^2 = 3/N: W_i = (N + eta)/2 as printed, 1/(2 (N + eta)) corrected."""
    epsilon_squared = Fraction(3, size)
    eta = epsilon_squared * size - size
    spread = size + eta
    centre = eta / spread
    outer = spread / 2 if form == "printed" else 1 / (2 * spread)
    return Weights(size, centre, centre + 1 - epsilon_squared + BETA, outer, spread)
