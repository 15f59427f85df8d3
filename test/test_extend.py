# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Adding effects to a model: what is refused, what is fitted, what is written and read again."""

import json
import math

from model_support import arm_run, bicep_model, effect_of, runs, wandering_voltage
import numpy as np
import pytest

from hysteresis_ros.cli.main import main
from hysteresis_ros.diagnosis.determined import not_determined, undetermined
from hysteresis_ros.diagnosis.extend import extend, extend_by_hand, rmse
from hysteresis_ros.effects import effect_class
from hysteresis_ros.errors import MeasurementError, ParameterError
from hysteresis_ros.measurements import Measurement, write_csv
from hysteresis_ros.model import MuscleModel


def run_of(model, seed, noise=2e-3):
    """Return a settled run of an arm that is as the model says, with a little noise."""
    run = arm_run(wandering_voltage(400, seed)[::5])
    angle = model.predict(run) + noise * np.random.default_rng(seed).standard_normal(run.rows)
    return Measurement.from_columns({**run.columns, 'angle': angle}, source=f'run{seed}.csv')


@pytest.fixture(scope='module')
def base():
    """Return the model without effects."""
    return bicep_model()


@pytest.fixture(scope='module')
def recordings(base):
    """Return two recordings of an arm with 15 g too much and an encoder off by 2 degrees."""
    arm = base.with_effects([effect_of(base, 'payload_error', dm=15.0),
                             effect_of(base, 'encoder_offset', offset=2.0)])
    return run_of(arm, 1), run_of(arm, 2)


@pytest.fixture(scope='module')
def extension(base, recordings):
    """Return the model extended with both effects."""
    train, test = recordings
    return extend(base, ['payload_error', 'encoder_offset'], [train], [test])


def test_both_effects_get_the_values_of_the_arm(extension):
    """The intervals hold the truth, no wider than the bench's error of 0.4 mm makes them."""
    values = [effect.values for effect in extension.added]
    assert values[0]['dm'] == pytest.approx(15.0, abs=2.0)
    assert values[1]['offset'] == pytest.approx(2.0, abs=0.5)
    for effect, name in zip(extension.added, ('dm', 'offset')):
        low, high = effect.intervals[name]
        assert low < effect.values[name] < high
        assert high - low < 1.5 * abs(effect.values[name])
    assert extension.implausible == []


def test_what_the_model_has_of_an_effect_acts_until_it_is_fitted_anew(base):
    """Else a step before would show the error of a model without it."""
    own = base.with_effects([effect_of(base, 'series_compliance', compliance=0.3)])
    train = run_of(base.with_effects([effect_of(base, 'series_compliance', compliance=0.4),
                                      effect_of(base, 'payload_error', dm=15.0)]), 1)
    first, both = (extend(own, names, [train]).steps for names in (
        ['payload_error'], ['payload_error', 'series_compliance']))
    assert both[1] == (first[1][0], pytest.approx(first[1][1], rel=0.01))
    assert both[2][1] < both[1][1] < both[0][1]


def test_the_error_on_the_unseen_recording_falls_to_the_noise(extension, base, recordings):
    """Step by step: the base, one effect more, both."""
    assert extension.test['rmse_before'] == rmse(base, recordings[1:])
    assert extension.test['rmse_before'] > 0.03
    assert extension.test['rmse_after'] < 1.15 * 2e-3
    names, errors = zip(*extension.steps)
    assert names == ('base', '+ payload_error', '+ encoder_offset')
    assert errors[0] > errors[1] > errors[2] == extension.test['rmse_after']
    assert extension.train['rmse_after'] < 0.1 * extension.train['rmse_before']


def test_the_error_of_a_model_is_that_over_all_rows_of_all_recordings(base, recordings):
    """A root of the mean of squares, not a mean of roots."""
    errors = np.concatenate([base.predict(m) - m.column('angle') for m in recordings])
    assert rmse(base, recordings) == pytest.approx(math.sqrt(np.mean(errors ** 2)))


