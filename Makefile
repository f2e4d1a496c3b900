# `make demo` and `make test` are all you need. Each makes .venv and installs what it needs on its first call;
# later calls use the stamps in .venv and start at once. Another Python: make PYTHON=python3.12 test

PYTHON ?= python3
WORKERS ?= 2
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

export PYRIGHT_PYTHON_IGNORE_WARNINGS := 1

.PHONY: help demo test test-services fuzz check format web-assets bench calibrate validate docs picture wheelhouse release-check venv clean

help:
	@echo "make demo     diagnose simulated plant data and write a report"
	@echo "make test     run the tests that need nothing but Python"
	@echo "make test-services  run the tests with a browser (Chromium), a database server (PostgreSQL), killed processes"
	@echo "make fuzz     read 20 000 damaged inputs of all formats"
	@echo "make check    lint, types, import contracts, documentation"
	@echo "make format   let ruff mend layout and imports"
	@echo "make web-assets  fetch the plot library of stiction serve (needed once in a clone)"
	@echo "make bench    measure speed"
	@echo "make calibrate  train the model of the verdict on simulated loops (some minutes)"
	@echo "make validate   score it and the published methods on other loops; write docs/validation.md and docs/benchmark.md"
	@echo "make docs     build the documentation site into docs/_build/html and check it"
	@echo "make picture  draw the pictures of README and documentation anew"
	@echo "make wheelhouse  collect all packages for a computer without internet in dist/wheelhouse"
	@echo "make release-check  build the package, install it with each extra, run the demo"
	@echo "make venv     make .venv with everything a developer needs"
	@echo "make clean    remove .venv and caches"

demo: $(VENV)/.ready
	@$(BIN)/stiction demo || [ $$? -eq 1 ]  # 1: a verdict differs from the truth, as the table shows

test: $(VENV)/.ready-test
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal -m "not (slow or browser or database or processes)"

test-services: $(VENV)/.ready-test
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal -m "not slow and (browser or database or processes)"

fuzz: $(VENV)/.ready-test
	$(BIN)/python tests/damaged_inputs.py 20000

check: $(VENV)/.ready-check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports
	$(BIN)/python calibration/room_sizes.py

format: $(VENV)/.ready-check
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

web-assets: $(VENV)/.ready-check
	$(BIN)/python .ci/web_assets.py

bench: $(VENV)/.ready-test
	$(BIN)/python benchmarks/run.py

TABLES := calibration/out
RECORDS := $(or $(STICTION_RECORDS),../shared/data)

calibrate: $(VENV)/.ready-test
	$(BIN)/python -m calibration.feature_table --chunks 959 --seed 7 --jobs $(WORKERS) --out $(TABLES)/train.parquet
	$(BIN)/python -m calibration.train $(TABLES)/train.parquet
	$(BIN)/python -m calibration.feature_table --sets kinds --chunks 135 --seed 11 --jobs $(WORKERS) --out $(TABLES)/kinds.parquet
	$(BIN)/python -m calibration.train_causes $(TABLES)/kinds.parquet
	$(BIN)/python -m calibration.history_table --simulator first --histories 600 --seed 31 --jobs $(WORKERS) --out $(TABLES)/histories.parquet
	$(BIN)/python -m calibration.train_pooling $(TABLES)/histories.parquet

validate: $(VENV)/.ready-test
	$(BIN)/python -m calibration.feature_table --chunks 500 --seed 8 --jobs $(WORKERS) --out $(TABLES)/fresh.parquet
	$(BIN)/python -m calibration.feature_table --sets second --chunks 480 --seed 5 --jobs $(WORKERS) --out $(TABLES)/second.parquet
	if [ -f "$(RECORDS)/labels.csv" ]; then $(BIN)/python -m calibration.feature_table --recorded "$(RECORDS)" --out $(TABLES)/recorded.parquet; fi
	$(BIN)/python -m calibration.feature_table --sets kinds --chunks 150 --seed 41 --jobs $(WORKERS) --out $(TABLES)/kinds-fresh.parquet
	$(BIN)/python -m calibration.feature_table --sets second_kinds --chunks 150 --seed 42 --jobs $(WORKERS) --out $(TABLES)/kinds-second.parquet
	$(BIN)/python -m calibration.validate --first $(TABLES)/fresh.parquet --second $(TABLES)/second.parquet --recorded $(TABLES)/recorded.parquet --kinds $(TABLES)/kinds-fresh.parquet --second-kinds $(TABLES)/kinds-second.parquet
	$(BIN)/python -m calibration.history_table --simulator first --histories 400 --seed 43 --jobs $(WORKERS) --out $(TABLES)/histories-first.parquet
	$(BIN)/python -m calibration.history_table --simulator second --histories 400 --seed 44 --jobs $(WORKERS) --out $(TABLES)/histories-second.parquet
	$(BIN)/python -m calibration.validate_histories $(TABLES)/histories-first.parquet $(TABLES)/histories-second.parquet --write
	$(BIN)/python -m calibration.benchmark --first $(TABLES)/fresh.parquet --second $(TABLES)/second.parquet --recorded $(TABLES)/recorded.parquet
	$(BIN)/python docs/trust_numbers.py

docs: $(VENV)/.ready-docs
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --fresh-env --quiet docs docs/_build/html
	$(BIN)/python docs/check_site.py docs/_build/html

picture: $(VENV)/.ready-docs
	$(BIN)/python docs/pictures.py
	$(BIN)/python docs/trust_numbers.py

wheelhouse: $(VENV)/.ready-release
	$(BIN)/python .ci/web_assets.py
	$(BIN)/python -m pip wheel --quiet --wheel-dir dist/wheelhouse '.[control,dask,matlab,plot,sklearn,sql,web]'

release-check: $(VENV)/.ready-release
	$(BIN)/python .ci/web_assets.py
	$(BIN)/python .ci/release_check.py

venv: $(VENV)/.ready-check

clean:
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .import_linter_cache .hypothesis

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("stiction needs Python 3.11 or later, this is " + sys.version.split()[0] + "; name another: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.ready: pyproject.toml | $(VENV)/.made
	$(PIP) --editable .
	@touch $@

$(VENV)/.ready-test: pyproject.toml | $(VENV)/.made
	$(PIP) --editable '.[test]'
	@touch $@ $(VENV)/.ready

$(VENV)/.ready-check: pyproject.toml | $(VENV)/.made
	$(PIP) --editable '.[test,check]'
	@touch $@ $(VENV)/.ready-test $(VENV)/.ready

$(VENV)/.ready-docs: pyproject.toml | $(VENV)/.made
	$(PIP) --editable '.[docs]'
	@touch $@ $(VENV)/.ready-test $(VENV)/.ready

$(VENV)/.ready-release: pyproject.toml | $(VENV)/.made
	$(PIP) --editable '.[release]'
	@touch $@ $(VENV)/.ready
