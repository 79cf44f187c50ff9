"""Speed on the reference problem: our two relaxations, Clarabel alone, and the per-block cvxpy script beside the checkout.

Ratios are written into the benchmark's extra_info; nothing is asserted on a clock, only the answers. Run with

    pytest tests/bench/test_reference_problem.py --benchmark-only --benchmark-columns=median,rounds -s
"""

from __future__ import annotations

import importlib.util
import statistics
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from time import perf_counter
from types import ModuleType
from typing import Any

import pytest

from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, design_observer
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import corner

REFERENCE = 1.0441868
SCRIPT = Path(__file__).resolve().parents[3] / "shared" / "bench" / "cvxpy_script.py"
CHANNEL = Channel(
    ("friction", "acceleration_error", "force_noise"),
    ("bristle_deflection", "relative_velocity"),
    weights=(1.0, 1.0, 0.5),
)


@cache
def model() -> LpvModel:
    return corner("corner-estimation", "longitudinal", 140.0)[0]


def design(degree: int, relaxation: Relaxation, points: int = 140) -> ObserverGains:
    """From the model to verified gains: relaxation, assembly, solve and re-evaluation on the continuum."""
    settings = LmiSettings(relaxation=relaxation, points=points)
    return design_observer(model(), ObserverDesign((CHANNEL,), degree=degree, backoff=0.0, settings=settings))


def rounds(benchmark: Any, wanted: int) -> int:
    """One round when benchmarks are disabled (under xdist, or with --benchmark-disable)."""
    return 1 if benchmark.disabled else wanted


def median_seconds(function: Callable[[], Any], repeat: int) -> float:
    seconds = []
    for _ in range(repeat):
        start = perf_counter()
        function()
        seconds.append(perf_counter() - start)
    return statistics.median(seconds)


def over_bare_solve(found: ObserverGains) -> float:
    """(relaxation and assembly + solve + re-evaluation) / solve, all of one and the same solve."""
    report = found.result.report
    return round((report.assembly_seconds + report.seconds + report.verification_seconds) / report.seconds, 3)


@pytest.mark.parametrize("relaxation", ["grid", "exact"])
@pytest.mark.parametrize("degree", range(7))
def test_degrees(benchmark: Any, relaxation: Relaxation, degree: int) -> None:
    found = benchmark.pedantic(
        design, (degree, relaxation), rounds=rounds(benchmark, 5), warmup_rounds=rounds(benchmark, 2) - 1
    )
    benchmark.extra_info |= {"gamma": found.gamma, "with all our work / bare solve": over_bare_solve(found)}
    assert found.gamma == pytest.approx(REFERENCE, abs=2e-5)


@pytest.mark.parametrize("points", [35, 70, 140, 280, 560, 1120, 2240])
def test_points(benchmark: Any, points: int) -> None:
    if benchmark.disabled and points > 140:
        pytest.skip("long; runs when benchmarks are enabled")
    found = benchmark.pedantic(design, (2, "grid", points), rounds=rounds(benchmark, 3 if points < 1000 else 1))
    benchmark.extra_info |= {"gamma": found.gamma, "with all our work / bare solve": over_bare_solve(found)}
    assert found.gamma == pytest.approx(REFERENCE, abs=2e-5)


def test_auto_says_which(benchmark: Any) -> None:
    """The default takes the cheaper relaxation by its estimate of the work and names it in the report."""
    chosen = {degree: design(degree, "auto").result.report.relaxation for degree in (1, 2, 6)}
    benchmark.extra_info |= {f"degree {degree}": name for degree, name in chosen.items()}
    benchmark.pedantic(design, (2, "auto"), rounds=rounds(benchmark, 3))
    assert set(chosen.values()) <= {"grid", "exact"}
    assert chosen[1] == "exact"


def cvxpy_script() -> ModuleType:
    if not SCRIPT.is_file():
        pytest.skip(f"the per-block script is not beside the checkout ({SCRIPT})")
    spec = importlib.util.spec_from_file_location("cvxpy_script", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.shared
def test_against_one_cvxpy_block_for_each_point(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """Degree 2, 140 points, all three in one run, interleaved so that they share whatever else the machine does."""
    script = cvxpy_script()
    gammas: list[float] = []

    def per_block() -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            problem = script.build(degree=2, points=140, noise=0.5, scale=250.0)
            problem.solve(solver="CLARABEL")
        gammas.append(float(problem.value))

    repeat = rounds(benchmark, 3)
    seconds: dict[str, list[float]] = {"script": [], "grid": [], "exact": []}
    bare: dict[str, list[float]] = {"grid": [], "exact": []}
    for _ in range(repeat):
        seconds["script"].append(median_seconds(per_block, 1))
        for relaxation in ("grid", "exact"):
            start = perf_counter()
            found = design(2, relaxation)
            seconds[relaxation].append(perf_counter() - start)
            bare[relaxation].append(seconds[relaxation][-1] / found.result.report.seconds)
            assert found.gamma == pytest.approx(REFERENCE, abs=2e-6)
    assert gammas[0] == pytest.approx(REFERENCE, abs=2e-5)
    medians = {name: statistics.median(values) for name, values in seconds.items()}
    ratios = {
        "grid is faster than the script by": round(medians["script"] / medians["grid"], 1),
        "exact is faster than the script by": round(medians["script"] / medians["exact"], 1),
        "grid, end to end / bare solve": round(statistics.median(bare["grid"]), 3),
        "exact, end to end / bare solve": round(statistics.median(bare["exact"]), 3),
        "seconds": {name: round(value, 4) for name, value in medians.items()},
    }
    benchmark.extra_info |= ratios
    benchmark.pedantic(design, (2, "exact"), rounds=repeat)
    with capsys.disabled():
        if not benchmark.disabled:
            print("\n" + "\n".join(f"{name}: {value}" for name, value in ratios.items()))
