"""`gainsmith certify`: re-prove schedule files from the files alone. Imports no solver and no symbolic library."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from estimators.errors import ScheduleError
from estimators.schedule import read_content
from synthesis.verify import Proof, prove


@dataclass(frozen=True)
class Certification:
    """One file: its proofs, or why it was refused."""

    path: Path
    name: str
    proofs: tuple[Proof, ...]
    refusal: str
    seconds: float

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
        kind = "refuted: the closed loop is unstable" if failed[0].refuted else "not proved"
        return f"{kind}: '{failed[0].claim}' at {failed[0].level:g} {failed[0].unit} fails at {failed[0].place}"


def certify(path: Path) -> Certification:
    """Read, check and prove one file; a file that cannot be trusted is a refusal, not an exception."""
    start = perf_counter()
    try:
        content = read_content(path)
        proofs = tuple(prove(content, str(path)))
    except ScheduleError as error:
        return Certification(path, path.stem, (), str(error), perf_counter() - start)
    return Certification(path, str(content["name"]), proofs, "", perf_counter() - start)
