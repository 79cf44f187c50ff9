"""`gainsmith certify`: re-prove schedule files from the files alone. Imports no solver and no symbolic library."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import ClassVar

from estimators.display import Display
from estimators.errors import GainsmithError, printable
from estimators.schedule import read_content
from estimators.schedule.files import place_of
from synthesis.certificate.claims import written
from synthesis.certificate.proof import Proof, certificate

LONGEST = 300  # characters of a message
UNTIED = "format 1: constants and units are words only, tied to nothing that is proved"


@dataclass(frozen=True, repr=False)
class Certification(Display):
    """One file: its proofs and what is to be said beside them, or why it was refused."""

    shown_units: ClassVar = {"seconds": "s"}

    path: Path
    name: str
    proofs: tuple[Proof, ...]
    refusal: str
    seconds: float
    remarks: tuple[str, ...] = ()

    @property
    def certified(self) -> bool:
        """Whether every claim is proved."""
        return not self.refusal and all(proof.proved for proof in self.proofs)

    @property
    def message(self) -> str:
        """One line: certified, or what is wrong and where."""
        if self.refusal:
            return f"refused: {self.refusal}"
        failed = [proof for proof in self.proofs if not proof.proved]
        if not failed:
            return f"certified: {len(self.proofs)} claims"
        kind = "refuted: the loop itself breaks it" if failed[0].refuted else "not proved"
        claim, place = (
            printable(failed[0].claim, 90),
            printable(failed[0].place, 100),
        )  # in full where claims are listed
        return f"{kind}: '{claim}' at {written(failed[0].level)} {printable(failed[0].unit, 40)} fails at {place}"


def certify(path: Path) -> Certification:
    """Read, check and prove one file; a file that cannot be trusted is a refusal, not an exception.

    >>> from importlib.resources import files
    >>> print(certify(files("estimators") / "schedules/corner-estimation-longitudinal.json").certified)
    True
    """
    start, where = perf_counter(), place_of(path)
    try:
        content = read_content(path)
        found = certificate(content, where)
    except GainsmithError as error:
        words = printable(str(error).removeprefix(f"{where}: "), LONGEST - len("refused: "))
        return Certification(path, path.stem, (), words, perf_counter() - start)
    what = "moves" if found.feedback else "adds to the error of"
    remarks = [f"a parameter moving inside a sample {what} {line}" for line in found.inside_sample]
    remarks += [] if found.tied else [UNTIED]
    return Certification(path, str(content["name"]), found.proofs, "", perf_counter() - start, tuple(remarks))