def test_the_json_is_as_programs_expect_it(extension):
    """Plain finite numbers under the names that were promised."""
    content = json.loads(json.dumps(extension.to_dict(), allow_nan=False))
    assert content['added'] == ['payload_error', 'encoder_offset']
    assert set(content['parameters']) == set(content['added'])
    assert set(content['parameters']['payload_error']['dm']) >= {'value', 'low', 'high', 'unit'}
    for part in ('train', 'test'):
        assert set(content[part]) == {'rmse_before', 'rmse_after'}


def test_the_file_of_an_extended_model_predicts_the_same(extension, recordings, tmp_path):
    """With its effects, their intervals, and what they were fitted to."""
    extension.model.save(tmp_path / 'extended.yaml')
    again = MuscleModel.load(tmp_path / 'extended.yaml')
    assert [effect.id for effect in again.effects] == ['payload_error', 'encoder_offset']
    assert [e.to_dict() for e in again.effects] == [e.to_dict() for e in extension.added]
    assert np.array_equal(again.predict(recordings[1]), extension.model.predict(recordings[1]))
    entry, = again.provenance['extended']
    assert entry['effects'] == ['payload_error', 'encoder_offset']
    assert entry['data'][0]['source'] == 'run1.csv'
    assert len(entry['data'][0]['sha256']) == 64


def test_the_weights_of_the_bench_stay_as_they_are(extension, base):
    """On the arm nothing but the effects is fitted."""
    assert extension.model.length_stage.to_dict() == base.length_stage.to_dict()
    assert extension.model.force_stage.to_dict() == base.force_stage.to_dict()
    assert base.effects == [] and 'extended' not in base.provenance


def test_a_second_extension_builds_on_the_first(base, recordings):
    """The first stays as it was fitted, and the second explains a part of the residual."""
    train, test = recordings
    first = extend(base, ['payload_error'], [train], [test])
    second = extend(first.model, ['encoder_offset'], [train], [test])
    assert [effect.id for effect in second.model.effects] == ['payload_error', 'encoder_offset']
    assert second.test['rmse_before'] == first.test['rmse_after']
    assert second.train['rmse_after'] < second.train['rmse_before']
    assert second.model.effects[0].values == first.model.effects[0].values
    assert len(second.model.provenance['extended']) == 2


@pytest.mark.parametrize('names, words', [
    (['gremlins'], "there is no effect 'gremlins'"),
    (['payload_error', 'payload_error'], 'payload_error is named twice'),
    (['backlash'], 'already has the effect backlash'),
    ([], 'no effect is named')])
def test_names_that_make_no_sense_are_refused(base, recordings, names, words):
    """Before anything is fitted."""
    model = base.with_effects([effect_of(base, 'backlash')])
    with pytest.raises(ParameterError, match=words):
        extend(model, names, recordings[:1])


def test_an_effect_that_settled_rows_cannot_show_needs_force(base, recordings, tmp_path, capsys):
    """A lag on settled rows: refused, and with --force fitted with warnings."""
    with pytest.raises(ParameterError, match='cannot show thermal_lag: every row is settled.'):
        extend(base, ['thermal_lag'], recordings[:1])
    base.save(tmp_path / 'model.yaml')
    write_csv(recordings[0].columns, tmp_path / 'run.csv')
    command = ['extend', '--model', f'{tmp_path}/model.yaml', '--data', f'{tmp_path}/run.csv',
               '--add', 'thermal_lag', '-o', f'{tmp_path}/extended.yaml']
    assert main(command) == 1
    assert '--force' in capsys.readouterr().err and not (tmp_path / 'extended.yaml').exists()
    assert main([*command, '--force', '--json', f'{tmp_path}/e.json']) == 0
    assert 'warning: these recordings cannot show thermal_lag' in capsys.readouterr().err
    assert json.loads((tmp_path / 'e.json').read_text())['warnings']
    assert 'thermal_lag' in [e.id for e in MuscleModel.load(tmp_path / 'extended.yaml').effects]


