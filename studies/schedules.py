"""Regenerate gain schedules from their specifications: design, table, proof, file; or keep the file that is as good.

The optimum of a design is flat, and processors round differently: a fresh table may differ from a stored one in its last digit at
equal guarantees. A stored file is kept as it is when it comes from the same specification, every claim of it is proved again,
and no claim is worse than what was found just now. So regenerating changes nothing on any machine, and a check compares claims,
not digits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any, ClassVar

import numpy as np

from estimators.display import Display
from estimators.errors import GainsmithError
from estimators.schedule import read_content
from studies.execution.processes import available_cores, in_order
from studies.preflight import check_before_design
from studies.spec import Variant, load_spec
from synthesis.certificate.claims import LARGER_IS_BETTER
from synthesis.certificate.frozen import frozen_level
from synthesis.certificate.proof import Proof, prove
from synthesis.design.deploy import deploy, refuse_undeployable
from synthesis.design.export import export, schedule_content
from synthesis.design.law_table import matrices_of
from synthesis.design.norms import CLAIMED

# A stored claim may be worse than a fresh one by this share: levels are searched in steps, and solvers differ.
WORSE = 0.02
AS_IT_IS = Variant()


@dataclass(frozen=True, repr=False)
class ScheduleRun(Display):
    """One specification, done: `state` is written, kept, same (--check), drift, missing or failed.

    `proofs` are those of the file that is there now, `least` the largest frozen level of every channel (a bound from below), and
    `moved` how far the fresh gains lie from the stored ones, as a share of the largest: reported, not compared.
    """

    shown_units: ClassVar = {"seconds": "s"}

    name: str
    state: str
    seconds: float
    message: str = ""
    content: dict[str, Any] = field(default_factory=dict)
    proofs: tuple[Proof, ...] = ()
    published: tuple[tuple[float, float], ...] | None = None
    least: tuple[float, ...] = ()
    moved: float | None = None

    @property
    def good(self) -> bool:
        """Whether there is nothing to complain about."""
        return self.state in ("written", "kept", "same")


def regenerate(
    names: Iterable[str], out: Path, check: bool = False, variant: Variant = AS_IT_IS
) -> Iterator[ScheduleRun]:
    """Run the specifications on as many processes as there are cores; order as given.

    The work is under way when this returns.

    >>> from estimators.schedule import SHIPPED
    >>> (done,) = regenerate(["longitudinal-speed"], SHIPPED, check=True)
    >>> done.state in ("same", "kept")
    True
    """
    return in_order(_run, [(name, out, check, variant) for name in names], available_cores())


def _run(item: tuple[str, Path, bool, Variant]) -> ScheduleRun:
    name, out, check, variant = item
    start = perf_counter()
    try:
        return run_spec(name, out, check, variant)
    except GainsmithError as error:
        return ScheduleRun(variant.name(Path(name).stem), "failed", perf_counter() - start, str(error))


def run_spec(name: str, out: Path, check: bool = False, variant: Variant = AS_IT_IS) -> ScheduleRun:
    """Design, deploy, prove and write one schedule; with `check` compare only. Raises GainsmithError."""
    start = perf_counter()
    base, folder = load_spec(name)
    spec = variant.spec(base)
    plant = spec.plant(folder, variant.radius)
    model = plant.model
    refuse_undeployable(model)  # before the design, which may take minutes
    check_before_design(spec, model)
    deployment = deploy(spec.design(model), spec.deploy_settings())
    content = schedule_content(deployment, spec.name, spec.description, spec.resolved(plant))
    loop = deployment.loop
    least = tuple(
        frozen_level(loop, *matrices_of(model, channel), f"sampled {CLAIMED[channel.norm]}")
        for channel in deployment.gains.design.channels
    )
    path = out / f"{spec.name}.json"
    fresh = tuple(prove(content, str(path)))
    state, message, proofs, moved = compare(path, content, fresh)
    if state == "same":
        state = "same" if check else "kept"
        content = read_content(path)
    elif not check:
        out.mkdir(parents=True, exist_ok=True)
        proofs = tuple(export(path, content))
        state, message = "written", ""
    seconds = perf_counter() - start
    published = plant.published_gains
    return ScheduleRun(spec.name, state, seconds, message, content, proofs or fresh, published, least, moved)


def compare(
    path: Path, content: dict[str, Any], fresh: tuple[Proof, ...]
) -> tuple[str, str, tuple[Proof, ...], float | None]:
    """How the file at `path` stands to freshly made content: (same | drift | missing, why, its proofs, how far gains moved)."""
    if not path.exists():
        return "missing", f"{path} does not exist", (), None
    try:
        old = read_content(path)
        proofs = tuple(prove(old, str(path)))
    except GainsmithError as error:
        return "drift", str(error), (), None
    failed = [proof for proof in proofs if not proof.proved]
    if failed:
        return "drift", f"{path}: '{failed[0].claim}' is not proved at {failed[0].place}", proofs, None
    if old["provenance"].get("spec_sha256") != content["provenance"]["spec_sha256"]:
        return "drift", f"{path} was made from another specification or other parameter values", proofs, None
    moved = _moved(old, content)
    levels = {proof.claim: proof.level for proof in proofs}
    for proof in fresh:
        level = levels.get(proof.claim)
        if level is None or _loss(proof.kind, level, proof.level) > WORSE:
            has = "does not claim it" if level is None else f"proves {level:g}"
            words = f"'{proof.claim}' can be had at {proof.level:g} {proof.unit}, the file {has}"
            return "drift", f"{path}: {words}", proofs, moved
    return "same", "", proofs, moved


def _loss(kind: str, stored: float, fresh: float) -> float:
    """By which share the stored level is worse."""
    return fresh / stored - 1.0 if kind in LARGER_IS_BETTER else stored / fresh - 1.0


def _moved(old: dict[str, Any], new: dict[str, Any]) -> float | None:
    before, after = np.array(old["gain"]["table"]), np.array(new["gain"]["table"])
    if before.shape != after.shape:
        return None
    return float((np.abs(after - before).max(axis=0) / np.abs(before).max(axis=0)).max())
