# Two commands do everything: `make train` and `make test`. Both start with `make setup`.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
RUN ?= runs/quickstart
export TORCH_INDEX

.PHONY: setup train test lint types contract unit wheel-test slow clean

setup: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml constraints.txt tools/install.py
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python tools/install.py
	touch $@

train: setup
	$(BIN)/prnav-train pointgoal --config quickstart --run $(RUN)
	$(BIN)/prnav-eval --run $(RUN) --split test --episodes 360
	$(BIN)/prnav-report $(RUN)

test: setup lint types contract unit wheel-test

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

contract: setup
	$(BIN)/lint-imports

unit: setup
	$(BIN)/python -m pytest -n 2 --dist loadfile

wheel-test: setup
	$(BIN)/python tools/wheel_test.py

slow: setup
	$(BIN)/python -m pytest -m slow

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
	find prnav tests -name __pycache__ -type d -prune -exec rm -rf {} +
