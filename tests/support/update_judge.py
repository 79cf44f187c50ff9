"""Does a run beat a claim? Every claim of a schedule's content against what plant and runtime did, in plain numbers.

P is read from the stored Chebyshev coefficients, matrices of the update from scipy (`random_plant`) or from the runtime itself
(`update_run.probed`). Rounding is allowed for relative to what was added up (`Run.size`), and nothing else.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebval
from scipy.linalg import solve

from estimators import GainSchedule
from tests.support.random_plant import RandomPlant, interpolated
from tests.support.update_run import Run, probed

RELATIVE = 1e-12  # of V
SUMS = 1e-13  # of |e|'|P||e|: what cancels in V when P is nearly singular


@dataclass
class Tally:
    """Checks made and violations found, by the kind of claim."""

    checks: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)

    def judge(self, what: str, excess: np.ndarray, allowed: np.ndarray, seed: int) -> None:
        """excess <= allowed everywhere."""
        self.checks[what] += excess.size
        bad = ~(excess <= allowed)
        if bad.any():
            worst = np.unravel_index(np.argmax(np.where(bad, excess - allowed, -np.inf)), excess.shape)
            self.violations.append(
                f"seed {seed}: {what}: {excess[worst]:.3e} > {allowed[worst]:.3e} at {tuple(map(int, worst))}, "
                f"{int(bad.sum())} of {bad.size}"
            )


@dataclass(frozen=True)
class Judge:
    """One plant with its schedule and the claims of its content."""

    plant: RandomPlant
    schedule: GainSchedule
    claims: list[Mapping[str, Any]]
    tally: Tally

    def lyapunov(self, claim: Mapping[str, Any], parameters: np.ndarray) -> np.ndarray:
        """P at parameters (...): (..., 2, 2)."""
        u = (parameters - float(self.plant.centre)) / float(self.plant.half)
        highest = max(order for (order,) in claim["P"]["orders"])
        series = np.zeros((highest + 1, 2, 2))
        for (order,), matrix in zip(claim["P"]["orders"], claim["P"]["coefficients"], strict=True):
            series[order] = matrix
        return np.moveaxis(chebval(u, series), (0, 1), (-2, -1))

    def motion_matrix(self, parameters: np.ndarray) -> np.ndarray:
        """T (phi(TA) - phi(M)): from the plant's motion to the error of the held update, (..., 2, 2)."""
        flat = parameters.reshape(-1)
        gain = interpolated(self.schedule.breakpoints, self.schedule.table, flat)
        closed = self.plant.held_over_a_sample(flat, gain @ self.plant.at(flat)["C"])[1]
        return (self.plant.held_over_a_sample(flat)[1] - closed).reshape(*parameters.shape, 2, 2)

    def every_step(self, run: Run) -> None:
        """The inequality of each claim in every sample that it speaks of."""
        p, later = run.paths.p[:-1], run.paths.p[1:]
        e, after = run.e[:-1], run.e[1:]
        moved = np.zeros((*p.shape, 2, 2))
        if self.schedule.update == "held":
            moved = self.motion_matrix(p)
        still = after - np.einsum("knij,knj->kni", moved, run.motion)
        quiet = (run.paths.d == 0.0).all(axis=-1)
        # The last term keeps squares of what has decayed to nothing away from the end of float64.
        slack = self.plant.roundoff * run.size + 1e-120 * np.array([self.plant.units["x1"], self.plant.units["x2"]])
        off = np.abs(run.estimate[1:] - run.coasted)[run.paths.lost]
        self.tally.judge("coasting", off, slack[run.paths.lost], self.plant.seed)
        for claim in self.claims:
            kind, level = claim["kind"], claim["level"]
            P, P_later = self.lyapunov(claim, p), self.lyapunov(claim, later)
            V = _square(P, e) + SUMS * (_square(np.abs(P), np.abs(e)) + _square(np.abs(P_later), np.abs(after)))
            floor = np.einsum("kni,knii->kn", slack, np.sqrt(np.abs(P_later)))
            if kind in ("internal update", "sampled error"):
                heard = quiet & ~run.paths.lost
                reached = np.sqrt(_square(P_later, still))
                kept = np.exp(-level * self.plant.sample_time) * np.sqrt(V)
                self.tally.judge(kind, reached[heard], (kept * (1.0 + RELATIVE) + floor)[heard], self.plant.seed)
            if kind in ("sampled gain", "motion gain"):
                self._dissipates(claim, run, (still, moved, quiet), (V, P_later, floor))

    def _dissipates(
        self, claim: Mapping[str, Any], run: Run, parts: tuple[np.ndarray, ...], energy: tuple[np.ndarray, ...]
    ) -> None:
        """V+ + |z|^2 <= V + g^2 |w|^2 where nothing but the channel's inputs acts, or what else acts is taken out."""
        (still, moved, quiet), (V, P_later, floor) = parts, energy
        inputs, heard = claim["channel"]["inputs"], ~run.paths.lost
        if claim["kind"] == "sampled gain":
            names = [d.name for d in self.schedule.disturbances]
            heard = heard & ((run.paths.d == 0.0) | np.isin(names, list(inputs))).all(axis=-1)
            w = np.stack([run.paths.d[..., names.index(name)] / size for name, size in inputs.items()], axis=-1)
            reached = still
        else:
            names, heard = [s.name for s in self.schedule.states], heard & quiet
            places = [names.index(name) for name in inputs]
            w = run.motion[..., places] / np.array(list(inputs.values()))
            reached = still + np.einsum("knij,knj->kni", moved[..., places], run.motion[..., places])
        states = [s.name for s in self.schedule.states]
        z = run.e[:-1][..., [states.index(name) for name in claim["channel"]["errors"]]]
        V_later = _square(P_later, reached)
        left = V_later + (z**2).sum(axis=-1)
        right = V + claim["level"] ** 2 * (w**2).sum(axis=-1)
        allowed = right + RELATIVE * (left + right) + 2.0 * floor * np.sqrt(V_later) + floor**2
        self.tally.judge(claim["kind"], left[heard], allowed[heard], self.plant.seed)

    def whole_run(self, run: Run) -> None:
        """|z|_2 <= sqrt(V(0) + g^2 |w|^2) + sum of g_i |x_i'|_2 over runs without losses; nothing is taken out."""
        whole = ~run.paths.lost.any(axis=0)
        for claim in self.claims:
            if claim["kind"] != "sampled gain" or len(claim["channel"]["inputs"]) < len(self.schedule.disturbances):
                continue
            names = [d.name for d in self.schedule.disturbances]
            size = np.array([claim["channel"]["inputs"][name] for name in names])
            V = _square(self.lyapunov(claim, run.paths.p[0]), run.e[0])
            w = (run.paths.d / size) ** 2
            bound = np.sqrt(V + claim["level"] ** 2 * w.sum(axis=(0, 2)))
            found = True
            if self.schedule.update == "held":
                for i, state in enumerate(self.schedule.states):
                    gain = self._motion_gain(state.name, claim["channel"]["errors"])
                    found = found and gain is not None
                    bound = bound + (gain or 0.0) * np.sqrt((run.motion[..., i] ** 2).sum(axis=0))
            states = [s.name for s in self.schedule.states]
            errors = [states.index(name) for name in claim["channel"]["errors"]]
            z = np.sqrt((run.e[:-1][..., errors] ** 2).sum(axis=(0, 2)))
            rounding = self.plant.roundoff * run.size[..., errors].sum(axis=(0, 2)) * 10.0
            if found:
                allowed = bound * (1.0 + RELATIVE) + rounding
                self.tally.judge("sum over a run", z[whole], allowed[whole], self.plant.seed)

    def _motion_gain(self, state: str, errors: list[str]) -> float | None:
        for claim in self.claims:
            channel = claim.get("channel", {"inputs": {}, "errors": []})
            if claim["kind"] == "motion gain" and (channel["inputs"], channel["errors"]) == ({state: 1.0}, errors):
                return float(claim["level"])
        return None

    def second_moment(self, p: np.ndarray, draw: np.random.Generator) -> None:
        """trace(P S) falls along the walk, S = E e e', for drop probabilities up to the claimed one; p (k+1, n)."""
        claim = next((claim for claim in self.claims if claim["kind"] == "drop probability"), None)
        if claim is None:
            return
        received, lost = (probed(self.schedule, p[:-1].reshape(-1), gone).reshape(*p[:-1].shape, 2, 2)
                          for gone in (False, True))  # fmt: skip
        P = self.lyapunov(claim, p)
        size = np.array([self.plant.units["x1"], self.plant.units["x2"]])
        root = draw.normal(size=(p.shape[1], 2, 2)) * size[:, None]
        S = root @ np.swapaxes(root, 1, 2)
        share = claim["level"] * np.where(np.arange(p.shape[1]) % 2 == 0, 1.0, draw.random(p.shape[1]))[:, None, None]
        for k in range(len(p) - 1):
            before = np.einsum("nij,nji->n", P[k], S)
            S = (1.0 - share) * received[k] @ S @ np.swapaxes(received[k], 1, 2) + share * lost[k] @ S @ np.swapaxes(
                lost[k], 1, 2
            )
            now = np.einsum("nij,nji->n", P[k + 1], S)
            sums = SUMS * (np.abs(P[k + 1]) * np.abs(S)).sum(axis=(1, 2))
            self.tally.judge("drop probability", now, before * (1.0 + RELATIVE) + sums, self.plant.seed)

    def worst_steps(self, claim: Mapping[str, Any], p: np.ndarray, later: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(e, w) at each pair of parameters that come nearest to breaking the claim, by the smallest eigenvector."""
        A = self.plant.frozen(self.schedule.update, self.schedule.breakpoints, self.schedule.table, p)
        P, P_later = self.lyapunov(claim, p), self.lyapunov(claim, later)
        size = np.array([self.plant.units["x1"], self.plant.units["x2"]])
        kind, level = claim["kind"], claim["level"]
        fallen = np.swapaxes(A, 1, 2) @ P_later @ A
        if "channel" not in claim:
            matrix, units = P * np.exp(-2.0 * level * self.plant.sample_time) - fallen, size
            w = np.zeros((len(p), 0))
        else:
            B, units = self.input_matrix(claim, p), np.array([*size, *self._input_sizes(claim, p)])
            states = [s.name for s in self.schedule.states]
            Z = np.eye(2)[[states.index(name) for name in claim["channel"]["errors"]]]
            side = -np.swapaxes(A, 1, 2) @ P_later @ B
            corner = level**2 * np.eye(B.shape[2]) - np.swapaxes(B, 1, 2) @ P_later @ B
            matrix = np.block([[P - Z.T @ Z - fallen, side], [np.swapaxes(side, 1, 2), corner]])
            w = np.zeros((len(p), B.shape[2]))
        assert kind != "drop probability"
        scaled = matrix * units[:, None] * units
        scaled = scaled / np.abs(scaled).max(axis=(1, 2), keepdims=True)
        vector = np.linalg.eigh(scaled)[1][..., 0] * units
        w[:] = vector[:, 2:]
        return vector[:, :2], w

    def input_matrix(self, claim: Mapping[str, Any], p: np.ndarray) -> np.ndarray:
        """B W of the claim's channel, (g, 2, k)."""
        inputs = claim["channel"]["inputs"]
        sizes = np.array(list(inputs.values()))
        if claim["kind"] == "motion gain":
            names = [s.name for s in self.schedule.states]
            return self.motion_matrix(p)[..., [names.index(name) for name in inputs]] * sizes
        names = [d.name for d in self.schedule.disturbances]
        places = [names.index(name) for name in inputs]
        matrices = self.plant.at(p)
        gain = interpolated(self.schedule.breakpoints, self.schedule.table, p)
        E, F = matrices["E"][..., places], matrices["F"][..., places]
        if self.schedule.update == "held":
            closed = self.plant.held_over_a_sample(p, gain @ matrices["C"])[1]
            return closed @ (E - gain @ F) * sizes
        return (self.plant.held_over_a_sample(p)[1] @ E - gain @ F) * sizes

    def _input_sizes(self, claim: Mapping[str, Any], p: np.ndarray) -> np.ndarray:
        """What one unit of the errors is to the inputs: errors over gain."""
        states = [s.name for s in self.schedule.states]
        size = max(self.plant.units[name] for name in claim["channel"]["errors"] if name in states)
        return np.full(len(claim["channel"]["inputs"]), size / claim["level"])


def still_motion(plant: RandomPlant, p: np.ndarray, wanted: np.ndarray) -> np.ndarray | None:
    """x with A(p) x = wanted, (g, 2); None where A is nearly singular."""
    A = plant.at(p)["A"]
    size = np.array([plant.units["x1"], plant.units["x2"]])
    scaled = A / size[:, None] * size
    if (np.linalg.cond(scaled) > 1e6).any():
        return None
    return np.array([solve(a, b / size) for a, b in zip(scaled, wanted, strict=True)]) * size


def _square(P: np.ndarray, e: np.ndarray) -> np.ndarray:
    return np.maximum(np.einsum("...i,...ij,...j->...", e, P, e), 0.0)