def test_an_interval_that_spans_the_range_is_said_to_say_nothing(base):
    effect = effect_of(base, 'encoder_offset', offset=2.0)
    most = effect.parameters[0].high
    effect.intervals = {'offset': (-2.0 * most, 3.0 * most)}
    note, = undetermined(effect, 'arm')
    assert 'encoder_offset.offset spans its physical range' in note
    # The range has both signs: nine tenths of it is the border.
    effect.intervals = {'offset': (-0.9 * most, most)}
    assert len(undetermined(effect, 'arm')) == 1
    for interval in ((1.5, 2.5), (-0.7 * most, most)):
        effect.intervals = {'offset': interval}
        assert undetermined(effect, 'arm') == []


def test_an_effect_that_the_bench_has_shown_is_fitted_anew_to_the_arm(base, recordings):
    """The wires of the arm are others; a compliance next to the first would be no effect."""
    model = base.with_effects([effect_of(base, 'series_compliance')])
    extended = extend(model, ['series_compliance'], recordings[:1]).model
    assert [effect.id for effect in extended.effects] == ['series_compliance']
    assert extended.effects[0].values != model.effects[0].values


def test_an_effect_of_the_arm_is_not_fitted_to_a_bench(base):
    """No bench table knows the payload."""
    steps = np.arange(12.0)
    bench = Measurement.from_columns({
        'trial': np.zeros(12), 'step': steps, 'voltage': 3.0 + 3.0 * np.sin(steps),
        'force': np.full(12, 2.0), 'length': -0.01 * np.sin(steps)})
    with pytest.raises(ParameterError, match='payload_error cannot be fitted to a bench'):
        extend(base, ['payload_error'], [bench])


def test_recordings_of_two_kinds_are_refused(base, recordings):
    """One fit cannot be judged by two quantities."""
    bench = Measurement.from_columns({
        'trial': np.zeros(3), 'step': np.arange(3.0), 'voltage': np.arange(3.0),
        'force': np.ones(3), 'length': np.zeros(3)})
    with pytest.raises(MeasurementError, match='several kinds'):
        extend(base, ['payload_error'], [recordings[0], bench])


def test_a_test_recording_of_another_kind_is_refused(base, recordings, tmp_path, capsys):
    """An error in metres next to one in radians would say nothing."""
    bench = Measurement.from_columns({
        'trial': np.zeros(3), 'step': np.arange(3.0), 'voltage': np.arange(3.0),
        'force': np.ones(3), 'length': np.zeros(3)})
    base.save(tmp_path / 'model.yaml')
    write_csv(recordings[0], tmp_path / 'train.csv')
    write_csv(bench, tmp_path / 'test.csv')
    assert main(['extend', '--model', str(tmp_path / 'model.yaml'), '--add', 'payload_error',
                 '--data', str(tmp_path / 'train.csv'), '--test', str(tmp_path / 'test.csv'),
                 '-o', str(tmp_path / 'new.yaml')]) == 1
    error = capsys.readouterr().err
    assert error.count('\n') == 1 and 'several kinds' in error
    assert not (tmp_path / 'new.yaml').exists()


