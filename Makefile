# Each target does its own set-up. Needed on the machine: Python 3.11 or newer, make, a C compiler, Rust (cargo).
# `make` alone lists the targets.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# The environment made here, whichever other one is active.
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
unexport CONDA_PREFIX PYTHONHOME PYTHONPATH
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# The other kind of processor whose registers are used.
ARM := aarch64-unknown-linux-gnu

# Debian's packages that tests use: a browser, and the reader of SDF files.
DEBIAN := chromium libsdformat-dev pkg-config

# On CI the locked crates and no others.
LOCKED := $(if $(CI),--locked)

DEPS := $(VENV)/.deps
BUILT := $(VENV)/.built
# Whatever the compiled module is made from; Python sources are used in place and need no build.
RUST := Cargo.toml $(wildcard Cargo.lock) $(shell find crates/core crates/py -name target -prune -o -type f \( -name '*.rs' -o -name 'Cargo.toml' \) -print 2>/dev/null)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test test-all test-rust tools lint bench docs gallery wheel lock clean

help: ## list the targets
	@awk 'BEGIN { FS = ":.*## " } /^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile

demo: $(BUILT) ## analyse the published manipulator: tables and figures into demo/
	$(BIN)/polypod demo -o demo

test: $(BUILT) test-rust tools ## Rust and Python tests, without the slow ones
	$(BIN)/python -m pytest -n auto

test-all: tools $(BUILT) ## all tests, the slow ones too
	cargo test $(LOCKED) --release -- --include-ignored
	$(BIN)/python -m pytest -m "" -n auto

tools: ## what some tests use beside Python and Rust; on Debian, as root, it is installed
	@if ! command -v dpkg-query apt-get >/dev/null; \
	then echo "no Debian: tests that need $(DEBIAN) are left out"; \
	elif [ -z "$$(dpkg-query -Wf '$${db:Status-Status}\n' $(DEBIAN) 2>&1 | grep -vx installed)" ]; then :; \
	elif [ "$$(id -u)" = 0 ]; then apt-get update -qq && apt-get install -qq -y --no-install-recommends $(DEBIAN) >/dev/null; \
	else echo "tests that need them are left out; to have them: sudo apt-get install $(DEBIAN)"; fi

test-rust: $(BUILT)
	cargo test $(LOCKED) --release

lint: $(BUILT) ## formatting, style and types of both languages
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/python tools/imports.py
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest --mypy-config-file pyproject.toml polypod._core
	cargo fmt --all --check
	cargo clippy $(LOCKED) --workspace --all-targets -- -D warnings
	@if [ -d "$$(rustc --print target-libdir --target $(ARM))" ]; \
	then echo "cargo clippy --target $(ARM)"; cargo clippy $(LOCKED) --target $(ARM) -p polypod-core -- -D warnings; \
	else echo "registers of $(ARM): not compiled, rustup target add $(ARM)"; fi

bench: $(BUILT) ## measure the speed, beside alternatives, and write docs/performance.md
	$(BIN)/python -m benchmarks

docs: $(BUILT) ## build the site into site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

gallery: $(BUILT) ## draw the pictures of the site's gallery and catalogue again
	$(BIN)/python docs/gallery.py
	$(BIN)/python docs/catalogue.py

wheel: $(DEPS) ## build a wheel for this machine into dist/
	$(BIN)/maturin build --release $(LOCKED) --out dist

lock: $(DEPS) ## renew requirements.lock and Cargo.lock
	$(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-header \
		--extra dev --extra bench --output-file requirements.lock pyproject.toml
	cargo update

clean: ## remove whatever these targets made
	rm -rf $(VENV) build demo dist site target .mypy_cache .pytest_cache .ruff_cache
	rm -f python/polypod/_core*.so python/polypod/_core*.pyd
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(DEPS): requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "Polypod needs Python 3.11 or newer.")'
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	@touch $@

$(BUILT): $(DEPS) $(RUST) pyproject.toml
	$(BIN)/maturin develop --uv --release $(LOCKED)
	@touch $@
