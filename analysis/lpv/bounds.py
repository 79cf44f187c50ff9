"""What an analysis of an LPV system returns: two proved bounds, the certificate of the one and the witness of the other."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.lpv.trajectory import Trajectory
from estimators.display import Display
from synthesis.certificate.claims import Claim
from synthesis.lmi.result import Verdict


@dataclass(frozen=True, repr=False)
class LpvBounds(Display):
    """lower <= value <= upper, both proved; a side that nothing was found for is 0 or inf.

    For a norm `claim` (its P(u) in scaled parameters) proves `upper`, and along `witness` the norm is at least `lower`. For a
    decay rate the claim proves `lower`, and along the witness the system decays no faster than `upper`. `unit` of both bounds.
    """

    kind: str
    lower: float
    upper: float
    unit: str
    claim: Claim | None
    witness: Trajectory | None

    @property
    def gap(self) -> float:
        """upper/lower - 1; inf where one side is open."""
        return self.upper / self.lower - 1.0 if self.lower > 0.0 and self.upper < float("inf") else float("inf")

    def summary(self) -> tuple[str, ...]:
        """The bounds and what shows them."""
        certificate = (
            "none" if self.claim is None else f"P of degree {max(self.claim.P.degrees, default=0)}, {self.claim.kind}"
        )
        return (
            f"LpvBounds: {self.lower:.6g} <= {self.kind} <= {self.upper:.6g} {self.unit}".removesuffix(" 1"),
            f"gap: {100.0 * self.gap:.3g} %" if self.gap < float("inf") else "gap: open",
            f"certificate: {certificate}",
            f"witness: {'none' if self.witness is None else 'a trajectory'}",
        )

    def below(self, level: float) -> Verdict:
        """Whether the value is at most `level`: CERTIFIED, REFUTED, or INCONCLUSIVE where the level lies between the bounds."""
        if self.upper <= level:
            return Verdict.CERTIFIED
        return Verdict.REFUTED if self.lower > level else Verdict.INCONCLUSIVE

    def above(self, level: float) -> Verdict:
        """Whether the value is at least `level`: the question for a decay rate."""
        if self.lower >= level:
            return Verdict.CERTIFIED
        return Verdict.REFUTED if self.upper < level else Verdict.INCONCLUSIVE
