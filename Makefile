# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
TORCH := torch==2.13.0  # pinned: another version trains other policies from the same seed
# pip would compile all of every library, on one processor: tests, and what is hardly used, too.
PIP_INSTALL := $(BIN)/pip install --quiet --disable-pip-version-check --no-compile
# uv finds in a second which versions fit, for which pip takes a minute and a half. It does not
# read pip.conf: where that names the only index, pip does it.
UV_INSTALL := UV_FIND_LINKS="$$PIP_FIND_LINKS" UV_DEFAULT_INDEX="$$PIP_INDEX_URL" \
  UV_INDEX="$$PIP_EXTRA_INDEX_URL" $(BIN)/uv pip install --quiet --system-certs --python $(BIN)/python
install_packages = $(UV_INSTALL) $(1) || $(PIP_INSTALL) $(1)
NOT_COMPILED := /tests?/|/(pip|pkg_resources|pybullet_envs|pybullet_examples|pygments|setuptools)/|$\
  /(debugpy|devtools|docutils|fontTools|mypy|mypyc|networkx|OpenGL|scipy|sympy)/|$\
  /openai/(resources|types)/|/torch/(_inductor|distributed|onnx|testing)/
COMPILE_LIBRARIES := $(BIN)/python -m compileall -qq -j 0 -x '$(NOT_COMPILED)' $(VENV)/lib || true  # some have files of other Pythons
# No test should wait until motion planning is compiled. Half a second where it is.
COMPILE_MOTION := $(BIN)/python -m slap_ros.motion.kernels
TESTS_AT_ONCE := 4  # on two cores: many wait for nodes, networks and clocks
METADATA := pyproject.toml setup.py setup.cfg embedded_ros/pyproject.toml
# Images set it. Tests start hundreds of processes, and each would compile all that it imports.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help install demo test test-all quick-tests all-tests embedded-tests test-ros faults \
  reproduce lint style types format docs clean

help:  ## Show what can be made
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 12

install: $(VENV)/.installed  ## Make .venv with everything that running needs

$(VENV)/.installed: $(METADATA)
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' || \
	  { echo "slap_ros needs Python 3.11 or 3.12; try: make $(MAKECMDGOALS) PYTHON=python3.12" >&2; exit 1; }
	@echo "== setting up $(VENV), which takes about a minute"
	$(PYTHON) -m venv $(VENV) || \
	  { echo "no venv module; on Debian and Ubuntu: apt install python3-venv" >&2; exit 1; }
	$(PIP_INSTALL) uv || true  # then pip does it all
	$(call install_packages,-e ./embedded_ros -e '.[physics]')
	$(COMPILE_LIBRARIES) & $(COMPILE_MOTION) && wait $$!
	@touch $@

$(VENV)/.tested: $(VENV)/.installed
	$(call install_packages,'$(strip $(TORCH))' -e '.[test]')
	$(COMPILE_LIBRARIES)
	@touch $@

demo: install  ## Run the whole ensemble with and without a shortcut, record, replay, report
	@set -e; export PATH="$(abspath $(BIN)):$$PATH"; bag=runs/demo-$$(date +%Y%m%d-%H%M%S); \
	echo "== a Panda slaps a tower over, as it has learned to; every node is a process"; \
	slap run obstacle_tower --seed 1 --record $$bag; \
	echo "== the same task with the given skills alone; meanwhile the first run is drawn"; \
	slap bag render $$bag --output $$bag.gif 2> $$bag-gif.log & drawing=$$!; \
	slap run obstacle_tower --seed 1 --shortcuts none --record $$bag-pure; \
	wait $$drawing || { cat $$bag-gif.log >&2; exit 1; }; \
	rm $$bag-gif.log; \
	echo "== the numbers of the first run, from its bag alone"; \
	slap bag evaluate $$bag; \
	echo "== its recorded commands in a fresh world"; \
	slap bag replay $$bag; \
	echo "== both runs on one page, for any browser"; \
	slap report $$bag-pure $$bag --output $$bag.html; \
	echo "bags: $$bag $$bag-pure   animation: $$bag.gif   report: $$bag.html"; \
	echo "== more, after source $(BIN)/activate"; \
	echo "more: \`slap run obstacle2d --seed 1\`: a planar task, which needs no physics"; \
	echo "more: \`slap plan obstacle2d --seed 1 --output runs/plan\`: PDDL, and the abstract graph"; \
	echo "more: \`slap evaluate obstacle2d\`: 50 tasks, success and plan length with intervals"; \
	echo "more: \`slap evaluate obstacle2d --preset paper\`: from the paper's start states"

# A product of matrices on two threads would wait for the processor that another test has.
PYTEST := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(abspath $(BIN))/pytest -q --dist worksteal
# Types are checked, and embedded_ros is tested, while other tests wait.
BESIDE := $(MAKE) --no-print-directory --jobs 3 types embedded-tests

test: $(VENV)/.tested style  ## Check style and types, and run all tests but the slow ones
	$(COMPILE_MOTION)
	$(BESIDE) quick-tests

test-all: $(VENV)/.tested style  ## The same with the slow tests, as CI does
	$(COMPILE_MOTION)
	$(BESIDE) all-tests

quick-tests:
	$(PYTEST) -n $(TESTS_AT_ONCE) -m "not slow"

all-tests:
	$(PYTEST) -n $(TESTS_AT_ONCE)

embedded-tests:
	cd embedded_ros && $(PYTEST) -n 2

test-ros: $(VENV)/.installed  ## Run the tests that face ROS 2 on a sourced Jazzy
	EMBEDDED_PYTHON=$(abspath $(BIN))/python test/ros/run

faults: $(VENV)/.tested  ## Inject many more faults than the tests do, for about an hour
	$(BIN)/pytest -q test/faults --fault-cases $(or $(CASES),100)

reproduce: $(VENV)/.tested  ## Make every published figure again; says first what that takes
	$(BIN)/python -m tools.reproduce $(FIGURES)

lint: style types  ## Check style and types

style: $(VENV)/.tested
	$(BIN)/ruff check . embedded_ros
	$(BIN)/ruff format --check . embedded_ros

types: $(VENV)/.tested
	$(BIN)/mypy
	cd embedded_ros && $(abspath $(BIN))/mypy

format: $(VENV)/.tested  ## Format the code
	$(BIN)/ruff format . embedded_ros
	$(BIN)/ruff check --fix . embedded_ros

docs: $(VENV)/.documented  ## Build the documentation into site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "open site/index.html; for the search: $(BIN)/python -m http.server --directory site"

$(VENV)/.documented: $(VENV)/.installed
	$(call install_packages,-e '.[docs]')
	@touch $@

clean:  ## Remove what was made
	rm -rf $(VENV) .venv-ros build install log site *.egg-info
