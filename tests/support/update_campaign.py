"""Random plants, claims searched and proved for them, and runs that try to beat the claims.

`python -m tests.support.update_campaign 1000` prints counts of plants, claims, samples and violations (there must be none).
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field
from time import process_time
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from flint import fmpq_mat
from scipy.linalg import solve_discrete_are

from estimators import GainSchedule
from synthesis.certificate.claims import Claim, ClaimChannel
from synthesis.certificate.frozen import critical_probability, slowest_decay
from synthesis.certificate.levels import best_gain, largest
from synthesis.certificate.proof import prove
from synthesis.certificate.search import Search, Wish
from synthesis.design.deploy import Deployment, names_of
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.errors import ProblemError
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.polynomials.rational import decimal
from tests.support.random_plant import RandomPlant, few_digits, places, random_plant
from tests.support.update_judge import Judge, Tally, still_motion
from tests.support.update_run import Paths, Run, simulate, walks

UPDATE_KIND = {"held": "internal update", "sampled": "sampled error"}
REST, MOVING, DRIVEN, NOISY, DROPPING = (np.arange(4 * i, 4 * i + 4) for i in range(5))  # entries of a batch
SETTLE = 0.005


@dataclass
class Report:
    """What a campaign did."""

    plants: Counter[str] = field(default_factory=Counter)
    claims: Counter[str] = field(default_factory=Counter)
    samples: int = 0
    converged: int = 0  # runs of the sampled update, the plant moving, that reached 1e-12 of the states
    skipped: Counter[str] = field(default_factory=Counter)
    tally: Tally = field(default_factory=Tally)


@dataclass(frozen=True)
class Case:
    """A plant with a table of gains and how they run."""

    plant: RandomPlant
    update: str
    breakpoints: np.ndarray
    table: np.ndarray
    how: str

    @property
    def loop(self) -> ObserverLoop:
        """As the prover sees it."""
        table = {
            (i,): fmpq_mat([[decimal(float(x)) for x in row] for row in gain]) for i, gain in enumerate(self.table)
        }
        points = (tuple(decimal(float(value)) for value in self.breakpoints),)
        T = decimal(self.plant.sample_time)
        return ObserverLoop(plant_of(self.plant.model), points, table, self.update, T)  # type: ignore[arg-type]

    def frozen(self, parameters: np.ndarray) -> np.ndarray:
        """A of the error's update, by scipy: (g, 2, 2)."""
        return self.plant.frozen(self.update, self.breakpoints, self.table, parameters)

    @property
    def search(self) -> Search:
        """For claims about the loop."""
        model = self.plant.model
        return Search(self.loop, names_of(model), model.parameters, degree=1)

    def content(self, claims: list[Claim]) -> dict[str, Any]:
        """The content of a schedule file."""
        gains = SimpleNamespace(
            model=self.plant.model, update=self.update, design=SimpleNamespace(settings=LmiSettings())
        )
        settings = DeploySettings(sample_time=self.plant.sample_time)
        found = Deployment(cast(Any, gains), settings, (self.breakpoints,), self.table, tuple(claims), 0.0)
        return schedule_content(found, f"random-{self.plant.seed}")


def random_case(seed: int, units: dict[str, float] | None = None) -> Case | None:
    """Gains by pole placement, every seventh time by a design; None if none of a few draws is stable at frozen parameters."""
    plant, draw = random_plant(seed, units), np.random.default_rng(seed + 1_000_000)
    update = ("held", "sampled")[seed % 2]
    low, high = float(plant.low), float(plant.high)
    breakpoints = places(low, high, int(draw.integers(2, 4)))
    grid = np.linspace(low, high, 41)
    for attempt in range(8):
        how = "designed" if seed % 7 == 0 and attempt == 0 else "placed"
        try:
            table = designed(plant, update, breakpoints) if how == "designed" else None
        except ProblemError:
            continue
        table = plant.stabilising(update, breakpoints, draw) if table is None else table
        if not np.isfinite(table).all():
            continue
        A = plant.frozen(update, breakpoints, table, grid)
        if np.abs(np.linalg.eigvals(A)).max() < 0.995:
            return Case(plant, update, breakpoints, table, how)
    return None


def designed(plant: RandomPlant, update: str, breakpoints: np.ndarray) -> np.ndarray:
    """Gains of a design with cheap settings."""
    sizes = (plant.units["d1"], plant.units["d2"])
    errors = ("x1", "x2") if plant.units["x1"] == plant.units["x2"] else ("x1",)
    channel = Channel(("process", "noise"), errors, weights=sizes)
    settings = LmiSettings(relaxation="grid", points=9)
    if update == "held":
        rate = min(20.0 * plant.speed, 2.0 / plant.sample_time)
        design = ObserverDesign((channel,), decay_rate=0.05 * plant.speed, fastest_pole=rate, settings=settings)
        gains = design_observer(plant.model, design)
    else:
        design = ObserverDesign((channel,), decay_rate=0.05 * plant.speed, settings=settings)
        gains = design_sampled_observer(plant.model, design, plant.sample_time)
    return np.array([[[few_digits(float(x))] for x in row[:, 0]] for row in gains.gain(breakpoints)])


