"""What a sweep looks at: an observer with its plant, its gains and its sample time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np

from analysis.drops.modes import DropModes, DropPolicy, runtime_drop_modes
from analysis.errors import AnalysisError
from analysis.markov.second_moment import spectral_radius
from analysis.norms.hinf import stability_margin
from analysis.norms.observer_error import checked_gain
from analysis.norms.planar import planar_margin
from analysis.perturbed import Matrices
from analysis.planar_exponential import planar_exponential
from estimators.arrays import FloatArray
from estimators.errors import unknown
from estimators.interpolate import PiecewiseLinear
from estimators.schedule import Update
from estimators.schedule.gain_signals import quotient
from studies.spec import ScheduleSpec
from studies.sweeps.plant import Grid, Parameter, Plant, model_plant
from synthesis.errors import SpecError
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Signal

ROUNDING = 1e-12  # relative: what a constant may differ by without being another


@dataclass(frozen=True, eq=False)
class Gains:
    """A gain table (b, nx, ny) over `breakpoints` (b,) of the one scheduling parameter, or one constant gain: b = 0, (1, ...)."""

    table: FloatArray
    breakpoints: FloatArray = field(default_factory=lambda: np.empty(0))

    @property
    def constant(self) -> bool:
        """Whether the gain does not follow the parameter."""
        return not len(self.breakpoints)

    def on(self, grid: Grid) -> FloatArray:
        """L (g, nx, ny), linear between breakpoints as at run time."""
        if self.constant:
            return np.repeat(self.table, len(grid), axis=0)
        found = PiecewiseLinear(self.breakpoints, self.table.reshape(len(self.table), -1))(grid.points[:, 0].copy())
        return np.ascontiguousarray(found.T).reshape(len(grid), *self.table.shape[1:])


@dataclass(frozen=True, eq=False)
class Observer:
    """An observer of a plant with sample time `sample_time` in s, running one `update` of `estimators.velocity.exact_update`.

    "held" is x^' = A x^ + B u + L (y - C x^ - D u) with y held over a sample; the gains K of "sampled" correct once a sample.

    A perturbed design changes plant and observer model alike and keeps the gains (P3 section IV): the question is what gains
    designed for one tire are worth on another. `origin` says where the gains come from, for messages; `specification` is what
    they were designed from, for measures that design again; `proved_for` holds the constants of their certificate.
    """

    name: str
    plant: Plant
    gains: Gains
    sample_time: float
    origin: str = "gain"
    specification: ScheduleSpec | None = None
    proved_for: Mapping[str, float] | None = None
    update: Update = "held"

    def unproved(self) -> list[str]:
        """The constants that are not those which the schedule's certificate speaks of, each in words."""
        found = []
        for name, value in (self.proved_for or {}).items():
            p = self.plant.parameters.get(name)
            if p is not None and abs(p.nominal - value) > ROUNDING * max(abs(p.nominal), abs(value)):
                found.append(f"{name} is {p.nominal:.6g} {p.unit}, {self.origin} was proved for {value:.6g} {p.unit}")
        return found

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """All that can be varied, by name: parameters of the plant, and entries of the gain or factors on them."""
        found = dict(self.plant.parameters)
        for i, j, state, output, suffix in self._gain_entries():
            if self.gains.constant:
                unit = quotient(state.unit, self.update == "held", output.unit)
                found[f"gain_{suffix}"] = Parameter(f"gain_{suffix}", unit, float(self.gains.table[0, i, j]), "gain")
            found[f"gain_factor_{suffix}"] = Parameter(f"gain_factor_{suffix}", "1", 1.0, "gain factor")
        return found

    def _gain_entries(self) -> Iterator[tuple[int, int, Signal, Signal, str]]:
        """Row, column, state, output and name of every entry of the gain."""
        outputs = self.plant.outputs
        for (i, state), (j, output) in product(enumerate(self.plant.states), enumerate(outputs)):
            yield i, j, state, output, state.name if len(outputs) == 1 else f"{state.name}_{output.name}"

    def require_error_equation(self) -> None:
        """Raises SpecError where there is no error equation e' = (A - L C) e, so no norm of it."""
        if self.update != "held":
            raise SpecError(
                f"subject '{self.name}': its gains correct once a sample (update '{self.update}'): it has no error equation in "
                "continuous time; use sampled_radius, second_moment_radius or critical_drop_probability"
            )

    def grid(self, points: int, bounds: Mapping[str, tuple[float, float]] | None = None) -> Grid:
        """Every combination of `points` values of each scheduling parameter, over its range or narrower `bounds`."""
        axes, box = [], self.plant.box
        known = [p.name for p in box]
        for name in bounds or {}:
            if name not in known:
                raise SpecError(f"subject '{self.name}': {unknown('scheduling parameter', name, known)}")
        for p in box:
            low, high = (bounds or {}).get(p.name, (p.minimum, p.maximum))
            if not p.minimum <= low < high <= p.maximum:
                raise SpecError(
                    f"subject '{self.name}': grid of {p.name} [{low:g}, {high:g}] {p.unit} is empty, reversed or outside "
                    f"[{p.minimum:g}, {p.maximum:g}] {p.unit}"
                )
            axes.append(np.linspace(low, high, points))
        mesh = np.meshgrid(*axes, indexing="ij")
        values = np.stack([m.ravel() for m in mesh], axis=1) if axes else np.empty((1, 0))
        return Grid(tuple(known), tuple(p.unit for p in box), values)

    def at(self, columns: Mapping[str, FloatArray], grid: Grid) -> Batch:
        """The designs of some columns (n,). Raises AnalysisError if one of them makes the model invalid."""
        own = {name: column for name, column in columns.items() if name in self.plant.parameters}
        for name, column in own.items():
            p = self.plant.parameters[name]
            bad = ~np.isfinite(column) | ((np.sign(column) != np.sign(p.nominal)) & (p.nominal != 0.0))
            if bad.any():
                words = f"has not the sign of its nominal value {p.nominal:.6g} {p.unit}"
                raise AnalysisError(f"{name} = {column[bad][0]:.6g} {p.unit} {words}")
        count = max((len(column) for column in columns.values()), default=1)
        return Batch(self, grid, dict(columns), count, self.plant.at(own, grid), self._gains(columns, grid))

    def _gains(self, columns: Mapping[str, FloatArray], grid: Grid) -> FloatArray:
        """L over (n or 1, g)."""
        chosen = [name for name in columns if name.startswith("gain_") and name in self.parameters]
        L = self.gains.on(grid)[None]
        if not chosen:
            return L
        L = np.repeat(L, len(columns[chosen[0]]), axis=0)
        for i, j, _, _, suffix in self._gain_entries():
            if f"gain_{suffix}" in chosen:
                L[:, :, i, j] = columns[f"gain_{suffix}"][:, None]
            if f"gain_factor_{suffix}" in chosen:
                L[:, :, i, j] *= columns[f"gain_factor_{suffix}"][:, None]
        return L


