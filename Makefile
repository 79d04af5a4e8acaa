# Everything runs in a virtual environment of the checkout; only Python is needed on the machine.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
READY := $(VENV)/.ready
JOBS ?= 2
# every process goes on with its part of the tests and then takes from the others
SPREAD := -n $(JOBS) --dist worksteal

# the models of the gallery that move in the site: all, none, or names with commas between them
LIVE ?= all

# tests start many processes of Python, which read modules faster when the first one keeps them compiled
export PYTHONDONTWRITEBYTECODE :=
# of 6000 modules that come with dependencies tests import 1500: those alone are compiled, when they are first imported
PIP := -m pip install --quiet --disable-pip-version-check --no-compile
# each process of the tests has a processor of its own: threads of linear algebra would wait for each other on it
test check test-all: export OPENBLAS_NUM_THREADS ?= 1

.PHONY: demo test check test-all extras style lint docs bench published record release installed clean

demo: $(READY)
	$(BIN)/lag2fmu demo --plot double_pendulum.png

# the main claims on every bundled model, in minutes; style first, which takes a second
test: style
	$(BIN)/python -m pytest $(SPREAD) -m "not slow and not toolchain" $(PYTEST)

# what needs neither a compiler nor an importer and takes a minute
check: lint
	$(BIN)/python -m pytest $(SPREAD) -m "not long and not slow and not fmu and not toolchain" $(PYTEST)

# everything: other importers, cross builds, sanitizers, fuzzing; PYTEST=--optimised compiles all as users get it
test-all: $(READY)
	$(MAKE) -j $(JOBS) lint extras
	$(BIN)/python -m pytest $(SPREAD) --all-models $(PYTEST)

# what tests use if it is there; mypy knows nothing of these packages and runs meanwhile
extras: $(READY)
	-$(BIN)/python $(PIP) -e ".[imports,importers,meshes,docs,page,sweeps]"
	-$(BIN)/python $(PIP) --no-deps dm_control gymnasium  # their files alone

RECORDED := double_pendulum cart_pole four_bar_linkage heavy_top_quaternion whipple_bicycle andrews_squeezer \
	six_axis_arm bouncing_ball woodpecker sliding_sphere

# docs/record: what other tools say of ten FMUs; the FMUs themselves are not committed
record: $(READY)
	-$(BIN)/python $(PIP) -e ".[importers]"
	$(BIN)/lag2fmu record $(RECORDED) -o docs/record

# dist: wheel, sdist, record with its FMUs, site, bill of materials, and hashes. Equal commits and tools give equal bytes
release: export SOURCE_DATE_EPOCH := $(shell git log -1 --format=%ct)
release: $(READY)
	rm -rf dist build/record
	-$(BIN)/python $(PIP) -e ".[importers]"
	$(BIN)/python -m build --outdir dist
	$(BIN)/lag2fmu record $(RECORDED) -o build/record
	$(MAKE) docs
	$(BIN)/python docs/site/release.py dist record=build/record site=build/site

PYTHONS ?= python3.10 python3.11 python3.12 python3.13 python3.14

# the wheel in an empty environment of each of PYTHONS that is here: install, demo, import without a warning; minutes each
installed: $(READY)
	rm -rf build/installed
	$(BIN)/python -m build --wheel --outdir build/installed
	set -e; for python in $(PYTHONS); do \
	    command -v $$python > /dev/null || { echo "$$python is not here"; continue; }; \
	    $$python -m venv --clear build/installed/env; \
	    build/installed/env/bin/python -m pip install --quiet --disable-pip-version-check build/installed/*.whl; \
	    (cd build/installed && env/bin/lag2fmu demo > demo.txt && env/bin/python -W error -c "import lag2fmu"); \
	    build/installed/env/bin/python --version; \
	done

style: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

lint: style
	$(BIN)/mypy --num-workers $(JOBS)
	$(BIN)/mypy templates/python/runtime

# the documentation as a site, in build/site, in minutes; LIVE=none: no model of the gallery moves, which is faster
docs: $(READY)
	$(BIN)/python $(PIP) -e ".[docs]"
	LAG2FMU_LIVE=$(LIVE) NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict -f docs/site/mkdocs.yml

# all measurements, half an hour of a quiet machine; writes docs/benchmarks.md. BENCH=stepping: that one alone
bench: $(READY)
	-$(BIN)/python $(PIP) -e ".[bench,sweeps]"
	$(BIN)/python -m benchmarks.all $(BENCH)

# docs/published.md: benchmark problems of the literature beside their published numbers, in minutes
published: $(READY)
	$(BIN)/python -m benchmarks.published

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python $(PIP) -e ".[test]"
	touch $(READY)

clean:
	rm -rf $(VENV) build dist *.egg-info
