"""Re-prove a schedule from its content alone, without any solver, and say in words what was shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flint import fmpq

from estimators.display import Display
from estimators.schedule import FIRST_FORMAT, check_content, upgraded
from synthesis.certificate.claims import Claim, claim_name, claim_unit
from synthesis.certificate.content import Subject, claims_of, subject_of
from synthesis.certificate.inside_sample import inside_sample
from synthesis.certificate.refute import refuting_place
from synthesis.certificate.verify import Outcome, Verifier
from synthesis.loop.plant import Axis
from synthesis.polynomials.rational import as_float


@dataclass(frozen=True, repr=False)
class Proof(Display):
    """One claim: proved on the whole range and rate box, or the place where the proof fails.

    `claim`, `level` and `unit` are derived from what was proved, never read. `refuted`: the loop itself breaks the claim at
    `place`, the parameters standing still; otherwise a failed proof only says that this P does not do.
    """

    claim: str
    kind: str
    level: float
    unit: str
    proved: bool
    place: str = ""
    refuted: bool = False


@dataclass(frozen=True)
class Certificate:
    """The proofs of a content, what moving parameters add inside a sample, and whether constants and units are tied."""

    proofs: tuple[Proof, ...]
    inside_sample: tuple[str, ...]
    tied: bool
    feedback: bool = False


def prove(content: Mapping[str, Any], where: str = "schedule") -> list[Proof]:
    """Prove every claim of a schedule content of either format.

    Raises ScheduleError if its form is wrong, or if plant, formulas, constants, units and claims do not fit together.

    >>> import json
    >>> from importlib.resources import files
    >>> content = json.loads((files("estimators") / "schedules/corner-estimation-longitudinal.json").read_text())
    >>> proofs = prove(content)
    >>> all(proof.proved for proof in proofs), proofs[0].claim
    (True, 'error equation: decay rate')
    """
    return list(certificate(content, where).proofs)


def certificate(content: Mapping[str, Any], where: str = "schedule") -> Certificate:
    """As `prove`, with what is to be said beside the claims."""
    if content.get("schema") == FIRST_FORMAT:
        content = upgraded(content, where)
    check_content(content, where)
    subject = subject_of(content, where)
    claims = claims_of(content, subject, where)
    verifier = Verifier(subject.loop, subject.names)
    proofs = tuple(_proof(claim, verifier, subject) for claim in claims)
    bounds = inside_sample(subject.loop)
    inputs = [signal["name"] for signal in content["model"]["inputs"]]
    words = () if bounds is None else tuple(bounds.words(subject.names.states, inputs, subject.units))
    return Certificate(proofs, words, subject.tied, content["update"]["kind"] == "feedback")


def _proof(claim: Claim, verifier: Verifier, subject: Subject) -> Proof:
    name, unit = (
        claim_name(claim.kind, claim.channel, subject.units, claim.centre),
        claim_unit(claim.kind, claim.channel, subject.units),
    )
    outcome = verifier.prove(claim)
    if outcome.proved:
        return Proof(name, claim.kind, claim.level, unit, True)
    worse = refuting_place(verifier, claim, [outcome.place])
    axes = subject.loop.plant.axes
    place = place_words(axes, outcome.place if worse is None else worse, outcome)
    return Proof(name, claim.kind, claim.level, unit, False, place, worse is not None)


def place_words(axes: tuple[Axis, ...], point: tuple[fmpq, ...], outcome: Outcome | None = None) -> str:
    """Parameter values of a scaled place, and the inequality that failed there."""
    values = [
        f"{axis.name} = {as_float(axis.middle + axis.half * u):.6g} {axis.unit}"
        for axis, u in zip(axes, point, strict=False)
    ]
    words = ", ".join(values) or "its only point"
    return words if outcome is None else f"{words} (inequality '{outcome.inequality}')"
