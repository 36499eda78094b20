# Each target sets up what it needs: only Python 3.11 or newer with venv and pip, and make, have to be there.
PYTHON ?= python3
BIN := .venv/bin
RECORDINGS := ../shared/data/festo_tp511

.PHONY: demo test check clean

demo: .venv/ready
	@echo "1/3 the paper's figures on jack-10t"
	@$(BIN)/jackbench run experiments/paper.toml --out out/paper --force
	@echo "2/3 position steps of a closed loop"
	@$(BIN)/jackbench run experiments/position_step.toml --out out/position_step --force
	@if [ -d $(RECORDINGS) ]; then \
	  echo "3/3 a model held against real recordings" && \
	  $(BIN)/jackbench residual $(RECORDINGS) --out out/residual-festo_tp511 --force && \
	  echo "open out/residual-festo_tp511/report.html"; \
	else \
	  echo "3/3 a model held against the bundled sample (simulated; the real recordings are not in $(RECORDINGS))" && \
	  $(BIN)/jackbench residual experiments/sample --out out/residual-sample --force && \
	  echo "open out/residual-sample/report.html"; \
	fi
	@echo "open out/paper/report.html and out/position_step/report.html"

test: .venv/ready
	$(BIN)/pytest

check: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports

.venv/ready: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "jackbench needs Python 3.11 or newer, this is " + sys.version.split()[0])'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --editable . --group dev
	@touch $@

clean:
	rm -rf .venv out
