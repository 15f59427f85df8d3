# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's experiment in the virtual laboratory, and the command that prints it."""

import json

import numpy as np
import pytest

from hysteresis_ros.cli.main import main
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.table1 import inside, Inverse, PAPER, ROWS, table1


@pytest.fixture(scope='module')
def result():
    """Return the experiment on a specimen that nothing was tuned on."""
    return table1([41])


def test_each_row_is_at_or_below_the_papers(result):
    assert [row['name'] for row in result['rows']] == list(ROWS)
    for row in result['rows']:
        assert row['ours']['two-stage']['mean'] <= row['paper']['two-stage']['mean'], row['name']
        assert row['unit'] == ('deg' if row['name'].startswith('arm') else '%')


def test_linear_is_at_least_as_much_worse_as_in_the_paper(result):
    for row in result['rows']:
        ratios = [methods['linear']['mean'] / methods['two-stage']['mean']
                  for methods in (row['ours'], row['paper'])]
        assert ratios[0] >= ratios[1], row['name']


def test_the_papers_numbers_are_its_table(result):
    assert result['rows'][4]['paper'] == {'two-stage': {'mean': 3.4, 'std': 5.2},
                                          'linear': {'mean': 12.6, 'std': 9.9}}
    assert len(PAPER['two-stage']) == len(PAPER['linear']) == len(ROWS)


def test_rejected_models_are_worse(result):
    verified = result['rows'][4]['ours']['two-stage']['mean']
    for name in ('additive', 'embedded line'):
        assert result['baselines'][name]['verification'] > 1.5 * verified
    figure = result['baselines']['Fig. 9 (mm)']
    assert figure['one operator'] < figure['two-stage']


def test_a_specimen_is_needed():
    with pytest.raises(ParameterError, match='at least one seed'):
        table1([])


def test_references_stay_inside_what_was_seen():
    wanted = inside(np.array([3.0, -1.0, 1.0]), 1000, np.random.default_rng(0))
    assert wanted.shape == (1000,)
    assert -1.0 + 0.08 <= wanted.min() < -0.8 and 2.8 < wanted.max() <= 3.0 - 0.08


class OneController:
    """Stands in for a model: remembers what its controller is asked for."""

    ranges = {'voltage': (0.0, 6.0)}
    drive = 'voltage'

    def __init__(self):
        self.asked = []

    def controller(self, voltage_limits, arm):
        """Return itself, with its memory wiped."""
        self.asked.append(('cold', voltage_limits, arm))
        return self

    def force_setpoint(self, force):
        """Return the force as the voltage."""
        self.asked.append(force)
        return type('Setpoint', (), {'voltage': force})


def test_each_sequence_starts_cold_and_goes_in_order():
    model = OneController()
    inverse = Inverse(model, 'preisach')
    assert inverse.forces(np.array([2.0, 1.0])).tolist() == [2.0, 1.0]
    assert inverse.forces(np.array([3.0])).tolist() == [3.0]
    cold = ('cold', (0.0, 6.0), False)
    assert model.asked == [cold, 2.0, 1.0, cold, 3.0]


def test_command_prints_both_tables_and_is_repeatable(result, tmp_path, capsys):
    path = tmp_path / 'table1.json'
    assert main(['table1', '--seeds', '1', '--first-seed', '41', '--json', str(path)]) == 0
    printed = capsys.readouterr().out
    for row in ROWS:
        assert row in printed
    assert 'paper, two-stage' in printed and 'ours, linear' in printed
    content = json.loads(path.read_text())
    assert content == json.loads(json.dumps(result))
    assert [one['seed'] for one in content['seeds']] == [41]
    assert f'{content["rows"][0]["ours"]["two-stage"]["mean"]:.2f}' in printed


def test_effects_get_columns_of_their_own(capsys):
    assert main(['table1', '--seeds', '1', '--effects',
                 'stress_dependence,stress_dependent_strain']) == 0
    printed = capsys.readouterr().out
    assert 'ours, + effects' in printed
    assert 'specimen 0: + stress_dependence, stress_dependent_strain' in printed


@pytest.mark.parametrize('arguments', [['--seeds', '0'], ['--seeds', 'x'], ['--first-seed', '-1']])
def test_wrong_usage_is_refused(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(['table1', *arguments])
    assert caught.value.code == 2
    assert 'number' in capsys.readouterr().err
