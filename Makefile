# The verbs of this house; `make` alone prints them.
PYTHON ?= python3
WORKERS ?= 2

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
INSTALLING := $(VENV)/.installing

.DEFAULT_GOAL := help
.PHONY: help install fly test check docs bench

help: ## print the verbs
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
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
	@$(BIN)/python -m pytest -n $(WORKERS)

check: install ## lint, formatting, types, and the floors of the house
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/python -m pytest -q tests/test_floors.py

docs: install ## draw the README's figures and rewrite the generated pages
	@$(BIN)/python docs/make.py

bench: install ## run every script in benchmarks/
	@for script in benchmarks/*.py; do \
		[ -e "$$script" ] || { echo 'benchmarks/ holds no script'; break; }; \
		echo "== $$script"; \
		$(BIN)/python "$$script" || exit 1; \
	done
