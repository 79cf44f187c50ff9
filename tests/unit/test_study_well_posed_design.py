"""What determines the gains: exact floors, the infimum of the literal problem, and how designs answer to demands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from studies.beyond.well_posed_design.achieved import achieved, printed_achieved
from studies.beyond.well_posed_design.cases import Case, all_cases, case, p1_cases
from studies.beyond.well_posed_design.demands import (
    DEMANDS,
    decay_rate,
    friction_bound,
    noise_weight,
    pole_limit,
    sweep,
)
from studies.beyond.well_posed_design.gain_plane import gain_plane
from studies.beyond.well_posed_design.literal import (
    approach,
    explicit_family,
    floor,
    literal_design,
)
from studies.beyond.well_posed_design.study import STUDY
from studies.study import QUICK, Part
from synthesis.errors import SpecError
from tests.support.study_checks import check_result, check_study

LONG, LATERAL = p1_cases()


@pytest.fixture(scope="module")
def literal() -> dict[tuple[str, int], object]:
    return {(c.name, degree): approach(c, literal_design(degree)) for c in (LONG, LATERAL) for degree in (0, 1)}


@pytest.fixture(scope="module")
def posed() -> dict[str, object]:
    return {c.name: approach(c, c.design) for c in (LONG, LATERAL)}


class TestLiteral:
    @pytest.mark.parametrize("which", all_cases(), ids=lambda c: c.title)
    def test_floor_is_exact_and_free_of_the_gain(self, which: Case) -> None:
        """sqrt(1 + (sigma2/sigma0)^2), by solving the static error equations for a gain of symbols."""
        exact, free = floor(which)
        s0, s2 = (sp.Rational(str(which.model.constants[name].value)) for name in ("sigma0", "sigma2"))
        assert free and sp.simplify(exact**2 - (1 + (s2 / s0) ** 2)) == 0
        assert 1.0 < float(exact) < 1.0 + 1e-10

    def test_static_gain_of_random_gains(self) -> None:
        """Second calculation of the floor: A_e^-1 B_e in numbers, whatever the gain is."""
        rng, grid = np.random.default_rng(1), np.linspace(0.0, 140.0, 8)
        a = 8.32 * 0.33 * grid
        for _ in range(10):
            gain = np.array([[rng.uniform(0.2, 1.2)], [rng.uniform(5.0, 400.0)]])
            A_e, B_e = LONG.model.on(grid).error_dynamics(gain)
            static = np.linalg.solve(-A_e, B_e)[:, :, 0]
            below = 632.1 + 0.0016 * a
            np.testing.assert_allclose(static, np.stack([0.0016 / below, -632.1 / below], axis=1), rtol=1e-7)

    def test_infimum_is_one(self, literal: dict[tuple[str, int], object]) -> None:
        for (name, _), found in literal.items():
            assert float(floor(case(name))[0]) <= found.gamma < 1.0 + 3e-4  # type: ignore[attr-defined]

    def test_gains_grow_without_bound_unless_the_problem_is_well_posed(self, literal, posed) -> None:  # type: ignore[no-untyped-def]
        assert all(found.unbounded for found in literal.values())
        assert not any(found.unbounded for found in posed.values())
        for found in literal.values():
            assert (np.diff(found.gains[:, 1]) > 0.0).all()

    @pytest.mark.parametrize("which", [LONG, LATERAL], ids=lambda c: c.title)
    def test_explicit_gains_approach_the_floor(self, which: Case) -> None:
        """L = [1/sigma1, L2]: the distance falls like 1/L2^2 down to the exact floor, and never below."""
        exact = float(floor(which)[0]) - 1.0
        found = explicit_family(which, np.array([1e2, 1e3, 1e7])) - 1.0
        assert found[0] / found[1] == pytest.approx(100.0, rel=0.01)
        assert found[2] == pytest.approx(exact, rel=0.05)
        assert (found >= 0.99 * exact).all()


class TestSweeps:
    def test_decay_sets_the_second_gain(self) -> None:
        """The slowest pole is never slower than asked, and L2 follows the demand nearly in proportion."""
        found = sweep(LONG, decay_rate, (20.0, 80.0), points=15)
        assert (found.achieved.slowest >= found.demand).all()
        middle = found.gains[:, :, 1].mean(axis=1)
        assert middle[1] / middle[0] == pytest.approx(4.0, rel=0.1)
        assert found.achieved.noise_density[1] / found.achieved.noise_density[0] == pytest.approx(2.0, rel=0.1)

    def test_pole_limit_holds_and_sets_the_first_gain(self) -> None:
        found = sweep(LONG, pole_limit, (400.0, 800.0), points=15)
        assert (found.achieved.fastest <= found.demand).all()
        assert found.gains[1, :, 0].min() > found.gains[0, :, 0].max()

    def test_tighter_friction_bound_costs_noise(self) -> None:
        found = sweep(LATERAL, friction_bound, (1.01, 1.1, 1.5), points=15)
        assert (np.diff(found.gamma) < 0.0).all() and (found.gamma_lower <= found.gamma).all()
        assert (found.achieved.friction <= found.demand).all() and (found.achieved.noise <= found.gamma).all()

    def test_noise_weight_raises_the_second_gain(self) -> None:
        found = sweep(LATERAL, noise_weight, (0.1, 30.0), points=15)
        assert found.gains[1, :, 1].min() > 2.0 * found.gains[0, :, 1].max()
        assert found.achieved.acceleration[1] < found.achieved.acceleration[0]

    def test_the_shipped_design_is_the_middle_of_every_sweep(self) -> None:
        """At the shipped demand the sweep gives the gains of the shipped schedule's own design."""
        base = LONG.design
        by_decay = sweep(LONG, decay_rate, (base.decay_rate,), points=5)
        by_poles = sweep(LONG, pole_limit, (base.fastest_pole or 0.0,), points=5)
        np.testing.assert_allclose(by_decay.gains, by_poles.gains, rtol=1e-9)
        assert (
            sweep(LONG, lambda design, degree: replace(design, degree=int(degree)), (0,), points=5).gamma[0]
            > by_decay.gamma[0]
        )

    def test_infeasible_demands_are_left_out(self) -> None:
        """Negative control: a pole limit below what the friction bound needs leaves no gains, and says so."""
        found = sweep(LATERAL, pole_limit, (150.0, 300.0), points=5)
        assert found.feasible.tolist() == [False, True]
        assert np.isnan(found.gains[0]).all() and np.isfinite(found.gains[1]).all()
        assert np.isnan(found.achieved.noise[0])
        row = DEMANDS[2].table([found]).rows[0]
        assert row[2] is False and row[-1] is None


