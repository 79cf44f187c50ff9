r"""Linear systems as weights of signals: from coefficients, from matrices, or of first order from two gains and a crossover."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from synthesis.errors import ModelError

DIGITS = 12  # of a corner frequency: it is a choice


def first_order_weight(low_gain: float, high_gain: float, crossover: float) -> Any:
    r"""W(s) = (h s + l c)/(s + c) as a `control.TransferFunction`: |W| = l at low frequencies, h at high ones, 1 at `crossover`.

    c = w ((1 - h^2)/(l^2 - 1))^(1/2) with w the crossover, rad/s. A gain of zero at one end is allowed. Raises ModelError for
    gains that are not on both sides of one, and a crossover that is not positive.

    >>> round(float(first_order_weight(10.0, 0.1, 2.0).dcgain()), 9)
    10.0
    """
    import control  # half a second: paid by those who use it

    if not (low_gain >= 0.0 and high_gain >= 0.0 and (low_gain - 1.0) * (1.0 - high_gain) > 0.0):
        raise ModelError(
            f"a first-order weight with low_gain {low_gain:g} and high_gain {high_gain:g} never crosses 1; give one gain above 1 "
            "and the other below it"
        )
    if not (0.0 < crossover < np.inf and low_gain < np.inf and high_gain < np.inf):
        raise ModelError(f"a first-order weight needs finite gains and a positive crossover, not {crossover:g} rad/s")
    corner = crossover * np.sqrt((1.0 - high_gain**2) / (low_gain**2 - 1.0))
    corner = float(f"{corner:.{DIGITS}g}")
    return control.TransferFunction([high_gain, low_gain * corner], [1.0, corner])


def transfer_weight(numerator: Sequence[float], denominator: Sequence[float]) -> Any:
    """A `control.TransferFunction` from coefficients of falling powers of s; raises ModelError for one that is no stable weight.

    >>> float(transfer_weight([1.0], [1.0, 2.0]).dcgain())
    0.5
    """
    import control

    above, below = (np.trim_zeros(np.asarray(part, float), "f") for part in (numerator, denominator))
    if not len(above) or not len(below):
        raise ModelError("a weight needs a numerator and a denominator that are not zero")
    if len(above) > len(below):
        raise ModelError(
            f"the numerator has the degree {len(above) - 1}, the denominator {len(below) - 1}: the weight is improper; give it a "
            "pole far beyond the bandwidth for each missing degree"
        )
    _refuse_unstable(np.roots(below))
    return control.TransferFunction(above, below)


def state_space_weight(A: Any, B: Any, C: Any, D: Any) -> Any:
    """A `control.StateSpace` of one input and one output; raises ModelError for other shapes, and one that is not stable."""
    import control

    matrices = [np.asarray(part, float) for part in (A, B, C, D)]
    n = len(matrices[0])
    shapes = ((n, n), (n, 1), (1, n), (1, 1))
    for name, matrix, shape in zip("ABCD", matrices, shapes, strict=True):
        if matrix.shape != shape:
            raise ModelError(
                f"{name} of a weight with {n} states has the shape {matrix.shape}; one input and one output need {shape}"
            )
    _refuse_unstable(np.linalg.eigvals(matrices[0]))
    return control.StateSpace(*matrices)


def _refuse_unstable(poles: Any) -> None:
    """A pole that does not decay is moved by no input: no law would be found, and the reason not seen."""
    late = [pole for pole in poles if not pole.real < 0.0]
    if late:
        turning = f" +- {abs(late[0].imag):.4g}j" if late[0].imag else ""
        remedy = "; in the place of an integrator take a slow pole" if not abs(late[0]) else ""
        raise ModelError(f"the weight is not stable: its pole {late[0].real:.4g}{turning} 1/s does not decay{remedy}")
