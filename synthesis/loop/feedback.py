r"""A feedback law in closed loop with its plant: a table of gains on a grid, multilinear between its breakpoints.

Once a sample (T) the law is worked out from the measurement v (all states, or the outputs y), its input to the plant is held:

    xk+ = Ak(p) xk + Bk(p) v,    u = Ck(p) xk + Dk(p) v,    K(p) = [[Ak, Bk], [Ck, Dk]] the table, (nk + nu, nk + nv)

The plant x' = A x + B u + E d with d held, too, and p at its value of the sample's start, gives with Phi = e^(TA)

    [x; xk]+ = [Phi x + T phi(TA) (B u + E d); Ak xk + Bk v],    phi(M) = int_0^1 e^(M s) ds

In continuous time (`sample_time` None) xk' stands for xk+, and x' = A x + B u + E d for the first line: the law without sampling.
Of a rational plant this loop is over its denominator where states are measured, over its square where outputs are: B Dk C.
Performance outputs are all states of the plant, then its outputs y = C x + D u + F d, then its inputs u.

Where the input acts on an output at once (D), Dk must not use that output: u would depend on itself. Such an output is meant with
the input of its own sample; a runtime that measures before it acts adds D (u - u before). What float64 rounds when the runtime
interpolates the gains (and evaluates D) is inside the balls of these matrices; that it then adds up in float64 leaves an error of
about 1e-16 of the signals, which no claim speaks of.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Literal

from flint import fmpq, fmpq_mat

from synthesis.errors import ProblemError
from synthesis.loop.on_boxes import local, unit
from synthesis.loop.plant import Plant
from synthesis.loop.system import Region, System, Time
from synthesis.loop.tabulated import Tabulated
from synthesis.polynomials import box_exponential
from synthesis.polynomials import exponential as exponentials
from synthesis.polynomials.enclosure import identity
from synthesis.polynomials.stacked import rows, stacked

Measured = Literal["states", "outputs"]
ORDER = 8  # total degree in the local parameters that products of exponentials keep


@dataclass(frozen=True)
class FeedbackLoop(Tabulated):
    """Plant, table of K (nk + nu, nk + nv) by grid indices, what is measured, and the order nk of the law.

    `sample_time` None: the continuous-time loop is meant. With `rounded` the gains are balls that hold what the runtime
    interpolates of them in float64; without it they are exact. Raises ProblemError for a table of another shape, and an algebraic
    loop.
    """

    plant: Plant
    breakpoints: tuple[tuple[fmpq, ...], ...]
    table: Mapping[tuple[int, ...], fmpq_mat]
    measured: Measured = "states"
    order: int = 0
    sample_time: fmpq | None = None
    rounded: bool = True
    _systems: dict[Any, System | None] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        measured = self.plant.states if self.by_states else self.plant.shape("C")[0]
        wanted = self.order + self.inputs, self.order + measured
        if self._gain_shape != wanted:
            raise ProblemError(f"the gains have the shape {self._gain_shape}; this plant and law need {wanted}")
        if not self.by_states:
            self._refuse_algebraic_loop()

    @classmethod
    def constant_gain(
        cls, plant: Plant, gain: fmpq_mat, measured: Measured = "states", sample_time: fmpq | None = None
    ) -> FeedbackLoop:
        """One static gain on the whole range, exact: the table has one cell."""
        corners = list(product(*((0, 1) for _ in plant.axes)))
        ends = tuple((axis.low, axis.high) for axis in plant.axes)
        return cls(plant, ends, dict.fromkeys(corners, gain), measured, sample_time=sample_time, rounded=False)

    @property
    def by_states(self) -> bool:
        """Whether the law measures all states of the plant."""
        return self.measured == "states"

    @property
    def inputs(self) -> int:
        """Number of inputs of the plant."""
        return self.plant.shape("B")[1]

    @property
    def states(self) -> int:
        """Those of the plant, then those of the law."""
        return self.plant.states + self.order

    @property
    def time(self) -> Time:
        """Discrete where the law runs once a sample."""
        return "continuous" if self.sample_time is None else "discrete"

    def system(self, region: Region, time: Time) -> System | None:
        """The closed loop on a region (of one cell of the table); None where the exponential is too large to be enclosed.

        None, too, where a denominator is not certainly positive. Raises ProblemError for the other time.
        """
        self._refuse_other(time)
        box = (region.offset[: region.parameters], region.factor[: region.parameters])
        if box not in self._systems:
            plant = self.plant_on(region, "ABCDEF", self.sample_time is not None)
            below = None if self.sample_time is not None or self._below is None else region.local(self._below)
            eyes = [identity(size, 2 * region.parameters) for size in (self.plant.states, self.order)]
            self._systems[box] = (
                None if plant is None else self._closed(plant, self.gain(region), eyes, below, exponentials)
            )
        return self._systems[box]

    def on_boxes(self, time: Time, cells: Sequence[Region]) -> System | None:
        """`system` on many regions at once, every matrix `Boxes`; None where they are too many or too large for that."""
        self._refuse_other(time)
        found = self._at_once(cells, "ABCDEF", self.sample_time is not None)
        if found is None:
            return None
        plant, gain = found
        below = None if self.sample_time is not None or self._below is None else local(self._below, cells)
        eyes = [unit(size, self.plant.axes) for size in (self.plant.states, self.order)]
        return self._closed(plant, gain, eyes, below, box_exponential)

    def _closed(self, plant: dict[str, Any], gain: Any, eyes: list[Any], below: Any, ring: Any) -> System | None:
        """The loop from its parts; `eyes` of plant and law, `ring` knows phi and the exponential of its matrices."""
        n, nk, nu = self.plant.states, self.order, self.inputs
        ny, nd = plant["C"].shape[0], plant["E"].shape[1]
        free, forced = plant["A"], {key: plant[key] for key in "BE"}
        if self.sample_time is not None:
            TA = plant["A"] * self.sample_time
            integral = ring.phi(TA)
            if integral is None:
                return None
            free = ring.exponential(TA, integral)
            forced = {key: (integral @ plant[key]).truncated(ORDER) * self.sample_time for key in "BE"}
        wide, nv, (eye, memory) = (n, nk), n if self.by_states else ny, eyes

        def over(matrix: Any) -> Any:
            return matrix if below is None else matrix.scaled_by(below)

        def once(matrix: Any) -> Any:  # outputs, and u from them, are over the denominator
            return matrix if self.by_states else over(matrix)

        seen, noise = (eye, plant["E"] * 0) if self.by_states else (plant["C"], plant["F"])
        # What the law measures, but for the inputs of this sample: Dk uses no output that they act on.
        measured = stacked([[None, once(memory)], [seen, None]], (nk, nv), wide)
        disturbed = stacked([[None], [noise]], (nk, nv), (nd,))
        acting = rows(gain, nk, nk + nu)
        u, of_d = (acting @ measured).truncated(ORDER), (acting @ disturbed).truncated(ORDER)
        y = once(stacked([[plant["C"], None]], (ny,), wide)) + (plant["D"] @ u).truncated(ORDER)
        y_of_d = once(plant["F"]) + (plant["D"] @ of_d).truncated(ORDER)
        moved = once(stacked([[free, None]], (n,), wide)) + (forced["B"] @ u).truncated(ORDER)
        driven = once(forced["E"]) + (forced["B"] @ of_d).truncated(ORDER)
        if nk:
            measured, disturbed = over(measured), over(disturbed)
            if not self.by_states:
                measured = stacked([[rows(measured, 0, nk)], [y]], (nk, nv), (n + nk,))
                disturbed = stacked([[None], [y_of_d]], (nk, nv), (nd,))
            kept = rows(gain, 0, nk)
            moved = stacked([[moved], [(kept @ measured).truncated(ORDER)]], (n, nk), (n + nk,))
            driven = stacked([[driven], [(kept @ disturbed).truncated(ORDER)]], (n, nk), (nd,))
        x = stacked([[eye, None]], (n,), wide)
        x, u, of_d = once(over(x)), over(u), over(of_d)  # y is there already, as x' is
        below = None if below is None else once(below)
        heights = (n, ny, nu)
        C = stacked([[x], [y], [u]], heights, (n + nk,))
        D = stacked([[None], [y_of_d], [of_d]], heights, (nd,))
        return System(
            self.time, moved, {"disturbances": driven}, C, {"disturbances": D}, None, below, below is not None
        )

    def _refuse_other(self, time: Time) -> None:
        if time != self.time:
            raise ProblemError(f"a {self.time}-time feedback loop makes no claims about {time} time")

    def _refuse_algebraic_loop(self) -> None:
        nk, through = self.order, [m for *_, piece in self.plant.cells for m in piece.matrices["D"].terms.values()]
        acted = {i for m in through for i in range(m.nrows()) for j in range(m.ncols()) if m[i, j] != 0}
        for gain in self.table.values():
            for j in acted:
                if any(gain[i, nk + j] != 0 for i in range(nk, nk + self.inputs)):
                    raise ProblemError(
                        f"the law feeds output {j + 1} straight to the input, which acts on it at once (D): an algebraic "
                        "loop; take a law without feedthrough from it, or measure something else"
                    )
