"""Where the sensors of a drive sit: `[mounting]` of a drive file, and its log as if they all sat at the centre of gravity."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydantic import ValidationInfo, model_validator

from estimators.arrays import FloatArray
from estimators.errors import EstimatorError
from estimators.pipeline.mounted_unit import RATE_LAG, USUAL_PULL, USUAL_RATE, held_turning, repeating
from estimators.signals.mounting import Mounting, UnitAxes, lever_acceleration, lever_velocity
from studies.drives import quantities as si
from synthesis.toml_file import StrictTable

PULLS, RATES = ("ax", "ay", "az"), ("roll_rate", "pitch_rate", "yaw_rate")
_ARMS = {"x": ("yaw_rate",), "y": ("yaw_rate",), "z": ("roll_rate", "pitch_rate")}
"""Without one of these signals a lever arm along an axis changes nothing."""


class Place(StrictTable):
    """One unit: lever arm from the centre of gravity (x ahead, y to the left, z above) and angles against the car.

    Right-handed rotations (ISO 8855): roll with the left side of the unit up, pitch with its nose down, yaw turned to the left.
    """

    x: si.Place = 0.0
    y: si.Place = 0.0
    z: si.Place = 0.0
    roll: si.Angle = 0.0
    pitch: si.Angle = 0.0
    yaw: si.Angle = 0.0

    @property
    def mounting(self) -> Mounting:
        """For the estimators."""
        return Mounting(self.x, self.y, self.z, self.roll, self.pitch, self.yaw)

    @model_validator(mode="after")
    def _possible(self, _info: ValidationInfo) -> Place:
        _ = self.mounting
        return self


class Mountings(StrictTable):
    """``inertial``: the unit that measures ax, ay, az and the three rates. ``reference``: what measures reference.vx and vy."""

    inertial: Place = Place()
    reference: Place = Place()


def check_mountings(given: Mountings, signals: Mapping[str, object], reference: Mapping[str, object]) -> None:
    """Every lever arm and angle has the signals that it needs. Raises ValueError, one line, naming the first that lacks one."""
    for name, place in (("inertial", given.inertial), ("reference", given.reference)):
        for axis, rates in _ARMS.items():
            there = {*signals, *(("yaw_rate",) if name == "reference" and "yaw_rate" in reference else ())}
            if getattr(place, axis) and not there & set(rates):
                raise ValueError(
                    f"mounting.{name}.{axis}: a lever arm along {axis} does nothing without signals.{' or '.join(rates)}; "
                    "add it, or leave the arm out"
                )
    turn = given.reference
    if turn.yaw and not {"vx", "vy"} <= reference.keys():
        raise ValueError("mounting.reference.yaw: turns reference.vx and reference.vy into each other; give both")
    try:
        _axes(given.inertial.mounting, PULLS, signals, USUAL_PULL)
        _axes(given.inertial.mounting, RATES, signals, USUAL_RATE)
        _axes(turn.mounting, ("vx", "vy", "vz"), reference, USUAL_RATE)
    except EstimatorError as error:
        raise ValueError(str(error)) from error


def centred_signals(signals: Mapping[str, FloatArray], place: Place, sample_time: float) -> dict[str, FloatArray]:
    """The inertial signals (n,) of a unit at ``place`` as those of one at the centre of gravity, along the axes of the car.

    The same numbers, sample by sample, as `estimators.MountedUnit` on the target; other signals as they are.
    """
    mounting, out = place.mounting, dict(signals)
    if not (mounting.turned or mounting.away):
        return out
    pull = _turned(mounting, PULLS, signals, USUAL_PULL)
    rate = _turned(mounting, RATES, signals, USUAL_RATE)
    if mounting.away:
        pull -= lever_acceleration(mounting.lever, *held_turning(rate, sample_time, RATE_LAG))
    moved = _repeated(np.concatenate([pull, rate], axis=1), signals, mounting)
    both = dict(zip((*PULLS, *RATES), moved.T, strict=True))
    return out | {name: value for name, value in both.items() if name in signals}


def centred_reference(
    reference: Mapping[str, FloatArray], signals: Mapping[str, FloatArray], place: Place
) -> dict[str, FloatArray]:
    """V_x, V_y (n,) measured at ``place`` (an antenna, an optical sensor) as those of the centre of gravity: R V - w x l.

    w: reference.yaw_rate if it is there, else the ``signals`` of the car. Missing where a rate is that it needs.
    """
    mounting, out = place.mounting, dict(reference)
    if not (mounting.turned or mounting.away) or "vx" not in reference:
        return out
    velocity = _turned(mounting, ("vx", "vy", "vz"), reference, USUAL_RATE)
    nothing = np.zeros(len(velocity))
    rates = [signals.get(name, nothing) for name in RATES]
    rates[2] = reference.get("yaw_rate", rates[2])
    arms = lever_velocity(mounting.lever, np.stack(rates, axis=1)) if mounting.away else np.zeros_like(velocity)
    moved = dict(zip(("vx", "vy"), (velocity - arms).T[:2], strict=True))
    return out | {name: value for name, value in moved.items() if name in reference}


def _axes(
    mounting: Mounting, names: tuple[str, ...], given: Mapping[str, object], usual: tuple[float, ...]
) -> UnitAxes:
    return UnitAxes(mounting, tuple(name in given for name in names), usual)


def _turned(
    mounting: Mounting, names: tuple[str, ...], signals: Mapping[str, FloatArray], usual: tuple[float, ...]
) -> FloatArray:
    """(n, 3) in axes of the car."""
    nothing = np.zeros(len(next(iter(signals.values()))))
    raw = np.stack([signals.get(name, nothing) for name in names], axis=1)
    return _axes(mounting, names, signals, usual)(raw, _last(raw, np.array(usual)))


def _repeated(moved: FloatArray, signals: Mapping[str, FloatArray], mounting: Mounting) -> FloatArray:
    """``moved`` (n, 6), each held at its predecessor where the readings that it consists of repeat theirs."""
    names = (*PULLS, *RATES)
    raw = np.stack([signals.get(name, np.zeros(len(moved))) for name in names], axis=1)
    repeats = np.zeros(raw.shape, dtype=np.bool_)
    repeats[1:] = raw[1:] == _last(raw, np.full(6, np.nan))[:-1]
    pulls, rates = _axes(mounting, PULLS, signals, USUAL_PULL), _axes(mounting, RATES, signals, USUAL_RATE)
    old = repeating((pulls, rates), repeats & np.array([name in signals for name in names])) & np.isfinite(moved)
    old[1:] &= np.isfinite(moved[:-1])
    rows = np.maximum.accumulate(np.where(old, 0, np.arange(len(moved))[:, None]), axis=0)
    return np.take_along_axis(moved, rows, axis=0)


def _last(raw: FloatArray, start: FloatArray) -> FloatArray:
    """The last known value (n, 3) of each column, ``start`` before the first."""
    rows = np.where(np.isfinite(raw), np.arange(len(raw))[:, None], -1)
    found = np.maximum.accumulate(rows, axis=0)
    return np.where(found >= 0, np.take_along_axis(raw, np.maximum(found, 0), axis=0), start)
