"""The orthogonal basis of unknown polynomials: products of Chebyshev polynomials on [-1, 1]^p."""

from __future__ import annotations

from itertools import product

import numpy as np

from estimators.arrays import FloatArray


def chebyshev_basis(parameters: int, degree: int | tuple[int, ...]) -> FloatArray:
    """Monomial coefficients of the basis functions, shape (functions, d_1+1, ..., d_p+1).

    An integer is a bound on the total degree, a tuple one bound for each parameter (0: independent of it).
    Monomials of degree 6 on [0, 140] span 13 decades; Chebyshev polynomials on [-1, 1] are all of size one.
    """
    bounds = (degree,) * parameters if isinstance(degree, int) else degree
    total = degree if isinstance(degree, int) else sum(degree)
    single = [[np.polynomial.chebyshev.cheb2poly(np.eye(bound + 1)[k]) for k in range(bound + 1)] for bound in bounds]
    functions = []
    for powers in sorted(product(*(range(bound + 1) for bound in bounds)), key=lambda p: (sum(p), p)):
        if sum(powers) > total:
            continue
        function = np.ones((1,) * parameters)
        for axis, power in enumerate(powers):
            column = np.zeros(bounds[axis] + 1)
            column[: power + 1] = single[axis][power][: power + 1]
            function = function * column.reshape([-1 if i == axis else 1 for i in range(parameters)])
        functions.append(function)
    return np.stack(functions)