@dataclass(frozen=True, eq=False)
class Batch:
    """Some designs of an observer on its grid: what a measure is given.

    `columns` hold the parameter values (n,) by name; `matrices` and `gain` have the leading axes (n or 1, g). What several
    measures need is made once.
    """

    observer: Observer
    grid: Grid
    columns: dict[str, FloatArray]
    count: int
    matrices: Matrices
    gain: FloatArray

    @cached_property
    def error(self) -> tuple[FloatArray, FloatArray]:
        """A_e = A - L C (n, g, nx, nx) and B_e = E - L F (n, g, nx, nd). Raises SpecError for the update "sampled"."""
        self.observer.require_error_equation()
        A_e, B_e = self.matrices.error_dynamics(self.gain)
        return self._whole(A_e), self._whole(B_e)

    @cached_property
    def margin(self) -> FloatArray:
        """Growth of the error in 1/s (n, g): max Re lambda(A_e), or log(radius of a received sample)/T, which is the same."""
        if self.observer.update == "sampled":
            with np.errstate(divide="ignore"):  # deadbeat: -inf
                return np.asarray(np.log(spectral_radius(self.coast.received)) / self.observer.sample_time)
        A_e = self.error[0]
        return planar_margin(A_e) if A_e.shape[-1] == 2 else stability_margin(A_e)

    @cached_property
    def coast(self) -> DropModes:
        """What the runtime does with a dropped and with a received sample: e^{A T}, and e^{A_e T} or e^{A T} - K C."""
        if self.matrices.A.shape[-1] != 2:
            return self.modes("coast")
        T = self.observer.sample_time
        dropped = planar_exponential(self._whole(self.matrices.A) * T)
        if self.observer.update == "sampled":
            return DropModes(dropped, dropped - self.gain @ self.matrices.C, "coast")
        return DropModes(dropped, planar_exponential(self.error[0] * T), "coast")

    def modes(self, policy: DropPolicy) -> DropModes:
        """Both updates for any drop policy."""
        A, C, L = (self._whole(M) for M in (self.matrices.A, self.matrices.C, self.gain))
        return runtime_drop_modes(A, C, L, self.observer.sample_time, policy, self.observer.update)

    def _whole(self, array: FloatArray) -> FloatArray:
        return np.broadcast_to(array, (self.count, len(self.grid), *array.shape[2:]))


def model_observer(
    name: str,
    model: LpvModel,
    gain: FloatArray,
    sample_time: float,
    breakpoints: FloatArray | None = None,
    specification: ScheduleSpec | None = None,
) -> Observer:
    """An observer of any LpvModel: a constant gain (nx, ny), or a table (b, nx, ny) over `breakpoints` of its one parameter.

    >>> import numpy as np
    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> model_observer("printed gains", model, np.array([[0.68], [183.1]]), sample_time=0.005).name
    'printed gains'
    """
    table, where = checked_gain(model, gain), f"subject '{name}'"
    places = np.empty(0) if breakpoints is None else np.asarray(breakpoints, float)
    if table.shape[0] != len(places) if table.ndim == 3 else len(places):
        raise SpecError(f"{where}: a gain {table.shape} does not fit {len(places)} breakpoints")
    if len(places) and (len(model.parameters) != 1 or not (np.diff(places) > 0.0).all() or len(places) < 2):
        raise SpecError(f"{where}: a table needs one scheduling parameter and two or more ascending breakpoints")
    if not 0.0 < sample_time < 1.0:
        raise SpecError(f"{where}: sample_time = {sample_time:g} s must lie between 0 and 1 s")
    whole = table if table.ndim == 3 else table[None]
    return Observer(name, model_plant(model), Gains(whole, places), sample_time, "the gain", specification)
