# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
#
# make demo, make test and the rest do all their set-up: see `make help`.

PYTHON ?= python3
CONSTRAINTS ?=
DEMO_ARGS ?=
BENCHMARK_ARGS ?=
HIDDEN_ARGS ?=
PYTEST_ARGS ?=
FUZZ_ARGS ?=
RUNS ?= 1000000

# With it each of some thousand processes would compile the package's sources anew.
unexport PYTHONDONTWRITEBYTECODE

# The wheels of ROS 2 set this variable, and with it the library path, for one environment only.
ifdef _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE LD_LIBRARY_PATH
endif

# ROS 2 Jazzy where it is sourced, else its wheels, which must not see another ROS.
ROS := $(if $(filter jazzy,$(ROS_DISTRO)),$(shell \
	env -u _ROS_WHEELS_BOOTSTRAP_COMPLETE $(PYTHON) -c 'import rclpy; print("sourced")' 2>/dev/null))
ifeq ($(ROS),sourced)
EXTRAS := test,docs,bags,studio
else
ifeq ($(ROS_DISTRO),jazzy)
$(info ROS 2 Jazzy is sourced, but $(PYTHON) cannot import rclpy: its wheels are used.)
endif
EXTRAS := test,docs,bags,studio,ros
unexport PYTHONPATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH
endif

# Another interpreter or constraints file has an environment and a workspace of its own.
ifeq ($(PYTHON)$(CONSTRAINTS),python3)
VENV := .venv
WORKSPACE := .
else
NAME := $(subst $() ,,$(notdir $(PYTHON))$(if $(CONSTRAINTS),-$(basename $(notdir $(CONSTRAINTS)))))
VENV := .venv-$(NAME)
WORKSPACE := .workspace-$(NAME)
endif

PREFIX := $(WORKSPACE)/install/hysteresis_ros
SOURCES := $(shell find hysteresis_ros config launch resource urdf -type f \
	-not -path '*/__pycache__/*' 2>/dev/null | LC_ALL=C sort) package.xml setup.py setup.cfg

# colcon on the environment's own interpreter, which becomes that of the executables.
COLCON := $(VENV)/bin/python -c 'import sys; from colcon_core.command import main; sys.exit(main())'

# Runs a command in the built workspace. ROS 2 from wheels does not name its own prefix.
IN_WORKSPACE := export PATH="$$PWD/$(VENV)/bin:$$PATH"; \
	$(if $(filter sourced,$(ROS)),,export AMENT_PREFIX_PATH="$$PWD/$(VENV)";) \
	. ./$(WORKSPACE)/install/local_setup.sh; \
	HYSTERESIS_ROS_PREFIX="$$PWD/$(PREFIX)"

.PHONY: help build demo test test-all benchmark hidden docs pictures firmware fuzz faults clean force

help:
	@echo 'make demo       the whole system on the simulated arm: identify, drive, record, compare'
	@echo 'make test       tests and linters, but for those that take many seconds each'
	@echo 'make test-all   all tests: whole diagnoses, sessions, browsers, machine code; with coverage'
	@echo 'make benchmark  speed and accuracy, into benchmark.json'
	@echo 'make hidden     the hidden-effect grid, into hidden.json'
	@echo 'make docs       the pages of docs/ with the programming interface, into build/docs'
	@echo 'make pictures   the pictures of docs/ and of the README, made anew'
	@echo 'make firmware   machine code for the board, see firmware/README.md'
	@echo 'make fuzz       both parsers fed with what breaks them; RUNS=10000000'
	@echo 'make faults     the table of docs/safety.md, measured anew'
	@echo 'make build      the workspace alone; make demo builds it, too'
	@echo 'make clean      remove all that make made'
	@echo 'Then, for `hysteresis` and `ros2 run hysteresis_ros ...` in this shell:'
	@echo '  . $(if $(filter .,$(WORKSPACE)),,$(WORKSPACE)/)install/local_setup.sh'
	@echo 'or without sourcing: $(PREFIX)/bin/hysteresis --help'
	@echo 'PYTHON= chooses the interpreter, CONSTRAINTS= a pip constraints file,'
	@echo 'DEMO_ARGS=, PYTEST_ARGS=, HIDDEN_ARGS= are passed on, BENCHMARK_ARGS= such as --quick.'

