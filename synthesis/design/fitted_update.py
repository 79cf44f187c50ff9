r"""The plant over a sample as polynomials in the parameters, for a design in discrete time.

Of a rational plant A = N / d the exponentials are entire in 1/d, and d^3 times them is close to a polynomial of a low degree
where the exponentials themselves ask for one that is high: e^(TN/d) = 1 + TN/d + (TN/d)^2 / 2 + ..
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.models.discretise import weights_over_sample
from synthesis.models.lpv import LpvModel
from synthesis.models.numeric import NumericModel, values
from synthesis.models.pieces import ModelPiece

FIT, OF_RATIONAL = 1e-10, 1e-7  # relative; what comes out is proved for the exact matrices anyway
LOOSE = 1e-4  # beyond it a fit is none: the design would be one for another plant
DEGREES = (4, 8, 12, 16, 24)
POWER = 3  # of the denominator


def power_below(piece: ModelPiece) -> int:
    """The power of the model's denominator that `fitted_update` is over: none of a polynomial model."""
    return 0 if piece.polynomial.is_polynomial else POWER


def fitted_update(
    model: LpvModel, piece: ModelPiece, scale: FloatArray, period: float, weights: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """e^(TA), T phi(TA) B and T phi(TA) E in the states diag(scale) x, as polynomials over d^k, k = `power_below`.

    Of a piece of the model in its local variables: in u, where it is the whole range.

    The last states are of `weights` that run once a sample (`synthesis.models.discretise.weights_over_sample`).
    Coefficients (d_1+1, ..., d_p+1, rows, columns), fitted to 1e-10, of a rational model to 1e-7. Raises ProblemError where
    degree 24 leaves more than 1e-4.
    """
    n, inputs = len(model.states), len(model.inputs)

    def update(at: NumericModel) -> FloatArray:
        driven = np.concatenate([at.B, at.E], axis=-1) * scale[:, None]
        held = weights_over_sample(at.A * scale[:, None] / scale, driven, weights, period)
        moved = np.concatenate(held, axis=-1)
        return np.asarray(moved * values(piece.polynomial.denominator, model.scaled(at.points)) ** power_below(piece))

    series = _fitted(model, piece, update)
    return series[..., :n], series[..., n : n + inputs], series[..., n + inputs :]


def _fitted(model: LpvModel, piece: ModelPiece, update: Callable[[NumericModel], FloatArray]) -> FloatArray:
    """Monomial coefficients of the Chebyshev series of least degrees, one for every parameter, that is close enough.

    In every column, as each has a unit of its own: the size of an input or a disturbance must not decide how well another is met.
    """
    count = len(model.parameters)
    middle, half = (np.array([getattr(p, key) for p in model.parameters]) for key in ("middle", "half_width"))
    middle, half = middle + half * piece.box[0], half * piece.box[1]
    degrees = [DEGREES[0]] * count
    wanted = OF_RATIONAL if power_below(piece) else FIT
    while True:
        lines = [np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)) for degree in degrees]
        nodes = list(product(*lines))  # one empty node without parameters
        points = np.array(nodes).reshape(len(nodes), count)
        found = update(model.on(middle + half * points))
        series = found.reshape(*(degree + 1 for degree in degrees), *found.shape[1:])
        for axis, line in enumerate(lines):
            inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(line, degrees[axis]))
            series = np.moveaxis(np.tensordot(inverse, series, axes=(1, axis)), 0, axis)
        size = np.abs(series).max(axis=tuple(range(count + 1)))
        size = np.where(size > 0.0, size, 1.0)
        tails = [np.abs(np.take(series, -1, axis=axis)).max(axis=tuple(range(count))) for axis in range(count)]
        off = np.array([float((tail / size).max()) for tail in tails])
        short = [axis for axis in range(count) if off[axis] > wanted and degrees[axis] < DEGREES[-1]]
        if not short:
            break
        for axis in short:
            degrees[axis] = next(degree for degree in DEGREES if degree > degrees[axis])
    if (off > LOOSE).any():
        raise ProblemError(
            f"model '{model.name}': no polynomial of degree {DEGREES[-1]} in '{model.parameters[int(off.argmax())].name}' comes "
            f"close to its update over a sample (off by {off.max():.1g}); shrink the range"
        )
    for axis, degree in enumerate(degrees):
        powers = np.zeros((degree + 1, degree + 1))
        for k in range(degree + 1):
            column = np.polynomial.chebyshev.cheb2poly(np.eye(degree + 1)[k])
            powers[: len(column), k] = column
        series = np.moveaxis(np.tensordot(powers, series, axes=(1, axis)), 0, axis)
    return np.asarray(series)
