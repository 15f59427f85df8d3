# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the README tells a person to type works, and what it names is there."""

import inspect
import re
import shlex
import shutil
import subprocess
import sys

from model_support import arm_run, bicep_model, effect_of, wandering_voltage
import numpy as np
import pytest

from hysteresis_ros.cli.main import COMMANDS, main
from hysteresis_ros.diagnosis.extend import extend
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import ModelFileError
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.measurements.csv import write_csv

# What `--effects auto` finds on a bench.
EFFECTS = 'stress_dependence', 'stress_dependent_strain', 'series_compliance'


@pytest.fixture(scope='module')
def readme(root):
    """Return the text of the README."""
    return (root / 'README.md').read_text(encoding='utf-8')


def blocks(text, language=''):
    """Return the fenced blocks of a language."""
    return re.findall(rf'^```{language}\n(.*?)^```', text, re.MULTILINE | re.DOTALL)


def lines_of(readme, first_word):
    """Return the commands in the README that start with a word, as lists of arguments."""
    return [shlex.split(line) for block in blocks(readme) for line in block.splitlines()
            if line.split()[:1] == [first_word]]


def test_the_commands_of_the_readme_work_one_after_the_other(
        readme, tmp_path, monkeypatch, capsys):
    """From the bench to the extended model, in the order in which they stand there."""
    monkeypatch.chdir(tmp_path)
    commands = lines_of(readme, 'hysteresis')
    assert [command[1] for command in commands] == [
        'simulate', 'simulate', 'identify', 'compare', 'diagnose', 'extend', 'compare']
    said = {}
    for command in commands:
        # Effects of the bench are found in a test of their own; here they are named.
        arguments = [','.join(EFFECTS) if word == 'auto' else word
                     for word in command[1:]]
        if arguments[0] == 'diagnose':
            arguments += ['--jobs', '1']
        status = main(arguments)
        output = capsys.readouterr()
        assert status == 0, f'{shlex.join(command)}\n{output.err}'
        said[command[1]] = output.out
    assert 'Missing: payload_error' in said['diagnose']
    assert '+ payload_error: dm' in said['extend'] and 'not fitted' in said['extend']
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {'bench', 'arm', 'model.yaml', 'extended.yaml', 'compare.html',
                       'diagnosis.html', 'extended.html'}


