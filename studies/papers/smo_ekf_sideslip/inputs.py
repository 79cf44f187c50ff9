"""Car, settings and printed tables of P5."""

from __future__ import annotations

import numpy as np

from estimators.sideslip import SingleTrack
from studies.papers.published import printed_numbers
from synthesis.models.catalogue.single_track import PEUGEOT_307

PACKAGE = "studies.papers.smo_ekf_sideslip"
PRINTED = printed_numbers(PACKAGE)
"""Tables 1 to 5 by test (slalom, roundabout), then by kind: forces, stiffness, mass."""
FORCES = ("F_y1", "F_y2", "F_x1", "yaw_rate")
"""Names of the quantities of Tables 1 and 2, in their order."""
FACTORS, MASSES = (0.5, 1.0, 1.5), (-300.0, 0.0, 300.0)
"""What the assumed stiffness is multiplied with, and by how many kg the assumed mass is wrong: Tables 3 to 5."""
SAMPLE_TIME = 0.01  # s
GRAVITY = 9.81  # m/s^2, of the axle loads
_FRONT, _REAR, _ALONG, _YAW = (PRINTED["slalom"]["forces"][name]["largest"] for name in FORCES)
LARGEST = np.array([np.radians(_YAW), _FRONT, _REAR, _ALONG])
"""Largest values of Table 1 in the order of the observer's state, rad/s and N."""


def published_car(mass_change: float = 0.0, stiffness_factor: float = 1.0) -> SingleTrack:
    """The car of P5 Table B.1, with another assumed mass (change in kg) or stiffness."""
    mass, inertia, front, rear, *stiffness = (constant.value for constant in PEUGEOT_307.values())
    return SingleTrack(mass + mass_change, inertia, front, rear, *(stiffness_factor * value for value in stiffness))


CAR = published_car()
WHEELBASE = CAR.wheelbase  # m
