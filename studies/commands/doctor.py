"""Output of `gainsmith doctor`: what is installed, and whether it works."""

from __future__ import annotations

import json
import platform
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, requires, version

from estimators.schedule import SHIPPED
from studies.commands.terminal import print_table
from studies.execution.processes import available_cores
from synthesis.lmi.result import Verdict

HEADER = ("part", "found", "state", "remedy")


@dataclass(frozen=True)
class Finding:
    """One line: `good` None where something optional is not there."""

    part: str
    found: str
    good: bool | None
    remedy: str = ""


def run_doctor(as_json: bool) -> int:
    """Look at everything and print it; 0 if all that is needed works, else 1."""
    findings = [*_machine(), *_libraries(), *_solvers(), _proof()]
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings], indent=1))
    else:
        state = {True: "works", False: "FAILS", None: "absent"}
        rows = [(f.part, f.found, state[f.good], f.remedy) for f in findings]
        print_table("gainsmith doctor", HEADER, rows, left=range(len(HEADER)))
    return 1 if any(finding.good is False for finding in findings) else 0


def _machine() -> Iterator[Finding]:
    yield Finding("gainsmith", version("gainsmith"), True)
    yield Finding("python", f"{platform.python_version()} on {platform.system()} {platform.machine()}", True)
    yield Finding("cores", str(available_cores()), True)


def _libraries() -> Iterator[Finding]:
    """Everything that the package's own metadata asks for: an extra may be absent, the core may not."""
    for line in requires("gainsmith") or []:
        needed, _, condition = line.partition(";")
        name = re.split(r"[^\w.-]", needed, maxsplit=1)[0]
        extra = next(iter(re.findall(r"extra\s*==\s*['\"]([\w-]+)", condition)), "")
        part = f"{name} [{extra}]" if extra else name
        try:
            found = version(name)
        except PackageNotFoundError:
            remedy = f"pip install 'gainsmith[{extra}]'" if extra else f"pip install '{needed.strip()}'"
            yield Finding(part, "", None if extra else False, remedy)
            continue
        fits = _fits(found, needed[len(name) :])
        yield Finding(part, found, fits, "" if fits else f"pip install '{needed.strip()}'")


def _fits(found: str, bounds: str) -> bool:
    """Whether a version lies within bounds such as >=2.0,<3; only numbers count."""
    numbers = _numbers(found)
    for comparison, limit in re.findall(r"([<>]=?)\s*([\d.]+)", bounds):
        wanted = _numbers(limit)
        size = max(len(numbers), len(wanted))
        mine, theirs = (v + (0,) * (size - len(v)) for v in (numbers, wanted))
        good = {"<": mine < theirs, "<=": mine <= theirs, ">": mine > theirs, ">=": mine >= theirs}[comparison]
        if not good:
            return False
    return True


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.match(r"[\d.]*", text)[0].split(".") if part)  # type: ignore[index]


def _solvers() -> Iterator[Finding]:
    for solver in ("CLARABEL", "cvxpy:SCS"):
        yield _tried(f"solver {solver}", partial(_lyapunov, solver))


def _lyapunov(solver: str) -> str:
    """A stable matrix has a Lyapunov function: a solver that finds none does not work here."""
    import numpy as np

    from analysis.constant_lmi import constant_problem
    from synthesis.lmi.settings import LmiSettings
    from synthesis.lmi.solve import solve

    problem = constant_problem()
    P, A = problem.symmetric("P", 2), problem.constant(np.array([[0.0, 1.0], [-2.0, -3.0]]))
    problem.require("P > 0", P)
    problem.require("P < 1", problem.constant(np.eye(2)) - P, strict=False)
    problem.require("decrease", -(A.T @ P + P @ A))
    found = solve(problem, LmiSettings(solver=solver))
    if found.verdict is not Verdict.CERTIFIED:
        raise RuntimeError(found.message)
    return f"Lyapunov function found and checked, {found.message}"


def _proof() -> Finding:
    def prove() -> str:
        from studies.certification import certify

        outcome = certify(next(iter(sorted(SHIPPED.glob("*.json")))))
        if not outcome.certified:
            raise RuntimeError(outcome.message)
        return f"{outcome.name}: {outcome.message}"

    return _tried("proof without a solver", prove)


def _tried(part: str, action: Callable[[], str]) -> Finding:
    try:
        return Finding(part, action(), True)
    except Exception as error:
        return Finding(
            part, f"{type(error).__name__}: {error}"[:100], False, "reinstall gainsmith in a fresh environment"
        )
