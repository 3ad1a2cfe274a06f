# Everything lives in .venv, which the first target sets up: plain python3 >= 3.11 and a package
# index are all it needs. `make PYTHON=python3.12 study` picks another interpreter.

PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
STUDY_FLAGS ?=
TEST_FLAGS ?=
WORKERS ?= auto
REGRESSION_FLAGS ?=
RACE_FLAGS ?= --peers --only race
SHOWS_FLAGS ?= --list

# Tests start hundreds of processes: without stored bytecode each of them compiles all it imports.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup study picture table docs test test-slow lint benchmark regression race exudyn shows clean

help:
	@echo "make study      optimal deployment of the 24-module antenna, into results/"
	@echo "make picture    the README's pictures, from the main study and an example"
	@echo "make table      every number of the paper compared with ours"
	@echo "make docs       the site, into docs/build/html; runs every example"
	@echo "make test       fast tests"
	@echo "make test-slow  slow tests"
	@echo "make lint       formatting, lint, types, import rule"
	@echo "make benchmark  fifteen problems with known optima"
	@echo "make regression values, iterations and certificates beside those of benchmarks/baseline.json"
	@echo "make race       the engine beside other tools, each in an environment of its own"
	@echo "make exudyn     the simulator of flexible links beside Exudyn, which is installed first"
	@echo "make shows      what is too long for a test: SHOWS_FLAGS=\"NAME --count N --seed S\""
	@echo "make clean      remove caches (keeps .venv and results/)"

setup: $(READY)

$(READY): pyproject.toml constraints.txt
	@command -v $(PYTHON) >/dev/null || { echo "antenna-ocp needs Python 3.11 or newer, but '$(PYTHON)' is not on the PATH; name one with make PYTHON=..."; exit 1; }
	@$(PYTHON) -c 'import sys; v = sys.version.split()[0]; sys.exit(0 if sys.version_info >= (3, 11) else "antenna-ocp needs Python 3.11 or newer, but $(PYTHON) is " + v + "; name a newer one with make PYTHON=...")'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) lacks the modules venv and ensurepip; install your system's python3-venv package or name another interpreter with make PYTHON=..."; exit 1; }
	@echo "setting up .venv (once, a minute or two) ..."
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt setuptools
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --config-settings editable_mode=compat -c constraints.txt -e '.[test,lint,docs]'
	@touch $@

study: $(READY)
	$(BIN)/antenna-ocp truss studies/truss/main.toml $(STUDY_FLAGS)

picture: $(READY)
	$(BIN)/antenna-ocp truss studies/truss/main.toml --results results/picture --overwrite
	cp results/picture/overview.png docs/overview.png
	cd docs && MPLBACKEND=Agg PYTHONPATH=.. ../$(BIN)/python examples/bryson_denham.py

table: $(READY)
	$(BIN)/antenna-ocp paper

docs: $(READY)
	$(BIN)/python -m sphinx -E -W --keep-going -n -q -b html docs docs/build/html
	@echo "open docs/build/html/index.html"

test: $(READY)
	$(BIN)/python -m pytest -n $(WORKERS) $(TEST_FLAGS)

# Without a limit a worker takes up to a quarter of what is left at once. Long tests come first, so
# that one worker could be left with most of them.
test-slow: $(READY)
	$(BIN)/python -m pytest -n $(WORKERS) -m slow --maxschedchunk=16

lint: $(READY)
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/lint-imports

benchmark: $(READY)
	$(BIN)/python -m benchmarks.optima

regression: $(READY)
	$(BIN)/python -m benchmarks.regression --against benchmarks/baseline.json $(REGRESSION_FLAGS)

race: $(READY)
	$(BIN)/python -m benchmarks.race $(RACE_FLAGS)

exudyn: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -r benchmarks/exudyn/requirements.txt
	$(BIN)/python -m benchmarks.exudyn

shows: $(READY)
	$(BIN)/python -m benchmarks.shows $(SHOWS_FLAGS)

clean:
	rm -rf build dist docs/build docs/generated *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
