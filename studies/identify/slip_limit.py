"""Which slip is low: the widest range over which the fitted stiffness does not depend on the range (Lepski's rule).

The slope at the origin is wanted, the friction curve beyond is unknown and changes with the road. A wide range has more
information and more curvature than the saturation term can follow. So every limit is tried, and the widest is taken whose
stiffness agrees with that of all narrower ones that excite it: within 5 %, or within the errors of both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from studies.identify.estimate import Rules, estimate
from studies.identify.settings import IdentifySettings
from studies.identify.unknowns import Estimate, Unknown

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


NOTHING = 10.0
"""Half width of ln C beyond which the widest range shows no trace of slip: the narrower ones have less."""


class SlipModel(Protocol):
    """What :class:`LongitudinalSlip` and :class:`LateralSlip` have in common."""

    @property
    def direction(self) -> str: ...  # noqa: D102
    @property
    def unknowns(self) -> tuple[Unknown, ...]: ...  # noqa: D102
    def residual(self, p: Mapping[str, float]) -> Array: ...  # noqa: D102
    def mask(self, limit: float, p: Mapping[str, float]) -> Mask: ...  # noqa: D102
    def slip(self, p: Mapping[str, float]) -> Array: ...  # noqa: D102
    def picture(self) -> tuple[Array, Array]: ...  # noqa: D102


@dataclass(frozen=True)
class LimitedFit:
    """The fit at the slip ``limit`` that was chosen; ``tried`` is the stiffness (None: not excited) at every limit."""

    model: SlipModel
    limit: float
    fit: Estimate
    mask: Mask
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
        fit = fits[-1].fit if same else estimate(model.residual, mask, model.unknowns, rules)
        values = fit.values() if fit.excited["slip_stiffness"] else values
        fits.append(LimitedFit(model, limit, fit, mask, {}))
        if not k and fit.half["slip_stiffness"] > NOTHING:
            break
        progress((k + 1) / len(settings.slip_limits))
    chosen = _choose(fits, settings)
    tried = {f.limit: f.fit.value("slip_stiffness") if f.fit.excited["slip_stiffness"] else None for f in fits}
    return LimitedFit(model, chosen.limit, chosen.fit, chosen.mask, tried)


def _choose(fits: list[LimitedFit], settings: IdentifySettings) -> LimitedFit:
    telling = [f for f in fits if f.fit.excited["slip_stiffness"]]
    for k, wide in enumerate(telling):
        if all(_agree(wide, narrow, settings) for narrow in telling[k + 1 :]):
            return wide
    return fits[0]


def _agree(wide: LimitedFit, narrow: LimitedFit, settings: IdentifySettings) -> bool:
    """Equal stiffness, after the curvature that the wide range tells and the narrow one may not is taken out.

    Where a fit leaves s out, its stiffness is lower by (s - s_fit) sum |mu|^3/sum mu^2, the secant instead of the origin.
    """
    a, b = wide.fit, narrow.fit
    mu = narrow.model.picture()[0][:, : narrow.mask.shape[1]][narrow.mask]
    bend = float(np.sum(np.abs(mu) ** 3) / np.sum(mu**2)) if np.any(mu) else 0.0
    curved = (a.value("saturation") - b.value("saturation")) * bend
    i = a.index("slip_stiffness")
    allowed = np.hypot(a.half["slip_stiffness"], b.half["slip_stiffness"])
    gap = abs(a.x[i] - b.x[i] - curved)
    return bool(gap <= max(settings.same_stiffness, settings.comparisons * float(allowed)))
