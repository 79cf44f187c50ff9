"""Output of `gainsmith certify`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from estimators.errors import printable
from estimators.schedule import SHIPPED
from studies.certification import certify
from synthesis.certificate.claims import written


def run_certify(files: list[Path], as_json: bool) -> int:
    """Certify every file; 0 if all are certified, 1 if one is refuted or not proved, 2 if one is no valid schedule."""
    results = [certify(shipped(path)) for path in files]
    if as_json:
        rows = [
            {"path": str(r.path), "name": r.name, "certified": r.certified, "message": r.message, "seconds": r.seconds,
             "proofs": [asdict(proof) for proof in r.proofs], "remarks": r.remarks}
            for r in results
        ]  # fmt: skip
        print(json.dumps(rows, indent=1))
    else:
        for result in results:
            print(f"{printable(str(result.path))}: {printable(result.message)} ({result.seconds:.2f} s)")
            for proof in result.proofs:
                state = "proved" if proof.proved else "FAILS "
                line = f"  {state}  {proof.claim} {written(proof.level)} {proof.unit}  {proof.place}"
                print(printable(line).rstrip())
            for remark in result.remarks:
                print(printable(f"  note    {remark}"))
    if any(result.refusal for result in results):
        return 2
    return 0 if all(result.certified for result in results) else 1


def shipped(path: Path) -> Path:
    """A bare name that is no file here may be a shipped schedule."""
    there = SHIPPED / f"{path.name}.json"
    return there if path == Path(path.name) and not path.exists() and there.is_file() else path
