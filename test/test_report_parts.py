# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What stands on a page: the card's reasons and commands, glossary, provenance, charts' data."""

from argparse import Namespace
import base64
import hashlib
import json
import re
import shlex

import numpy as np
import pytest
from test_compare import FakeModel, run
from test_report import diagnosis, row, words_of

from hysteresis_ros.cli.common import origin
from hysteresis_ros.cli.main import build_parser
from hysteresis_ros.comparison.compare import compare
from hysteresis_ros.measurements import parse_columns
from hysteresis_ros.report.card import diagnosis_card, probability_of, values_of
from hysteresis_ros.report.commands import after_comparison, after_diagnosis, after_extension
from hysteresis_ros.report.descriptions import descriptions
from hysteresis_ros.report.glossary import glossary, linked
from hysteresis_ros.report.plots import separated
from hysteresis_ros.report.provenance import Origin, provenance
from hysteresis_ros.report.reasons import share, why_not_another
from hysteresis_ros.report.recording import as_json, chosen_rows, Curve, packed, recording
from hysteresis_ros.report.words import short_name

ALONE = {'alternatives': [[]]}


@pytest.fixture(scope='module')
def comparison():
    """Return a comparison of a continuous run of two trials, off where the voltage is high."""
    return compare(FakeModel(), [run(lambda t, v, up: 0.03 * (v > 4))])


def weighed(*entries):
    """Return sets with probabilities and errors [rad]."""
    return [{'effects': list(names), 'probability': probability, 'rmse': rmse}
            for names, probability, rmse in entries]


def test_tied_effects_have_their_values_and_the_probability_of_all():
    found = diagnosis(
        ranking=[row('payload_error', 0.002), row('encoder_offset', 0.002)],
        sets=weighed((['payload_error'], 0.62, 0.002), (['encoder_offset'], 0.31, 0.002),
                     (['unknown'], 0.07, 0.08)))
    text = words_of(probability_of(found))
    assert text == '0.93 that it is one of them: payload_error 0.62, encoder_offset 0.31'
    assert 'dm 15 (14 to 16) g' in words_of(values_of(found))
    assert 'offset 15 (14 to 16) deg' in words_of(values_of(found))
    assert 'or <a' in values_of(found)


def test_the_headline_names_every_missing_effect():
    found = diagnosis(missing=['payload_error', 'slack'], alternatives=[['encoder_offset'], []])
    card = diagnosis_card(found, 'angle', 'm.yaml', ['a.csv'], Origin())
    assert words_of(card).split('\n')[1] == (
        'Missing: one of payload_error, encoder_offset; and slack')


@pytest.mark.parametrize('value, words', [
    (1.0, 'more than 0.99'), (0.0, 'less than 0.01'), (0.936, '0.94')])
def test_no_probability_is_said_to_be_certain(value, words):
    assert share(value) == words


@pytest.mark.parametrize('changes, words', [
    ({**ALONE, 'sets': weighed((['payload_error'], 0.9, 0.002),
                               (['payload_error', 'slack'], 0.1, 0.0019))},
     ['payload_error with slack', '0.10', 'less than one more effect has to earn']),
    ({**ALONE, 'sets': weighed((['payload_error'], 0.9, 0.002), (['slack'], 0.1, 0.00205))},
     ['slack comes next', 'it fits as well', 'less usual']),
    ({**ALONE, 'sets': weighed((['payload_error'], 0.9, 0.002), (['slack'], 0.1, 0.02))},
     ['slack comes next', '1.15 deg instead of 0.115 deg, 10.0 times']),
    # The sets say nothing of it: effects by themselves do, the best first and why it lost.
    ({**ALONE, 'ranking': [row('payload_error', 0.002), row('slack', 0.03),
                           row('clamp_mass', 0.0021, plausible=False)]},
     ['With clamp_mass the RMSE is 0.120 deg', 'outside its physical range', 'With slack the']),
    ({**ALONE, 'ranking': [row('payload_error', 0.002)]}, []),
    ({'verdict': 'adequate', 'missing': [], 'alternatives': [],
      'sets': weighed(([], 0.95, 0.01)), 'ranking': [row('slack', 0.079)]},
     ['slack comes next', '1 % off', 'not more than chance']),
    ({'verdict': 'unknown', 'missing': [], 'alternatives': [],
      'sets': weighed((['unknown'], 1.0, 0.08)), 'ranking': [row('slack', 0.06)]},
     ['slack comes next', 'does not explain the rest'])])