def test_a_dask_cluster_takes_the_diagnosis_as_the_readme_says(readme, tmp_path):
    """The script of the README on a local cluster, in a process of its own."""
    pytest.importorskip('distributed', reason='the extra "cluster" is not installed')
    script, = (block for block in blocks(readme, 'python') if 'LocalCluster' in block)
    model = bicep_model()
    run = arm_run(wandering_voltage(400, 1)[::10])
    heavier = model.with_effects([effect_of(model, 'payload_error', dm=40.0)])
    (tmp_path / 'arm').mkdir()
    write_csv({**run.columns, 'angle': heavier.predict(run)}, tmp_path / 'arm' / 'train.csv')
    model.save(tmp_path / 'model.yaml')
    (tmp_path / 'cluster.py').write_text(script, encoding='utf-8')
    done = subprocess.run([sys.executable, 'cluster.py'], cwd=tmp_path, text=True, timeout=300,
                          capture_output=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "['payload_error']"


@pytest.fixture
def own_effect(readme, tmp_path, monkeypatch):
    """Return the class of the README, installed as the entry point of a package."""
    sources = [block for block in blocks(readme, 'python') if 'class ' in block]
    (tmp_path / 'my_package.py').write_text(sources[0], encoding='utf-8')
    point, = re.search(r"entry_points=\{'hysteresis_ros.effects': \['(.*?)'\]\}", readme).groups()
    information = tmp_path / 'my_package-1.0.dist-info'
    information.mkdir()
    (information / 'METADATA').write_text(
        'Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n', encoding='utf-8')
    (information / 'entry_points.txt').write_text(
        f'[hysteresis_ros.effects]\n{point}\n', encoding='utf-8')
    monkeypatch.syspath_prepend(str(tmp_path))
    catalogue.cache_clear()
    yield catalogue()['contact_resistance']
    sys.modules.pop('my_package', None)
    catalogue.cache_clear()


def test_the_effect_of_the_readme_is_undone_by_its_inverse(own_effect):
    """A share p of the power goes elsewhere, and a controller gives so much more."""
    assert not inspect.isabstract(own_effect)
    model = bicep_model()
    effect = own_effect(model.surroundings, p=0.2)
    squared = np.linspace(0.0, 36.0, 7)
    assert effect.forward(squared, None, None) == pytest.approx(0.8 * squared)
    assert effect.inverse(effect.forward(squared, None, None), None, None) == pytest.approx(squared)


def test_the_effect_of_the_readme_is_fitted_and_explained_like_any_other(own_effect, capsys):
    """It takes part in simulation, in the fit and on the command line."""
    model = bicep_model()
    truth = model.with_effects([own_effect(model.surroundings, p=0.2)])
    run = arm_run(wandering_voltage(400, 1)[::5])
    run = Measurement.from_columns({**run.columns, 'angle': truth.predict(run)})
    extension = extend(model, ['contact_resistance'], [run])
    assert extension.added[0].values['p'] == pytest.approx(0.2, abs=0.002)
    assert extension.train['rmse_after'] < 0.02 * extension.train['rmse_before']
    assert main(['effects', 'contact_resistance']) == 0
    assert 'tighten the clamp' in capsys.readouterr().out


def test_a_model_whose_effect_is_not_installed_names_the_package(own_effect, tmp_path, monkeypatch):
    """Somebody else's model file with the effect of the README."""
    model = bicep_model()
    model.with_effects([own_effect(model.surroundings, p=0.2)]).save(tmp_path / 'model.yaml')
    assert model.load(tmp_path / 'model.yaml').effects[0].values['p'] == 0.2
    shutil.rmtree(tmp_path / 'my_package-1.0.dist-info')
    catalogue.cache_clear()
    with pytest.raises(ModelFileError, match='package my-package, which is not installed; install '
                                             'it .pip install my-package.'):
        model.load(tmp_path / 'model.yaml')


def test_commands_and_effects_that_the_text_names_exist(readme):
    """A renamed command or effect would leave the README behind."""
    inline = re.findall(r'`hysteresis (\w+)(?: (\w+))?`', readme)
    assert inline
    for command, argument in inline:
        assert command in COMMANDS
        assert not argument or argument in catalogue()
    for names in re.findall(r'--(?:effect|add) (\w+)', readme):
        assert names in catalogue()


def test_nodes_and_launch_files_that_the_text_names_exist(readme, root):
    """The table of nodes, `ros2 run` and `ros2 launch`."""
    table = re.findall(r'^\| `(\w+_node)` \|(.*)\|$', readme, re.MULTILINE)
    assert sorted(name for name, _ in table) == sorted(
        path.stem for path in (root / 'hysteresis_ros' / 'nodes').glob('*_node.py'))
    # The parameters module holds the words that the nodes use for topics and services.
    for name, row in table:
        source = (root / 'hysteresis_ros' / 'nodes' / f'{name}.py').read_text(encoding='utf-8')
        for word in re.findall(r'`([~/\w]+)`', row):
            assert f"'{word}'" in source or word in source, f'{name}: {word}'
    for command in lines_of(readme, 'ros2'):
        if command[1] == 'run':
            assert command[2] == 'hysteresis_ros'
            assert (root / 'hysteresis_ros' / 'nodes' / f'{command[3]}.py').is_file()
        if command[1] == 'launch':
            assert (root / 'launch' / command[3]).is_file()


def test_files_and_targets_that_the_text_names_exist(readme, root):
    """Links and pictures lead somewhere, and make knows its targets."""
    links = [link for link in re.findall(r'\]\(([^)#]+)\)', readme) if '://' not in link]
    assert links
    missing = [link for link in links if not (root / link).exists()]
    assert missing == []
    makefile = (root / 'Makefile').read_text(encoding='utf-8')
    for target in set(re.findall(r'^make (\w+)|`make (\w+)', readme, re.MULTILINE)):
        target = ''.join(target)
        assert re.search(rf'^{target}\b.*:', makefile, re.MULTILINE)
