"""Magic Formula under combined slip behind a relaxation length: the second, independent tire.

    y(x) = D sin(C atan(B x - E (B x - atan(B x)))),   B C D = slip stiffness, D = friction x peak x F_z
    F_x = y_x(kappa) G_x(alpha),  G_x = cos(C_xa atan(B_xa alpha)),  B_xa = r_Bx1 cos(atan(r_Bx2 kappa)); F_y likewise

Pacejka (2012) sections 4.3.2 and 7.2 without camber, ply steer, conicity and turn slip, with the published tire of its
Table A3.1 (205/60R15, 2.2 bar). Friction scales the peak and leaves the stiffness (lambda_mu). Slips lag:

    sigma kappa' = v_rx - W kappa,  sigma tan(alpha)' = v_ry - W tan(alpha),  W = max(|R_e w|, |v_xt|, |v_yt|)

With the transport speed W instead of |v_x| the steady kappa is the papers' slip ratio lambda, everything stays regular at
rest and backwards, and slips stay within about 1. The relaxation length falls with slip about as the slope of the force
does (Pacejka's restricted nonlinear form), sigma = sigma_0 (1 + (kappa/kappa_s)^2 + (tan(alpha)/alpha_s)^2)^-1.5 with
kappa_s = peak/stiffness: so the tire gives way by sigma_0 kappa_s = F_peak/C at most, C being its stiffness at rest, and
lets go within a centimetre when a slide ends. At rest it is a spring; the damping that it then lacks is added below
`damping_speed` (Pacejka (8.131)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from estimators.arrays import FloatArray
from studies.truth.layout import column


@dataclass(frozen=True)
class MagicFormulaParameters:
    """Pacejka (2012) Table A3.1, pairs for x and y; relaxation lengths and damping are chosen (its own need more states)."""

    nominal_load: float = 4000.0  # F_z0, N
    shape: tuple[float, float] = (1.685, 1.193)  # p_Cx1, p_Cy1
    peak: tuple[float, float] = (1.210, 0.990)  # p_Dx1, -p_Dy1
    peak_load: tuple[float, float] = (-0.037, -0.145)  # p_Dx2, -p_Dy2
    curve: tuple[float, float] = (0.344, -1.003)  # p_Ex1, p_Ey1
    curve_load: tuple[float, float] = (0.095, -0.537)  # p_Ex2, p_Ey2
    curve_load2: tuple[float, float] = (-0.020, 0.0)  # p_Ex3
    stiffness_x: tuple[float, float, float] = (21.51, -0.163, 0.245)  # p_Kx1, p_Kx2, p_Kx3
    stiffness_y: tuple[float, float] = (14.95, 2.130)  # -p_Ky1, p_Ky2
    weight: tuple[float, float] = (12.35, 6.461)  # r_Bx1, r_By1
    weight_fall: tuple[float, float] = (10.77, 4.196)  # |r_Bx2|, r_By2
    weight_shape: tuple[float, float] = (1.092, 1.081)  # r_Cx1, r_Cy1
    relaxation: tuple[float, float] = (0.25, 0.45)  # m, at small slip
    relaxation_least: float = 0.002  # m
    damping: tuple[float, float] = (0.06, 0.06)  # slip per m/s at rest
    damping_speed: float = 2.5  # m/s
    nominal_friction: float = 1.1  # what `friction` = 1 means, mean of both peaks at nominal load; peaks are over it


class MagicFormulaTire:
    """The tires of B vehicles; arrays (2, 4, B) of x and y. The lagged slips kappa and tan(alpha) are the state."""

    name: ClassVar[str] = "magic-formula"

    def __init__(self, parameters: list[MagicFormulaParameters]) -> None:
        def one(name: str) -> FloatArray:
            return column(parameters, name)

        def pair(name: str) -> FloatArray:
            return one(name)[:, None, :]

        self.nominal_load, self.damping_speed = one("nominal_load"), one("damping_speed")
        self.nominal_friction, self.relaxation_least = one("nominal_friction"), one("relaxation_least")
        self.shape, self.peak, self.peak_load = pair("shape"), pair("peak"), pair("peak_load")
        self.curve, self.curve_load, self.curve_load2 = pair("curve"), pair("curve_load"), pair("curve_load2")
        self.weight, self.weight_fall, self.weight_shape = pair("weight"), pair("weight_fall"), pair("weight_shape")
        self.relaxation, self.damping = pair("relaxation"), pair("damping")
        self.stiffness_x, self.stiffness_y = one("stiffness_x"), one("stiffness_y")
        first = np.stack([self.stiffness_x[0], self.stiffness_y[0]])[:, None, :]
        self.narrow: FloatArray = first / self.peak * self.nominal_friction  # 1/kappa_s, 1/alpha_s at friction 1

    def rates(
        self, slip: FloatArray, slide: FloatArray, _surface: FloatArray, transport: FloatArray, friction: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """a (2, 4, B), 1/s, and what drives the slips, v_r/sigma, 1/s: slip' = v_r/sigma - a slip, a = W/sigma."""
        near = slip * (self.narrow / friction)
        stiff = 1.0 + (near * near).sum(axis=0)
        sigma = np.maximum(self.relaxation / (stiff * np.sqrt(stiff)), self.relaxation_least)
        return transport / sigma, slide / sigma

    def forces(
        self, slip: FloatArray, _: FloatArray, slide: FloatArray, W: FloatArray, load: FloatArray, friction: FloatArray
    ) -> FloatArray:
        """F (2, 4, B), N, in the tire frame, from lagged slips, slip velocity (m/s), load (4, B), N, and friction."""
        slow = np.maximum(1.0 - W / self.damping_speed, 0.0)
        slip = slip + slow * self.damping * slide
        df = load / self.nominal_load - 1.0
        peak = np.maximum(self.peak + self.peak_load * df, 0.1) * (friction / self.nominal_friction)
        curve = np.minimum(self.curve + df * (self.curve_load + df * self.curve_load2), 1.0)
        x = self._stiffness(load, df) / (self.shape * peak) * slip
        pure = peak * np.sin(self.shape * np.arctan(x - curve * (x - np.arctan(x))))
        angle = np.stack([slip[0], np.arctan(slip[1])])  # kappa and alpha: each weakens the other's force
        own = self.weight_fall * angle
        weight = np.cos(self.weight_shape * np.arctan(self.weight * angle[::-1] / np.sqrt(1.0 + own * own)))
        return np.asarray(pure * weight * load)

    def _stiffness(self, load: FloatArray, df: FloatArray) -> FloatArray:
        """B C D/F_z (2, 4, B): K_x = F_z (p_1 + p_2 df) exp(p_3 df), K_y = p_1 F_z0 sin(2 atan(F_z/(p_2 F_z0)))."""
        first, second, exponent = self.stiffness_x
        along = (first + second * df) * np.exp(exponent * df)
        slope, width = self.stiffness_y
        ratio = load / (width * self.nominal_load)
        return np.stack([along, slope / width * 2.0 / (1.0 + ratio * ratio)])