def test_the_card_says_why_the_next_best_lost(changes, words):
    text = why_not_another(diagnosis(**changes), 'angle')
    assert all(word in text for word in words)
    assert bool(text) is bool(words)


def test_a_tied_effect_is_no_rival():
    found = diagnosis(sets=weighed((['payload_error'], 0.6, 0.002),
                                   (['encoder_offset'], 0.3, 0.002), (['slack'], 0.1, 0.01)))
    assert why_not_another(found, 'angle').startswith('slack comes next')


KEPT = {'effect': 'formation_memory', 'kept': 0.9, 'rmse_before': 0.02, 'rmse_after': 0.005}
KINETICS = {'effect': 'kinetics', 'share': 0.8, 'rmse_before': 0.02, 'rmse_after': 0.005}


@pytest.mark.parametrize('changes, command, added', [
    (ALONE, 'extend', 'payload_error'), ({}, 'diagnose', None),
    ({'verdict': 'adequate', 'missing': [], 'alternatives': []}, 'compare', None),
    ({'verdict': 'adequate', 'missing': [], 'alternatives': [], 'kept_strain': KEPT}, 'extend',
     'formation_memory'),
    ({'verdict': 'adequate', 'missing': [], 'alternatives': [], 'kept_strain': KEPT,
      'kinetics': KINETICS}, 'extend', 'formation_memory,kinetics'),
    ({**ALONE, 'kept_strain': KEPT}, 'extend', 'payload_error'),
    ({'verdict': 'unknown', 'missing': []}, 'diagnose', None)])
def test_the_next_command_is_one_that_the_command_line_takes(changes, command, added):
    reading = ('--namespace', '/left', '--columns', 'angle=theta:deg', '--settled')
    text = after_diagnosis(diagnosis(**changes), 'my model.yaml', ['a b.csv'],
                           Origin('', reading))
    words = shlex.split(text)[1:]
    assert words[0] == command
    args = build_parser(words).parse_args(words)
    assert args.model == 'my model.yaml' and args.settled and args.namespace == '/left'
    assert 'NEW.csv' in words and ('a b.csv' in words) is (command != 'compare')
    if command == 'extend':
        assert args.add == added and args.test == ['NEW.csv']


def test_other_pages_have_their_next_command_too():
    for text in (after_comparison('m.yaml', ['a.csv'], Origin()),
                 after_extension('m.yaml', Origin())):
        words = shlex.split(text)[1:]
        assert build_parser(words).parse_args(words).model == 'm.yaml'


def test_the_options_that_read_a_recording_are_kept():
    columns = parse_columns('angle=theta:deg,"time=t, in ms:ms"')
    found = origin(Namespace(columns=columns, settled=True, words=['compare', 'a b']))
    assert found.command == "hysteresis compare 'a b'"
    assert found.reading[0] == '--columns' and parse_columns(found.reading[1]) == columns
    assert found.reading[2:] == ('--settled',)
    args = build_parser(['compare']).parse_args([
        'compare', '--model', 'm.yaml', '--data', 'a.csv', '--settled-time', '7.5'])
    assert origin(args).reading == ('--settled-time', '7.5')
    assert origin(Namespace()) == Origin()


def test_the_glossary_has_the_effects_that_are_linked_and_no_others():
    part = linked('slack & creep_test; no `extend --add backlash`, but creeps')
    assert part == ('<a href="#effect-slack">slack</a> &amp; creep_test; no <code>extend --add '
                    '<a href="#effect-backlash">backlash</a></code>, but creeps')
    section = glossary(part, 'creep')
    assert re.findall('id="effect-(\\w+)"', section) == ['slack', 'backlash']
    assert section.count('Equation: <code>') == section.count('Source: ') == 2
    assert glossary('creep') == ''


def test_every_link_of_a_card_leads_somewhere():
    card = diagnosis_card(diagnosis(), 'angle', 'm.yaml', ['<b>.csv'], Origin())
    section = glossary(card)
    links = set(re.findall('href="#([^"]+)"', card))
    assert links == set(re.findall('<dt id="([^"]+)"', section)) != set()
    assert '<b>' not in card and '&lt;b&gt;.csv' in card


