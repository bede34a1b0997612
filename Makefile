# The workbench from a clone: `make demo` shows it, `make test` checks it.
# Needs make and Python 3.11 to 3.13; with uv on the path the set-up is faster, and the same.
# Another Python: `make test PYTHON=python3.12`.

PYTHON ?= python3
BIN := .venv/bin
READY := .venv/ready
UV := $(shell command -v uv 2>/dev/null)
# Without a C compiler one is installed as a package (100 MB): simulations run five times faster.
COMPILER := $(shell command -v cc || command -v gcc || command -v clang)
LOCKS := -r requirements.lock $(if $(COMPILER),,-r compiler.lock)

# Two workers test at a time: further threads of BLAS would only wait for a core.
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: demo test test-all lint lock clean

demo: $(READY)
	@$(BIN)/workbench demo

test: lint
	@$(BIN)/python -m pytest -n 2 --dist worksteal -q

test-all: lint
	@$(BIN)/python -m pytest -n 2 --dist worksteal -q -m ""

lint: $(READY)
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --check --quiet .

# Every package comes as a wheel whose hash is in requirements.lock: nothing is compiled here,
# and a package that differs from the locked one stops the set-up. Python compiles what it imports,
# which is a small part of them.
$(READY): requirements.lock compiler.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || { \
	  echo "$(PYTHON) is $$($(PYTHON) --version 2>&1); the workbench needs Python 3.11 to 3.13:" \
	       "make PYTHON=python3.12" >&2; exit 1; }
	@echo "Setting up .venv (once, about a minute)"
	@rm -rf .venv
ifdef UV
	@uv venv --quiet --python "$(PYTHON)" .venv
	@VIRTUAL_ENV=.venv uv pip install --quiet --require-hashes --only-binary :all: $(LOCKS)
	@VIRTUAL_ENV=.venv uv pip install --quiet --no-deps --no-build-isolation -e .
else
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip -qq --disable-pip-version-check install --no-compile \
	  --require-hashes --only-binary :all: $(LOCKS)
	@$(BIN)/python -m pip -qq --disable-pip-version-check install \
	  --no-deps --no-build-isolation -e .
endif
	@touch $@

# Keeps the pins that still fit pyproject.toml; remove requirements.lock first to renew them all.
# The oldest Python is named, or uv would lock for the one at hand and newer only.
lock:
	@uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
	  --custom-compile-command "make lock" \
	  --extra automotive --extra build --extra cluster --extra page --extra test \
	  pyproject.toml -o requirements.lock
	@echo ziglang | uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url --custom-compile-command "make lock" - -o compiler.lock

clean:
	@rm -rf .venv .pytest_cache .ruff_cache .mypy_cache .hypothesis .benchmarks build dist
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
