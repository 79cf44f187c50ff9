"""Average lumped LuGre tire under combined slip: P1 (18)-(19), P3 (1)-(2), with one friction for both directions.

    z_q' = v_rq - (kappa_q R_e |w| + sigma_0q |v_r|/(theta g(|v_r|))) z_q,   |v_r| = sqrt(v_rx^2 + v_ry^2)
    mu_q = sigma_0q z_q + sigma_1q z_q' + sigma_2q v_rq,   F_q = mu_q F_z
    g(v) = mu_c + (mu_s - mu_c) exp(-|v/V_s|^0.5)

The papers put |v_rq| where |v_r| stands: then each direction has the whole friction to itself. With |v_r| a sliding tire
pulls against its sliding velocity with theta g, as Velenis (2005) has it. P1 and P2 print no mu_c, mu_s, V_s: P3's serve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from estimators.arrays import FloatArray
from studies.truth.layout import column
from synthesis.models.parameter_set import ParameterSet, load_parameter_set, quantities


@dataclass(frozen=True)
class LuGreParameters:
    """One tire; x and y of the constants as in P1 Table I and section IV."""

    sigma0: tuple[float, float]  # 1/m, x and y
    sigma1: tuple[float, float]  # s/m
    sigma2: tuple[float, float]  # s/m
    kappa: tuple[float, float]  # 1/m
    sliding: float = 0.85  # mu_c, P3 Table I
    static: float = 1.1  # mu_s, P3 Table I
    stribeck: float = 5.0  # V_s, m/s, P3 Table I

    @classmethod
    def of(cls, values: ParameterSet) -> LuGreParameters:
        """From a parameter set; a direction that it lacks (P2 has no lateral tire) is that of P1, the same car."""
        along = values.tire.get("longitudinal") or load_parameter_set("corner-estimation").tire["longitudinal"]
        across = values.tire.get("lateral") or load_parameter_set("corner-estimation").tire["lateral"]
        x, y = quantities(along), quantities(across)
        given = {key: entry.value for key, entry in values.vehicle.items()}
        return cls(
            sigma0=(x["sigma0"].value, y["sigma0"].value), sigma1=(x["sigma1"].value, y["sigma1"].value),
            sigma2=(x["sigma2"].value, y["sigma2"].value), kappa=(x["kappa"].value, y["kappa"].value),
            sliding=given.get("friction_sliding", cls.sliding), static=given.get("friction_static", cls.static),
            stribeck=given.get("stribeck_velocity", cls.stribeck),
        )  # fmt: skip


class LuGreTire:
    """The tires of B vehicles; arrays (2, 4, B) of x and y. The bristle deflection z is the state, m."""

    name: ClassVar[str] = "lugre"

    def __init__(self, parameters: list[LuGreParameters]) -> None:
        self.sigma0, self.sigma1, self.sigma2, self.kappa = (
            column(parameters, name)[:, None, :] for name in ("sigma0", "sigma1", "sigma2", "kappa")
        )
        self.sliding, static, self.stribeck = (column(parameters, n) for n in ("sliding", "static", "stribeck"))
        self.rise: FloatArray = static - self.sliding

    def rates(
        self, _z: FloatArray, slide: FloatArray, surface: FloatArray, _transport: FloatArray, friction: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """a (2, 4, B), 1/s, and what drives the bristles, m/s: z' = v_r - a z, from v_r, |R_e w| (4, B), m/s, and theta."""
        speed = np.sqrt((slide * slide).sum(axis=0))
        grip = friction * (self.sliding + self.rise * np.exp(-np.sqrt(speed / self.stribeck)))
        return self.kappa * surface + self.sigma0 * (speed / grip), slide

    def forces(
        self, z: FloatArray, dz: FloatArray, slide: FloatArray, _w: FloatArray, load: FloatArray, _theta: FloatArray
    ) -> FloatArray:
        """F (2, 4, B), N, in the tire frame, from deflection (m), its rate and the slip velocity (m/s), load (4, B), N."""
        return np.asarray((self.sigma0 * z + self.sigma1 * dz + self.sigma2 * slide) * load)
