# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The hidden-effect grid: which cases it has for each muscle, and what is made of its results."""

import importlib
import json
import os
import subprocess
import sys

from hysteresis_ros.laboratory import hidden_effects
import pytest


@pytest.fixture(scope='module')
def tool(root):
    """Return the tool, whose folder is on the path only while it is run."""
    sys.path.insert(0, str(root / 'tools'))
    try:
        yield importlib.import_module('hidden_grid')
    finally:
        sys.path.remove(str(root / 'tools'))


@pytest.fixture(scope='module')
def scores(tool):
    """Return the module of the scores."""
    return importlib.import_module('hidden_scores')


def result(group, truth, sets, **more):
    """Return a result of one case: `sets` are pairs of effects and probability."""
    return {'group': group, 'truth': truth, 'missing': truth, 'reported': truth,
            'verdict': 'missing' if truth else 'adequate', 'unseen': 1.2, 'clean': 1.0,
            'sets': [{'effects': effects, 'probability': share, 'rmse': 0.01}
                     for effects, share in sets], **more}


def test_each_muscle_has_the_cases_of_the_effects_it_can_have(tool):
    refused = {'grains': set(),
               'brinson': {'stress_dependent_strain', 'r_phase', 'formation_memory', 'cold_clamps'},
               'lagoudas': {'r_phase', 'formation_memory', 'cold_clamps'},
               'tanaka': {'stress_dependent_strain', 'r_phase', 'formation_memory', 'cold_clamps'}}
    found = tool.cases(2, 20, muscles=tuple(refused))
    for muscle, names in refused.items():
        chosen = [case for case in found if case.muscle == muscle]
        single = [case for case in chosen if case.group in tool.STRENGTHS]
        assert {name for case in single for name in case.effects} == set(hidden_effects()) - names
        assert len(single) == 4 * (len(hidden_effects()) - len(names))
        assert not any(names.intersection(case.effects) for case in chosen)
        assert sum(case.group == 'none' for case in chosen) == 20
        assert [case[1:] for case in chosen] == [
            case[1:] for case in found
            if case.muscle == 'grains' and not names.intersection(case.effects)]
    assert {case.muscle for case in tool.cases(1, 1)} == {'grains'}


def test_truth_of_the_most_probable_set(scores):
    sets = [(['slack'], 0.3), (['creep', 'slack'], 0.6), (['unknown'], 0.1)]
    assert scores.most_probable(result('pair', ['slack', 'creep'], sets)) == (0.6, True)
    assert scores.most_probable(result('strong', ['slack'], sets)) == (0.6, False)
    for group, truth, right in (('none', [], []), ('unknown', ['unlisted_magnet'], ['unknown'])):
        for effects in ([], ['unknown'], ['unlisted_magnet']):
            row = result(group, truth, [(effects, 0.9), (['creep'], 0.1)])
            assert scores.most_probable(row) == (0.9, effects == right)


def test_a_pair_missed_counts_apart_where_as_few_effects_predict_as_well(scores):
    def pair(missing, **more):
        return {**result('pair', ['creep', 'slack'], []), 'missing': missing, 'reported': missing,
                **more}
    rows = [pair(['creep', 'slack']), pair(['creep'], unseen=1.04, unseen_of_truth=1.0),
            pair(['creep'], unseen=1.06, unseen_of_truth=1.0), pair([]),
            pair(['backlash', 'inertia', 'latency'], unseen=1.0, unseen_of_truth=1.0)]
    found = scores.score(rows)
    assert found['both of a pair found [%]'][:2] == (20.0, 5)
    assert found['both found, or as few that predict as well [%]'][:2] == (40.0, 5)


