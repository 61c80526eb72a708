# `make demo` does the main job, `make test` passes the tests; both set up .venv first, once.
PYTHON ?= $(shell command -v python3.11 || echo python3)
VENV ?= .venv
BIN := $(VENV)/bin
PYTEST := $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.PHONY: demo test test-long check style bench docs studio clean

# The whole single-axis tumble test of the standard gyro: FMUs, run, step check, coefficients, report.
demo: $(VENV)/demo.stamp
	$(BIN)/gyrobench build --all
	$(BIN)/gyrobench run tumble_single_axis --set latitude=45.75deg --check-step

# mypy, on one core, runs beside the tests and is printed after them.
# Without reordering: xdist would put files of few, long tests last.
# With bytecode, whatever the environment says: hundreds of processes start, and each would compile every module.
test: export PYTHONDONTWRITEBYTECODE =
test: style
	@$(BIN)/mypy > $(VENV)/mypy.log 2>&1 & types=$$!; \
	$(PYTEST) -m "not long"; failed=$$?; \
	wait $$types || failed=1; cat $(VENV)/mypy.log; exit $$failed

# What takes seconds and has quick tests beside it: counts, attacks, the commands of the guides.  Before a release, and in
# the continuous integration.
test-long: export PYTHONDONTWRITEBYTECODE =
test-long: $(VENV)/test.stamp
	$(PYTEST) -m long

check: style
	$(BIN)/mypy

style: $(VENV)/test.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# Speed against the budgets and other tools, then against the state whose figures the pages quote.
bench: $(VENV)/bench.stamp
	$(BIN)/python tests/benchmarks/run.py
	$(BIN)/python tests/benchmarks/against.py --systems --rounds 1

# The documentation as a site that opens from disk; strict: a warning is an error.
docs: $(VENV)/docs.stamp
	$(BIN)/python docs/site/build.py

# The bench in the browser; Ctrl-C ends it.
studio: $(VENV)/studio.stamp
	$(BIN)/gyrobench studio

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "gyrobench needs Python 3.11 or newer; name one: make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/demo.stamp: pyproject.toml | $(BIN)/python
	@echo "installing gyrobench and what it needs into $(VENV); the first time takes some minutes"
	$(PIP) -e .
	@touch $@

$(VENV)/test.stamp: pyproject.toml | $(BIN)/python
	@echo "installing gyrobench and what its tests need into $(VENV); the first time takes some minutes"
	$(PIP) -e ".[test]"
	@touch $@ $(VENV)/demo.stamp

$(VENV)/bench.stamp: pyproject.toml | $(BIN)/python
	$(PIP) -e ".[test,bench]"
	@touch $@

$(VENV)/docs.stamp: pyproject.toml | $(BIN)/python
	$(PIP) -e ".[docs,notebook]"
	@touch $@

$(VENV)/studio.stamp: pyproject.toml | $(BIN)/python
	$(PIP) -e ".[studio]"
	@touch $@

clean:
	rm -rf $(VENV) fmus/*.fmu fmus/*.ssp reports/out build dist
