"""What is asked of static output feedback (`synthesis.design.static_feedback`)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from estimators.display import Display
from synthesis.design.asked import check_degree_and_poles, check_shares, minimised_channel
from synthesis.design.feedback_channel import FeedbackChannel, check_feedback_channels
from synthesis.errors import ProblemError
from synthesis.lmi.settings import LmiSettings


@dataclass(frozen=True, repr=False)
class StaticFeedbackDesign(Display):
    """What is asked of the gains.

    `start` (nu, ny) are constant gains in physical units to begin with (None: zero). `uses` names pairs (input, output) that K
    may join (None: all): `(("force", "speed"), ("force", "speed_integral"))` is a PI law.

    >>> StaticFeedbackDesign((FeedbackChannel(("gust",), ("roll",)),), uses=(("aileron", "roll"),)).degree
    1
    """

    shown_units: ClassVar = {"decay_rate": "1/s", "fastest_pole": "1/s"}

    channels: tuple[FeedbackChannel, ...]
    degree: int = 1  # of K and P in the parameters
    decay_rate: float = 0.0  # alpha, 1/s
    fastest_pole: float | None = None  # radius of the disc about zero that holds every frozen pole, 1/s; None: no bound
    start: tuple[tuple[float, ...], ...] | None = None
    uses: tuple[tuple[str, str], ...] | None = None
    steps: int = 30  # at most, of those on the way to stability and of those that lower the level
    backoff: float = 0.01  # the last solve is this fraction above the level that the steps ended with
    reserve: float = 0.01  # poles are designed this much tighter than they are asked for, for the table's sake
    settings: LmiSettings = field(default_factory=LmiSettings)

    def __post_init__(self) -> None:
        check_feedback_channels(self.channels)
        check_degree_and_poles(self.degree, self.decay_rate, self.fastest_pole)
        if self.steps < 1:
            raise ProblemError(f"{self.steps} steps are none; give one at least")
        check_shares(self.backoff, self.reserve)
        if self.backoff == 0.0:
            raise ProblemError("backoff 0 leaves the last solve no room; give more")

    @property
    def minimised(self) -> FeedbackChannel:
        """The channel without a bound."""
        return minimised_channel(self.channels)
