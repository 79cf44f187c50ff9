"""What a fingerprint is taken of: what a module really imports, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.execution.fingerprint import PACKAGES, SOURCE_ROOT, Sources, traits
from studies.parts.marks import Marks
from studies.registry import MODULES, Registry
from studies.study import QUICK, Part, PartResult, Scope
from tests.support.study_fakes.registry import REGISTRY

TREE = {
    "own/__init__.py": "",
    "own/settings.json": "{}",
    "own/part.py": """
from typing import TYPE_CHECKING
import numpy
from own.model import curve
from .data import limits
if TYPE_CHECKING:
    from own.drawing import Canvas

def run(scope):
    from own.late import solve
    return read("own.tables")
""",
    "own/model/__init__.py": "from own.model.curve import shape\n",
    "own/model/curve.py": "import own.model.base\n",
    "own/model/base.py": "from own.model import curve\n",
    "own/model/constants.toml": "a = 1\n",
    "own/model/sets/one.toml": "a = 1\n",
    "own/model/unused.py": "",
    "own/data.py": "from own.door import gain\n",
    "own/late.py": "",
    "own/tables/__init__.py": "",
    "own/tables/printed.toml": "a = 1\n",
    "own/door/__init__.py": "from importlib import import_module\n",
    "own/door/inside.py": "",
    "own/drawing.py": "",
    "own/other.py": "from own.part import run\n",
    "own/notes.md": "",
    "strange/__init__.py": "",
}
REACHED = {
    "part.py", "model/__init__.py", "model/curve.py", "model/base.py", "model/constants.toml", "model/sets/one.toml",
    "data.py", "late.py", "tables/__init__.py", "tables/printed.toml", "door/__init__.py", "door/inside.py", "settings.json",
    "__init__.py",
}  # fmt: skip


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, text in TREE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def mark(tree: Path, scope: Scope = QUICK) -> str:
    return Sources(tree, ["own"]).fingerprint(scope, ["own.part", "numpy"])


def test_reached_is_what_is_imported(tree: Path) -> None:
    found = Sources(tree, ["own"]).reached(["own.part"])
    assert {path.relative_to(tree / "own").as_posix() for path in found} == REACHED


@pytest.mark.parametrize("name", sorted(TREE))
def test_a_change_counts_where_it_is_imported_and_nowhere_else(tree: Path, name: str) -> None:
    before = mark(tree)
    assert mark(tree) == before
    (tree / name).write_text(TREE[name] + ("\n# changed\n" if name.endswith(".py") else "\n"))
    assert (mark(tree) != before) == (name.removeprefix("own/") in REACHED)


def test_scope_and_place_of_the_tree(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (tree / "own").rename(elsewhere / "own")
    there = mark(elsewhere)
    (elsewhere / "own").rename(tree / "own")
    assert mark(tree) == there != mark(tree, Scope())


def test_modules_of_nobody_are_refused(tree: Path) -> None:
    with pytest.raises(ValueError, match="none of the modules numpy is below"):
        Sources(tree, ["own"]).reached(["numpy"])


def bound(settings: dict[str, object], scope: Scope) -> PartResult:
    """A part that is given values."""
    return PartResult(notes=[str(settings), str(scope)])


def test_what_a_part_is_bound_to_belongs_to_it() -> None:
    modules, values = traits(partial(bound, {"limit": (1.5, Path("a"))}))
    assert __name__ in modules and "1.5" in values and "'limit'" in values
    marks = Marks(REGISTRY, QUICK)

    def of(value: object) -> str:
        return marks.part(Part("one", "One", partial(bound, {"limit": value})))

    assert of(1.5) == of(1.5) != of(1.6)
    assert of([1, (2, bound)]) == of([1, (2, bound)]) != of([1, (2, mark)])


def test_all_values_count_and_the_same_ones_every_time() -> None:
    """Many lists that live for a moment: none may pass for another one that had its place in memory."""
    arrays = [np.arange(3.0 * k, 3.0 * k + 3.0) for k in range(400)]
    _, values = traits(partial(bound, {f"a{k}": array for k, array in enumerate(arrays)}))
    assert sorted(float(v) for v in values.split() if v[0].isdigit()) == list(range(1200))


@dataclass(frozen=True)
class Remembering:
    value: float

    @cached_property
    def square(self) -> float:
        return self.value**2


class Plain:
    def __init__(self) -> None:
        self.value, self.mark = 2.0, object()

    @cached_property
    def square(self) -> float:
        return self.value**2


@pytest.mark.parametrize("made", [lambda: Remembering(2.0), Plain])
def test_what_an_object_remembers_later_is_no_part_of_it(made: Callable[[], Any]) -> None:
    one = made()
    before = traits(partial(bound, {"x": one}))
    assert one.square == 4.0 and traits(partial(bound, {"x": one})) == before == traits(partial(bound, {"x": made()}))
    assert "2.0" in before[1] and "0x" not in before[1]


def test_the_shipped_studies_do_not_depend_on_how_they_are_shown() -> None:
    """Every study has a fingerprint; pages, commands and other studies' claims are none of its business."""
    sources = Sources()
    assert all((SOURCE_ROOT / name / "__init__.py").exists() for name in PACKAGES)
    for name, module in MODULES.items():
        files = {path.relative_to(SOURCE_ROOT).as_posix() for path in sources.reached([module])}
        assert module.replace(".", "/") + ".py" in files
        assert not [
            file for file in files if file.startswith(("studies/commands", "studies/report/html", "studies/sweeps"))
        ]
        assert "studies/papers/ekf_ukf_lateral/claims.toml" not in files or name == "ekf-ukf-lateral"
    assert Marks(Registry(MODULES), QUICK).study("friction-floor") != Marks(Registry(MODULES), Scope()).study(
        "friction-floor"
    )


def test_a_part_that_its_topic_shows_rests_on_the_module_of_its_claims_and_keeps_its_mark_when_it_ran() -> None:
    part = next(p for p in Registry(MODULES).load("resilient-velocity").parts if p.name == "norms")
    before = traits(part.run)
    assert "studies.papers.resilient_velocity.error_dynamics" in before[0]
    part.run(QUICK)
    assert traits(part.run) == before
