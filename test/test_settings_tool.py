# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tool that halves and doubles each setting of the selection of effects."""

import dataclasses
import importlib
import sys

from hysteresis_ros.diagnosis.settings import Settings
import pytest


@pytest.fixture(scope='module')
def tool(root):
    """Return the tool, whose folder is on the path only while it is run."""
    sys.path.insert(0, str(root / 'tools'))
    try:
        yield importlib.import_module('settings')
    finally:
        sys.path.remove(str(root / 'tools'))


def result(group, truth, missing):
    """Return a result of one case with `truth` hidden and `missing` found."""
    return {'muscle': 'grains', 'group': group, 'truth': truth, 'missing': missing,
            'reported': missing, 'verdict': 'missing' if missing else 'adequate'}


def test_each_setting_is_halved_and_doubled_alone(tool):
    usual = dataclasses.asdict(Settings())
    found = {name: dataclasses.asdict(one) for name, one in tool.variants().items()}
    assert found.pop('as it is') == usual
    assert len(found) == 2 * len(usual)
    for name, one in found.items():
        changed = {key: value for key, value in one.items() if value != usual[key]}
        (key, value), = changed.items()
        assert name == f'{key} {usual[key]:g} -> {value:g}'
        assert isinstance(value, type(usual[key])) and value > 0
    assert list(tool.variants(['prior'])) == [
        'as it is', 'prior 0.03 -> 0.015', 'prior 0.03 -> 0.06']
    assert tool.variants(['most_effects'])['most_effects 3 -> 1'].most_effects == 1


def test_cases_are_spread_over_the_grid_on_their_own_specimens(tool):
    few = tool.sample(12, 500)
    assert len(few) == len(set(map(str, few))) == 12
    assert {'strong', 'weak'} < {case.group for case in few}
    assert all(500 <= case.seed < 700 and case.muscle == 'grains' for case in few)
    assert {case.group for case in tool.sample(99, 500, 'slack')} >= {'strong', 'weak'}
    assert all('slack' in case.effects for case in tool.sample(99, 500, 'slack'))
    assert len(tool.sample(2, 500, 'strong')) == 2
    assert {case.muscle for case in tool.sample(3, 500, muscle='lagoudas')} == {'lagoudas'}
    assert tool.sample(3, 500, 'no_such_effect') == tool.sample(0, 500) == []


def test_the_table_says_how_the_scores_move(tool):
    right, wrong = result('strong', ['slack'], ['slack']), result('strong', ['slack'], ['creep'])
    clean = result('none', [], [])
    lines = tool.to_markdown({
        'as it is': [right, wrong, clean], 'prior 0.03 -> 0.015': [right, right, clean],
        'prior 0.03 -> 0.06': [wrong, wrong, result('none', [], ['slack'])]}).splitlines()
    assert lines[0].startswith('| setting | cases | truth in the reported set, strong [%] |')
    assert 'weak' not in lines[0] and 'pair' not in lines[0]      # which no case counts for
    assert {line.count('|') for line in lines} == {lines[0].count('|')}
    rows = [[cell.strip() for cell in line.strip('|').split('|')] for line in lines]
    alarm = rows[0].index('false alarm when nothing is hidden [%]')
    assert [row[0] for row in rows[2:]] == [
        'as it is', 'prior 0.03 -> 0.015', 'prior 0.03 -> 0.06']
    assert [row[1] for row in rows[2:]] == ['3', '3', '3']
    assert [row[2] for row in rows[2:]] == ['50', '100 (+50)', '0 (-50)']
    assert [row[alarm] for row in rows[2:]] == ['0', '0', '100 (+100)']


def test_a_score_without_cases_has_no_number(tool):
    text = tool.to_markdown({'as it is': [result('none', [], [])],
                             'other': [result('strong', ['slack'], ['slack'])]})
    assert text.splitlines()[2].startswith('| as it is | 1 | - |')
    assert text.splitlines()[3].startswith('| other | 1 | 100 |')