def test_the_command_says_the_gain_and_writes_model_json_and_page(
        base, recordings, tmp_path, capsys):
    """From files to files."""
    base.save(tmp_path / 'model.yaml')
    for name, recording in zip(('train.csv', 'test.csv'), recordings):
        write_csv(recording, tmp_path / name)
    command = ['extend', '--model', str(tmp_path / 'model.yaml'), '--add',
               'payload_error, encoder_offset', '--data', str(tmp_path / 'train.csv'),
               '--test', str(tmp_path / 'test.csv'), '-o', str(tmp_path / 'new.yaml')]
    written = ['--json', str(tmp_path / 'r.json'), '--report', str(tmp_path / 'r.html')]
    assert main(command + written) == 0
    said = capsys.readouterr().out
    assert '+ payload_error: dm' in said and 'not fitted' in said
    content = json.loads((tmp_path / 'r.json').read_text(encoding='utf-8'))
    assert content['test']['rmse_after'] < 0.1 * content['test']['rmse_before']
    assert len(MuscleModel.load(tmp_path / 'new.yaml').effects) == 2
    assert 'unseen recording' in (tmp_path / 'r.html').read_text(encoding='utf-8')

    assert main(command) == 0
    assert 'warning' not in capsys.readouterr().err
    command[8] = command[6]
    assert main(command) == 0
    assert 'trials of the test are among those that are fitted' in capsys.readouterr().err
    command[2:5] = [str(tmp_path / 'new.yaml'), '--add', 'frame_tilt']
    assert main(command[:-1] + [str(tmp_path / 'newer.yaml')]) == 0
    assert 'frame_tilt takes less than 5 % off the error' in capsys.readouterr().err
    command[2] = str(tmp_path / 'model.yaml')
    command[4] = 'gremlins'
    assert main(command) == 1
    error = capsys.readouterr().err
    assert error.count('\n') == 1 and 'gremlins' in error
    # Of two options both count.
    assert main([*command, '--add', 'payload_error']) == 1
    assert 'gremlins' in capsys.readouterr().err


def test_the_recording_is_not_overwritten(base, recordings, tmp_path, capsys):
    """An output named like an input is a slip of the pen."""
    base.save(tmp_path / 'model.yaml')
    write_csv(recordings[0], tmp_path / 'train.csv')
    before = (tmp_path / 'train.csv').read_bytes()
    assert main(['extend', '--model', str(tmp_path / 'model.yaml'), '--add', 'payload_error',
                 '--data', str(tmp_path / 'train.csv'), '-o', str(tmp_path / 'train.csv')]) == 1
    assert capsys.readouterr().err.count('\n') == 1
    assert (tmp_path / 'train.csv').read_bytes() == before


@pytest.fixture
def files(base, recordings, tmp_path, monkeypatch):
    """Write the model and, as one table of two trials, both recordings."""
    monkeypatch.chdir(tmp_path)
    base.save('base.yaml')
    columns = {name: np.concatenate([one.columns[name] for one in recordings])
               for name in ('time', 'voltage', 'angle')}
    write_csv({'trial': np.repeat([0.0, 1.0], recordings[0].rows), **columns}, 'both.csv')
    return ['extend', '--model', 'base.yaml', '--data', 'both.csv', '-o', 'new.yaml', '--json',
            'new.json']


def test_values_given_by_hand_are_taken_as_they_are(files, base, recordings):
    assert main([*files, '--add', 'payload_error,encoder_offset', '--values',
                 'encoder_offset.offset=2,payload_error.dm=14.5']) == 0
    found = json.loads(open('new.json', encoding='utf-8').read())
    assert found['parameters']['payload_error']['dm'] == {
        'value': 14.5, 'low': 14.5, 'high': 14.5, 'unit': 'g'}
    assert [step['model'] for step in found['steps']] == [
        'base', '+ payload_error', '+ encoder_offset']
    model = MuscleModel.load('new.yaml')
    assert [effect.values for effect in model.effects] == [{'dm': 14.5}, {'offset': 2.0}]
    assert model.provenance['extended'][-1]['by_hand'] is True
    assert found['train']['rmse_after'] == pytest.approx(rmse(model, recordings))
    assert found['train']['rmse_after'] < 0.2 * found['train']['rmse_before']


def test_a_drift_given_by_hand_is_implausible_if_it_adds_up_to_too_much(base, recordings):
    """The range of each of its terms does not know how long the recording takes."""
    duration = max(float(one.columns['time'][-1]) for one in recordings)
    for share, named in ((0.9, []), (1.1, ['ambient_drift.total'])):
        drift = effect_of(base, 'ambient_drift', offset=0.0, curvature=0.0,
                          rate=share * 8.0 * 600.0 / duration)
        found = extend_by_hand(base, [drift], recordings)
        assert [one for one in found.implausible if one.endswith('total')] == named


