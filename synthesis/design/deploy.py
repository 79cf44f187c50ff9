"""From gains to the table that is deployed: breakpoints, rounding, and P solved for again with that table fixed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display, counted
from estimators.schedule.check import HIGHEST_ORDER
from synthesis.certificate.claims import Claim, ClaimChannel, claim_unit
from synthesis.certificate.frozen import slowest_decay
from synthesis.certificate.levels import feedback_claims, held_claims, sampled, sampled_claims
from synthesis.certificate.rounding import significant
from synthesis.certificate.search import Search, Wish
from synthesis.certificate.verify import Names
from synthesis.design.cut_table import tabulated_places, with_borders
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.feedback_channel import FeedbackChannel, feedback_names
from synthesis.design.hinf_observer import Channel, ObserverGains
from synthesis.design.law_table import (
    Gains,
    deployed_loop,
    extra_digits,
    refuse_beyond_limits,
    table_at,
    update_of,
    update_section,
)
from synthesis.design.norms import CLAIMED
from synthesis.design.pole_regions import PoleRegions
from synthesis.design.well_posedness import well_posedness
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.observer import ObserverLoop
from synthesis.models.lpv import LpvModel
from synthesis.one_thread import one_thread
from synthesis.polynomials.half_spaces import faces_of

SEGMENTS = (7, 14, 28, 56, 112)
MOST_PARAMETERS = 3  # of a proof: polynomials of order 8 in more of them have too many terms
MOST_ENTRIES, FINEST = 4000, 64  # breakpoints of a table with several parameters, and segments along one of them
REFINEMENT = 4  # a table is compared with one of so many times its segments
OF_RATIONAL = (0, 1)  # degrees of P more that are tried for a feedback law of a rational plant
TABLE_DIGITS = 4  # of the largest gain of each entry; more would be digits of the solver and not of the guarantee


@dataclass(frozen=True, repr=False)
class Deployment(Display):
    """A table with the claims that are proved for it: `table` (b_1, .., b_p, rows, columns) as stored, `breakpoints` (b_i,) each.

    Of an observer (states, outputs), of a feedback law (its states + inputs, its states + measured signals).
    """

    gains: Gains
    settings: DeploySettings
    breakpoints: tuple[FloatArray, ...]
    table: FloatArray
    claims: tuple[Claim, ...]
    cost: float  # relative loss of the worst gain through tabulation and rounding

    def summary(self) -> tuple[str, ...]:
        """The table over its breakpoints, what it cost, and the claims by kind and level."""
        model = self.gains.model
        over = [f"{p.name} [{p.unit}]" for p in model.parameters]
        units = {claim.kind: "" if claim.channel else claim_unit(claim.kind, None, {}) for claim in self.claims}
        levels = [
            f"{claim.kind} {claim.level:.4g} {units[claim.kind]}".removesuffix(" 1").strip()
            for claim in self.claims[::-1]
        ]
        limit = self.settings.interpolation_cost
        return (
            f"Deployment of '{model.name}'",
            f"table: {self.table.shape} over {', '.join(over) or 'nothing'}, {self.settings.dtype}",
            f"update: {update_of(self.gains)}, every {1e3 * self.settings.sample_time:g} ms",
            f"cost of tabulation: {max(100.0 * self.cost, 0.0):.2f} % of the worst gain, {100.0 * limit:g} % allowed",
            f"{counted(len(self.claims), 'claim')}: {', '.join(levels)}",
        )

    @property
    def loop(self) -> ObserverLoop | FeedbackLoop:
        """The closed loop that was proved."""
        return deployed_loop(self.gains, self.breakpoints, self.table, self.settings.sample_time)


@one_thread
def deploy(
    gains: Gains, settings: DeploySettings | None = None, progress: Callable[[str], None] = lambda _: None
) -> Deployment:
    """Tabulate on the coarsest breakpoints that cost less than the allowed share of every gain, and prove claims.

    Raises ProblemError if the gains are not certified, if the design is ill-posed, if the loop is not stable at this sample time
    although parameters stand still, or if no table is fine enough.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> channels = (Channel(("friction",), ("relative_velocity",), bound=1.05), Channel(("force_noise",), ("relative_velocity",)))
    >>> gains = design_observer(model, ObserverDesign(channels, degree=0, decay_rate=80.0, fastest_pole=600.0))
    >>> deployment = deploy(gains, DeploySettings(sample_time=0.005))
    >>> len(deployment.breakpoints[0]) == len(deployment.table), deployment.cost < 0.01
    (True, True)
    """
    settings = settings or DeploySettings()
    model, design = gains.model, gains.design
    if gains.verdict is not Verdict.CERTIFIED:
        raise ProblemError(f"gains are not certified and are not deployed: {gains.result.message}")
    refuse_undeployable(model)
    observer = gains if isinstance(gains, ObserverGains) else None
    update_section(gains, settings)  # refuses limits of inputs that there are not
    wanted = getattr(gains, "sample_time", None)  # of a sampled design
    if wanted is not None and wanted != settings.sample_time:
        raise ProblemError(f"gains designed for a sample time of {wanted} s are not run at {settings.sample_time} s")
    if observer is not None and observer.update == "held" and observer.design.fastest_pole is None:
        posed = well_posedness(model, observer.design)  # nothing bounds the gains but the channels themselves
        if posed.ill_posed:
            raise ProblemError(f"model '{model.name}' is not deployed: {posed.message}")
    wishes = [Wish(CLAIMED[channel.norm], None, claim_channel(channel)) for channel in design.channels]
    compared = wishes if observer is not None and observer.update == "held" else [sampled(wish) for wish in wishes]
    degrees, allowed = lyapunov_degrees(model, gains), 1.0 + settings.interpolation_cost
    for segments in _candidates(gains, settings):
        progress(f"{' x '.join(map(str, segments))} segments")
        found: list[Deployment] = []
        for degree in degrees:
            search, points, table = _tabulated(gains, segments, settings, settings.dtype, degree)
            fine = tuple(REFINEMENT * number for number in segments)
            finer, _, _ = _tabulated(gains, fine, settings, "float64", degree)
            cost = max(table_cost(search, finer, wish) for wish in compared)
            if not np.isfinite(cost):
                refuse_unstable(gains, finer, settings.sample_time)
            if not cost < settings.interpolation_cost:
                continue
            claims = _claims(gains, search, wishes, settings.settle)
            if claims is not None:
                found.append(Deployment(gains, settings, points, table, claims, cost))
                if len(degrees) > 1 and _claimed(found[-1]) <= allowed * np.prod(
                    [search.frozen_level(w) for w in compared]
                ):
                    break  # no other P is better by more than is allowed
        if found:
            refuse_beyond_limits(gains, found[0].table)
            least = min(_claimed(one) for one in found)
            return next(one for one in found if _claimed(one) <= least * allowed)
    raise ProblemError(
        f"model '{model.name}': no table with up to {' x '.join(map(str, segments))} segments keeps the guarantee within "
        f"{100 * settings.interpolation_cost:g} %; give the design more back-off or a lower degree"
    )


def refuse_undeployable(model: LpvModel) -> None:
    """Raise ProblemError for a model whose tables cannot be proved or stored: known before anything is solved."""
    count = len(model.parameters)
    if not 1 <= count <= MOST_PARAMETERS:
        raise ProblemError(
            f"model '{model.name}' has {count} scheduling parameters; a table that is deployed has 1 to {MOST_PARAMETERS}"
        )
    exact = [piece.exact for piece in model.pieces]
    highest = max(max(m.degrees) for one in exact for m in (*one.matrices.values(), one.denominator))
    if highest > HIGHEST_ORDER:
        raise ProblemError(
            f"model '{model.name}' has a power {highest} of a scheduling parameter over its common denominator; schedule files "
            f"store powers up to {HIGHEST_ORDER}"
        )


def refuse_unstable(gains: Gains, search: Search, sample_time: float) -> None:
    """Raise ProblemError where the update of a fine table grows although parameters stand still: no finer one helps then."""
    decay = slowest_decay(search.loop)
    if not decay < 0.0:
        return
    raise ProblemError(
        f"model '{gains.model.name}': run every {sample_time:g} s the loop is unstable while parameters stand still (it grows by "
        f"{-decay:.3g} 1/s), so that no table helps; give a shorter sample_time, a bound on the fastest pole, more back-off, or "
        "take a sampled design"
    )


def _candidates(gains: Gains, settings: DeploySettings) -> Iterator[tuple[int, ...]]:
    """Segments along every parameter, coarsest first.

    With several parameters an axis is cut until interpolating along it alone costs no more than the allowed share of the
    largest gain, and not finer than tables may be; then all of them are doubled together. An axis along which the gains are
    straight keeps one segment.
    """
    count = len(gains.model.parameters)
    if count == 1:
        yield from ((number,) for number in SEGMENTS)
        return
    wanted = [_along(gains, axis, settings) for axis in range(count)]
    while np.prod([number + 1 for number in wanted]) > MOST_ENTRIES:
        wanted[int(np.argmax(wanted))] //= 2
    segments = tuple(wanted)
    while np.prod([number + 1 for number in segments]) <= MOST_ENTRIES:
        yield segments
        segments = tuple(2 * number for number in segments)


def _along(gains: Gains, axis: int, settings: DeploySettings) -> int:
    """The least number of segments, a power of two, that interpolates well along one parameter, the others at both ends."""
    parameters = gains.model.parameters
    others, faces = [np.array([p.minimum, p.maximum]) for p in parameters], faces_of(gains.model.half_spaces)
    others[axis] = np.linspace(parameters[axis].minimum, parameters[axis].maximum, FINEST + 1)
    grid = np.stack(np.meshgrid(*others, indexing="ij"), axis=-1)
    found, share = table_at(gains, grid.reshape(-1, len(parameters)), settings.sample_time), settings.interpolation_cost
    values = np.moveaxis(found.reshape(*grid.shape[:-1], -1), axis, 0).reshape(FINEST + 1, -1, found[0].size)
    seen = np.ones(values.shape[:2], dtype=np.bool_)
    if faces is not None:  # what interpolation makes of gains outside the set is of no interest
        seen = faces.inside(gains.model.scaled(grid.reshape(-1, len(parameters)))).reshape(grid.shape[:-1])
        seen = np.moveaxis(seen, axis, 0).reshape(values.shape[:2])
    size = np.abs(values).max(axis=(0, 1), where=seen[..., None], initial=0.0) + np.finfo(float).tiny
    for segments in (1, 2, 4, 8, 16, 32):
        weights = np.linspace(0.0, segments, FINEST + 1)
        low = np.minimum(weights.astype(int), segments - 1)
        knots, rest = values[:: FINEST // segments], (weights - low)[:, None, None]
        off = np.abs(knots[low] * (1 - rest) + knots[low + 1] * rest - values)
        if (off.max(axis=(0, 1), where=seen[..., None], initial=0.0) <= share * size).all():
            return segments
    return FINEST


def table_cost(coarse: Search, fine: Search, wish: Wish) -> float:
    """Relative loss of one gain by the coarser table; infinite if it has none."""
    least, best = coarse.least_gain(wish), fine.least_gain(wish)
    return least / best - 1.0 if np.isfinite(least) and np.isfinite(best) else np.inf


def _claims(gains: Gains, search: Search, wishes: Sequence[Wish], settle: float) -> tuple[Claim, ...] | None:
    """What is claimed of a table, by how it is run; None if something of it cannot be proved."""
    regions = getattr(gains.design, "regions", PoleRegions())
    of_update = [Wish(kind, level, centre=centre) for kind, level, centre in regions.of_update]
    if not isinstance(gains, ObserverGains):
        # A copy of weights has their own poles, and sampling moves those of a design in continuous time.
        designed = getattr(gains, "sample_time", None) is not None and not gains.order
        return feedback_claims(search, wishes, settle, of_update, widened=not designed)
    if gains.update == "held":
        return held_claims(
            search, wishes, gains.design.decay_rate, gains.design.fastest_pole, settle, gains.design.regions.claims
        )
    return sampled_claims(search, wishes, settle, of_update)


def claim_channel(channel: Channel | FeedbackChannel) -> ClaimChannel:
    """A channel of the design as claims name it."""
    if isinstance(channel, FeedbackChannel):
        return channel.claim
    sizes = channel.weights or (1.0,) * len(channel.disturbances)
    return ClaimChannel(dict(zip(channel.disturbances, sizes, strict=True)), channel.errors)


def tabulate(
    gains: Gains, segments: int | tuple[int, ...], dtype: str, sample_time: float
) -> tuple[tuple[FloatArray, ...], FloatArray]:
    """Equidistant breakpoints of every parameter and gains there, rounded to a few digits and to the type that stores them."""
    parameters = gains.model.parameters
    numbers = (segments,) * len(parameters) if isinstance(segments, int) else segments
    lines = tuple(
        with_borders(np.linspace(p.minimum, p.maximum, n + 1), borders)
        for p, n, borders in zip(parameters, numbers, gains.model.cells.lines, strict=True)
    )
    points = tabulated_places(gains.model, lines)
    table, digits = table_at(gains, points, sample_time), TABLE_DIGITS + extra_digits(gains)
    largest = np.abs(table).max(axis=0)
    rounded = np.empty_like(table)
    for place, value in np.ndenumerate(table):
        rounded[place] = significant(float(value), float(largest[place[1:]]), digits)
    return lines, rounded.reshape(*map(len, lines), *table.shape[1:]).astype(dtype).astype(np.float64)


def names_of(model: LpvModel) -> Names:
    """The signals of an observer's error: states and disturbances in order."""
    return Names(tuple(s.name for s in model.states), tuple(d.name for d in model.disturbances))


