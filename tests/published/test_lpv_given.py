"""Published values of given LPV systems: each bound lies where its source says, from the side that it bounds."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from analysis.lpv.norms import lpv_decay_rate, lpv_l2_gain
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model

p, t1, t2, t3 = sp.symbols("p t1 t2 t3")


@pytest.mark.parametrize(
    ("rate", "printed", "independent", "gap"),
    [(np.inf, 1.0024, 1.0, 0.002), (4.0, None, 0.8663, 0.12), (0.2, 0.2, 0.19436, 0.06)],
)
def test_peni_and_seiler(rate: float, printed: float | None, independent: float, gap: float) -> None:
    """Peni, Seiler 2015/2016 and LPVTools: 1.0024 for jumps (optimum 1), about 20 % at a rate of 0.2; degree 3 otherwise."""
    model = small_model([[-1, 0], [0, -1]], [[p, -1]], [parameter(rate=rate)], E=[[1], [p]])
    found = lpv_l2_gain(model, degree=3 if np.isfinite(rate) else 0)
    assert found.upper == pytest.approx(independent, rel=3e-3)
    assert printed is None or found.upper <= printed
    assert found.lower <= independent * (1 + 1e-9)
    assert found.gap < gap
    assert found.witness is not None and not found.witness.constant


def spring(k: float) -> LpvModel:
    """Zelentsovsky 1994: x'' + x' + (2 + p) x = 0, 0 <= p <= k, p free to jump."""
    return small_model([[0, 1], [-2 - p, -1]], [[1, 0]], [parameter("p", 0.0, k, np.inf)])


def test_zelentsovsky() -> None:
    """Quadratic margin 3.82 = 1 + 2 sqrt 2 cut, exact margin 6.985: certified below, refuted above, open between."""
    inside, between, beyond = (lpv_decay_rate(spring(k), degree=0) for k in (3.8, 6.5, 7.2))
    assert inside.lower > 0.0
    assert between.lower == 0.0 < between.upper
    assert beyond.upper == 0.0
    assert beyond.witness is not None and beyond.witness.period > 0.5
    pushed = small_model([[0, 1], [-2 - p, -1]], [[1, 0]], [parameter("p", 0.0, 7.5, np.inf)], E=[[0], [1]])
    assert lpv_l2_gain(pushed, degree=0).lower == np.inf


def test_quadratic_stability_margin_of_the_lmi_manual() -> None:
    """LMI Control Toolbox, quadstab: x'' + f x' + k x = 0, k in [10, 12], f in [0.5, 0.7] grown 1.4908 times about its middle."""

    def grown(times: float) -> LpvModel:
        k, f = sp.symbols("k f")
        ranges = (
            parameter("k", 11 - times, 11 + times, np.inf),
            parameter("f", 0.6 - times / 10, 0.6 + times / 10, np.inf),
        )
        return small_model([[0, 1], [-k, -f]], [[1, 0]], ranges)

    assert lpv_decay_rate(grown(1.48), degree=0).lower > 0.0
    assert lpv_decay_rate(grown(1.50), degree=0).lower == 0.0


def test_decay_rate_of_the_yalmip_manual() -> None:
    found = lpv_decay_rate(small_model([[-1, 2], [-3, -4 + 0 * p]], [[1, p]], [parameter(rate=np.inf)]), degree=0)
    assert found.lower == pytest.approx(2.5, rel=2e-3) and found.lower <= 2.5 <= found.upper * (1 + 1e-9)


def test_rolmip_gain() -> None:
    """ROLMIP manual, tables 2 and 3: 2.8429 with a constant P, 1.0108 at the worst frozen place (brute force)."""
    model = small_model(
        [[0, 0, 1, 0], [0, 0, 0, 1], [-2 * t1, t1, -t1 * t3, 0], [t2, -t2, 0, -t2 * t3]],
        [[0, 1, 0, 0]],
        [parameter("t1", 2 / 3, 2.0, 0.0), parameter("t2", 0.8, 4 / 3, 0.0), parameter("t3", 1.0, 3.0, 0.0)],
        E=[[0], [0], [t1], [0]],
    )
    found = lpv_l2_gain(model, degree=0)
    assert found.lower == pytest.approx(1.0108, abs=5e-5)
    assert found.upper == pytest.approx(2.8429, rel=2e-3) and found.upper > 2.8429


def test_rolmip_discrete_stability() -> None:
    """ROLMIP manual, section 7.1: two vertices, constant parameter, feasible with an affine P and not with a constant one."""
    modes = sp.Matrix([[0.1, 0.9], [0, 0.1]]), sp.Matrix([[0.5, 0], [1, 0.5]])
    model = small_model(modes[0] * (1 + p) / 2 + modes[1] * (1 - p) / 2, [[1, 0]], [parameter(rate=0.0)])
    assert lpv_decay_rate(model, degree=1, discrete=True).lower > 0.0
    assert lpv_decay_rate(model, degree=0, discrete=True).lower == 0.0
