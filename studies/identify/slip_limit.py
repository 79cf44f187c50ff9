"""Which slip is low: the widest range over which the fitted stiffness does not depend on the range (Lepski's rule).

The slope at the origin is wanted, the friction curve beyond is unknown and changes with the road. A wide range has more
information and more curvature than the saturation term can follow. So every limit is tried, and the widest is taken whose
stiffness agrees with that of all narrower ones that excite it: within 5 %, or within the errors of both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from studies.identify.estimate import Estimate, Rules, Unknown, estimate
from studies.identify.settings import IdentifySettings

NOTHING = 10.0  # half width of ln C beyond which the widest range shows no trace of slip: the narrower ones have less


class SlipModel(Protocol):
    """What :class:`LongitudinalSlip` and :class:`LateralSlip` have in common."""

    @property
    def direction(self) -> str: ...  # noqa: D102
    @property
    def unknowns(self) -> tuple[Unknown, ...]: ...  # noqa: D102
    def residual(self, p: Mapping[str, float]) -> FloatArray: ...  # noqa: D102
    def mask(self, limit: float, p: Mapping[str, float]) -> BoolArray: ...  # noqa: D102
    def slip(self, p: Mapping[str, float]) -> FloatArray: ...  # noqa: D102
    def force_and_speed(self) -> tuple[FloatArray, FloatArray]: ...  # noqa: D102


@dataclass(frozen=True)
class LimitedFit:
    """The fit at the slip ``limit`` that was chosen; ``tried`` is the stiffness (None: not excited) at every limit."""

    model: SlipModel
    limit: float
    fit: Estimate
    mask: BoolArray
    tried: dict[float, float | None]


def fit_low_slip(
    model: SlipModel, settings: IdentifySettings, correlation: int, progress: Callable[[float], None]
) -> LimitedFit:
    """Fit at every limit, widest first (its radii and angle zeros place the next one), and choose."""
    fits: list[LimitedFit] = []
    rules = Rules(settings.confidence, settings.residual_floor, correlation, settings.least_freedom)
    values: dict[str, float] = {}
    for k, limit in enumerate(settings.slip_limits):
        mask = model.mask(limit, values)
        same = bool(fits) and np.array_equal(mask, fits[-1].mask)
        last = zip(model.unknowns, fits[-1].fit.x, strict=True) if values else ()
        start = {u.name: float(x) for u, x in last} or None
        fit = fits[-1].fit if same else estimate(model.residual, mask, model.unknowns, rules, start)
        values = fit.values() if fit.excited["slip_stiffness"] else values
        fits.append(LimitedFit(model, limit, fit, mask, {}))
        if not k and fit.half["slip_stiffness"] > NOTHING:
            break
        progress((k + 1) / len(settings.slip_limits))
    chosen = _widened(_choose(fits, settings), fits)
    tried = {f.limit: f.fit.value("slip_stiffness") if f.fit.excited["slip_stiffness"] else None for f in fits}
    return LimitedFit(model, chosen.limit, chosen.fit, chosen.mask, tried)


def _choose(fits: list[LimitedFit], settings: IdentifySettings) -> LimitedFit:
    telling = [f for f in fits if f.fit.excited["slip_stiffness"]]
    for k, wide in enumerate(telling):
        if all(_agree(wide, narrow, settings) for narrow in telling[k + 1 :]):
            return wide
    return fits[0]


def _widened(chosen: LimitedFit, fits: list[LimitedFit]) -> LimitedFit:
    """Intervals that allow for the limit: what a narrower one says otherwise, no less than half as exactly, is an error too.

    Statistical errors know nothing of a curve that is not in the family; this does: h^2 + (x - x_narrower)^2.
    """
    fit = chosen.fit
    half = dict(fit.half)
    for other in (f.fit for f in fits if f.limit < chosen.limit):
        for i, u in enumerate(fit.unknowns):
            if fit.excited[u.name] and other.excited[u.name] and other.half[u.name] <= 2 * fit.half[u.name]:
                half[u.name] = max(half[u.name], float(np.hypot(fit.half[u.name], fit.x[i] - other.x[i])))
    excited = {
        u.name: fit.excited[u.name] and u.narrow(float(x), half[u.name])
        for u, x in zip(fit.unknowns, fit.x, strict=True)
    }
    factors = {name: fit.factors[name] * half[name] / fit.half[name] for name in half}
    return replace(chosen, fit=replace(fit, half=half, factors=factors, excited=excited))


def _agree(wide: LimitedFit, narrow: LimitedFit, settings: IdentifySettings) -> bool:
    """Equal stiffness, after the curvature that the wide range tells and the narrow one may not is taken out.

    Where a fit leaves s out, its stiffness is lower by (s - s_fit) sum |mu|^3/sum mu^2, the secant instead of the origin;
    c as well, with mu^4.
    """
    a, b = wide.fit, narrow.fit
    mu = narrow.model.force_and_speed()[0][:, : narrow.mask.shape[1]][narrow.mask]
    power = float(np.sum(mu**2))
    curved = sum(
        (a.value(name) - b.value(name)) * float(np.sum(np.abs(mu) ** k)) / power if power > 0 else 0.0
        for name, k in (("saturation", 3), ("bend", 4))
    )
    i = a.index("slip_stiffness")
    allowed = np.hypot(a.half["slip_stiffness"], b.half["slip_stiffness"])
    gap = abs(a.x[i] - b.x[i] - curved)
    return bool(gap <= max(settings.same_stiffness, settings.comparisons * float(allowed)))