def _tabulated(
    gains: Gains, segments: tuple[int, ...], settings: DeploySettings, dtype: str, degree: tuple[int, ...]
) -> tuple[Search, tuple[FloatArray, ...], FloatArray]:
    model, design = gains.model, gains.design
    points, table = tabulate(gains, segments, dtype, settings.sample_time)
    names = names_of(model) if isinstance(gains, ObserverGains) else feedback_names(model)
    loop = deployed_loop(gains, points, table, settings.sample_time)
    return (
        Search(loop, names, model.parameters, degree, design.settings),
        points,
        table,
    )


def lyapunov_degrees(model: LpvModel, gains: Gains) -> list[tuple[int, ...]]:
    """Degrees of P in the claims for each parameter: those of the gains, at least one; none in a parameter that may jump.

    A law whose own P is rational in the parameters says by `rational` how many degrees more come close to it. What is best for
    a law of a rational plant is tried: its P hardly moves, or follows a quotient.
    """
    own = int(getattr(gains, "rational", 0))
    quotient = not isinstance(gains, ObserverGains) and not all(
        piece.polynomial.is_polynomial for piece in model.pieces
    )
    tried = (
        tuple(0 if p.may_jump else max(gains.design.degree, 1) + more for p in model.parameters)
        for more in (OF_RATIONAL if quotient else (own,))
    )
    return list(dict.fromkeys(tried))


def _claimed(deployment: Deployment) -> float:
    """The product of the levels that are claimed for channels."""
    return float(np.prod([claim.level for claim in deployment.claims if claim.channel is not None]))
