"""Slips, model forces and velocities with and without the suspension compliance, on truth vehicles whose suspensions give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from estimators.velocity import SlipWeights, side_slip_angle, slip_ratio
from estimators.velocity.corners import CornerVectors, tire_frame
from studies.experiments.play import Reading, believed, play
from studies.papers.resilient_velocity.compliant_corners import compliant_parts
from studies.papers.resilient_velocity.friction import stribeck
from studies.papers.resilient_velocity.setting import DIRECTIONS, PRINTED
from studies.truth import Measured
from studies.truth.stepper import stepped_deflection

Array = npt.NDArray[np.float64]


def _corner(name: str) -> Reading:
    return lambda step: getattr(step.corners, name)


WITHOUT, PRINTED_WAY, INSIDE = "without", "as (15) is printed", "in the observer's input"
WAYS = (WITHOUT, PRINTED_WAY, INSIDE)
_OWN = ("relative", "relative_inside", "seen", "seen_inside", "give")
READINGS: dict[str, Reading] = {name: _corner(name) for name in _OWN} | {
    "force_x": lambda step: step.force_x,
    "force_y": lambda step: step.force_y,
    "force_z": lambda step: step.force_z,
}


@dataclass(frozen=True)
class ComplianceTrial:
    """S sensor draws x B runs over n samples; x and y of the tire frame on the last axis of what is per corner."""

    drawn: Measured
    slip: Mapping[str, Array]  # by way: V_r (S, B, n, 4, 2), m/s
    residual: Mapping[str, Array]  # by way: measured minus calculated F/F_z (S, B, n, 4, 2)
    centre: Mapping[str, Array]  # by way: V_x, V_y (S, B, n, 2), m/s
    give: Array  # estimated psi' (S, B, n, 4, 2), m/s
    true_slip: Array  # (B, n, 4, 2) m/s
    true_give: Array  # (B, n, 4, 2) m/s, tire frame


def run_trial(drawn: Measured) -> ComplianceTrial:
    """Play all runs of ``drawn`` and calculate the forces of every way.

    With compliance, the wheel centre moves with the body's velocity plus psi': V_r = R_e w - V_xt - psi'.
    """
    found = play(drawn, READINGS, compliant_parts)
    relative, give, steer = found["relative"], found["give"], drawn.signals["steer"]
    give_tire = np.stack(tire_frame(CornerVectors(give[..., 0], give[..., 1]), steer), axis=-1)
    slip = {WITHOUT: relative, PRINTED_WAY: relative - give_tire, INSIDE: found["relative_inside"]}
    seen = {WITHOUT: found["seen"], PRINTED_WAY: found["seen"] + give, INSIDE: found["seen_inside"] - give}
    use = np.stack([found["force_x"], found["force_y"]], axis=-1) / np.maximum(found["force_z"], 1.0)[..., None]
    calculated = model_force(drawn, np.stack([slip[way] for way in WAYS]))
    truth = drawn.truth
    body = CornerVectors(truth["compliance_x_rate"], truth["compliance_y_rate"])
    shares = _shares(believed(drawn).radius * drawn.signals["wheel_speed"], relative)
    return ComplianceTrial(
        drawn,
        slip,
        {way: use - force for way, force in zip(WAYS, calculated, strict=True)},
        {way: np.einsum("...cd,...cd->...d", shares, value) for way, value in seen.items()},
        give_tire,
        np.stack([truth["slip_velocity_x"], truth["slip_velocity_y"]], axis=-1),
        np.stack(tire_frame(body, truth["steer"]), axis=-1),
    )


def _shares(surface: Array, relative: Array) -> Array:
    """What each corner counts in V_x and V_y (..., 4, 2): the axle that slips less counts more, each wheel half of it."""
    along, across = surface - relative[..., 0], -relative[..., 1]
    slips = slip_ratio(surface, along), side_slip_angle(along, across)
    front = np.stack([SlipWeights().front(slip) for slip in slips], axis=-1)[..., None, :]
    return 0.5 * np.concatenate([front, front, 1.0 - front, 1.0 - front], axis=-2)


def model_force(drawn: Measured, slip: Array) -> Array:
    """F/F_z of the LuGre tire (1), (2) with Table I at slip velocities (..., S, B, n, 4, 2), m/s, each direction by itself.

    The road parameter is that of the truth: what the paper's tire was told of ice and dry is not said. Bristles are
    stepped exactly for slips held over a sample.
    """
    tires = [PRINTED.parameters.tire[d] for d in DIRECTIONS]
    sigma0, sigma1, sigma2, kappa = (
        np.array([getattr(tire, name).value for tire in tires]) for name in ("sigma0", "sigma1", "sigma2", "kappa")
    )
    road = drawn.truth["friction"][..., None]
    rolling = PRINTED.parameters.vehicle["effective_radius"].value * np.abs(drawn.signals["wheel_speed"])[..., None]
    rate = kappa * rolling + sigma0 * np.abs(slip) / (road * stribeck(PRINTED, slip))
    out, z = np.empty_like(slip), np.zeros_like(slip[..., 0, :, :])
    for k in range(slip.shape[-3]):
        z, mean, speed = stepped_deflection(z, slip[..., k, :, :], rate[..., k, :, :], drawn.sample_time)
        out[..., k, :, :] = sigma0 * mean + sigma1 * speed
    return np.asarray(out + sigma2 * slip)
