# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of a diagnosis and of an extension: they need nothing but themselves."""

from html import unescape
from html.parser import HTMLParser
import json
import re

from model_support import arm_run, bicep_model, effect_of, wandering_voltage
import pytest

from hysteresis_ros.diagnosis.diagnose import Diagnosis
from hysteresis_ros.cli.diagnose import to_text
from hysteresis_ros.diagnosis.extend import extend
from hysteresis_ros.diagnosis.verdict import shown_or_not
from hysteresis_ros.effects import catalogue
from hysteresis_ros.report.diagnosis_page import write_diagnosis, write_extension
from hysteresis_ros.report.resources import script, script_digest
from hysteresis_ros.report.words import parameters_in_words, verdict_in_words
from hysteresis_ros.measurements import Measurement

NASTY = '<script>alert(1)</script>&run.csv'


def run_of(model, seed):
    """Return a settled run of the arm of a model, from a file with a nasty name."""
    run = arm_run(wandering_voltage(400, seed)[::5])
    return Measurement.from_columns({**run.columns, 'angle': model.predict(run)}, source=NASTY)


@pytest.fixture(scope='module')
def case():
    """Return model, recordings and the extension by the payload that they lack."""
    model = bicep_model()
    arm = model.with_effects([effect_of(model, 'payload_error')])
    train, test = run_of(arm, 1), run_of(arm, 2)
    return model, train, test, extend(model, ['payload_error'], [train], [test])


def row(effect, after, plausible=True):
    """Return a row of the ranking."""
    return {'effect': effect, 'rmse_before': 0.08, 'rmse_after': after,
            'gain': 1.0 - after / 0.08, 'gain_low': 0.1, 'gain_high': 0.95, 'p_value': 0.002,
            'parameters': {
                name: {**entry, 'value': 15.0, 'low': 14.0, 'high': 16.0} for name, entry in
                catalogue()[effect](None).to_dict()['parameters'].items()},
            'plausible': plausible, 'absorbed': 0.4, 'confused_with': []}


def diagnosis(verdict='missing', **changes):
    """Return what was found, without the search."""
    content = {
        'missing': ['payload_error'], 'alternatives': [['encoder_offset']],
        'ranking': [row('payload_error', 0.002), row('supply_sag', 0.05, False)],
        'sets': [{'effects': ['payload_error'], 'probability': 0.9, 'rmse': 0.002},
                 {'effects': ['unknown'], 'probability': 0.1, 'rmse': 0.08}],
        'noise_floor': 1e-3, 'structural_error': 5e-3, 'bench_error': 4e-3, 'unexplained': 0.01,
        'experiment': 'weigh the payload & the forearm', 'effects': [], 'rmse_before': 0.08,
        'rmse_after': 0.002, 'not_excited': {'latency': 'every row is settled'}, 'event': None,
        'signal': '', **changes}
    return Diagnosis(verdict=verdict, **content)


