"""Which claims a deployed table gets, and the best level of each."""

from __future__ import annotations

import numpy as np

from synthesis.claims import Claim, Request, find_claim, solve_request
from synthesis.deployed_loop import DeployedLoop
from synthesis.hinf_observer import Channel, ObserverDesign
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel


def claim_levels(loop: DeployedLoop, design: ObserverDesign) -> dict[str, float]:
    """The least L2 gain of every channel that some P of this degree proves for the table."""
    out = {}
    for channel in design.channels:
        result = solve_request(loop, design, Request(channel.name, "gain", "1", None, channel))
        good = result.verdict is Verdict.CERTIFIED and result.objective is not None
        out[channel.name] = float(np.sqrt(result.objective or 0.0)) if good else np.inf
    return out


def prove_claims(
    loop: DeployedLoop, design: ObserverDesign, levels: dict[str, float], settle: float, sample_time: float
) -> tuple[Claim, ...] | None:
    """P for every claim with the largest margin; None if one of them cannot be had for this table.

    The claim about dropped measurements is the only one that a table may lack: an open loop may grow too fast for it.
    """
    requests = [Request("decay rate", "decay", "1/s", design.decay_rate)] if design.decay_rate else []
    if design.fastest_pole is not None:
        requests.append(Request("fastest pole", "fastest pole", "1/s", design.fastest_pole))
    for channel in design.channels:
        level = _round_up(levels[channel.name] * (1.0 + settle))
        requests.append(Request(f"gain {channel.name}", "gain", _gain_unit(loop.model, channel), level, channel))
    claims = []
    for request in requests:
        claim = find_claim(loop, design, request)
        if claim is None:
            return None
        claims.append(claim)
    slowest = slowest_pole(loop)
    sampled = _sampled_claim(loop, design, slowest)
    if sampled is None:
        return None
    drops = _drops_claim(loop, design, slowest, sample_time)
    return (*claims, sampled, *([] if drops is None else [drops]))


def slowest_pole(loop: DeployedLoop, points: int = 2001) -> float:
    """Distance of the slowest frozen pole from the imaginary axis, 1/s, on a grid."""
    grid = np.linspace(loop.breakpoints[0], loop.breakpoints[-1], points)
    return -float(np.linalg.eigvals(loop.error_matrices(grid)[0]).real.max())


def _sampled_claim(loop: DeployedLoop, design: ObserverDesign, slowest: float) -> Claim | None:
    """The runtime's own update: the largest proved alpha - beta among a few splits of the slowest frozen pole."""
    for share in (0.95, 0.9, 0.8, 0.6, 0.4, 0.2, 0.1):
        for growth in (0.001, 0.05, 0.2, 0.5):
            alpha = _round_down(share * slowest)
            beta = _round_down(growth * alpha)
            if not 0.0 < beta < alpha:
                continue
            level = _round_down(0.999999 * (alpha - beta))
            claim = find_claim(loop, design, Request("sampled decay rate", "sampled", "1/s", level, None, alpha, beta))
            if claim is not None:
                return claim
    return None


def _drops_claim(loop: DeployedLoop, design: ObserverDesign, slowest: float, sample_time: float) -> Claim | None:
    """The largest proved drop probability over a few decay rates, each with the least growth g of the open loop.

    Bisection on g (of ratios) is exact enough: any g that is proved is a valid claim, a smaller one only a better claim.
    """
    best: Claim | None = None
    for share in (0.9, 0.7):
        alpha = _round_down(share * slowest)
        beta = _round_down(0.01 * alpha)
        low, high = slowest / 4.0, 8.0 * slowest
        for _ in range(5):
            middle = float(np.sqrt(low * high))
            g = _round_up(middle)
            level = _round_down(0.9999 * drop_probability(alpha, beta, g, sample_time), 3)
            claim = find_claim(loop, design, Request("drop probability", "drops", "1", level, None, alpha, beta, g))
            if claim is None:
                low = middle
                continue
            high = middle
            if best is None or claim.level > best.level:
                best = claim
    return best


def drop_probability(alpha: float, beta: float, g: float, sample_time: float) -> float:
    """The p at which (1-p) e^{-2 alpha T} + p e^{2 g T} = e^{-2 beta T}; below it V falls in the mean (synthesis.verify)."""
    used, lost = np.exp(-2.0 * alpha * sample_time), np.exp(2.0 * g * sample_time)
    return float((np.exp(-2.0 * beta * sample_time) - used) / (lost - used))


def _gain_unit(model: LpvModel, channel: Channel) -> str:
    """Unit of the gain when all its disturbances and all its errors share one unit each, else '1' (mixed)."""
    above = {s.unit for s in model.states if s.name in channel.errors}
    below = {d.unit for d in model.disturbances if d.name in channel.disturbances}
    if above == below or len(above) > 1 or len(below) > 1:
        return "1"
    (top,), (bottom,) = above, below
    return top if bottom == "1" else f"({top})/({bottom})"


def _round_up(value: float, digits: int = 4) -> float:
    """Up to so many significant digits, so that a printed bound is a bound."""
    step = 10.0 ** (np.floor(np.log10(value)) - digits + 1)
    return float(f"{np.ceil(value / step) * step:.{digits}g}")


def _round_down(value: float, digits: int = 4) -> float:
    if not value > 0.0:
        return 0.0
    step = 10.0 ** (np.floor(np.log10(value)) - digits + 1)
    return float(f"{np.floor(value / step) * step:.{digits}g}")
