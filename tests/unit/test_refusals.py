"""Bad input to models, LMIs, designs and judgements: a GainsmithError in one line, never anything else."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from estimators.errors import GainsmithError
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.stability import affine_quadratic_stability
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.solve import solve
from synthesis.models.param import Constant, SchedulingParameter, Signal
from synthesis.published_certificate import check_certificate
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
m = small_model([[0, 1], [-4 - p, -1]], [[1, 0]])
BAD = {
    "nan in A": lambda: small_model([[sp.nan, 1], [-p, -1]], [[1, 0]]),
    "float nan in A": lambda: small_model([[float("nan"), 1], [-p, -1]], [[1, 0]]),
    "oo in A": lambda: small_model([[sp.oo, 1], [-p, -1]], [[1, 0]]),
    "complex in A": lambda: small_model([[sp.I, 1], [-p, -1]], [[1, 0]]),
    "3-D grid": lambda: m.on([[[0.5]]]),
    "text grid": lambda: m.on("abc"),
    "constant text": lambda: Constant("2", "1", "x"),
    "constant no source": lambda: Constant(1.0, "1", " "),
    "empty signal name": lambda: Signal("", "1"),
    "empty parameter name": lambda: SchedulingParameter("", "1", 0.0, 1.0, -1.0, 1.0),
    "unknown form": lambda: affine_quadratic_stability(m, np.array([[1.0], [1.0]]), 1, "dula"),
    "negative degree": lambda: affine_quadratic_stability(m, np.array([[1.0], [1.0]]), -1),
    "nan decay": lambda: affine_quadratic_stability(m, np.array([[1.0], [1.0]]), 1, decay_rate=float("nan")),
    "negative decay": lambda: affine_quadratic_stability(m, np.array([[1.0], [1.0]]), 1, decay_rate=-5.0),
    "degree tuple": lambda: LmiProblem((parameter(),)).symmetric("P", 2, (1, 1)),
    "no inequality": lambda: (lambda q: (q.scalar("x"), solve(q)))(LmiProblem((parameter(),))),
    "two unknowns": lambda: (lambda q: q.scalar("x") @ q.scalar("y"))(LmiProblem((parameter(),))),
    "box outside": lambda: (lambda q: q.require_on("a", q.scalar("x"), np.array([0.8, 0.0]), np.array([0.5, 1.0])))(
        LmiProblem((parameter(),))
    ),
    "nan known": lambda: LmiProblem((parameter(),)).known(np.full((1, 1, 1), np.nan)),
    "design nan decay": lambda: ObserverDesign((Channel(("d1",), ("x1",)),), decay_rate=float("nan")),
    "design nan fastest": lambda: ObserverDesign((Channel(("d1",), ("x1",)),), fastest_pole=float("nan")),
    "channel nan weight": lambda: design_observer(
        small_model([[p - 3]], [[1]], E=[[1]], F=[[1]]),
        ObserverDesign((Channel(("d1",), ("x1",), weights=(float("nan"),)),)),
    ),
    "channel empty": lambda: design_observer(
        small_model([[p - 3]], [[1]], E=[[1]], F=[[1]]), ObserverDesign((Channel((), ("x1",)),))
    ),
    "channel no errors": lambda: design_observer(
        small_model([[p - 3]], [[1]], E=[[1]], F=[[1]]), ObserverDesign((Channel(("d1",), ()),))
    ),
    "judge gains shape": lambda: check_certificate(m, [[1, 2]], [[["1", "0"], ["0", "1"]]]),
    "judge matrix shape": lambda: check_certificate(m, [[1], [2]], [[["1"]]]),
    "judge not a number": lambda: check_certificate(m, [["1x"], [2]], [[["1", "0"], ["0", "1"]]]),
    "judge nan": lambda: check_certificate(m, [[float("nan")], [2]], [[["1", "0"], ["0", "1"]]]),
    "judge infinite rate": lambda: check_certificate(
        small_model([[0, 1], [-4 - p, -1]], [[1, 0]], (parameter(rate=np.inf),)), [[1], [2]], [[["1", "0"], ["0", "1"]]]
    ),
    "judge not symmetric": lambda: check_certificate(m, [[1], [2]], [[["1", "9"], ["0", "1"]]]),
    "judge bad form": lambda: check_certificate(m, [[1], [2]], [[["1", "0"], ["0", "1"]]], "dula"),
}


@pytest.mark.parametrize("name", list(BAD))
def test_bad_input(name: str) -> None:
    with pytest.raises(GainsmithError) as refusal:
        BAD[name]()
    assert len(str(refusal.value).splitlines()) == 1


def test_symbols_with_assumptions() -> None:
    real = sp.Symbol("p", real=True)
    small_model([[0, 1], [-4 - real, -1]], [[1, 0]])