# An environment holds absolute paths, so a moved checkout needs a new one, as another Python does.
IDENTITY := $(CURDIR) $(PYTHON) $(EXTRAS) $(CONSTRAINTS)
ifneq ($(strip $(shell cat $(VENV)/identity 2>/dev/null)),$(strip $(IDENTITY)))
$(VENV)/made: force
endif

$(VENV)/made: setup.py tools/environment.sh tools/requirements.py $(wildcard $(CONSTRAINTS))
	@tools/environment.sh '$(IDENTITY)' $(PYTHON) $(VENV) $(EXTRAS) $(CONSTRAINTS)
	@touch $@

# Changes when a source appears or goes, which no file's time shows.
$(WORKSPACE)/build/sources: force
	@mkdir -p $(@D)
	@echo '$(SOURCES)' | cmp -s - $@ || echo '$(SOURCES)' > $@

$(WORKSPACE)/build/made: $(VENV)/made $(SOURCES) $(WORKSPACE)/build/sources
	@rm -rf $(WORKSPACE)/build/hysteresis_ros $(PREFIX)
	@$(COLCON) --log-base $(WORKSPACE)/log build --base-paths . \
		--build-base $(WORKSPACE)/build --install-base $(WORKSPACE)/install
	@touch $@

build: $(WORKSPACE)/build/made

demo: build
	@$(if $(findstring avr://,$(DEMO_ARGS)),$(MAKE) -s -C firmware machine)
	@$(IN_WORKSPACE) HYSTERESIS_ROS_AVR="$$PWD/firmware/build" \
		$(PREFIX)/lib/hysteresis_ros/hysteresis demo $(DEMO_ARGS)

PYTEST := $(VENV)/bin/python -m pytest -o cache_dir=$(WORKSPACE)/build/pytest_cache

# With arguments of one's own, pytest alone says what runs.
test: build
	@$(IN_WORKSPACE) $(if $(strip $(PYTEST_ARGS)),,tools/quick_tests.sh) $(PYTEST) $(PYTEST_ARGS)

test-all: build
	@$(IN_WORKSPACE) COVERAGE_CORE=sysmon COVERAGE_FILE=$(WORKSPACE)/build/coverage \
		$(PYTEST) --cov --cov-report=term $(PYTEST_ARGS)

benchmark: build
	@$(IN_WORKSPACE) $(VENV)/bin/python -m benchmark $(BENCHMARK_ARGS) benchmark.json

hidden: build
	@$(IN_WORKSPACE) $(VENV)/bin/python tools/hidden.py --page docs/results.md $(HIDDEN_ARGS) hidden.json

docs: $(VENV)/made
	@$(VENV)/bin/python -m sphinx -q -W --keep-going -b html \
		-d $(WORKSPACE)/build/doctrees docs $(WORKSPACE)/build/docs
	@echo '$(WORKSPACE)/build/docs/index.html'

# The numbers in the pictures are those of this run.
pictures: build
	@$(IN_WORKSPACE) tools/pictures.sh $(PREFIX)/lib/hysteresis_ros/hysteresis \
		$(VENV)/bin/python $(WORKSPACE)/build/pictures

firmware:
	@$(MAKE) -s -C firmware all
	@echo 'firmware/build/firmware.hex'

fuzz: $(VENV)/made
	@$(MAKE) -s -C firmware fuzz RUNS=$(RUNS) $(FUZZ_ARGS)
	@mkdir -p $(WORKSPACE)/build
	@$(VENV)/bin/python -m tools.fuzz_decoder --runs $(RUNS) --crash $(WORKSPACE)/build/crash

# The times in docs/safety.md; a machine that does something else makes them longer.
faults: build
	@$(MAKE) -s -C firmware machine
	@$(IN_WORKSPACE) HYSTERESIS_ROS_AVR="$$PWD/firmware/build" \
		$(VENV)/bin/python -m tools.faults docs/safety.md

clean:
	rm -rf firmware/build .venv* .workspace* build install log dist demo *.egg-info
	rm -rf .pytest_cache .hypothesis .coverage benchmark.json hidden.json
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
