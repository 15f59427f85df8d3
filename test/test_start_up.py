# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is imported and compiled at the start, so that it is not in a control loop."""

import math
import os
import subprocess
import sys

from model_support import bicep_model
import numba
from numba.core.dispatcher import Dispatcher
import numpy as np
import pytest

from hysteresis_ros.kernels.jit import jit
from hysteresis_ros.kernels.warm_up import small_model, warm_up

SLOW = ('numba', 'scipy', 'matplotlib', 'joblib')
EFFECTS = ('thermal_lag', 'creep', 'stress_dependence', 'unequal_muscles', 'coulomb_friction',
           'inertia', 'backlash')


def imported_by(code, names=SLOW):
    """Return those of the modules that a fresh Python has imported after some code."""
    code += f'\nimport sys\nprint(*[name for name in {names!r} if name in sys.modules])'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-1].split()


def test_the_package_and_its_help_import_nothing_slow():
    """A name typed on a command line is completed, or misspelt, at once."""
    assert imported_by('import hysteresis_ros') == []
    assert imported_by("""
from hysteresis_ros.cli.main import main
try:
    main(['--help'])
except SystemExit:
    pass
""") == []


@pytest.mark.parametrize('command', ['compare', 'predict', 'effects', 'simulate'])
def test_the_help_of_a_command_imports_no_compiler(command):
    """Nor what draws."""
    assert imported_by(f"""
from hysteresis_ros.cli.main import main
try:
    main(['{command}', '--help'])
except SystemExit:
    pass
""", ('numba', 'matplotlib', 'joblib')) == []


def test_identification_imports_neither_optimisers_nor_distributions():
    """They take longer to import than bench tables take to be fitted."""
    assert imported_by('import hysteresis_ros.diagnosis.bench_effects',
                       ('scipy.optimize', 'scipy.stats', 'joblib')) == []


@pytest.mark.parametrize('node', ['geometry', 'bridge'])
def test_nodes_that_simulate_nothing_import_nothing_slow(node):
    """The geometry needs no model, and a real port no simulated arm."""
    pytest.importorskip('rclpy')
    port = "parameter_overrides=[Parameter('port', value=os.ttyname(port))]"
    assert imported_by(f"""
import os
import pty
import rclpy
from rclpy.parameter import Parameter
from hysteresis_ros.nodes.{node}_node import {node.capitalize()}Node
board, port = pty.openpty()
rclpy.init()
{node.capitalize()}Node({port if node == 'bridge' else ''}).destroy_node()
rclpy.try_shutdown()
""") == []


@pytest.fixture
def compilations(monkeypatch):
    """Return a list that fills with the functions that numba has to compile or to load."""
    found = []
    compile_for = Dispatcher._compile_for_args

    def watched(self, *args, **kwargs):
        found.append(self.py_func.__name__)
        return compile_for(self, *args, **kwargs)

    monkeypatch.setattr(Dispatcher, '_compile_for_args', watched)
    return found


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason='nothing is compiled')
def test_a_first_call_is_seen(compilations):
    """The check of the tests below sees what it is to see."""
    twice = jit(lambda x: 2 * x)
    assert [twice(2.0), twice(3.0), twice(2)] == [4.0, 6.0, 4]
    assert compilations == ['<lambda>', '<lambda>']


@pytest.mark.parametrize('effects', [(), *((name,) for name in EFFECTS)], ids=str)
def test_after_warming_up_nothing_is_compiled_in_a_loop(compilations, effects):
    """Neither in the controller nor in the observer, with the model's own effects."""
    model = bicep_model(effects)
    warm_up(model)
    compilations.clear()
    controller, observer = model.controller(arm=True), model.observer()
    controller.dead_band = 1e-4
    rng = np.random.default_rng(1)
    for step, angle in enumerate(rng.uniform(1.2, 1.9, 50).tolist()):
        wanted = controller.reference(angle)
        setpoint = controller.setpoint(wanted.length, wanted.force, 0.1 * step)
        controller.hold(0.1 * step + 0.05)
        observer.step(0.1 * step, setpoint.voltage, math.nan)
    assert compilations == []


COMMANDS = """
from numba.core.dispatcher import Dispatcher
import numpy as np
from hysteresis_ros import diagnose, extend, identify
from hysteresis_ros.compile_kernels import compile_kernels
from hysteresis_ros.laboratory.experiments import experiment_tables
from model_support import bicep_model, runs

compile_kernels()
compile_for = Dispatcher._compile_for_args

def watched(self, *args, **kwargs):
    print('compiled', self.py_func.__module__, self.py_func.__name__)
    return compile_for(self, *args, **kwargs)

Dispatcher._compile_for_args = watched
length, force = experiment_tables('bench', seed=4).values()
length, force = length if 'length' in length else force, force if 'length' in length else length
length, force = ({name: values[::3] for name, values in table.items()}
                 for table in (length, force))
identify(length, force, length_trials=[0, 2], effects=['stress_dependent_strain'])
identify({name: values[:40] for name, values in length.items()}, operator='bouc-wen')
effects = ['thermal_lag', 'latent_heat', 'creep', 'inertia', 'wire_break', 'coulomb_friction']
moving = runs(bicep_model(['thermal_lag']), trials=2, rows=50, dt=0.4)
print(diagnose(bicep_model(), moving, effects, jobs=1))
print(extend(bicep_model(), ['creep'], moving))
"""


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason='nothing is compiled')
def test_after_an_installation_nothing_is_compiled_by_a_command(root):
    """A user who identifies for the first time does not wait for the compiler."""
    path = os.pathsep.join((str(root), str(root / 'test'), os.environ.get('PYTHONPATH', '')))
    found = subprocess.run([sys.executable, '-c', COMMANDS], capture_output=True, text=True,
                           env={**os.environ, 'PYTHONPATH': path}, check=False)
    assert found.returncode == 0, found.stderr
    assert 'thermal_lag' in found.stdout
    assert [line for line in found.stdout.splitlines() if line.startswith('compiled')] == []


def test_warming_up_leaves_the_model_as_it_is():
    """The node's own controller starts from the cold muscle."""
    model = bicep_model(['thermal_lag', 'creep', 'backlash', 'coulomb_friction'])

    def played():
        controller, observer = model.controller(arm=True), model.observer()
        wanted = [controller.reference(angle) for angle in (1.4, 1.7, 1.5)]
        volts = [controller.setpoint(*one, 0.1 * step).voltage for step, one in enumerate(wanted)]
        return volts, [observer.step(0.1 * step, volt) for step, volt in enumerate(volts)]

    before = played()
    assert warm_up(model) > 0.0
    assert played() == before


def test_the_small_model_can_be_driven():
    """Else warming up would be over before anything was called."""
    model = small_model()
    controller = model.controller(arm=True)
    setpoints = [controller.setpoint(*controller.reference(angle)) for angle in (1.5, 2.0, 1.7)]
    assert not any(setpoint.saturated for setpoint in setpoints)
    assert len({setpoint.voltage for setpoint in setpoints}) == 3
    assert math.isfinite(model.observer().step(0.0, 3.0))
