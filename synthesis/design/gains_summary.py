"""What gains say of themselves in five lines."""

from __future__ import annotations

from typing import Any

from synthesis.certificate.claims import quotient


def gains_summary(gains: Any) -> tuple[str, ...]:
    """Of `synthesis.ObserverGains`: verdict, level with its lower bound, channels, update, the tightest inequality."""
    bound = "no lower bound" if gains.gamma_lower is None else f"at least {gains.gamma_lower:.6g}"
    channels = [f"{' + '.join(c.disturbances)} -> {' + '.join(c.errors)}" for c in gains.design.channels]
    period = "" if gains.sample_time is None else f", every {1e3 * gains.sample_time:g} ms"
    tight = "none"
    if gains.result.margins:
        tight = f"{gains.result.tightest.name}, margin {gains.result.tightest.value:.3g}"
    return (
        f"ObserverGains of '{gains.model.name}': {gains.verdict}",
        f"gamma: {gains.gamma:.6g} {_unit(gains)}".removesuffix(" 1") + f", {bound}",
        f"channels: {'; '.join(channels)}",
        f"update: {gains.update}{period}, degree {gains.design.degree}",
        f"tightest: {tight}",
    )


def _unit(gains: Any) -> str:
    """Of gamma: error over disturbance; with weights, or several disturbances, these are numbers of their sizes."""
    channel, model = gains.design.minimised, gains.model
    above = {s.unit for s in model.states if s.name in channel.errors}
    below = [s.unit for s in model.disturbances if s.name in channel.disturbances]
    top = above.pop() if len(above) == 1 else "(mixed units)"
    return quotient(top, below[0]) if len(below) == 1 and channel.weights is None else top