class Elements(HTMLParser):
    """Collects the elements of a page and what they refer to."""

    def __init__(self, text):
        super().__init__()
        self.names, self.addresses, self.handlers = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Note an element."""
        self.names.append(tag)
        for name, value in attrs:
            if name in ('src', 'href', 'action', 'data'):
                self.addresses.append(value)
            if name.startswith('on'):
                self.handlers.append(name)


def words_of(text):
    """Return what a page says, without its pictures, style and script."""
    text = re.sub(r'<(style|script)\b.*?</\1>', '', text, flags=re.DOTALL)
    return unescape(re.sub('<[^>]*>', '', text))


def check_self_contained(text):
    """Nothing is fetched, no script but our own runs, and a phone shows it at its own width."""
    elements = Elements(text)
    assert 'iframe' not in elements.names
    assert text.count('<script') == 2 and f'<script>{script()}</script>' in text
    assert f"script-src '{script_digest()}'" in text and "default-src 'none'" in text
    assert elements.handlers == []
    assert len(text) < 1.5e6
    assert elements.addresses, 'a page without a picture'
    assert all(address.startswith(('data:image/', '#')) for address in elements.addresses)
    without_pictures = re.sub(r'data:image/[^"]*', '', text).replace(script(), '')
    assert not re.search(r'https?://|@import|url\(', without_pictures)
    assert 'name="viewport"' in text and '<!doctype html>' in text.lower()
    assert '@media print' in text


@pytest.fixture(scope='module')
def found_page(case, tmp_path_factory):
    """Return the page of a diagnosis."""
    model, train, _, extension = case
    path = tmp_path_factory.mktemp('page') / 'diagnosis.html'
    write_diagnosis(path, model, [train], diagnosis(effects=extension.added), NASTY)
    return path.read_text(encoding='utf-8')


@pytest.fixture(scope='module')
def extended_page(case, tmp_path_factory):
    """Return the page of an extension."""
    model, train, test, extension = case
    path = tmp_path_factory.mktemp('page') / 'extended.html'
    write_extension(path, model, extension, [train], [test], NASTY)
    return path.read_text(encoding='utf-8')


def test_the_page_of_a_diagnosis_needs_nothing_but_itself(found_page):
    """No network, no script."""
    check_self_contained(found_page)


def test_the_page_of_an_extension_needs_nothing_but_itself(extended_page):
    """No network, no script."""
    check_self_contained(extended_page)


def test_names_of_files_are_text(found_page, extended_page):
    """What stands in angle brackets is shown and not obeyed."""
    for text in (found_page, extended_page):
        assert '&lt;script&gt;alert(1)&lt;/script&gt;&amp;run.csv' in text
    assert 'weigh the payload &amp; the forearm' in found_page


def test_the_verdict_comes_first(found_page):
    """Then where it fails, the effects, the alternatives, what could not show, provenance."""
    order = ['Missing: one of payload_error, encoder_offset', 'What to do next',
             'Response and residual', 'Where it fails',
             'Effects, by what they do on rows not fitted', 'Probabilities', 'Alternatives',
             'What this recording could not show', 'Before and after',
             'What the error is made of', 'Provenance', 'Glossary of effects']
    text = words_of(found_page)
    places = [text.index(words) for words in order]
    assert places == sorted(places)
    assert 'payload_error cannot be told from encoder_offset' in text
    assert 'latency: every row is settled' in text


def test_errors_are_in_degrees(found_page, extended_page, case):
    """The page shows the unit that a person thinks in."""
    assert 'RMSE [deg]' in found_page
    said = re.search(r'Adding payload_error takes the error on the unseen recording from ([\d.]+) '
                     r'to \S+ deg RMS', words_of(extended_page))
    assert float(said[1]) == pytest.approx(57.29578 * case[3].test['rmse_before'], rel=0.02)


def test_charts_judge_what_the_page_is_about(found_page, extended_page, case):
    """Of a diagnosis the model as it is, of an extension the extended one."""
    data = [json.loads(re.search('id="recording">([^<]*)<', text)[1])
            for text in (found_page, extended_page)]
    assert [content['predictions'][content['main']]['role'] for content in data] == [
        'model', 'after']
    assert [content['predictions'][1]['name'] for content in data] == 2 * ['with payload_error']
    # Its largest residual, which bounds the colours of the loop.
    assert data[1]['limit'] < 0.2 * data[0]['limit']


def test_nothing_found_is_a_page_too(case, tmp_path):
    """Without effects there is no before and after."""
    model, train, _, _ = case
    write_diagnosis(tmp_path / 'p.html', model, [train], diagnosis(
        'adequate', missing=[], alternatives=[], ranking=[]), 'model.yaml')
    text = (tmp_path / 'p.html').read_text(encoding='utf-8')
    check_self_contained(text)
    assert 'Adequate' in words_of(text) and 'Before and after' not in words_of(text)


def test_a_value_outside_its_range_is_warned_of(case, tmp_path):
    """It is an implausible explanation."""
    model, train, _, extension = case
    try:
        extension.implausible.append('payload_error.dm')
        write_extension(tmp_path / 'p.html', model, extension, [train], [], 'extended.yaml')
    finally:
        extension.implausible.clear()
    text = (tmp_path / 'p.html').read_text(encoding='utf-8')
    assert 'payload_error.dm is outside its physical range' in text


@pytest.mark.parametrize('verdict, changes, words', [
    ('missing', {'alternatives': [[]]}, ['Missing: payload_error. ', 'Adding it takes 98 % off']),
    ('missing', {}, ['Missing: one of payload_error, encoder_offset. This data cannot tell them',
                     'Adding payload_error takes 98 % off']),
    ('missing', {'missing': ['payload_error', 'backlash'], 'alternatives': [[], []]},
     ['Also missing: backlash', 'Adding them']),
    ('unknown', {'unexplained': 0.6, 'event': 1234.4}, ['60 %', 'happened 1234 s after']),
    ('unknown', {'single_row': 1830.2, 'event': 1000.0},
     ['single row, 1830 s after', 'leave it out']),
    ('unknown', {'unexplained': 0.6, 'signal': 'cycles'}, ['shows in cycles', '60 %']),
    ('unknown', {'uneven': True}, ['like noise', 'larger at some times']),
    ('unknown', {'resembles': ['end_stop', 'slack']}, ['like end_stop with slack', 'not physical']),
    ('unknown', {'explains_most': ['backlash']}, ['backlash would explain most', 'what stays']),
    ('not_excited', {}, ['moves too little']),
    ('adequate', {}, ['no effect of the catalogue'])])
def test_the_words_say_what_was_found(verdict, changes, words):
    """Each verdict in a sentence that a person can act on."""
    text = verdict_in_words(diagnosis(verdict, **changes))
    assert all(word in text for word in words)


def test_a_p_value_says_when_it_is_the_smallest_that_the_draws_can_give():
    found = diagnosis(draws=400, ranking=[{**row('payload_error', 0.002), 'p_value': 1 / 401},
                                          {**row('supply_sag', 0.05), 'p_value': 0.012}])
    text = to_text(found, 'angle')
    assert re.search('payload_error .* <= 0.0025 ', text)
    assert re.search('supply_sag .* 0.012 ', text)
    assert '<= 0.0025 is the smallest that 400 random draws can give' in text
    assert '<= 0.0025' in found.brief().rows[0]
    found.ranking.pop(0)
    assert 'random draws' not in to_text(found, 'angle')


def test_the_text_tells_probabilities_and_what_absorbed_means():
    """Most probable first, as they come; none of less than one in a hundred."""
    found = diagnosis(sets=[
        {'effects': ['payload_error', 'backlash'], 'probability': 0.62, 'rmse': 0.01},
        {'effects': [], 'probability': 0.361, 'rmse': 0.01},
        {'effects': ['unknown'], 'probability': 0.012, 'rmse': 0.01},
        {'effects': ['slack'], 'probability': 0.004, 'rmse': 0.01}],
        ranking=[row('payload_error', 0.002)])
    text = to_text(found, 'angle')
    assert ('probability: backlash with payload_error 0.62, the model as it is 0.36, '
            'an unknown cause 0.01\n') in text
    assert 'absorbed: share of what an effect changes' in text
    assert 'probability' not in to_text(diagnosis(sets=[], ranking=[]), 'angle')


def test_the_text_says_apart_what_the_bench_shows_of_the_models_error():
    text = to_text(diagnosis(), 'angle')
    assert ('error of the base model, as its bench shows, about 0.23 deg, with what no bench of '
            'constant loads shows 0.29 deg, unexplained') in text
    assert 'error of the base model' not in to_text(
        diagnosis(bench_error=None, structural_error=None), 'angle')


def test_an_effect_is_not_both_ranked_and_one_that_could_not_have_shown():
    found = shown_or_not(diagnosis(
        not_excited={'supply_sag': 'too weak', 'payload_error': 'too weak', 'encoder_offset': '-'},
        ranking=[{**row('payload_error', 0.002), 'confused_with': ['supply_sag', 'airflow']},
                 row('supply_sag', 0.05)]))
    assert [one['effect'] for one in found.ranking] == ['payload_error']
    assert found.ranking[0]['confused_with'] == ['airflow']
    # What is missing, or may be in its place, has shown.
    assert found.not_excited == {'supply_sag': 'too weak'}


def test_the_words_of_values_have_units_and_intervals_where_there_are_any():
    values = {'B': {'value': 1.2345, 'low': 1.1, 'high': 1.5, 'unit': 'deg'},
              'seat': {'value': -1.0, 'low': -1.0, 'high': -1.0, 'unit': '1'},
              'zeroed': {'value': 0.5, 'low': 0.5, 'high': 0.5, 'unit': '1'}}
    assert (parameters_in_words('backlash', values)
            == 'B 1.23 (1.1 to 1.5) deg, seat -1, zeroed 0.5')
    assert (parameters_in_words('backlash', values, intervals=False)
            == 'B 1.23 deg, seat -1, zeroed 0.5')


def test_the_words_of_values_say_nothing_of_what_is_neutral_and_was_not_fitted():
    values = effect_of(bicep_model(), 'stress_dependent_strain', r=0.4).to_dict()['parameters']
    values['F0'].update(value=2.0, low=1.0, high=3.0)
    assert (parameters_in_words('stress_dependent_strain', values)
            == 'r 0.4, F0 2 (1 to 3) loads')
    values['hot'].update(value=1.0, low=1.0, high=1.0)
    values['growth'].update(low=-0.1, high=0.1)
    assert (parameters_in_words('stress_dependent_strain', values)
            == 'r 0.4, F0 2 (1 to 3) loads, growth 0 (-0.1 to 0.1), hot 1')
    # The size is always written, and all values of an effect that no catalogue has.
    size = {'offset': {'value': 0.0, 'low': 0.0, 'high': 0.0, 'unit': 'deg'}}
    assert parameters_in_words('encoder_offset', size) == 'offset 0 deg'
    assert parameters_in_words('my_own', size) == 'offset 0 deg'
