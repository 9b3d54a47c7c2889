# Every target sets up .venv by itself: a fresh clone and `make demo` are enough.

SHELL := /bin/bash
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.installed
COMPILED := build/compiled
# One more than two cores: tests that start nodes wait for them now and then.
JOBS ?= 3
ARGS ?=

# A sourced ROS, or another virtual environment with ROS wheels, would lend its libraries to ours.
unexport PYTHONPATH PYTHONHOME LD_LIBRARY_PATH AMENT_PREFIX_PATH RMW_IMPLEMENTATION
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE VIRTUAL_ENV
# Without bytecode on disk, each node and each tool would compile its sources again.
unexport PYTHONDONTWRITEBYTECODE
# The nodes talk to nobody outside this machine.
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST

# Of the Python that is asked for, or none: not silently another one that was set up before.
VERSION := -c 'import sys; print(sys.version_info[:2])' 2>/dev/null
ifneq ($(PYTHON),)
ifneq ($(wildcard $(READY)),)
ifneq ($(MAKECMDGOALS),clean)
ifneq ($(shell $(PYTHON) $(VERSION)),$(shell $(BIN)/python $(VERSION)))
$(error $(VENV) was set up with another Python than PYTHON=$(PYTHON): make clean first)
endif
endif
endif
endif

.DEFAULT_GOAL := help
.PHONY: help demo match test test-slow bench rcss results compiled lint docs urdf install clean

help:  ## this list
	@grep -E '^[a-z-]+:.*## ' Makefile | sed -E 's/:.*## /|/' \
	  | while IFS='|' read -r name text; do printf '  make %-9s %s\n' "$$name" "$$text"; done

demo: $(READY)  ## watch the NAO walk a tour over ROS 2 (options: make demo ARGS="--gui")
	@$(BIN)/nao_gait demo $(ARGS)

match: compiled  ## two teams of two play soccer over ROS 2 (options: make match ARGS="--minutes 1")
	@PYTHONPATH="$(CURDIR)/$(COMPILED)" $(BIN)/nao_gait match $(ARGS)

test: $(READY)  ## the tests (those marked slow: make test-slow)
	@$(BIN)/python -m pytest -q -n $(JOBS) --dist loadgroup -m "not slow" $(ARGS)

test-slow: $(READY)  ## the slow tests, which CI does not run
	@$(BIN)/python -m pytest -q -n $(JOBS) --dist loadgroup -m slow $(ARGS)

bench: compiled  ## measure with the compiled gait (make bench ARGS="speed --robots 8")
	@PYTHONPATH="$(CURDIR)/$(COMPILED)" $(BIN)/nao_gait bench $(or $(ARGS),all)

rcss: compiled  ## a Booster K1 on RoboCup's simulation server, which is installed for it
	@PYTHONPATH="$(CURDIR)/$(COMPILED)" $(BIN)/nao_gait bench rcss $(ARGS)

results: compiled  ## every figure of docs/results.md, from one commit (ARGS=--quick: a smaller one)
	@PYTHONPATH="$(CURDIR)/$(COMPILED)" $(BIN)/nao_gait results $(ARGS)

compiled: $(READY)  ## the gait as machine code in build/compiled, as bench uses it
	@$(BIN)/nao_gait compile $(COMPILED) || echo 'the gait runs as Python' >&2

lint: $(READY)  ## ruff and mypy
	@$(BIN)/ruff check . && $(BIN)/mypy && $(BIN)/mypy examples

docs: $(READY)  ## the documentation as a site in build/site
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet && echo 'build/site/index.html; with search: python3 -m http.server -d build/site'

urdf: $(READY)  ## write urdf/*.urdf again from the table of facts
	@$(BIN)/nao_gait write urdf $(ARGS)

install: $(READY)  ## only set up .venv

clean:  ## remove .venv and everything that was built
	rm -rf $(VENV) build dist out .pytest_cache .ruff_cache .mypy_cache .hypothesis ./*.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Python 3.11 first: PyPI has a pybullet wheel for it; on 3.12 pybullet is compiled (4 minutes).
# Each candidate is run, because a pyenv shim exists also for versions that are not active.
$(READY): setup.py setup.cfg pyproject.toml
	@set -euo pipefail; found=; \
	for python in $(or $(PYTHON),python3.11 python3.12 python3 python \
	    "$$HOME"/.pyenv/versions/3.11.*/bin/python "$$HOME"/.pyenv/versions/3.12.*/bin/python); do \
	  if "$$python" -c 'import sys, venv, ensurepip; \
	      sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))' >/dev/null 2>&1; then \
	    found=$$python; break; \
	  fi; \
	done; \
	if [ -z "$$found" ] && [ -n '$(PYTHON)' ]; then \
	  echo 'PYTHON=$(PYTHON) does not run as a Python 3.11 or 3.12 with venv' \
	    '(of pyenv, a version that is not active?).' >&2; \
	  exit 1; \
	fi; \
	if [ -z "$$found" ]; then \
	  echo 'No Python 3.11 or 3.12 with venv found (Debian, Ubuntu: apt install python3-venv).' >&2; \
	  echo 'Install one, or name it: make PYTHON=/path/to/python3.11 ...' >&2; \
	  exit 1; \
	fi; \
	echo "Setting up $(VENV) with $$("$$found" -V) (once, 1 to 6 minutes) ..."; \
	[ -x $(BIN)/python ] && $(BIN)/python -c '' 2>/dev/null || "$$found" -m venv --clear $(VENV); \
	$(BIN)/python -m pip install --disable-pip-version-check --progress-bar off \
	    --editable '.[lab,mujoco,gym,vision,video,tune,view,browser,dev]' | awk -v tty="$$([ -t 1 ] && echo 1)" ' \
	      /^(Collecting|Building|Installing)/ { ++n; \
	        if (tty) printf "\r\033[K  %3d %.70s", n, $$0; \
	        else if (n % 25 == 0) printf "  %3d packages\n", n; fflush() } \
	      END { if (tty) print "" }'; \
	touch $@; \
	echo "$(VENV) is ready."