def test_provenance_has_command_date_versions_and_hashes(tmp_path):
    model = tmp_path / 'model.yaml'
    model.write_bytes(b'content')
    recorded = run(lambda t, v, up: 0.0)
    text = words_of(provenance(Origin('hysteresis compare <x>'), str(model), [recorded]))
    assert hashlib.sha256(b'content').hexdigest() in text
    assert 'hysteresis compare <x>' in text
    assert re.search(r'\d{4}-\d\d-\d\d \d\d:\d\d UTC', text)
    assert re.search(r'hysteresis_ros [\d.]+, Python [\d.]+, numpy [\d.]+', text)


def unpack(column):
    """Return a packed column as the page's script does."""
    whole = np.frombuffer(base64.b64decode(column['data']), f'<u{column["bits"] // 8}')
    none = 2 ** column['bits'] - 1
    values = column['low'] + whole / (none - 1.0) * (column['high'] - column['low'])
    return np.where(whole == none, np.nan, values)


@pytest.mark.parametrize('bits, error', [(16, 8e-6), (32, 2e-10)])
def test_packed_columns_keep_what_is_seen(bits, error):
    values = np.array([-3.0, 0.1, np.nan, 7.0])
    np.testing.assert_allclose(unpack(packed(values, bits)), values, atol=10 * error)
    np.testing.assert_array_equal(unpack(packed(np.full(3, 2.5), bits)), np.full(3, 2.5))


def test_charts_have_the_rows_of_a_comparison(comparison):
    content = json.loads(as_json(recording(comparison, [
        Curve('two-stage', 'model', comparison.predicted)])))
    measured = np.rad2deg(comparison.measured)
    np.testing.assert_allclose(unpack(content['measured']), measured, atol=1e-3)
    np.testing.assert_allclose(unpack(content['x']['values']), comparison.time / 60, atol=1e-6)
    assert content['x']['unit'] == 'min' and content['response']['unit'] == 'deg'
    assert [(one['from'], one['to']) for one in content['trials']] == [(0, 3000), (3000, 6000)]
    # The worst region is where the voltage is high.
    inside = np.zeros(comparison.rows, dtype=bool)
    for first, last in content['regions'][0]['rows']:
        inside[first:last] = True
    voltage = comparison.signals['voltage']
    assert np.mean(inside == (voltage > 4)) > 0.97


def test_data_cannot_end_its_element():
    text = as_json({'name': '</script><!--&'})
    assert not re.search('[<>&]', text) and json.loads(text) == {'name': '</script><!--&'}


def test_of_many_rows_the_extremes_and_the_ends_of_trials_are_drawn(comparison):
    curves = [Curve('two-stage', 'model', comparison.predicted)]
    rows = chosen_rows(comparison, curves, 400)
    assert len(rows) <= 410 and np.all(np.diff(rows) > 0)
    assert {0, 2999, 3000, 5999} <= set(rows)
    for values in (comparison.measured, comparison.residual):
        assert values[rows].max() == values.max() and values[rows].min() == values.min()
    assert recording(comparison, curves)['drawn'] == 6000


def test_trials_are_not_joined():
    x, y = separated(np.arange(6.0), np.arange(6.0), np.array([0, 0, 0, 1, 1, 2]))
    assert np.flatnonzero(np.isnan(y)).tolist() == [3, 6]
    np.testing.assert_array_equal(y[~np.isnan(y)], np.arange(6.0))
    np.testing.assert_array_equal(np.isnan(x), np.isnan(y))


@pytest.mark.parametrize('name, short', [
    ('two-stage', 'two-stage'), ('two-stage + creep', 'two-stage + creep'),
    ('two-stage + creep + slack', 'two-stage + 2 effects'), ('+ creep', '+ creep')])
def test_long_names_of_models_are_shortened(name, short):
    assert short_name(name) == short


def test_texts_for_those_who_do_not_see_a_picture_say_what_it_shows(comparison):
    said = descriptions(comparison)
    mean = np.rad2deg(comparison.model.mean_abs)
    off = re.search(r'The model is off by ([\d.]+) deg on average', said['overlay'])
    assert float(off[1]) == pytest.approx(mean, rel=0.01)
    assert 'in 2 trials' in said['overlay'] and 'the linear model by' in said['overlay']
    low, high = (float(re.search(rf'(\S+) deg at {which} drive', said['loop'])[1])
                 for which in ('low', 'high'))
    assert abs(low) < 0.1 < 1.0 < high
    assert re.search('mean is 1.72 deg, where (voltage|predicted angle) is about', said['signals'])
    assert len(set(said.values())) == len(said)