def searched(case: Case, quick: bool = False) -> list[Claim]:
    """The claims that a deployment would get, each if it can be had; `quick`: one gain and one motion gain of each two."""
    search, units, turn = case.search, case.plant.units, case.plant.seed // 2
    both = ClaimChannel({"process": units["d1"], "noise": units["d2"]}, ("x1",))
    channels = [both, ClaimChannel({"noise": 1.0}, ("x2",))][turn % 2 if quick else 0 :][: 1 if quick else 2]
    found = [largest(search, UPDATE_KIND[case.update], slowest_decay(search.loop))]
    found += [best_gain(search, Wish("sampled gain", None, channel), SETTLE) for channel in channels]
    if case.update == "held":
        motions = [ClaimChannel({state: 1.0}, ("x1",)) for state in ("x1", "x2")]
        motions = [motions[turn // 2 % 2]] if quick and turn % 2 else motions  # a whole run needs both
        found += [best_gain(search, Wish("motion gain", None, channel), SETTLE) for channel in motions]
    found += [largest(search, "drop probability", critical_probability(search.loop))]
    return [claim for claim in found if claim is not None]


def attack(case: Case, claims: list[Claim], report: Report, steps: int) -> None:
    """Export, prove the content, run, judge."""
    content = case.content(claims)
    proofs = prove(content)
    for proof in proofs:
        if not proof.proved:
            report.tally.violations.append(f"seed {case.plant.seed}: {proof.claim} is not proved from its file")
    schedule = GainSchedule.from_content(content)
    judge = Judge(case.plant, schedule, content["claims"], report.tally)
    draw = np.random.default_rng(case.plant.seed + 2_000_000)
    run = moving_run(case, schedule, max(steps, settled(case, claims, 3 * steps)), draw)
    report.samples += run.paths.u.size
    judge.every_step(run)
    judge.whole_run(run)
    judge.second_moment(run.paths.p, draw)
    if case.update == "sampled":
        report.converged += converged(case, claims, run, report.tally)
    for claim in content["claims"]:
        if claim["kind"] != "drop probability":
            worst = worst_run(judge, claim, draw)
            if worst is None:
                report.skipped["worst step of a motion gain: A is singular"] += 1
                continue
            report.samples += worst.paths.u.size
            judge.every_step(worst)


def moving_run(case: Case, schedule: GainSchedule, steps: int, draw: np.random.Generator) -> Run:
    """20 entries: at rest; moving; driven by both disturbances; by the noise alone; moving with losses."""
    plant, count = case.plant, 20
    p = walks(plant, steps, count, draw)
    time, size = np.arange(steps)[:, None], np.array([plant.units["x1"], plant.units["x2"]])
    swing = np.sin(time * 10 ** draw.uniform(-2.0, 0.3, count) + draw.uniform(0.0, 6.0, count))
    u = plant.units["u"] * (swing + 0.3 * draw.normal(size=(steps, count)))
    d = draw.normal(size=(steps, count, 2)) * [plant.units["d1"], plant.units["d2"]]
    d[:, NOISY, 1] = plant.units["d2"] * swing[:, NOISY] * 10.0
    d[:, NOISY, 0] = 0.0
    d[:, [*REST, *MOVING, *DROPPING]] = 0.0
    x, e = draw.normal(size=(2, count, 2)) * size * 10 ** draw.uniform(-1.0, 1.0, (2, count, 1))
    lost = draw.random((steps, count)) < 0.3
    lost[:, [*REST, *MOVING, *DRIVEN, *NOISY]] = False
    u[:, REST], x[REST] = 0.0, 0.0
    e[[*DRIVEN[:2], *NOISY[:2]]] = 0.0
    return simulate(plant, schedule, Paths(p, u, d, lost, x, x - e), feedback(plant))


def feedback(plant: RandomPlant) -> np.ndarray:
    """Holds the plant on its input, so that it moves and does not run away; zero where it stays in bounds by itself."""
    middle = np.array([float(plant.centre)])
    growth = np.linalg.eigvals(plant.at(np.linspace(float(plant.low), float(plant.high), 9))["A"]).real.max()
    if growth * plant.sample_time < 1e-3:
        return np.zeros(2)
    size = np.array([plant.units["x1"], plant.units["x2"]])
    coast, drive = (m[0] / size[:, None] * size for m in plant.held_over_a_sample(middle))
    B = drive @ (plant.at(middle)["B"][0] * plant.units["u"] / size[:, None])
    try:
        X = solve_discrete_are(coast, B, np.eye(2) * 1e-2, np.eye(1))
    except (np.linalg.LinAlgError, ValueError):
        return np.zeros(2)
    gain = np.linalg.solve(np.eye(1) + B.T @ X @ B, B.T @ X @ coast)
    return np.asarray(gain[0] * plant.units["u"] / size)


def settled(case: Case, claims: list[Claim], most: int) -> int:
    """Samples after which the claimed decay of a sampled update leaves 2e-15 of an error; 0 if that takes more than `most`."""
    rate = next((claim.level for claim in claims if claim.kind == "sampled error"), 0.0)
    needed = 34.0 / (rate * case.plant.sample_time) if rate > 0.0 else np.inf
    return int(np.ceil(needed)) if needed <= most else 0


def converged(case: Case, claims: list[Claim], run: Run, tally: Tally) -> int:
    """The sampled update, the plant moving: the error ends at rounding, 1e-12 of the states, if the decay gives it time."""
    if not settled(case, claims, len(run.paths.u)):
        return 0
    last = np.abs(run.e[-1, MOVING]).max(axis=0)
    size = np.maximum(np.abs(run.x[:, MOVING]).max(axis=(0, 1)), run.size[:, MOVING].max(axis=(0, 1)))
    tally.judge("converged", last, (1e-12 + 10.0 * case.plant.roundoff) * size, case.plant.seed)
    return len(MOVING)


def worst_run(judge: Judge, claim: Any, draw: np.random.Generator) -> Run | None:
    """One sample from each of many places: the error and the inputs that come nearest to breaking the claim."""
    plant = judge.plant
    low, high = float(plant.low), float(plant.high)
    fall, rise = (rate * plant.sample_time * (1.0 - 1e-6) for rate in plant.rates)
    grid = np.linspace(low, high, 33)
    p = np.concatenate([grid, grid, grid])
    later = np.clip(p + np.repeat([fall, 0.0, rise], len(grid)), low, high)
    e, w = judge.worst_steps(claim, p, later)
    count = len(p)
    names = [d.name for d in judge.schedule.disturbances]
    x, d, u = np.zeros((count, 2)), np.zeros((count, 2)), np.zeros(count)
    if claim["kind"] == "sampled gain":
        for k, (name, size) in enumerate(claim["channel"]["inputs"].items()):
            d[:, names.index(name)] = w[:, k] * size
    if claim["kind"] == "motion gain":
        wanted = np.zeros((count, 2))
        for k, (name, size) in enumerate(claim["channel"]["inputs"].items()):
            wanted[:, [s.name for s in judge.schedule.states].index(name)] = w[:, k] * size
        found = still_motion(plant, p, wanted)
        if found is None:
            return None
        x = found
    elif judge.schedule.update == "sampled":
        x = draw.normal(size=(count, 2)) * np.abs(e).max(axis=0)  # whatever the plant does
    paths = Paths(np.stack([p, later]), u[None], d[None], np.zeros((1, count), bool), x, x - e)
    return simulate(plant, judge.schedule, paths, np.zeros(2))


def campaign(seeds: range, steps: int = 200, quick: bool = False, show: bool = False) -> Report:
    """Claims of every kind for every plant, and runs against them."""
    report = Report()
    for seed in seeds:
        case = random_case(seed)
        if case is None:
            report.skipped["no stabilising gains drawn"] += 1
            continue
        claims = searched(case, quick)
        report.plants[f"{case.update}, {case.plant.kind}, {case.how}"] += 1
        for claim in claims:
            report.claims[claim.kind] += 1
        if UPDATE_KIND[case.update] in {claim.kind for claim in claims}:
            attack(case, claims, report, steps)
        else:  # a file says nothing where it cannot say that its update is stable
            report.skipped["no P of degree one found for the update"] += 1
        if show and seed % 50 == 49:
            print(seed + 1, process_time(), report.samples, len(report.tally.violations), flush=True)
    return report


if __name__ == "__main__":
    first, last = (0, int(sys.argv[1])) if len(sys.argv) == 2 else (int(sys.argv[1]), int(sys.argv[2]))
    done = campaign(range(first, last), show=True)
    print("plants", sum(done.plants.values()), dict(sorted(done.plants.items())))
    print("claims", sum(done.claims.values()), dict(done.claims))
    print("samples", done.samples, "converged runs", done.converged, "skipped", dict(done.skipped))
    print("checks", dict(done.tally.checks))
    print("violations", len(done.tally.violations))
    for line in done.tally.violations[:40]:
        print(" ", line)
