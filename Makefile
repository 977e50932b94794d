# Every target works from a fresh clone on a machine that has only Python (3.11 or later) and make: it creates
# .venv, installs exactly what it needs, once, and runs. `make` alone lists the targets.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check
STUDY  := --editable studies/savi2007
OUT    ?= out/savi2007
# Matrices are tiny: threads of the linear algebra only wait for each other and for a core.
export OPENBLAS_NUM_THREADS ?= 1
# Without bytecode each worker rewrites all tests, and each child compiles all that it imports.
export PYTHONDONTWRITEBYTECODE :=
# The order of the files is that of tests/conftest.py.
PYTEST_ARGS ?= -n auto --dist loadfile --no-loadscope-reorder

.DEFAULT_GOAL := help
.PHONY: help reproduce reproduce-full test slow installed wheels test-times mutants mutants-sample fuzz altered coverage \
	coverage-awkward coverage-fit check contacts equilibria branches bench gpu gpu-compiler docs screenshots clean distclean \
	versions

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 26

reproduce: $(VENV)/.compiled-run  ## reproduce Savi et al. (2007): figures, data and report in out/savi2007
	$(BIN)/nonsmooth reproduce savi2007 --out $(OUT)

reproduce-full: $(VENV)/.compiled-zarr  ## the same with charts of a million points; an interrupted run goes on
	$(BIN)/nonsmooth reproduce savi2007 --full --out $(OUT)

test: $(VENV)/.compiled-test  ## run the tests
	$(BIN)/python -m pytest $(PYTEST_ARGS)

slow: $(VENV)/.compiled-test $(VENV)/.installed-cluster  ## run the long campaigns that `make test` leaves out
	$(BIN)/python -m pytest -m slow -rP -o faulthandler_timeout=0 $(PYTEST_ARGS)

installed: $(VENV)/.compiled-test  ## build sdist and wheel; the README's ten lines by the wheel, in an empty environment
	$(BIN)/python tests/installed.py

wheels: $(VENV)/.compiled-test  ## dist/: a wheel with compiled kernels for Linux, and a plain one; both tried in empty environments
	$(BIN)/python tests/installed.py --wheels dist

test-times: $(VENV)/.compiled-test  ## processor time of each file of tests: compiling, importing, children, browser, rest
	$(BIN)/python -m pytest -p tests.costs -n 0 -q

mutants: $(VENV)/.compiled-test  ## small mistakes in the sources, one by one: each must fail a test
	$(BIN)/python tests/mutants.py

mutants-sample: $(VENV)/.compiled-test  ## 300 generated mistakes, spread over the rooms by the commit's hash (hours)
	@mkdir -p out
	test -f out/called.json || $(BIN)/python -m pytest -p tests.costs --called out/called.json -n 0 -q
	$(BIN)/python tests/mutants_sample.py $(NUMBER)

fuzz: $(VENV)/.compiled-test  ## read 100 000 damaged recordings with every reader
	$(BIN)/python -m pytest -m slow tests/recordings/test_fuzz.py -s

altered: $(VENV)/.compiled-test  ## alter bytes of 400 saved files of each format: none loads with other content
	$(BIN)/python -m pytest -m slow tests/results/test_altered_bytes.py -s

coverage: $(VENV)/.compiled-run  ## identify 40 virtual rigs; writes docs/measured_coverage.md
	$(BIN)/python -m studies.savi2007.tests.identification.coverage --seeds 0-39 --out docs/measured_coverage.md

coverage-awkward: $(VENV)/.compiled-run  ## the same on rigs where much goes wrong; writes docs/measured_coverage_awkward.md
	$(BIN)/python -m studies.savi2007.tests.identification.coverage --awkward --seeds 0-39 --out docs/measured_coverage_awkward.md

coverage-fit: $(VENV)/.compiled-test  ## fit twelve systems to data of SciPy, 40 seeds each; writes docs/measured_coverage_fit.md
	$(BIN)/python -m tests.identification.fit_coverage --seeds 0-39 --out docs/measured_coverage_fit.md

