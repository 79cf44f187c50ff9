"""Which flags and cross-checks a drive raised, when, and what each of them means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from estimators import Flag
from estimators.arrays import BoolArray, FloatArray, IntArray
from estimators.faults import DRIVING
from estimators.pipeline import Check
from studies.drives.evaluation import DriveData
from studies.drives.quantities import CORNERS

FLAGS: Mapping[Flag, str] = {
    Flag.MISSING_MEASUREMENT: "a measurement is missing: the estimate coasts on the kinematics",
    Flag.STALE_MEASUREMENT: "a measurement repeats for too long: the estimate coasts",
    Flag.MISSING_INPUT: "an input is missing: held at its last value",
    Flag.MISSING_PARAMETER: "a scheduling parameter is missing: held at its last value",
    Flag.PARAMETER_OUT_OF_RANGE: "a scheduling parameter is outside the certified range: clipped to it",
    Flag.RATE_OUT_OF_RANGE: "a scheduling parameter moves faster than certified: used, without the guarantee",
    Flag.RESET: "the state was set anew",
    Flag.WHEEL_STOPPED: "a wheel does not turn though the car moves: locked, or its sensor is dead",
    Flag.HIGH_SLIP: "a wheel slips too much to tell the speed: not used",
    Flag.GATED: "a signal is further from the estimate than its model explains: not used",
    Flag.STANDING: "the car stands: speeds and yaw rate are zero",
    Flag.NOT_EXCITED: "nothing excites a learned parameter: it keeps its value",
}
CHECKS: Mapping[Check, str] = {
    Check.FORCE_BALANCE: "forces along the car and m a_x stay apart: torque scale, brake temperature, grade or mass",
    Check.LATERAL_BALANCE: "side forces and m a_y stay apart",
    Check.LOAD_SUM: "wheel loads do not sum to m a_z: the car flies, or a load part is wrong",
    Check.CORNERS_DISAGREE: "fusion and corner observers disagree about the speed",
    Check.NO_WHEEL: "no wheel supports the speed: it is integrated acceleration",
    Check.UNKNOWN_FORCE: "a wheel's force is a share of m a_x, not from its own equation",
    Check.LATE_SAMPLE: "the time since the last sample is not the sample time",
}
SHORTEST = 1e-3  # of a drive: gaps below it are closed in `intervals`, which are for drawing


@dataclass(frozen=True)
class Raised:
    """A flag ``name`` of ``owner`` (pipeline, checks, or the observer of a corner), ``on`` (n,) at the samples of ``time``, s.

    ``usual``: it says what the car does (standing, nothing excited), not what is wrong.
    """

    owner: str
    name: str
    meaning: str
    usual: bool
    time: FloatArray
    on: BoolArray

    @property
    def share(self) -> float:
        """Of the samples, %."""
        return 100.0 * float(self.on.mean())

    @property
    def first(self) -> float:
        """When it rises, s."""
        return float(self.time[int(np.argmax(self.on))])

    @property
    def longest(self) -> float:
        """The longest time that it stays, s."""
        start, stop = self._edges()
        return float((stop - start).max()) * self._step

    @property
    def _step(self) -> float:
        return float(np.median(np.diff(self.time))) if self.time.size > 1 else 0.0

    def _edges(self) -> tuple[IntArray, IntArray]:
        change = np.diff(np.concatenate([[False], self.on, [False]]).astype(np.int8))
        return np.flatnonzero(change == 1), np.flatnonzero(change == -1)

    def intervals(self) -> tuple[FloatArray, FloatArray]:
        """Begin and length of every stretch, s; what is too near to be told apart in a drawing is one."""
        start, stop = self._edges()
        apart = (start[1:] - stop[:-1]) > SHORTEST * self.on.size
        start, stop = start[np.append(True, apart)], stop[np.append(apart, True)]
        return self.time[start], (stop - start) * self._step


def raised(data: DriveData) -> list[Raised]:
    """Everything that rose at least once: of the pipeline, of its cross-checks, of each corner's observer."""
    sources: list[tuple[str, IntArray, Mapping[Flag, str] | Mapping[Check, str]]] = []
    if data.chain is not None:
        sources += [("pipeline", data.chain.flags, FLAGS), ("cross-check", data.chain.checks, CHECKS)]
    if data.replay is not None:
        sources += [(f"observer {corner}", data.replay.flags[:, k], FLAGS) for k, corner in enumerate(CORNERS)]
    return [one for source in sources for one in _of(data.log.time, *source)]


def _of(
    time: FloatArray, owner: str, flags: IntArray, meanings: Mapping[Flag, str] | Mapping[Check, str]
) -> Iterator[Raised]:
    flag: IntFlag
    for flag, meaning in meanings.items():
        on = (flags & flag.value) != 0
        if on.any():
            usual = isinstance(flag, Flag) and bool(flag & DRIVING)
            yield Raised(owner, str(flag.name).lower().replace("_", " "), meaning, usual, time, on)
