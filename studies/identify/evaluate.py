"""How well a tire explains a drive that it was not fitted to: velocity and force residual at low slip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.identify.identify import Identification
from studies.identify.slip_limit import LimitedFit
from synthesis.models.parameter_set import Tire


@dataclass(frozen=True)
class TireResidual:
    """RMS over ``samples`` rows: of the slip velocity that the tire asks for, m/s, and of the force it makes of the slip, 1."""

    velocity: float
    force: float
    samples: int


def tire_residual(found: Identification, direction: str, tire: Tire, limit: float = 0.03) -> TireResidual | None:
    """Of any ``tire`` on the drive of ``found``, with the radii and angle zeros that this drive says; None: no usable row.

    Velocity: measured minus asked slip velocity, dynamic, m/s. Force: mu - C slip, quasi-static, both filtered; slips below
    ``limit``. Both with the linear corner model: friction is a disturbance to the observers.
    """
    limited: LimitedFit | None = found.fits.get(direction)
    if limited is None:
        return None
    values = limited.fit.values()
    values |= {
        "slip_stiffness": tire.sigma0.value / tire.kappa.value,
        "relaxation_length": 1.0 / tire.kappa.value,
        "damping_time": tire.sigma1.value / tire.sigma0.value,
        "saturation": 0.0,
        "bend": 0.0,
    }
    mask = limited.model.mask(limit, values)
    if not mask.any():
        return None
    error = limited.model.residual(values)[mask]
    mu, _ = limited.model.picture()
    width = min(mask.shape[1], limited.model.slip(values).shape[1])
    inside = mask[:, :width]
    force = (mu[:, :width] - values["slip_stiffness"] * limited.model.slip(values))[inside]
    return TireResidual(
        velocity=float(np.sqrt(np.mean(error**2))),
        force=float(np.sqrt(np.mean(force**2))) if force.size else float("nan"),
        samples=int(mask.sum()),
    )
