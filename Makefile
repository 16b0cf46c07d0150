# The verbs of this house; `make` alone prints them.
PYTHON ?= python3
WORKERS ?= 2

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
INSTALLING := $(VENV)/.installing
ARM_PACKAGES := gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm

.DEFAULT_GOAL := help
.PHONY: help install fly test check docs bench arm arm-tools

help: ## print the verbs
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo 'PYTHON=... chooses the interpreter of a new $(VENV), WORKERS=... the number of test processes.'

install: $(INSTALLED) ## create .venv with gammastar and every extra; again when pyproject.toml has changed
	@:

# An installation carries the name $(INSTALLING) until it is complete; one that was interrupted is started afresh.
$(INSTALLED): pyproject.toml
	@echo 'installing gammastar and every extra into $(VENV)'
	@if [ -e $(INSTALLING) ]; then rm -rf $(VENV); fi
	@mkdir -p $(VENV)
	@rm -f $(INSTALLED)
	@touch $(INSTALLING)
	@if ! $(BIN)/python -m pip --version >/dev/null 2>&1; then $(PYTHON) -m venv $(VENV); fi
	@$(BIN)/python -m pip install -qq --no-input --disable-pip-version-check --editable '.[all]'
	@mv $(INSTALLING) $(INSTALLED)

fly: install ## fly the upside-down recovery
	@$(BIN)/gammastar fly upside-down

test: install ## run every test
	@$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal

check: install ## lint, formatting, types, and the floors of the house
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/python -m pytest -q tests/test_floors.py

docs: install ## draw the README's figures and rewrite the generated pages
	@$(BIN)/python docs/make.py

bench: install ## run every script in benchmarks/
	@for script in benchmarks/*.py; do \
		echo "== $$script"; \
		$(BIN)/python "$$script" || missed="$$missed $$script"; \
	done; \
	if [ -n "$$missed" ]; then echo "not as wished:$$missed"; exit 1; fi

arm: install ## count the instructions of an exported mission on an emulated Cortex-M4F
	@$(BIN)/python benchmarks/cortex_m4.py

arm-tools: ## install the compiler and the emulator that arm needs, as root on Debian; elsewhere say what to install
	@for tool in arm-none-eabi-gcc qemu-system-arm; do command -v $$tool >/dev/null || missing=1; done; \
	if [ -z "$$missing" ]; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && timeout 100 apt-get -qq update >/dev/null 2>&1 && \
		DEBIAN_FRONTEND=noninteractive apt-get -qq install --no-install-recommends --yes $(ARM_PACKAGES) >/dev/null 2>&1; \
	then echo 'installed $(ARM_PACKAGES)'; else echo 'not installed: $(ARM_PACKAGES); arm is skipped without them'; fi
