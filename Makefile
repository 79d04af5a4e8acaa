# Everything runs in a virtual environment of the checkout; only Python is needed on the machine.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
READY := $(VENV)/.ready
JOBS ?= 2
# every process goes on with its part of the tests and then takes from the others
SPREAD := -n $(JOBS) --dist worksteal

.PHONY: demo test check test-all lint bench clean

demo: $(READY)
	$(BIN)/lag2fmu demo --plot double_pendulum.png

# the main claims on every bundled model, in minutes
test: $(READY)
	$(BIN)/python -m pytest $(SPREAD) -m "not slow and not toolchain" $(PYTEST)

# what needs neither a compiler nor an importer
check: lint
	$(BIN)/python -m pytest $(SPREAD) -m "not slow and not fmu and not toolchain" $(PYTEST)

# everything: other importers, cross builds, sanitizers, fuzzing
test-all: lint
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[imports,importers,sweeps]"
	$(BIN)/python -m pytest $(SPREAD) --all-models $(PYTEST)

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy templates/python/runtime

# all measurements, an hour of a quiet machine; writes docs/benchmarks.md. BENCH=stepping: that one alone
bench: $(READY)
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[bench]"
	$(BIN)/python -m benchmarks.all $(BENCH)

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[test]"
	touch $(READY)

clean:
	rm -rf $(VENV) build dist *.egg-info
