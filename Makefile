# Every goal makes what it needs: `make run` and `make test` work on a bare clone. Everything installed lies in .venv.

PYTHON ?= python3
VENV   := .venv
# Tools are run as modules: the scripts in bin/ name a folder that may have moved.
PY     := $(VENV)/bin/python
PIP    := $(PY) -m pip --disable-pip-version-check --no-input
# Two thirds of pip's work were byte-compiling what nothing imports: Python compiles what it imports, once, if it may.
INSTALL = $(PIP) install --quiet --no-compile -c constraints.txt
export PYTHONDONTWRITEBYTECODE =
# What a run needs in two halves that have no package in common: two installers share the cores.
HALVES  = "matplotlib numba pandas scipy" "fastapi filelock jinja2 markdown-it-py mpmath orjson platformdirs psutil pyarrow \
	python-flint python-multipart rich uvicorn"
RUN    := $(VENV)/.installed-run
TEST   := $(VENV)/.installed-test
DEV    := $(VENV)/.installed-dev
KILLS  ?= 1000
REQUESTS ?= 1000000
RECENT  = { $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
    { echo 'phongbench needs Python 3.11 or newer; name one: make GOAL PYTHON=python3.12' >&2; exit 2; }; }

# When this began, for the run that says where the time went.
BEGAN  := $(shell date +%s)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help run test soak mutate check bench bench-api targets docs lock clean

# An editable install points at the folder it was made in: in a moved or copied checkout the stamps do not count.
$(shell test "$$(cat $(VENV)/.checkout 2>/dev/null)" = "$$(pwd -P)" || rm -f $(RUN) $(TEST) $(DEV))

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

run: $(RUN) ## a quick study on this machine; prints what to ship, where the time went and where its report is
	PHONGBENCH_STARTED=$(BEGAN) $(PY) -m phongbench run

# Tests start many processes that import all packages: what is compiled for one is kept for the others, always.
test: $(TEST) ## the tests, on all cores
	PYTHONDONTWRITEBYTECODE= $(PY) -m pytest --numprocesses=auto

soak: $(TEST) ## for hours: attacked budgets, devices at their worst, random lines and pictures, disk faults, KILLS=1000, REQUESTS=1000000
	PHONGBENCH_SOAK=1000 $(PY) -m pytest --numprocesses=auto tests/phongbench/analysis/test_promise.py tests/phongbench/analysis/test_raw_promise.py \
		tests/phongbench/accuracy/test_contract_catalogue.py
	PYTHONPATH=tests/soak $(PY) -m soaking inverse
	PYTHONPATH=tests/soak $(PY) -m soaking disk --docs
	PYTHONPATH=tests/soak $(PY) -m soaking kills --count $(KILLS) --docs
	PYTHONPATH=tests/soak $(PY) -m soaking cluster --docs
	PYTHONPATH=tests/soak:tests/api $(PY) -m soaking service --requests $(REQUESTS) --docs
	PYTHONPATH=tests/soak $(PY) -m soaking gpu
	PYTHONPATH=tests/soak $(PY) -m soaking page

mutate: $(TEST) ## 200 single changes of the product, each against the tests that run it; goes on where it stopped
	PYTHONPATH=tests/mutate $(PY) -m mutating --docs

check: $(DEV) ## lint, format, types, layers
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(PY) -c 'from importlinter.cli import lint_imports_command; lint_imports_command()' --no-logo --no-cache

bench: $(TEST) ## our kernels, sweep, shading, pictures and stages beside peers and bounds; a ledger of them
	$(PY) -m phongbench bench $(BENCH)

bench-api: $(TEST) ## the service over loopback: against an echo, against /healthz, overloaded
	PYTHONPATH=tests/api $(PY) -m load

targets: $(TEST) ## the shipped costs of formulas, on every target whose compiler is here
	$(PY) -m phongbench.targets

docs: $(TEST) ## fill the generated parts of README.md and reports/docs; the only way a number gets in there
	$(PY) -m phongbench_reports.readme

# `pip list` and not `pip freeze`: freeze writes the address of anything that came from a file.
lock: ## rewrite constraints.txt from a fresh resolution of runtime, test, dev and targets
	@$(RECENT)
	@box=$$(mktemp -d) && trap 'rm -rf "$$box"' EXIT && set -e && \
	$(PYTHON) -m venv "$$box" && \
	"$$box/bin/python" -m pip --disable-pip-version-check --no-input install --quiet -e ".[test,dev,targets]" && \
	"$$box/bin/python" -m pip --disable-pip-version-check list --format=freeze \
	    --exclude phongbench --exclude pip --exclude setuptools >"$$box/pins" && \
	{ echo '# The exact releases the tests run with. Written by `make lock`; the ranges are in pyproject.toml.'; \
	  LC_ALL=C sort -f "$$box/pins"; } >constraints.txt
	@echo "constraints.txt: $$(grep -c == constraints.txt) pins"

clean: ## remove the environment, caches and build output (runs are kept)
	rm -rf $(VENV) dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find phongbench api reports tests -name __pycache__ -type d -prune -exec rm -rf {} +

# A usable .venv of any origin is kept; one that is broken, without pip or too old is made anew. A run needs no test tools.
$(RUN): pyproject.toml constraints.txt
	@$(PY) -c 'import sys, pip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
	    { $(RECENT) && $(PYTHON) -m venv --clear $(VENV); }
	@for half in $(HALVES); do $(INSTALL) --no-warn-conflicts $$half & done; $(INSTALL) --no-deps --no-warn-conflicts -e . || { wait; exit 1; }; wait
	@$(INSTALL) "phongbench[certify]" # what is lacking still
	@pwd -P >$(VENV)/.checkout
	@touch $@

$(TEST): $(RUN)
	$(INSTALL) -e ".[test]"
	@$(PY) -m compileall -qq -j 0 $(VENV)/lib || : # by all cores; else pytest takes warnings of others' sources for errors
	@touch $@

$(DEV): $(TEST)
	$(INSTALL) -e ".[test,dev]"
	@touch $@