def test_trials_that_are_not_named_are_not_fitted(files, base, recordings, capsys):
    assert main([*files, '--add', 'payload_error', '--values', 'payload_error.dm=10',
                 '--trials', '0']) == 0
    found = json.loads(open('new.json', encoding='utf-8').read())
    assert found['train']['rmse_before'] == pytest.approx(rmse(base, recordings[:1]))
    assert found['test']['rmse_before'] == pytest.approx(rmse(base, recordings[1:]))
    capsys.readouterr()
    assert main(['compare', '--model', 'new.yaml', '--data', 'both.csv', '--trials', '1',
                 '--json', 'compared.json']) == 0
    assert f'{recordings[1].rows} rows of 1 trial,' in capsys.readouterr().out
    compared = json.loads(open('compared.json', encoding='utf-8').read())
    assert compared['extensions'][-1]['rmse'] == pytest.approx(found['test']['rmse_after'])
    assert compared['rows'] == recordings[1].rows


@pytest.mark.parametrize('name, values', [
    ('wire_break', {'time': 2000.0}), ('ambient_drift', {'offset': 0.2, 'rate': 0.4}),
    ('fatigue', {'b': -0.3, 'a': 0.0})])
def test_what_happens_in_the_course_of_a_recording_holds_for_its_other_trials(base, name, values):
    arm = base.with_effects([effect_of(base, name, **values)])
    run = runs(arm, trials=4, rows=40)
    found = extend(base, [name], [run.select([0, 1, 2])], [run.select([3])])
    assert found.test['rmse_after'] < 0.1 * found.test['rmse_before']


@pytest.mark.slow
@pytest.mark.parametrize('names', [
    ('wire_break', 'backlash'), ('wire_break', 'coulomb_friction'), ('wire_break', 'fatigue')])
@pytest.mark.parametrize('turned', [False, True])
def test_the_order_in_which_effects_are_added_does_not_matter_in_the_end(base, names, turned):
    arm = base.with_effects([
        effect_of(base, 'wire_break', time=3200.0), effect_of(base, names[1])])
    run = runs(arm, trials=3, rows=40)
    measured = run.column('angle') + 2e-3 * np.random.default_rng(1).standard_normal(run.rows)
    run = Measurement.from_columns({**run.columns, 'angle': measured})
    names = names[::-1] if turned else names
    found = extend(base, names, [run])
    assert [effect.id for effect in found.added] == list(names)
    assert list(found.model.effects[0].values) == list(found.added[0].values)
    assert found.train['rmse_after'] < 2.5e-3


@pytest.mark.parametrize('words, status, line', [
    (['--values', 'slack.Ls=1'], 1, 'gives no value to payload_error'),
    (['--values', 'payload_error.dm=1,slack.Ls=1'], 1, 'does not name slack'),
    (['--values', 'payload_error.mass=1'], 1, "has no parameter 'mass'"),
    (['--trials', '7'], 1, 'no trial 7; the table has trials 0, 1'),
    (['--values', 'payload_error=1'], 2, 'is not EFFECT.PARAMETER=VALUE'),
    (['--values', 'payload_error.dm=nan'], 2, 'is not EFFECT.PARAMETER=VALUE')])
def test_values_and_trials_that_make_no_sense_are_refused(files, capsys, words, status, line):
    try:
        found = main([*files, '--add', 'payload_error', *words])
    except SystemExit as left:
        found = left.code
    assert found == status and line in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize('interval, determined', [
    ((0.3, 0.5), True), ((0.01, 0.5), False), ((0.0, 0.009), False), ((0.01, 0.9), False)])
def test_a_size_is_determined_where_nothing_too_small_to_matter_is_likely(interval, determined):
    """Nor is one that is known to be nothing."""
    effect = effect_class('stress_dependent_strain')(None, r=0.2)
    effect.intervals['r'] = interval
    assert (not_determined(effect, 'bench') is None) == determined
