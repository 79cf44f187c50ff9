"""Small studies that the tests of the runner and the report run in place of the real ones."""

from __future__ import annotations

from studies.registry import Registry

HOME = "tests.support.study_fakes"
REGISTRY = Registry({name: f"{HOME}.{name}.study" for name in ("alpha", "beta", "slow", "crash", "sharing")})
