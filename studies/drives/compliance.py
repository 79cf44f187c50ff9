"""Suspension of a drive file's car, for slips of wheels that move against the body."""

from __future__ import annotations

from estimators.velocity import SuspensionParameters
from studies.drives import quantities as si
from synthesis.toml_file import StrictTable


class Suspension(StrictTable):
    """One corner, P3 (14); what is not given is P3 Table I."""

    stiffness_x: si.Spring = 3e5
    stiffness_y: si.Spring = 7e5
    damping_x: si.Damper = 3730.0
    damping_y: si.Damper = 3730.0
    unsprung_mass: si.Mass = 46.0

    @property
    def parameters(self) -> SuspensionParameters:
        """For the estimators, SI."""
        return SuspensionParameters(
            self.stiffness_x, self.stiffness_y, self.damping_x, self.damping_y, self.unsprung_mass
        )
