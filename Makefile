# make help lists the targets. Everything is installed in .venv, once for each set of extras.
PYTHON ?= $(shell python3.11 -c "" 2>/dev/null && echo python3.11 || echo python3)
WORKERS ?= 2
VENV := .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help demo docs gallery test lint matrix wheels benchmark benchmark-check clean

help: ## this list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

demo: $(VENV)/.core ## simulate the two-rotor start-up of the paper, with figures, into results/
	$(BIN)/jaxrotor run configs/two_rotor_startup.toml

docs: $(VENV)/.docs ## build the site into site/; open site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

gallery: $(VENV)/.core ## run the studies and experiments whose pictures are stale, for docs/gallery.md; minutes
	$(BIN)/python docs/pages/gallery.py

test: $(VENV)/.test $(VENV)/.interop $(VENV)/.docs ## run the tests
	$(BIN)/python -m pytest -n $(WORKERS) $(PYTEST_ARGS)

lint: $(VENV)/.test $(VENV)/.dev ## style, format and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/python docs/typed.py

matrix: ## the tests on each Python and JAX that is supported, as far as this machine has them
	WORKERS=$(WORKERS) PYTEST_ARGS="$(PYTEST_ARGS)" .ci/matrix

wheels: ## the wheel in empty environments: each Python, oldest and newest of what it needs
	.ci/wheels

benchmark: $(VENV)/.benchmarks $(VENV)/.interop ## time the program beside its peers
	for name in vector_field startup fitted estimates growth linear campbell identification uncertainty stiff sweep; do $(BIN)/python benchmarks/$$name.py || exit 1; done

benchmark-check: $(VENV)/.core ## compare the ratios that the benchmarks found with the stored ones
	$(BIN)/python benchmarks/record.py

clean: ## remove the environment and the caches; results stay
	rm -rf $(VENV) .cache .pytest_cache .ruff_cache site

# Each stamp says that its extra has been installed for the pyproject.toml and constraints of now.
$(VENV)/.python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "jaxrotor needs Python 3.11: make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.core: pyproject.toml constraints.txt | $(VENV)/.python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e .
	touch $@

$(VENV)/.test $(VENV)/.dev $(VENV)/.docs $(VENV)/.interop $(VENV)/.benchmarks: $(VENV)/.%: pyproject.toml constraints.txt | $(VENV)/.python
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[$*]'
	touch $@
