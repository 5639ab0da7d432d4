PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BENCHMARKS := startup efficiency speed_logs noisy_speeds open_hypotheses real_data supply delay timing blind limits mutations \
  contact_errors other_world board_logs diagnosis_speed exported_loop estimator \
  peers fleet_sines fleet_simulation simulation_speed fleet_scaling fleet_outliers fleet_kills devices
FAULTS := faults control_faults stop_reasons journal_damage firmware_fuzz

TOOLCHAIN := gcc-avr avr-libc binutils-avr libsimavr-dev libelf-dev

CHECKED := tests/recording tests/bench/test_encoder.py tests/docs/test_links.py tests/docs/test_constants.py \
    tests/test_layers.py tests/test_sentences.py

.PHONY: demo test check lint types bench faults docs firmware flash toolchain clean help
.DEFAULT_GOAL := help

help:
	@echo "make demo    install into $(VENV) and take the bundled recording through everything; says where the report is"
	@echo "make test    install what the tests need; lint, types, all tests"
	@echo "make check   lint, types and tests that compile nothing, in about a minute: while you edit"
	@echo "make bench   the benchmarks, each with its table (minutes)"
	@echo "make faults  the recorder under faults, each with its table (an hour)"
	@echo "make docs    the documentation as a site, in build/docs"
	@echo "make firmware             the board's program and the emulated bench (needs $(TOOLCHAIN))"
	@echo "make flash PORT=/dev/...  put the program on an Arduino Nano"
	@echo "make clean   remove $(VENV) and build products"

demo: $(VENV)/.installed
	$(BIN)/jaxmotor demo

# Tests fill the cores: numpy's threads would only wait for each other, and take processor time while they do. Processes
# that tests start would compile the whole package each where byte code is not kept.
test: lint types toolchain
	PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --dist worksteal

check: lint types
	$(BIN)/python -m pytest -q -n auto $(CHECKED)

# The firmware's tests run where its compiler and emulator can be installed, those of circuits where ngspice can;
# elsewhere they skip and say so.
toolchain:
	@if command -v avr-gcc >/dev/null && [ -e /usr/include/simavr/sim_avr.h ] && [ -e /usr/share/arduino ] && \
	  command -v ngspice >/dev/null; then :; \
	elif command -v apt-get >/dev/null && { [ "$$(id -u)" = 0 ] || sudo -n true 2>/dev/null; }; then \
	  as_root=$$([ "$$(id -u)" = 0 ] || echo sudo); \
	  $$as_root apt-get update -qq >/dev/null 2>&1; \
	  for tools in "$(TOOLCHAIN)" arduino-core-avr ngspice; do \
	    $$as_root apt-get install -y -qq --no-install-recommends $$tools >/dev/null 2>&1 || \
	    echo "could not install $$tools: tests that need it will skip"; \
	  done; \
	else echo "without $(TOOLCHAIN) the firmware's tests skip, without ngspice those of circuits"; fi

firmware:
	$(MAKE) -C firmware

flash:
	$(MAKE) -C firmware flash PORT=$(PORT)

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.installed-dev
	PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright

docs: $(VENV)/.installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict -f docs/mkdocs/mkdocs.yml
	@echo "open build/docs/index.html"

bench: $(VENV)/.installed-dev toolchain firmware
	@set -e; for name in $(BENCHMARKS); do echo "== benchmarks/$$name.py"; $(BIN)/python benchmarks/$$name.py; done

faults: $(VENV)/.installed-dev toolchain firmware
	@set -e; for name in $(FAULTS); do echo "== benchmarks/$$name.py"; $(BIN)/python benchmarks/$$name.py; done

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
	$(MAKE) -C firmware clean
	rm -rf $(VENV) build dist demo .pytest_cache .ruff_cache .hypothesis