equilibria: $(VENV)/.compiled-test  ## equilibria of 200 random systems beside their enumeration (half an hour)
	$(BIN)/python tests/independent/equilibria_campaign.py 0 200

contacts: $(VENV)/.compiled-test  ## 1000 random systems with contacts and friction beside an independent reference (hours)
	$(BIN)/python tests/independent/contact_campaign.py 0 1000 --rows out/contacts.jsonl

branches: $(VENV)/.compiled-test  ## 100 branches of random systems, each entered at five of its points (an hour)
	$(BIN)/python tests/continuation/entries_campaign.py --rows out/branches.jsonl

check: $(VENV)/.installed-dev  ## ruff (rules and form), mypy, import-linter, codespell, prose of docstrings, weight of rooms
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/codespell README.md CHANGELOG.md CONTRIBUTING.md src studies tests docs benchmarks examples
	$(BIN)/python tests/prose.py
	$(BIN)/python tests/weight.py --check

bench: $(VENV)/.compiled-bench  ## compare with other programs on the same work; writes benchmarks/results.md
	$(BIN)/python benchmarks/run.py

gpu: $(VENV)/.installed-gpu  ## compare a GPU with the processor and time it; writes benchmarks/results_gpu.md
	$(BIN)/python benchmarks/gpu.py --out benchmarks/results_gpu.md

gpu-compiler: $(VENV)/.installed-gpu  ## registers, spills and operations of the GPU's kernels; needs no GPU
	$(BIN)/python benchmarks/gpu.py --compiler

docs: $(VENV)/.installed-docs  ## build the documentation into docs/_build/html
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

screenshots: docs  ## pictures of some pages at 1280 and 400 pixels; no page is wider than its window (needs Chromium)
	$(BIN)/python docs/make_screenshots.py
	$(BIN)/python docs/make_screenshots.py all

clean:  ## remove results, built documentation and caches
	rm -rf out docs/_build .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis build dist
	find src studies tests benchmarks examples -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean  ## remove .venv too, and what was compiled ahead
	rm -rf $(VENV) src/nonsmooth/kernels/ahead

# One stamp per set of packages; a changed pyproject.toml installs again. Kernels are compiled ahead by the Numba that is
# installed here, not by the one that pip would fetch to build a wheel.
export HATCH_BUILD_NO_HOOKS := true

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed-run: pyproject.toml studies/savi2007/pyproject.toml | $(BIN)/python
	$(PIP) --editable . $(STUDY)
	@touch $@

# Groups of packages for work on this one, which need pip 25.1; all others are extras.
$(VENV)/.pip: | $(BIN)/python
	$(PIP) 'pip>=25.1'
	@touch $@

$(patsubst %,$(VENV)/.installed-%,test dev docs bench): $(VENV)/.installed-%: pyproject.toml studies/savi2007/pyproject.toml | $(VENV)/.pip
	$(PIP) --editable . $(STUDY) --group $*
	@touch $@

CHECKED := dev test docs  # what .ci/run needs, by one call of pip
$(VENV)/.installed-checked: pyproject.toml studies/savi2007/pyproject.toml | $(VENV)/.pip
	$(PIP) --editable . $(STUDY) $(CHECKED:%=--group %)
	@touch $(CHECKED:%=$(VENV)/.installed-%) $@

$(VENV)/.installed-%: pyproject.toml studies/savi2007/pyproject.toml | $(BIN)/python
	$(PIP) --editable '.[$*]' $(STUDY)
	@touch $@

.PRECIOUS: $(VENV)/.installed-%

# The reproduction runs nothing of more than two states by the exact flow.
$(VENV)/.compiled-run $(VENV)/.compiled-zarr: STEPPERS := --steppers series planar

$(VENV)/.compiled-%: $(VENV)/.installed-%
	$(BIN)/python -m nonsmooth.kernels.compile.ahead $(STEPPERS)
	@touch $@

# Each environment is thrown away; nothing is installed into .venv.
versions:  ## every verb with the lowest and the newest libraries allowed, with each Python found (minutes each)
	$(PYTHON) tests/versions.py
