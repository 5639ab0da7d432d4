PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BENCHMARKS := startup efficiency

.PHONY: demo test lint types bench clean help
.DEFAULT_GOAL := help

help:
	@echo "make demo    install into $(VENV) and identify the bundled recording; says where the figures are"
	@echo "make test    install what the tests need; lint, types, all tests"
	@echo "make bench   the benchmarks, each with its table (minutes)"
	@echo "make clean   remove $(VENV) and build products"

demo: $(VENV)/.installed
	$(BIN)/jaxmotor demo

test: lint types
	$(BIN)/python -m pytest -n auto

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.installed-dev
	PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright

bench: $(VENV)/.installed-dev
	@set -e; for name in $(BENCHMARKS); do echo "== benchmarks/$$name.py"; $(BIN)/python benchmarks/$$name.py; done

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "jaxmotor needs Python 3.11 or newer; name one with: make PYTHON=python3.12 ..."; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { rm -rf $(VENV); echo "Python's venv module is missing; on Debian and Ubuntu: apt install python3-venv"; exit 1; }

$(VENV)/.installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@ $(VENV)/.installed

clean:
	rm -rf $(VENV) build dist demo .pytest_cache .ruff_cache .hypothesis
