PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: schedules test lint docs docs-check wheels bench mutants studies sweep clean

schedules: $(STAMP)
	$(BIN)/gainsmith schedules --out estimators/schedules

test: $(STAMP)
	$(BIN)/pytest -n auto --dist worksteal # neighbours on one process: they share what is slow to make

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(STAMP)
	$(BIN)/python -m pip install -qq --editable '.[docs]'
	$(BIN)/python -m docs.tools.check --site

docs-check: $(STAMP)
	$(BIN)/python -m docs.tools.check

wheels: # sdist and wheel in clean environments of every Python found, lowest and newest versions; some minutes
	PYTHON=$(PYTHON) .ci/wheels

studies: $(STAMP)
	$(BIN)/gainsmith study --all --out out/studies

sweep: $(STAMP)
	rm -rf out/sweep/check
	for name in tire-vehicle gain-box drop-tolerance; do \
	  $(BIN)/gainsmith sweep $$name --quick --out out/sweep/check/$$name \
	    --baseline studies/sweeps/baselines/$$name.quick.toml || exit 1; \
	done

bench: $(STAMP)
	$(BIN)/python -m pip install -qq --editable '.[bench]'
	$(BIN)/pytest tests/bench --benchmark-only --benchmark-columns=min,median,max,rounds

WHICH ?= analysis.drops.planar*
mutants: $(STAMP)
	$(BIN)/python -m pip install -qq --editable '.[mutants]'
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/mutmut run --max-children 2 '$(WHICH)'
	$(BIN)/mutmut results

$(STAMP): pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "gainsmith needs python3 >= 3.11; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=24'
	$(BIN)/python -m pip install -qq --editable '.[test,lint,logs]'
	touch $@

clean:
	rm -rf $(VENV) mutants build *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .benchmarks
