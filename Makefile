# make demo   sets up everything and does the main job on two recordings
# make test   sets up everything and passes the tests
# make lint   ruff and mypy
# make bench  every benchmark; make bench-NAME one of them

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/pip --quiet --disable-pip-version-check

.PHONY: demo test lint bench bench-calibration bench-effects bench-hidden-small bench-inference bench-material bench-paper \
	bench-perception bench-posterior bench-proposals bench-real bench-sets bench-sim clean

# what the demo needs; tests and linters need a little more
$(VENV)/.ready: pyproject.toml constraints.txt
	@echo "setting up $(VENV) (some minutes, torch as a CPU build)"
	@$(PYTHON) -m venv $(VENV)
	@$(PIP) install -c constraints.txt -e '.[all]' 2>/dev/null || $(BIN)/pip install -c constraints.txt -e '.[all]'
	@touch $@

$(VENV)/.ready-dev: $(VENV)/.ready
	@echo "adding what tests and linters need"
	@$(PIP) install -c constraints.txt -e '.[all,dev]' 2>/dev/null || $(BIN)/pip install -c constraints.txt -e '.[all,dev]'
	@touch $@

# sbibm asks for an sbi of its own, long gone: it comes without what it asks for
$(VENV)/.ready-bench: $(VENV)/.ready
	@echo "adding what muslin is measured against"
	@$(PIP) install -c constraints.txt -e '.[all,bench]'
	@$(PIP) install -c constraints.txt --no-deps sbibm
	@touch $@

demo: $(VENV)/.ready
	@$(BIN)/python examples/demo.py

# two processes; more threads of linear algebra would be in one another's way
test: $(VENV)/.ready-dev
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist worksteal

lint: $(VENV)/.ready-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@rm -rf build/types && mkdir -p build/types/muslin
	@for part in __init__.py py.typed core backends perception inference plugins cli; do \
		ln -s "$(CURDIR)/$$part" build/types/muslin/$$part; done
	cd build/types && MYPYPATH=. "$(CURDIR)/$(BIN)/mypy" --config-file "$(CURDIR)/pyproject.toml" -p muslin

bench: bench-calibration bench-hidden-small bench-inference bench-material bench-posterior bench-proposals bench-sets bench-sim

# needs an hour or more; EFFECTS="--part test --cases 400 --minutes 2000" for the whole
bench-effects: $(VENV)/.ready-bench
	$(BIN)/python tests/benchmarks/effects.py $(EFFECTS)

bench-hidden-small: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/hidden_small.py

bench-inference: $(VENV)/.ready-bench
	$(BIN)/python tests/benchmarks/inference.py

bench-paper: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/paper.py $(PAPER)

# an hour and a quarter on one core; PERCEPTION="--only heatmap --scenarios wiping --shifts" is a part of the first
bench-perception: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/perception.py $(PERCEPTION)
	$(BIN)/python tests/benchmarks/perception_study.py $(PERCEPTION_STUDY)

bench-calibration: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/calibration.py

bench-posterior: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/posterior.py

bench-proposals: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/proposals.py

# real recordings: those in the repository, and those in the folder MUSLIN_DATA; REAL="--only 'cable 1'" for a part
bench-real: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/real.py $(REAL)

bench-sets: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/sets.py

bench-sim: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/sim.py

bench-material: $(VENV)/.ready
	$(BIN)/python tests/benchmarks/material.py

clean:
	rm -rf $(VENV) build *.egg-info demo