class TestAchieved:
    def test_printed_gains_of_p1_at_one_wheel_speed(self) -> None:
        """Independent check: poles by hand, static noise gain a / (sigma0 + sigma2 a), H2 norm by the Lyapunov equation."""
        from scipy.linalg import solve_continuous_lyapunov

        grid = np.array([140.0])
        found = achieved(LONG, np.array([LONG.printed]), grid)
        a = 8.32 * 0.33 * 140.0
        assert float(found.noise) == pytest.approx(a / (632.1 + 0.0016 * a), rel=1e-6)
        assert (float(found.slowest), float(found.fastest)) == pytest.approx((214.2, 540.8), abs=0.06)
        A_e, B_e = LONG.model.on(grid).error_dynamics(np.array(LONG.printed)[:, None])
        noise = B_e[0][:, 2:]
        X = solve_continuous_lyapunov(A_e[0], -noise @ noise.T)
        assert float(found.noise_density) == pytest.approx(np.sqrt(X[1, 1]), rel=1e-9)

    def test_worst_is_over_the_wheel_speeds(self) -> None:
        grid = LONG.grid(8)
        gains = np.broadcast_to(LONG.printed, (8, 2))
        each = [achieved(LONG, gains[k : k + 1], grid[k : k + 1]) for k in range(8)]
        whole = achieved(LONG, gains, grid)
        assert float(whole.fastest) == max(float(e.fastest) for e in each)
        assert float(whole.slowest) == min(float(e.slowest) for e in each)
        assert float(whole.noise_density) == max(float(e.noise_density) for e in each)

    def test_unstable_gains_have_infinite_norms(self) -> None:
        grid = LONG.grid(3)
        found = achieved(LONG, np.broadcast_to((-0.5, -50.0), (3, 2)), grid)
        assert float(found.slowest) < 0.0 and np.isinf(float(found.friction)) and np.isinf(float(found.noise_density))

    def test_plane_holds_the_printed_gains(self) -> None:
        first, second, fields = gain_plane(LATERAL, 15)
        exact = printed_achieved(LATERAL, 8)
        i, j = (
            np.abs(first - LATERAL.printed[0]).argmin(),
            np.abs(np.log(second / LATERAL.printed[1])).argmin(),
        )
        assert fields.slowest[i, j] == pytest.approx(float(exact.slowest), rel=0.3)
        assert fields.slowest.shape == (15, 15)


def test_case_without_printed_gains_is_refused() -> None:
    with pytest.raises(SpecError, match="no published gains"):
        case("longitudinal-speed")


def test_study_is_complete() -> None:
    check_study(STUDY)
    assert (STUDY.id, STUDY.paper) == ("well-posed-design", "")


@pytest.mark.parametrize("part", [p for p in STUDY.parts if p.name != "decay"], ids=lambda part: part.name)
def test_parts_stand_on_their_own(part: Part) -> None:
    check_result(part.run(QUICK))