def test_reliability_counts_cases_in_bins(scores):
    def slack(right, share):
        other = 1.0 - share
        return result('strong', ['slack'], [(['slack' if right else 'creep'], share),
                                            (['unknown'], min(other, share))])
    rows = scores.reliability([slack(True, 0.4), slack(False, 0.49), slack(True, 0.5),
                               slack(True, 0.7), slack(True, 0.89), slack(False, 0.81),
                               slack(True, 0.9), slack(True, 1.0),
                               {**slack(True, 1.0), 'sets': []}])
    assert [row['muscle'] for row in rows] == 4 * ['grains']
    assert [row['bin'] for row in rows] == ['<50', '50-70', '70-90', '>=90']
    assert [row['cases'] for row in rows] == [2, 1, 3, 2]
    assert [row['mean probability [%]'] for row in rows] == pytest.approx([44.5, 50, 80, 95])
    assert [row['true [%]'] for row in rows] == pytest.approx([50, 100, 200 / 3, 100])


def test_each_muscle_has_columns_tables_and_a_reliability(scores, tmp_path):
    results = [result('strong', ['slack'], [(['slack'], 0.95)], muscle='grains'),
               result('strong', ['slack'], [(['creep'], 0.6)], muscle='lagoudas', reported=[])]
    page = tmp_path / 'page.md'
    page.write_text('above {} old {} below'.format(*scores.MARKS), encoding='utf-8')
    scores.write_page(results, page)
    text = page.read_text(encoding='utf-8')
    assert '| score | asked | grains | cases | lagoudas | cases |' in text
    assert '| truth in the reported set, strong [%] | at least 97 | 100 | 1 | 0 | 1 |' in text
    assert '| all | >=90 | 1 | 95 | 100 |' in text and '| lagoudas | 50-70 | 1 | 60 | 0 |' in text
    assert text.startswith('above') and text.endswith('below') and 'old' not in text
    assert {line.count('|') for line in text.splitlines() if line.startswith('| score')} == {7}

    scores.write(results, tmp_path / 'hidden.json')
    written = json.loads((tmp_path / 'hidden.json').read_text(encoding='utf-8'))
    assert written['scores']['truth in the reported set, strong [%]'] == 50.0
    assert written['muscles']['grains']['truth in the reported set, strong [%]'] == 100.0
    assert written['reliability'] == scores.reliability(results)
    assert [row['muscle'] for row in written['reliability'][::4]] == ['all', 'grains', 'lagoudas']


def test_each_effect_has_a_line_and_each_muscle_a_column(scores):
    second = {**result('strong', ['slack'], []), 'missing': ['creep']}
    text = scores.to_markdown([
        result('strong', ['slack'], []), second, result('weak', ['slack'], [], reported=[]),
        result('pair', ['slack', 'latency'], []),
        *(result('weak', ['creep'], [], muscle='lagoudas', reported=names)
          for names in ([], ['creep'], ['slack', 'creep']))])
    assert 'weak, in the set | grains | lagoudas |' in text
    assert '| `creep` | - | 2 of 3 |\n| `slack` | 1, 2 of 2; 0 of 1 | - |' in text
    assert 'latency' not in text
    assert 'in the set |' not in scores.to_markdown([result('pair', ['slack', 'latency'], [])])


def test_twins_count_as_one(scores):
    """A sagging supply and a draught cannot be told apart on an arm at rest."""
    def first(named):
        row = {**result('strong', ['airflow'], []), 'missing': [named], 'reported': [named]}
        return scores.score([row])['truth named first, strong [%]'][0]
    assert [first(name) for name in ('airflow', 'supply_sag', 'slack')] == [100.0, 100.0, 0.0]


def test_outputs_without_muscle_and_probabilities_can_still_be_rendered(scores):
    old = result('weak', ['slack'], [])
    del old['sets']
    text = scores.to_markdown([old])
    assert '| score | asked | grains | cases |' in text
    assert '| `slack` | 1 of 1 |' in text
    assert 'probability' not in text


@pytest.mark.slow
@pytest.mark.long
def test_the_grid_runs_in_processes_of_its_own(root, tmp_path):
    written = tmp_path / 'hidden.json'
    ran = subprocess.run(
        [sys.executable, str(root / 'tools/hidden.py'), '--seeds', '0', '--others', '1', '--only',
         'none', '--jobs', '2', written], capture_output=True, text=True, check=False,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join([str(root), *sys.path])})
    assert ran.returncode == 0, ran.stderr
    found, = json.loads(written.read_text(encoding='utf-8'))['cases']
    assert found['group'] == 'none' and found['verdict'] == 'adequate'
