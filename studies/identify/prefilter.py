"""One low-pass for both sides of a differential equation, so that derivatives are taken of filtered signals only.

A linear equation y' + a y = u with constant a holds as well between F[y], F[u] and D[y], with F = 1/(T s + 1)^2 and
D = s F: the equation is filtered, not changed, and no signal is differentiated raw (state-variable filter; Young 1981).
Products such as omega*mu are formed before they are filtered.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import bilinear, lfilter, lfilter_zi

from estimators.arrays import BoolArray, FloatArray


class Prefilter:
    """F and D with lag T, s, at ``step``, s, by the trapezoidal rule (bilinear transform), over runs of known samples.

    Every run of ``known`` (n,) starts at rest. :meth:`settled` is False until ``settling`` lags after
    every bad sample, and a third of that after a run began: until then the filters remember what was before.
    """

    def __init__(self, known: BoolArray, step: float, lag: float, settling: float) -> None:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int)))
        self.runs = [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        self.known = known
        self.memory = int(np.ceil(settling * lag / step))
        self.start = self.memory // 3  # a run starts at rest at its first sample: only its slope is forgotten
        self.correlation = max(1, int(np.ceil(2 * lag / step)))
        denominator = [lag**2, 2 * lag, 1.0]
        smooth = bilinear([1.0], denominator, fs=1.0 / step)
        rate = bilinear([1.0, 0.0], denominator, fs=1.0 / step)
        self._smooth = (*smooth, lfilter_zi(*smooth))
        self._rate = (*rate, lfilter_zi(*rate))

    def smooth(self, value: FloatArray) -> FloatArray:
        """F[value] of (n,) or (n, k); NaN outside the runs."""
        return self._apply(self._smooth, value)

    def rate(self, value: FloatArray) -> FloatArray:
        """D[value] = F[d value/dt], per second."""
        return self._apply(self._rate, value)

    def power(self, variance: FloatArray) -> FloatArray:
        """Variance of F[noise], noise independent from sample to sample with this ``variance`` (n,)."""
        pulse = np.zeros(2 * self.memory)
        pulse[0] = 1.0
        weights = lfilter(*self._smooth[:2], pulse) ** 2
        out = np.full(variance.shape, np.nan)
        for run in self.runs:
            out[run] = lfilter(weights, [1.0], variance[run])
        return out

    def settled(self, bad: BoolArray) -> BoolArray:
        """Where neither a bad sample (n,) or (n, k) nor the start of a run is remembered."""
        out = np.zeros(bad.shape, dtype=bool)
        for run in self.runs:
            marks = bad[run].copy()
            count = np.cumsum(marks, axis=0)
            before = np.zeros_like(count)
            before[self.memory :] = count[: -self.memory]
            out[run] = count == before
            out[run.start : run.start + self.start] = False
        return out

    def _apply(self, filter_: tuple[FloatArray, FloatArray, FloatArray], value: FloatArray) -> FloatArray:
        numerator, denominator, rest = filter_
        out = np.full(value.shape, np.nan)
        for run in self.runs:
            part = value[run]
            start = rest.reshape(-1, *[1] * (part.ndim - 1)) * part[:1]
            out[run] = lfilter(numerator, denominator, part, axis=0, zi=start)[0]
        return out


def first_order_lag(value: FloatArray, step: float, lag: float, runs: list[slice]) -> FloatArray:
    """value/(lag s + 1) of (n, k), exact for linear interpolation between samples; lag 0 returns the value."""
    if lag < 1e-9:
        return value
    a = float(np.exp(-step / lag))
    b = lag / step * (1 - a)
    out = np.full(value.shape, np.nan)
    for run in runs:
        part = value[run]
        # y[k] = a y[k-1] + (b - a) x[k-1] + (1 - b) x[k]; at rest before the run
        out[run] = lfilter([1 - b, b - a], [1.0, -a], part, axis=0, zi=b * part[:1])[0]
    return out


def pitched(value: FloatArray, step: float, frequency: float, damping: float, runs: list[slice]) -> FloatArray:
    """(2 z w s + w^2)/(s^2 + 2 z w s + w^2) of (n, k), w = 2 pi ``frequency`` in Hz, by the trapezoidal rule; at rest before.

    scipy's `bilinear` takes general polynomials and two hundred times as long, inside a fit.
    """
    k, w = 2 / step, 2 * np.pi * frequency
    damped, square = 2 * damping * w * k, w**2
    numerator = [square + damped, 2 * square, square - damped]
    denominator = [k**2 + damped + square, 2 * (square - k**2), k**2 - damped + square]
    out = np.full(value.shape, np.nan)
    for run in runs:
        rest = value[run][:1]
        out[run] = rest + lfilter(numerator, denominator, value[run] - rest, axis=0)
    return out
