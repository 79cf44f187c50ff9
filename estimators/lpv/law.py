r"""One sample of a feedback law for entries (n, ..): command, limits, conditioning, and the state that starts without a bump.

    u = clip(Ck xk + Dk v),    xk := xk + Ck^+ (u - Ck xk - Dk v),    xk+ = Ak xk + Bk (v + D (u - u before))

Ck^+ is the pseudo-inverse: the state moves no further than it must to command what is applied.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import ScheduleError
from estimators.interpolate import Multilinear, PiecewiseLinear
from estimators.schedule import GainSchedule

_LARGEST = 1e50  # of gains and D: their products meet signals of up to 1e100 (arguments.LIMIT)
_FIRST = 1e6  # by how much more the command counts than rest, before it is met exactly
_RANK = 1e-9  # of the largest singular value: what is smaller moves no command


class Law:
    """Table, limits and D of a schedule; `rest` (nu,) the commands nearest to zero that the limits allow."""

    def __init__(self, schedule: GainSchedule) -> None:
        self.order, self.states = schedule.order, schedule.measured == "states"
        nu = len(schedule.inputs)
        limits = schedule.limits or (None,) * nu
        self.low: FloatArray = np.array([-np.inf if pair is None else pair[0] for pair in limits])
        self.high: FloatArray = np.array([np.inf if pair is None else pair[1] for pair in limits])
        self.rest: FloatArray = np.clip(np.zeros(nu), self.low, self.high)
        self.measured = len(schedule.states if self.states else schedule.outputs)
        self.several = len(schedule.parameters) > 1
        table = schedule.table
        if self.several:
            self.gains: Multilinear | PiecewiseLinear = Multilinear(schedule.grid, table)
        else:
            self.gains = PiecewiseLinear(schedule.breakpoints, table.reshape(len(table), -1))
        self.shape = table.shape[-2:]
        # Signals that no gain uses, such as outputs that only weigh in a design: nobody measures them.
        idle: BoolArray = ~np.asarray(table.reshape(-1, table.shape[-1]).any(axis=0))[self.order :]
        self.idle: BoolArray | None = idle if idle.any() and not idle.all() else None
        through = schedule.plant["D"]
        self.through = None if self.states or not self.order or not through.largest.any() else through
        if not max(np.abs(table).max(initial=0.0), through.largest.sum(initial=0.0)) <= _LARGEST:
            raise ScheduleError(
                f"schedule '{schedule.name}': gains or D beyond {_LARGEST:g} overflow float64; check units"
            )

    def matrices(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Ak (n, nk, nk), Bk (n, nk, nv), Ck (n, nu, nk), Dk (n, nu, nv)."""
        if isinstance(self.gains, Multilinear):
            K = self.gains(parameters).reshape(len(parameters), *self.shape)
        else:
            K = self.gains(np.ascontiguousarray(parameters[:, 0])).T.reshape(len(parameters), *self.shape)
        k = self.order
        return K[:, :k, :k], K[:, :k, k:], K[:, k:, :k], K[:, k:, k:]

    def used(self, measured: FloatArray) -> FloatArray:
        """Measurements (n, nv) with zeros in the place of what no gain uses, whatever stood there."""
        return measured if self.idle is None else np.asarray(np.where(self.idle, 0.0, measured))

    def advance(
        self, state: FloatArray, before: FloatArray, measured: FloatArray, parameters: FloatArray
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """The state after the sample, its commands, and where a limit changed them."""
        Ak, Bk, Ck, Dk = self.matrices(parameters)
        free = _times(Dk, measured)
        if self.order:
            free = free + _times(Ck, state)
        command = np.clip(free, self.low, self.high)
        limited: BoolArray = np.asarray(command != free) & np.isfinite(free)
        if not self.order:
            return state, command, limited
        cut = limited.any(axis=1)
        if cut.any():
            state = state.copy()
            state[cut] += _times(np.linalg.pinv(Ck[cut], rcond=_RANK), (command - free)[cut])
        if self.through is not None:
            D = self.through.at(parameters if self.several else parameters[:, 0])
            measured = measured + _times(D, command - before)
        return _times(Ak, state) + _times(Bk, measured), command, limited

    def starting(self, command: FloatArray, measured: FloatArray, parameters: FloatArray) -> FloatArray:
        """States with Ck xk + Dk v = u of which the next one differs least: min |(I - Ak) xk - Bk v|."""
        if not self.order:
            return np.zeros((len(command), 0))
        Ak, Bk, Ck, Dk = self.matrices(parameters)
        wanted = command - _times(Dk, measured)
        size = _FIRST * (1.0 + np.abs(Ak).max(initial=0.0)) / max(np.abs(Ck).max(initial=0.0), 1e-300)
        rows = np.concatenate([size * Ck, np.eye(self.order) - Ak], axis=1)
        state = _times(np.linalg.pinv(rows, rcond=1e-15), np.concatenate([size * wanted, _times(Bk, measured)], axis=1))
        missing = wanted - _times(Ck, state)
        return state + _times(np.linalg.pinv(Ck, rcond=_RANK), missing)


def _times(matrix: Any, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
