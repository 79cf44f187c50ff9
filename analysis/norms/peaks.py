"""Peaks of the gain of stacks of systems over a band: a fast method with its proof, then two slower ones for what it leaves
open."""

from __future__ import annotations

import numpy as np

from analysis.norms.exact_peak import proved_peaks
from analysis.norms.frequency_response import Systems, largest_gain, sigma_max
from analysis.norms.hamiltonian import between, circle, gain_at, near_axis, to_continuous
from analysis.norms.invariants import available, invariants
from analysis.norms.level_proof import level_proof
from analysis.norms.modal import Modal
from analysis.norms.peak_search import climbed, first_guess
from estimators.arrays import BoolArray, FloatArray, IndexArray

ROUNDS = 40
SPREAD = 8.0  # eigenvalues and eigenvectors are those of A + E with |E| below this times eps |A|
TRUSTED = 1e-5  # relative change of the gain by such an E from which on floats are not believed


def modal_peaks(
    systems: Systems, modal: Modal, band: FloatArray, tolerance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Norm, continuous frequency and upper bound (inf: none) over a band (2, g); no pole may lie on the boundary."""
    g = len(systems)
    norm, at, proved = np.zeros(g), np.zeros(g), np.zeros(g, bool)
    good = np.flatnonzero(np.isfinite(modal.spread))
    if len(good) and available(*modal.direct.shape[-2:]):
        _prove(modal, band, tolerance, norm, at, proved, good)
        norm[proved] = gain_on(systems, at, np.flatnonzero(proved))
    with np.errstate(all="ignore"):
        slack = np.where(norm > 0.0, SPREAD * modal.spread / norm, np.inf)
        upper = np.where(proved & (slack < TRUSTED), norm * (1.0 + tolerance) * (1.0 + slack), np.inf)
    rest = np.flatnonzero(~np.isfinite(upper))
    if len(rest):
        norm[rest], at[rest], upper[rest] = hamiltonian_peaks(
            systems.pick(rest), modal.pick(rest), band[:, rest], tolerance
        )
    return norm, at, upper


def gain_on(systems: Systems, at: FloatArray, index: IndexArray) -> FloatArray:
    """Gains of some systems at one continuous frequency each, on the matrices as they were given."""
    point, some = at[index], systems.pick(index)
    endless = ~np.isfinite(point)
    if systems.discrete:
        return largest_gain(some, circle(point)[:, None])[:, 0]
    gain = largest_gain(some, 1j * np.where(endless, 0.0, point)[:, None])[:, 0]
    return np.where(endless, sigma_max(some.D), gain)


def _prove(
    modal: Modal, band: FloatArray, tolerance: float, norm: FloatArray, at: FloatArray, proved: BoolArray, index: IndexArray
) -> None:  # fmt: skip
    """Guess, prove, and climb from what speaks against it, in place, until every level is proved or nothing rises."""
    whole = modal if len(index) == len(norm) else modal.pick(index)
    parts, direct = invariants(whole), sigma_max(whole.direct)
    some = band[:, index]
    gain, where = first_guess(parts, direct, some)
    norm[index], at[index] = gain, where
    rows = np.flatnonzero(gain > 0.0)
    for _ in range(ROUNDS):
        if not len(rows):
            break
        chosen = parts if len(rows) == len(index) else parts.pick(rows)
        done, against = level_proof(chosen, gain[rows] * (1.0 + tolerance), where[rows], some[:, rows])
        proved[index[rows[done]]] = True
        rows, against = rows[~done], against[~done]
        higher, there = climbed(parts.pick(rows), against, some[:, rows])
        raised = higher > gain[rows]
        rows = rows[raised]
        gain[rows], where[rows] = higher[raised], there[raised]
    norm[index], at[index] = gain, where


def hamiltonian_peaks(
    systems: Systems, modal: Modal, band: FloatArray, tolerance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The two-step method with eigenvalues of Hamiltonian matrices, believed where A is well conditioned; else exact
    rationals."""
    g = len(systems)
    norm, at = first_guess(modal, sigma_max(modal.direct), band)
    norm = gain_on(systems, at, np.arange(g))
    for end in band:  # the level test needs both
        found = gain_on(systems, end, np.arange(g))
        norm, at = np.where(found > norm, found, norm), np.where(found > norm, end, at)
    upper, active, continuous = np.full(g, np.inf), np.flatnonzero(norm > 0.0), to_continuous(systems)
    for _ in range(ROUNDS):
        if not len(active):
            break
        level = norm[active] * (1.0 + tolerance)
        upper[active] = level
        try:
            candidates = near_axis(continuous.pick(active), level)
        except np.linalg.LinAlgError:  # a level that is a singular value of D: left to exact rationals
            break
        low, high = band[0, active, None], band[1, active, None]
        candidates = np.sort(np.where((candidates > low) & (candidates < high), candidates, np.nan), axis=-1)
        count = np.isfinite(candidates).sum(axis=-1)
        active, candidates = active[count > 0], candidates[count > 0, : count.max(initial=0)]
        if not len(active):
            break
        tried = between(candidates, band[0, active], band[1, active])
        gain = gain_at(systems.pick(active), tried)
        best = gain.argmax(axis=-1)[:, None]
        peak, where = np.take_along_axis(gain, best, -1)[:, 0], np.take_along_axis(tried, best, -1)[:, 0]
        raised = peak > norm[active]
        norm[active[raised]], at[active[raised]] = peak[raised], where[raised]
        active = active[peak > level[count > 0]]  # a candidate with no gain above the level was none
    upper[active] = np.inf
    with np.errstate(all="ignore"):
        slack = np.where(norm > 0.0, SPREAD * modal.spread / norm, np.inf)
        upper = np.where(slack < TRUSTED, upper * (1.0 + slack), np.inf)
    hard = np.flatnonzero(~np.isfinite(upper))
    if len(hard):
        norm[hard], at[hard], upper[hard] = proved_peaks(
            systems.pick(hard), norm[hard], at[hard], band[:, hard], tolerance
        )
    return norm, at, upper
