# The few commands of the project. `make` shows them.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help study serve test coverage bench bench-check fuzz attack mutants lint format docs release-check clean

help:  ## show this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

study: $(VENV)/.core  ## set up the core and run the whole method on the bundled real data
	$(BIN)/mrdamper study --out result

serve: $(VENV)/.web  ## set up and open the app
	$(BIN)/mrdamper serve

TESTS ?= not slow
test: $(VENV)/.dev  ## set up and run the tests (TESTS= runs the slow ones too)
	$(BIN)/python -m pytest -m "$(TESTS)" -n 2

coverage: $(VENV)/.dev  ## the fast tests with the share of lines they reach
	$(BIN)/python -m pytest -m "not slow" -n 2 --cov=mrdamper --cov-report=term:skip-covered --cov-report=xml

bench: $(VENV)/.dev  ## timings beside the peers that are installed
	$(BIN)/python -m benchmarks

bench-check: $(VENV)/.dev  ## processor seconds against a stored commit, in turns
	$(BIN)/python -m benchmarks.check

MUTANTS ?= 20000
fuzz: $(VENV)/.dev  ## damage rig files at random (MUTANTS=200000), and put physical faults into records
	$(BIN)/python -m fuzz.fuzz_import --mutants $(MUTANTS)
	$(BIN)/python -m fuzz.fuzz_records

SHARE ?= 1
attack: $(VENV)/.dev  ## hostile names, models, tables, calls; killed and starved commands: counts a kind (SHARE=0.1)
	$(BIN)/python -m fuzz.attack --share $(SHARE)

mutants: SHARE = 0.2
mutants: $(VENV)/.dev  ## plant faults where results are judged: the tests notice at least 95 % of them (SHARE=1: all)
	$(BIN)/python -m mutants --share $(SHARE)

lint: $(VENV)/.dev  ## format check, lint, types, import order of the layers
	$(BIN)/ruff format --check . && $(BIN)/ruff check . && $(BIN)/pyright --pythonpath $(BIN)/python && $(BIN)/lint-imports

format: $(VENV)/.dev  ## format, and correct what ruff can correct
	$(BIN)/ruff format . && $(BIN)/ruff check --fix .

docs: $(VENV)/.docs  ## build the documentation site, offline, and check links and accessibility
	MPLBACKEND=agg $(BIN)/python -m sphinx -q -W --keep-going -b html docs docs/_build/html
	$(BIN)/python docs/check.py docs/_build/html

release-check:  ## build twice, compare, install bare and locked, lowest versions, SBOM
	bash release/check.sh

clean:  ## remove environments and results
	rm -rf $(VENV) .venv-* result dist docs/_build docs/_live docs/gallery docs/reference/generated

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.core: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@touch $@

$(VENV)/.web: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[web,rig]'
	@touch $@ $(VENV)/.core

$(VENV)/.dev: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[all,fleet,fmu,compiler]' --group dev
	@touch $@ $(VENV)/.core $(VENV)/.web

$(VENV)/.docs: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e . --group docs
	@touch $@ $(VENV)/.core
