# Each target sets up what it needs: only Python 3.11 or newer with venv and pip, and make, have to be there.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test fuzz lowest check figures docs docs-fast durations wheel release clean

demo: .venv/ready
	@echo "1/3 the paper's figures on jack-10t"
	@$(BIN)/jackbench run experiments/paper.toml --out out/paper --force
	@echo "2/3 a position loop"
	@$(BIN)/jackbench run experiments/first_loop.toml --out out/first_loop --force
	@echo "3/3 why do model and rig disagree? the bundled sample, simulated elsewhere with an effect that jack-10t lacks;"
	@echo "    every effect of the library is tried, which takes half a minute; the reports above can be read meanwhile"
	@$(BIN)/jackbench trace experiments/sample --out out/trace-sample --force
	@echo "open out/trace-sample/report.html, out/first_loop/report.html and out/paper/report.html"

test: .venv/dev
	$(BIN)/pytest -n 2 --dist worksteal

# .ci/durations.txt: the slowest tests of the whole suite
durations: .venv/dev
	$(BIN)/pytest -n 2 --dist worksteal -p durations

fuzz: .venv/dev
	$(BIN)/python tests/fuzz.py
	FUZZ_EXAMPLES=1000 $(BIN)/pytest -n 2 --dist worksteal -m hypothesis
	FUZZ_PAGES=10000 $(BIN)/pytest -n 0 tests/test_page_of_traces.py
	FUZZ_PAGES=500 $(BIN)/pytest -n 2 tests/test_made_pages.py tests/test_made_trace_pages.py tests/test_learned_pages.py
	FUZZ_DELAYS=60 $(BIN)/pytest -n 0 tests/test_one_forward_model.py -k intervals
	FUZZ_LEGS=1 $(BIN)/pytest -n 2 tests/test_platform_records.py -k effects_and_delays
	FUZZ_LIVE=10000 $(BIN)/pytest -n 0 tests/test_live.py -k whatever_is_moved
	FUZZ_LINK=100000 $(BIN)/pytest -n 0 tests/test_link.py -k strange_datagrams

lowest:
	PYTHON=$(PYTHON) bash .ci/lowest

check: .venv/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --threads 2
	$(BIN)/lint-imports
	$(BIN)/python .ci/prose.py

figures: .venv/ready
	$(BIN)/python .ci/figures.py

docs: .venv/docs
	$(BIN)/sphinx-build -W -q -d docs/_build/doctrees docs docs/_build/html
	$(BIN)/python .ci/links.py docs/_build/html
	@echo "open docs/_build/html/index.html"

# the words alone: what blocks, examples and the gallery left before is shown, and none of them runs
docs-fast: .venv/docs
	$(BIN)/sphinx-build -W -q -t words -d docs/_build/fast/doctrees docs docs/_build/fast/html
	$(BIN)/python .ci/links.py docs/_build/fast/html
	@echo "open docs/_build/fast/html/index.html"

wheel: .venv/dev
	$(BIN)/python .ci/release.py

release: .venv/dev
	@test -n "$(VERSION)" || { echo "which version? make release VERSION=0.2.0"; exit 1; }
	$(BIN)/python .ci/release.py $(VERSION)

.venv/ready: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "jackbench needs Python 3.11 or newer, this is " + sys.version.split()[0])'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --editable .
	@touch $@

.venv/dev: .venv/ready
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --editable . --group dev
	@touch $@

.venv/docs: .venv/ready
	$(BIN)/pip install --quiet --upgrade pip
	$(BIN)/pip install --quiet --editable . --group docs
	@touch $@

clean:
	rm -rf .venv .venv-lowest dist out docs/_build docs/reference
