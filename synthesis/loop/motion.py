"""How a matrix that depends on the parameters moves with them: dP/dt, and P one sample later."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flint import fmpq

from synthesis.errors import ProblemError
from synthesis.loop.plant import Axis


def rates(
    axes: tuple[Axis, ...],
    matrix: Any,
    one: Any,
    unit_rate: Any,
    number: Any,
    jump: Callable[[int], Any] | None = None,
) -> list[Any]:
    """du_i/dt = (rate middle + rate half r_i) / half as 1 x 1 polynomials, None where the matrix does not depend on u_i.

    `unit_rate` gives the polynomial r_i. A parameter that may jump is anywhere one sample later: `jump` gives (r_i - u_i)/T, r_i
    being its next value. Raises ProblemError if the matrix depends on such a parameter and there are no samples.
    """
    found: list[Any] = []
    for i, axis in enumerate(axes):
        if not matrix.degrees[i]:
            found.append(None)
            continue
        if axis.rate_low is None or axis.rate_high is None:
            if jump is not None:
                found.append(jump(i))
                continue
            raise ProblemError(
                f"'{axis.name}' may jump, so no Lyapunov function may depend on it; use degree 0 for it or bound its rate"
            )
        middle = (axis.rate_low + axis.rate_high) / (2 * axis.half)
        half = (axis.rate_high - axis.rate_low) / (2 * axis.half)
        found.append(one * number(middle) + unit_rate(i) * number(half) if half != 0 else one * number(middle))
    return found


def time_derivative(matrix: Any, speeds: list[Any]) -> Any:
    """dM/dt = sum over i of dM/du_i du_i/dt."""
    total = matrix * 0
    for i, speed in enumerate(speeds):
        if speed is not None:
            total = total + matrix.derivative(i).scaled_by(speed)
    return total


def one_sample_later(matrix: Any, speeds: list[Any], period: Any) -> Any:
    """M(u + T du/dt), with a rate that is constant over the sample: any admissible motion has such a mean rate.

    Taylor's series by Horner's rule, the derivatives taken first: the step to a parameter that jumps depends on u itself.
    """
    for i, speed in enumerate(speeds):
        if speed is None:
            continue
        step, slopes = speed * period, [matrix]
        for k in range(1, matrix.degrees[i] + 1):
            slopes.append(slopes[-1].derivative(i) * _inverse(k, period))  # of order k, over k!
        matrix = slopes[-1]
        for slope in reversed(slopes[:-1]):
            matrix = matrix.scaled_by(step) + slope
    return matrix


def _inverse(k: int, like: Any) -> Any:
    return fmpq(1, k) if isinstance(like, fmpq) else 1.0 / k
