"""Whole jobs: one schedule from specification to proved content, and certification of a file."""

from __future__ import annotations

from pathlib import Path

from pytest_benchmark.fixture import BenchmarkFixture

from studies.certification import certify
from studies.spec import load_spec
from synthesis.certificate.proof import prove
from synthesis.design.deploy import deploy
from synthesis.design.export import schedule_content

FOLDER = Path(__file__).parents[2] / "estimators" / "schedules"


def test_specification_to_proof(benchmark: BenchmarkFixture) -> None:
    def whole() -> bool:
        spec, folder = load_spec("corner-estimation-lateral")
        parameters = spec.parameter_set(folder)
        gains = spec.design(spec.build_model(parameters))
        content = schedule_content(deploy(gains, spec.deploy_settings()), spec.name)
        return all(proof.proved for proof in prove(content))

    assert benchmark.pedantic(whole, rounds=3, warmup_rounds=1)


def test_certify(benchmark: BenchmarkFixture) -> None:
    assert benchmark(lambda: certify(FOLDER / "resilient-velocity-lateral.json").certified)
