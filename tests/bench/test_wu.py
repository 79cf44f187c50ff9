"""Wu's problem over the whole circle: 8 states of 0.2 to 1000 1/s, 470 unknowns, a law that follows the angle.

The state of the art for comparison: the same inequalities in cvxpy with the basis 1, cos, sin on a grid end at 1.04.
"""

from __future__ import annotations

from time import process_time
from typing import Any

import numpy as np
import pytest

from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.lmi.result import Verdict
from tests.support.output_loops import frozen_gain
from tests.support.wu import CHANNEL, wu_plant

STATE_OF_THE_ART = 1.04


def test_the_whole_circle(benchmark: Any, capsys: Any) -> None:
    if benchmark.disabled:
        pytest.skip("long; runs when benchmarks are enabled")
    design = OutputFeedbackDesign((CHANNEL,), degree=5, still="X", backoff=0.02)
    model, start = wu_plant(), process_time()
    found = benchmark.pedantic(design_output_feedback, (model, design), rounds=1)
    seconds, line = process_time() - start, np.linspace(-np.pi, np.pi, 33)
    assert found.verdict is Verdict.CERTIFIED
    assert found.gamma <= 1.05 * STATE_OF_THE_ART
    assert frozen_gain(found, CHANNEL, line) <= found.gamma
    Ak, Bk, Ck, _ = found.controller(line)
    sizes = {name: float(np.abs(matrix).max()) for name, matrix in (("Ak", Ak), ("Bk", Bk), ("Ck", Ck))}
    pole = float(np.abs(np.linalg.eigvals(Ak)).max())
    benchmark.extra_info |= {"gamma": found.gamma, "cpu": round(seconds, 1), "fastest pole": pole} | sizes
    with capsys.disabled():
        print(f"\ngamma {found.gamma:.4f}, {seconds:.1f} s of processor time, fastest pole {pole:.2g} 1/s, {sizes}")
