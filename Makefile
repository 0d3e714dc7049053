# bushcli: `make demo` and `make test` install what is missing and go. `make help` lists the rest.

PYTEST_ARGS ?=
# Processes of the tests: one per core (nproc would count threads of OpenMP); each may need 2 GB, so no more than eight.
PROCESSES ?= $(shell n=$$(env -u OMP_NUM_THREADS nproc 2>/dev/null || echo 2); [ "$$n" -lt 8 ] && echo "$$n" || echo 8)
# Debian's release for this command, e.g. SUITE=sid: its DOLFINx in an environment of its own. Empty: the usual one.
SUITE ?= $(BUSHCLI_SUITE)
export BUSHCLI_SUITE := $(SUITE)
IN := setup/enter
TEST := tests/with-browser tests/with-solver $(IN) python -m pytest -n $(PROCESSES) --dist worksteal
CASE ?= examples/batch/case.toml
CONCEALED ?= examples/concealed/case.toml
SAY := @printf '\n== %s\n\n'

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-slow lint format bench install uninstall sizes lock clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' Makefile

setup: ## install what is missing (takes a second if nothing is)
	@bash setup/setup.sh

demo: setup ## simulate one bundled example, diagnose the other: results and reports in out/
	$(SAY) '1 of 2, seconds: a law from tests of the rubber; is the bushing as stiff as the law predicts? ($(CASE))'
	$(IN) bushcli direct $(CASE) -q -o out/direct
	$(SAY) '2 of 2, a minute or two: a recording with an effect that its maker concealed; which one? ($(CONCEALED))'
	$(IN) bushcli diagnose $(CONCEALED) --workers 2 -o out/diagnosis
	$(SAY) 'What was concealed: examples/concealed/truth/truth.json. To open in a browser:'
	@ls out/direct/report.html out/diagnosis/report.html

test: setup ## the tests but the slow ones; make test PYTEST_ARGS="-k curve" for some, SUITE=sid on Debian's newest
	tests/launcher.sh
	$(TEST) -m "not slow" $(PYTEST_ARGS)

test-slow: setup ## the slow tests, with the same arguments: whole diagnoses, other codes' references, the pages' commands
	$(TEST) -m slow $(PYTEST_ARGS)

lint: setup ## ruff, mypy, the import rules and unused code
	$(IN) ruff check .
	$(IN) ruff format --check .
	$(IN) mypy
	$(IN) lint-imports
	$(IN) python tests/unused.py

format: setup ## put all files into the common format
	$(IN) ruff check --fix --select I .
	$(IN) ruff format .

bench: setup ## measure the speed, beside other programs
	$(IN) python -m benchmarks

install: ## put bushcli on the PATH (~/.local/bin; as root /usr/local/bin; or BINDIR=...), EXTRAS= for less of it
	@bash setup/install.sh

uninstall: ## take it off again
	@bash setup/install.sh --remove

sizes: ## lines of each package, longest files and functions
	@$(IN) python tests/sizes.py

# Not after `setup`, which stops where the lock file lacks something; what it has made until then does for this.
lock: ## write setup/requirements.lock anew: versions and hashes of what set-up takes from PyPI
	setup/lock.sh

clean: ## remove the environment of this checkout, results and caches
	rm -rf .venv .venv-* out build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
