# Everything a fresh Debian or Ubuntu with git, make and Python >= 3.11 (with venv) needs.
#
#   make demo    a simulated drive on OPC UA and MQTT, on this machine
#   make test    all checks and tests
#   make check   format, lint, types, import contracts
#   make bench   everything in benchmarks/, on a quiet machine
#   make prove   worlds in a box for MINUTES=30, and docs/proof.md anew
#   make pins    make requirements/*.txt anew from pyproject.toml (needs uv)
#   make clean   remove the virtual environment and caches

PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready

.PHONY: demo test check bench prove setup pins clean
.DEFAULT_GOAL := test

demo: $(READY)
	@$(BIN)/gateway demo

test: check
	$(BIN)/pytest -n 2 --dist loadgroup -rs

check: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(READY)
	@for name in $(basename $(notdir $(wildcard benchmarks/*.py))); do \
	  echo "== $$name"; $(BIN)/python -m benchmarks.$$name || exit 1; done

MINUTES ?= 30
prove: $(READY)
	$(BIN)/python -m tests.prove --minutes $(MINUTES) --report docs/proof.md

setup: $(READY)

$(READY): pyproject.toml requirements/dev.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
	  { echo "Python 3.11 or newer is needed; name one with: make PYTHON=/path/to/python3 $(MAKECMDGOALS)" >&2; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv || \
	  { echo "This Python cannot make virtual environments; on Debian: apt-get install python3-venv" >&2; exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/dev.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

PINS := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
	--no-emit-index-url --no-header --no-annotate --quiet
pins:
	$(PINS) --output-file requirements/runtime.txt
	$(PINS) --extra dev --constraint requirements/runtime.txt --output-file requirements/dev.txt

clean:
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
