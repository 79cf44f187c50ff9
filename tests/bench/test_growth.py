"""How the cost of an observer with proof grows with states and parameters, and against one cvxpy block for each grid point.

Run with  pytest tests/bench/test_growth.py --benchmark-only -s ; without benchmarks only the small cases run, for their answers.
Times of one run are comparable with each other only: `cpu` is the processor's time, which a loaded machine lengthens less.
"""

from __future__ import annotations

import resource
import warnings
from itertools import product
from time import perf_counter, process_time
from typing import Any

import numpy as np
import pytest

from estimators import GainSchedule, LpvObserver
from synthesis.certificate.levels import held_claims
from synthesis.certificate.proof import certificate, prove
from synthesis.certificate.search import Search, Wish
from synthesis.design.deploy import claim_channel, deploy, names_of, tabulate
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.law_table import deployed_loop
from synthesis.lmi.result import Verdict
from tests.support.any_size import any_schedule, signals
from tests.support.chain import chain, chain_design

CASES = [(2, 1), (4, 1), (8, 1), (16, 1), (19, 1), (2, 2), (4, 2), (8, 2), (4, 3), (8, 3)]


@pytest.mark.parametrize(("states", "parameters"), CASES)
def test_from_model_to_proved_schedule(benchmark: Any, states: int, parameters: int) -> None:
    if benchmark.disabled and (states, parameters) not in [*CASES[:2], (2, 2)]:
        pytest.skip("long; runs when benchmarks are enabled")
    seconds: dict[str, float] = {}

    def everything() -> bool:
        start = process_time()
        model = chain(states, parameters)
        gains = design_observer(model, chain_design(model))
        seconds["design"] = process_time() - start
        content = schedule_content(deploy(gains), model.name)
        seconds["with table and claims"] = process_time() - start
        proved = all(proof.proved for proof in prove(content))
        seconds["with proof, cpu"] = process_time() - start
        return proved and gains.verdict is Verdict.CERTIFIED

    assert benchmark.pedantic(everything, rounds=1)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    benchmark.extra_info |= {name: round(value, 2) for name, value in seconds.items()} | {"peak MB": round(memory)}


def test_two_parameters_against_one_cvxpy_block_for_each_point(benchmark: Any, capsys: Any) -> None:
    """Four states, 20 x 20 points with four rate vertices; ours is proved between the points, too."""
    if benchmark.disabled:
        pytest.skip("long; runs when benchmarks are enabled")
    import cvxpy as cp

    model = chain(4, 2)
    channel = Channel(("w", "v0", "v1"), ("x2", "x3"))
    found = design_observer(model, ObserverDesign((channel,), degree=1, backoff=0.0))
    ours = benchmark.pedantic(design_observer, (model, ObserverDesign((channel,), degree=1, backoff=0.0)), rounds=3)
    assert ours.verdict is Verdict.CERTIFIED
    times = []
    for _ in range(3):
        start = perf_counter()
        design_observer(model, ObserverDesign((channel,), degree=1, backoff=0.0))
        times.append(perf_counter() - start)
    start = perf_counter()
    T, Ti = np.diag(found.scale), np.diag(1.0 / found.scale)
    P = [cp.Variable((4, 4), symmetric=True) for _ in range(3)]
    X = [cp.Variable((4, 2)) for _ in range(3)]
    square, constraints = cp.Variable(), []
    half = [q.half_width for q in model.parameters]
    unit = float((1.0 / found.scale[2:]).max())  # of the velocities
    Z = np.eye(4)[2:] @ Ti / unit
    for u in product(np.linspace(-1.0, 1.0, 20), repeat=2):
        at = model.on(np.array([[q.middle + q.half_width * x for q, x in zip(model.parameters, u, strict=True)]]))
        A, C, E, F = T @ at.A[0] @ Ti, at.C[0] @ Ti, T @ at.E[0], at.F[0]
        here, gain = P[0] + P[1] * u[0] + P[2] * u[1], X[0] + X[1] * u[0] + X[2] * u[1]
        constraints.append(here >> 1e-8 * np.eye(4))
        side = here @ E - gain @ F
        for rates in product(*[(q.rate_minimum, q.rate_maximum) for q in model.parameters]):
            moving = P[1] * (rates[0] / half[0]) + P[2] * (rates[1] / half[1])
            phi = A.T @ here + here @ A - gain @ C - C.T @ gain.T + moving + Z.T @ Z
            constraints.append(cp.bmat([[phi, side], [side.T, -square * np.eye(3)]]) << -1e-8 * np.eye(7))
    problem = cp.Problem(cp.Minimize(square), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of inaccuracy; the answer is compared
        problem.solve(solver="CLARABEL")
    script = perf_counter() - start
    gamma = float(np.sqrt(problem.value)) * unit
    assert ours.gamma == pytest.approx(gamma, rel=1e-4)
    ratio = script / float(np.median(times))
    benchmark.extra_info |= {"script / ours": round(ratio, 1), "script, s": round(script, 1), "gamma": ours.gamma}
    with capsys.disabled():
        print(
            f"\nper-block script {script:.1f} s, ours {np.median(times):.2f} s: {ratio:.0f} times; "
            f"gamma {gamma:.6f} and {ours.gamma:.6f}"
        )


def test_certify_a_table_of_ten_by_ten_cells(benchmark: Any) -> None:
    """Four states, two parameters, every claim of the deployed observer."""
    if benchmark.disabled:
        pytest.skip("long; runs when benchmarks are enabled")
    model = chain(4, 2)
    gains = design_observer(model, chain_design(model))
    small = deploy(gains)
    lines, table = tabulate(gains, (10, 10), "float64", 0.005)
    search = Search(
        deployed_loop(gains, lines, table, 0.005), names_of(model), model.parameters, 1, gains.design.settings
    )
    wishes = [Wish("gain", None, claim_channel(channel)) for channel in gains.design.channels]
    claims = held_claims(search, wishes, 0.05, 100.0, DeploySettings().settle)
    assert claims is not None
    content = schedule_content(type(small)(gains, small.settings, lines, table, claims, 0.0), "ten by ten")
    found = benchmark.pedantic(certificate, (content,), rounds=3)
    assert all(proof.proved for proof in found.proofs)
    benchmark.extra_info |= {"claims": len(found.proofs), "cells": 100}


@pytest.mark.parametrize(("states", "entries"), [(2, 1), (8, 1), (2, 4096), (8, 4096)])
def test_steps_of_the_observer_of_any_size(benchmark: Any, states: int, entries: int) -> None:
    schedule = any_schedule((states, 1, 1), 1)
    shape = () if entries == 1 else (entries,)
    observer = LpvObserver(schedule, shape)
    given = signals(schedule, np.random.default_rng(0), shape)
    observer.step(*given)
    benchmark(observer.step, *given)
    if not benchmark.disabled:
        benchmark.extra_info |= {"M steps/s": round(entries / benchmark.stats.stats.median / 1e6, 3)}
    assert np.isfinite(observer.state).all()


def test_the_growth_problem_runs(benchmark: Any) -> None:
    """The schedule of the benchmark is one that the runtime takes."""
    model = chain(3, 2)
    found = deploy(design_observer(model, chain_design(model)))
    schedule = GainSchedule.from_content(schedule_content(found, "odd"))
    benchmark.pedantic(lambda: LpvObserver(schedule), rounds=1)
    assert schedule.table.shape[-2:] == (3, 1)
