"""Random changes of schedule contents, to be resealed by whoever uses them. One number makes one case, on any machine."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np

from tests.support import mutations_aimed as aimed
from tests.support import mutations_blind as blind
from tests.support import mutations_loop as loop
from tests.support.mutations_blind import Content

CHANGES: dict[Callable[[Content, np.random.Generator], str], float] = {
    blind.number: 6, blind.foreign: 2, blind.dropped: 2, blind.doubled: 1, blind.added: 1, blind.swapped: 3, blind.copied: 3,
    blind.text: 2, blind.renamed: 2, aimed.unit: 3, aimed.kind: 4, aimed.level: 9, aimed.channel: 5, aimed.lyapunov: 5,
    aimed.claims: 4, loop.formula: 5, loop.constant: 6, loop.table: 5, loop.points: 6, loop.rates: 4, loop.sampling: 4,
    loop.ordered: 3,
}  # fmt: skip


def mutated(content: Content, rng: np.random.Generator) -> tuple[Content, str]:
    """An unsealed changed copy, and what was done to it."""
    data, done = copy.deepcopy(content), []
    for key in ("sha256", "section_sha256"):
        data.pop(key, None)
    changes, weights = list(CHANGES), np.array(list(CHANGES.values()))
    for _ in range(int(rng.choice([1, 1, 1, 1, 2, 2, 3, 4]))):
        change = changes[int(rng.choice(len(changes), p=weights / weights.sum()))]
        try:
            done.append(f"{change.__name__}: {change(data, rng)}")
        except Exception:  # an earlier change left nothing that this one could be done to
            done.append(f"{change.__name__}: -")
    return data, "; ".join(done)
