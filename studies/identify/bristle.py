"""The LuGre corner model solved for the slip velocity that belongs to a measured force.

P1 (18)-(19) in the quantities that a drive determines, C = sigma0/kappa (slip stiffness), l = 1/kappa (relaxation length),
T1 = sigma1/sigma0 (damping time), 1/(theta g) = s. With z = mu/sigma0 (mu freed of damping and viscous part) (18) reads
v_r (1 - s |mu|) = dz/dt + kappa R|w| z, so

    F[v_r] = (1/C) ( l D[G(mu)] + F[R|w| mu/(1 - s |mu|)] ),   G(mu) = -sign(mu) ln(1 - s |mu|)/s,   dG/dmu = 1/(1 - s|mu|),

linear in 1/C and l/C. Tires need not bend as LuGre does: the curve of a Magic Formula is odd and smooth, without the term
s |mu|, and forced into it the slope at the origin comes out too steep by 15 %. So the steady curve is

    v_r/|v| = mu/(C (1 - s |mu| - c mu^2)),

c = 0 being LuGre, and s = 0 (c about half of 1/friction^2) a Magic Formula, of which the slip is lagged, so that its part of
the curve enters l D[.] as it is. c has a prior; where a log does not tell s clearly from 0 it is 0 (both free, noise trades
one for the other and C with them), and the intervals allow for ``curvature`` of it. At one speed v only l - T1 v shows:
damping is held at the prior unless the log tells it apart.

The slip velocity, which carries the noise of the velocity reference, is what is predicted; the normalised force, which is
far better known against its range, is the regressor: the other way round the noise of slip would pull the stiffness down
(errors in variables).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.arrays import FloatArray
from studies.identify.estimate import Unknown
from studies.identify.prefilter import Prefilter, first_order_lag
from studies.identify.settings import IdentifySettings
from synthesis.models.parameter_set import Tire

MOST_USED = 0.9  # s |mu| above this is a sliding wheel: no slip velocity belongs to its force
MOST_DAMPING = 0.01
"""s: bristles of rubber rest within a few ms; more is noise of the regressor that a slow filter would take away."""


def tire_unknowns(tire: Tire, settings: IdentifySettings) -> tuple[Unknown, ...]:
    """C [1], l [m], T1 [s], s [1] and c [1], with the first three of ``tire`` as prior."""
    stiffness = tire.sigma0.value / tire.kappa.value
    far = (float(np.log(2.0 / stiffness)), float(np.log(300.0 / stiffness)))
    relaxation = 1.0 / tire.kappa.value
    near = (float(np.log(0.01 / relaxation)), float(np.log(1.5 / relaxation)))
    damping = tire.sigma1.value / tire.sigma0.value
    s = settings
    considered = s.curvature / s.saturation_spread
    return (
        Unknown("slip_stiffness", stiffness, s.stiffness_spread, s.stiffness_width, far, informed=False, starts=(-1.2,)),
        Unknown("relaxation_length", relaxation, s.relaxation_spread, s.relaxation_width, near, informed=False),
        Unknown(
            "damping_time", damping, damping, s.damping_width, (0.0, MOST_DAMPING),
            positive=False, informed=False, relative=True,
        ),
        Unknown(
            "saturation", 0.0, s.saturation_spread, s.saturation_width, (-0.1, 5.0),
            considered=considered, apart=s.saturation_apart, positive=False, informed=False,
        ),
        Unknown("bend", s.bend, s.bend_spread, s.bend_spread, (-2.0, 5.0), positive=False),
    )  # fmt: skip


KEPT = 2
"""Calls whose filtered parts are remembered: a fit changes one unknown at a time, and many are not felt by a part."""
FELT = ("damping_time", "saturation", "bend")  # by the filtered parts of the slip velocity


def filtered_parts(
    curve: tuple[float, float, float], mu: FloatArray, rolling: FloatArray, filter_: Prefilter, step: float
) -> tuple[FloatArray, FloatArray]:
    """D[G] and F[.] of the module's equation, (n, k) each, m/s; ``curve`` holds the unknowns `FELT`.

    From the normalised force mu (n, k) [1] at the rolling speed R|w| (n, k), m/s.
    """
    damping, s, c = curve
    lagged = first_order_lag(mu, step, damping, filter_.runs)
    size = np.abs(lagged)
    used = np.minimum(s * size, MOST_USED)
    bristles = size if abs(s) < 1e-6 else -np.log(1.0 - used) / s
    left = 1.0 - np.minimum(used + c * size**2, MOST_USED)
    odd = 1.0 - np.minimum(c * size**2, MOST_USED)
    stretched = np.sign(lagged) * (bristles + size / odd - size)
    return filter_.rate(stretched), filter_.smooth(rolling * lagged / left)


def slip_velocity(p: Mapping[str, float], parts: tuple[FloatArray, FloatArray]) -> FloatArray:
    """F[v_r] (n, k), m/s, of its `filtered_parts`."""
    moved, rolled = parts
    return np.asarray((p["relaxation_length"] * moved + rolled) / p["slip_stiffness"])
