# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The page `hysteresis studio` without the page: what is ticked, set, fitted, saved and shown."""

import os
import shlex
import socket
import sys
import threading

from model_support import bicep_model, effect_of, heavier_arm, wandering_voltage
import numpy as np
import pytest
import yaml

from hysteresis_ros import api
from hysteresis_ros.cli import studio as command
from hysteresis_ros.cli.main import main
from hysteresis_ros.diagnosis.extend import rmse
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import MeasurementError, ParameterError
from hysteresis_ros.measurements import Measurement, read_measurement
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.model.simulation import Simulator
from hysteresis_ros.studio import charts, server
from hysteresis_ros.studio.feed import Feed
from hysteresis_ros.studio.jobs import Job
from hysteresis_ros.studio.session import Session
from hysteresis_ros.studio.sliders import rounded, sliders_of
from hysteresis_ros.studio.views import axis

TRUTH = 15.0    # g


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with a model and two recordings of an arm with 15 g too much."""
    return heavier_arm(tmp_path_factory.mktemp('studio'), TRUTH, {'train.csv': 1, 'test.csv': 50})


@pytest.fixture
def opened(folder, tmp_path, monkeypatch):
    """Return a function that opens a session on recordings, in a folder of its own."""
    for name in ('model.yaml', 'train.csv', 'test.csv'):
        os.symlink(folder / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)

    def open_session(*names, **options):
        recordings = [read_measurement(name) for name in names or ['train.csv']]
        return Session(MuscleModel.load('model.yaml'), recordings, model_path='model.yaml',
                       **options)
    return open_session


@pytest.fixture
def session(opened):
    """Return a session on one recording of four trials."""
    return opened()


def names(parts):
    """Return the names of parts."""
    return [part.name for part in parts]


def slider(session, name):
    """Return the slider with a name."""
    return next(one for one in session.sliders() if one.name == name)


def test_ticking_an_effect_lets_the_error_fall_on_rows_that_were_not_looked_at(session):
    before = session.errors()
    assert all(one.now == one.before > 0.01 for one in before.values())
    session.tick('payload_error')
    after = session.errors()
    assert after['fitted'].now < 0.7 * before['fitted'].now
    assert after['unseen'].now < 0.7 * before['unseen'].now
    assert after['fitted'].before == before['fitted'].before
    session.tick('payload_error', False)
    assert session.errors() == before


def test_a_slider_sets_the_value_that_is_simulated(session):
    session.tick('payload_error')
    session.slide('payload_error.dm', TRUTH)
    assert session.errors()['fitted'].now < 1e-5
    session.slide('payload_error.dm', -30.0)
    assert slider(session, 'payload_error.dm').value == -30.0
    model = session.model.with_effects([effect_of(session.model, 'payload_error', dm=-30.0)])
    fitted = session.recordings[0].select([0, 1, 2])
    assert session.errors()['fitted'].now == pytest.approx(rmse(model, [fitted]), rel=1e-6)


def test_a_move_of_a_slider_is_one_simulation(session, monkeypatch):
    session.tick('payload_error')
    calls, run = [], Simulator.run
    monkeypatch.setattr(Simulator, 'run', lambda *args, **more: calls.append(1) or run(
        *args, **more))
    session.slide('payload_error.dm', 3.0)
    session.errors()
    session.curves()
    assert len(calls) == 1


def test_what_is_wrong_is_refused(session):
    for action, words in (
            (lambda: session.tick('payload'), 'did you mean'),
            (lambda: session.slide('payload_error.dm', 1.0), 'not ticked'),
            (session.fit, 'tick one first'), (session.save, 'tick one first'),
            (lambda: session.hold_out([f'trial {n}' for n in range(4)]), 'has to be fitted')):
        with pytest.raises(ParameterError, match=words):
            action()
    session.tick('payload_error')
    with pytest.raises(ParameterError, match='no parameter'):
        session.slide('payload_error.mass', 1.0)
    with pytest.raises(ParameterError, match='finite'):
        session.slide('payload_error.dm', float('nan'))
    assert names(session.unseen) == ['trial 3']


def test_an_effect_that_the_model_has_for_good_cannot_be_ticked(folder):
    model = bicep_model(['encoder_offset', 'stress_dependence'])
    session = Session(model, [read_measurement(folder / 'train.csv')], model_path='m.yaml')
    states = {one.name: one.built_in for one in session.catalogue()}
    # One of the wire that the bench has shown may be another one on the arm.
    assert states['encoder_offset'] and not states['stress_dependence']
    with pytest.raises(ParameterError, match='already has'):
        session.tick('encoder_offset')
    session.tick('stress_dependence')
    session.slide('stress_dependence.shift', 0.0)
    without = model.with_effects([model.effects[0], session.effects[0]])
    assert session.errors()['fitted'].now == pytest.approx(
        rmse(without, [session.recordings[0].select([0, 1, 2])]), rel=1e-6)


def test_effects_that_the_rows_cannot_show_say_so_and_are_forced(session):
    states = {one.name: one for one in session.catalogue()}
    assert states['thermal_lag'].hidden == 'every row is settled'
    assert states['payload_error'].hidden == '' and states['payload_error'].probability is None
    session.tick('thermal_lag')
    session.fit()
    assert '--force' in session.commands()[-1]


def test_trials_of_one_recording_and_recordings_are_held_out(opened):
    one, several = opened(), opened('train.csv', 'test.csv', unseen=1)
    assert names(one.parts) == [f'trial {n}' for n in range(4)]
    assert names(one.unseen) == ['trial 3'] and names(several.unseen) == ['test.csv']
    one.hold_out(['trial 0', 'trial 1'])
    residual = one.curves().measured - one.curves().before
    expected = np.deg2rad(np.sqrt(np.mean(residual[:60] ** 2)))
    assert one.errors()['unseen'].before == pytest.approx(expected)
    one.tick('payload_error')
    assert '--trials 2,3' in one.commands()[-1]
    several.tick('payload_error')
    assert '--data train.csv --test test.csv' in several.commands()[-1]
    one.hold_out([])
    assert 'unseen' not in one.errors() and '--trials' not in one.commands()[-1]


def test_a_diagnosis_ends_with_the_rows_that_it_is_of(opened, monkeypatch):
    one, found = opened(), object()
    monkeypatch.setattr('hysteresis_ros.api.diagnose', lambda *args, **more: found)
    one.diagnose()
    one.hold_out(['trial 3'])
    assert one.diagnosis is found
    one.hold_out(['trial 2'])
    assert one.diagnosis is None and 'diagnose' not in one.commands()[-1]

    def diagnose_while_the_user_holds_out_another_trial(*args, **more):
        one.hold_out(['trial 1'])
        return found
    monkeypatch.setattr('hysteresis_ros.api.diagnose',
                        diagnose_while_the_user_holds_out_another_trial)
    one.diagnose()
    assert one.diagnosis is None


def test_the_fit_is_that_of_extend_and_ends_with_a_move_of_a_slider(session):
    session.tick('payload_error')
    extension = session.fit()
    value = slider(session, 'payload_error.dm')
    assert value.value == pytest.approx(TRUTH, abs=0.5)
    assert value.interval[0] < TRUTH < value.interval[1]
    assert session.errors()['fitted'].now == pytest.approx(extension.train['rmse_after'], rel=1e-4)
    assert '--values' not in session.commands()[-1]
    session.slide('payload_error.dm', 4.0)
    assert session.extension is None and slider(session, 'payload_error.dm').interval is None
    assert '--values payload_error.dm=4' in session.commands()[-1]


@pytest.mark.parametrize('fitted', [True, False])
@pytest.mark.parametrize('recordings', [['train.csv'], ['train.csv', 'test.csv']])
def test_the_command_that_is_shown_writes_the_model_that_is_saved(
        opened, capsys, fitted, recordings):
    session = opened(*recordings)
    session.tick('payload_error')
    session.slide('payload_error.dm', 7.3)
    if fitted:
        session.fit()
    assert session.save('ours.yaml') == 'ours.yaml'
    os.rename('ours.yaml', 'saved.yaml')
    words = shlex.split(session.commands()[-1])
    assert words[:2] == ['hysteresis', 'extend'] and words[words.index('-o') + 1] == 'ours.yaml'
    assert main(words[1:]) == 0, capsys.readouterr().err
    ours, saved = (yaml.safe_load(open(name, encoding='utf-8'))
                   for name in ('ours.yaml', 'saved.yaml'))
    assert ours == saved
    assert bool(saved['provenance']['extended'][-1].get('by_hand')) is not fitted
    again = Session(MuscleModel.load('saved.yaml'), session.recordings, model_path='saved.yaml')
    assert again.errors()['fitted'].before == pytest.approx(
        session.errors()['fitted'].now, rel=1e-6)


@pytest.mark.parametrize('name, words', [
    ('model.yaml', 'would overwrite the input'), ('train.yaml', 'would overwrite the input'),
    ('../model.yaml', 'no name of a file'), ('.yaml', 'no name of a file'),
    ('.profile.yaml', 'no name of a file'), ('model.txt', 'no name of a file'),
    ('folder.yaml', 'is a folder')])
def test_nothing_is_saved_over_an_input_or_elsewhere(session, name, words):
    os.mkdir('folder.yaml')
    # Another name of an input.
    os.symlink('train.csv', 'train.yaml')
    session.tick('payload_error')
    with pytest.raises(ParameterError, match=words):
        session.save(name)
    assert session.saved == [] and MuscleModel.load('model.yaml').effects == []


@pytest.fixture
def found(session, monkeypatch):
    """Return the session after a diagnosis, whose work is done already."""
    diagnosis = api.diagnose(session.model, session.recordings, ['payload_error'], jobs=1)
    asked = []

    def diagnose(model, data, progress):
        asked.append(data)
        list(progress(range(3), 3))
        return diagnosis
    monkeypatch.setattr(api, 'diagnose', diagnose)
    session.diagnose(lambda items, total: items)
    assert [list(one.trials) for one in asked[0]] == [[0.0, 1.0, 2.0]]
    return session


def test_a_diagnosis_gives_probabilities_and_starts(found):
    shares = {one.name: one.probability for one in found.catalogue()}
    assert shares['payload_error'] > 0.9 and shares['supply_sag'] == 0.0
    assert sum(found.probabilities().values()) <= 1.0 + 1e-9
    assert shlex.split(found.commands()[0])[:2] == ['hysteresis', 'diagnose']
    found.tick('payload_error')
    assert slider(found, 'payload_error.dm').value == pytest.approx(TRUTH, abs=1.0)
    assert [line.split()[1] for line in found.commands()] == ['diagnose', 'extend']


def test_the_command_of_the_diagnosis_takes_the_same_trials(found, capsys, monkeypatch):
    seen = []
    monkeypatch.setattr(api, 'diagnose', lambda model, data, **more: seen.append(data) or (
        found.diagnosis))
    assert main(shlex.split(found.commands()[0])[1:]) == 0, capsys.readouterr().err
    assert [list(one.trials) for one in seen[0]] == [[0.0, 1.0, 2.0]]


def test_the_report_is_that_of_the_command(session, monkeypatch):
    from hysteresis_ros.report import diagnosis_page
    written = []
    monkeypatch.setattr(diagnosis_page, 'write_extension',
                        lambda path, *more: written.append((path, more)))
    session.tick('payload_error')
    session.slide('payload_error.dm', TRUTH)
    assert session.report('page.html') == 'page.html'
    path, (model, extension, train, test, output, origin) = written[0]
    assert path == 'page.html' and output == 'extended.yaml'
    assert extension.test['rmse_after'] < 1e-5 < extension.test['rmse_before']
    assert origin.command == session.commands()[-1]
    assert origin.command.endswith('-o extended.yaml --report page.html')
    with pytest.raises(ParameterError, match='no name of a file'):
        session.report('page.txt')


def test_bench_tables_are_judged_with_weights_refitted(tmp_path):
    base = bicep_model()
    drive = np.concatenate([wandering_voltage(60, seed)[::2] for seed in range(4)])
    columns = {'trial': np.repeat(np.arange(4.0), 30), 'step': np.tile(np.arange(30.0), 4),
               'voltage': drive, 'force': np.repeat([1.2, 3.1, 5.1, 7.1], 30),
               'length': np.zeros(120)}
    muscle = base.with_effects([effect_of(base, 'stress_dependent_strain')])
    table = Measurement.from_columns(
        {**columns, 'length': muscle.predict(Measurement.from_columns(columns))})
    session = Session(base, [table], model_path='model.yaml')
    assert 'payload_error' not in {one.name for one in session.catalogue()}
    before = session.errors()['fitted'].before
    session.tick('stress_dependent_strain')
    for name, value in effect_of(base, 'stress_dependent_strain').values.items():
        session.slide(f'stress_dependent_strain.{name}', value)
    assert session.errors()['fitted'].now < 0.3 * before
    assert session.curves().unit == 'mm'


@pytest.mark.parametrize('name', sorted(catalogue()))
def test_every_slider_goes_through_its_range_and_back(name):
    """Positions and values belong to each other, for every effect of the catalogue."""
    effect = effect_of(bicep_model(), name)
    for kind in effect.kinds:
        for one in sliders_of(effect, kind):
            ends = [0.0, len(one.choices) - 1.0 if one.choices else 1.0]
            low, high = map(one.at, ends)
            assert (low, high) == (pytest.approx(one.low, rel=1e-3),
                                   pytest.approx(one.high, rel=1e-3))
            middle = one.at(0.5)
            if one.logarithmic and not one.choices:
                assert middle == pytest.approx((one.low * one.high) ** 0.5, rel=1e-3)
            moved = effect.with_values(**{one.parameter.name: middle})
            there = next(other for other in sliders_of(moved, kind) if other.name == one.name)
            if not one.choices:
                assert there.position == pytest.approx(0.5, abs=2e-3)


def test_a_fitted_value_outside_its_physical_range_is_on_the_slider():
    effect = effect_of(bicep_model(), 'payload_error', dm=150.0)
    one = sliders_of(effect, 'arm')[0]
    assert one.low <= 150.0 <= one.high and one.at(one.position) == pytest.approx(150.0, rel=1e-3)


@pytest.mark.parametrize('value, span, expected', [
    (0.0, 1.0, 0.0), (12.34567, 200.0, 12.35), (1.23e-9, 1.0, 0.0), (-0.0987654, 1.0, -0.09877)])
def test_values_have_few_digits(value, span, expected):
    assert rounded(value, span) == expected


def test_charts_have_one_axis_and_gaps_between_trials(session):
    session.tick('payload_error')
    curves = session.curves()
    drawn = charts.options(curves, charts.LIGHT)
    upper, lower = drawn['xAxis']
    assert (upper['min'], upper['max']) == (lower['min'], lower['max'])
    assert drawn['grid'][0]['left'] == drawn['grid'][1]['left']
    series = {one['id']: one['data'] for one in drawn['series']}
    for name, values in (('measured', curves.measured), ('now', curves.now),
                         ('residual_now', curves.measured - curves.now)):
        assert [y for _, y in series[name]].count(None) == 3
        shown = [y for _, y in series[name] if y is not None]
        np.testing.assert_allclose(shown, values, rtol=1e-4, atol=1e-9)
        assert [x for x, _ in series[name]] == [x for x, _ in series['measured']]
    assert charts.moved(curves)['series'][0]['data'] == series['now']
    # The last of four trials is unseen.
    spans = drawn['series'][0]['markArea']['data']
    assert len(spans) == 1 and spans[0][0]['xAxis'] == pytest.approx(curves.x[90], rel=1e-4)
    assert curves.unit == 'deg' and curves.x_label == 'time [min]'


@pytest.mark.parametrize('last, scale, label', [
    (60.0, 1.0, 'time [s]'), (1200.0, 60.0, 'time [min]'), (36000.0, 3600.0, 'time [h]')])
def test_time_is_in_a_unit_that_can_be_read(last, scale, label):
    x, name = axis(np.array([0.0, last]), 2)
    assert x[-1] == pytest.approx(last / scale) and name == label
    assert axis(None, 3)[1] == 'row' and list(axis(None, 3)[0]) == [0.0, 1.0, 2.0]


def test_a_recording_that_grows_keeps_what_was_set(folder, tmp_path):
    whole = read_measurement(folder / 'train.csv')
    parts = [None, whole.where(slice(0, 20)), whole.where(slice(0, 20)), whole]
    session = Session(MuscleModel.load(folder / 'model.yaml'), [], model_path='model.yaml')
    assert not session.ready and session.commands() == [] and len(session.catalogue()) > 20
    with pytest.raises(ParameterError, match='no recording yet'):
        session.tick('payload_error')
    feed = Feed(session, lambda: parts.pop(0), str(tmp_path / 'live.csv'))
    feed.look()
    assert not session.ready
    feed.look()
    session.tick('payload_error')
    session.slide('payload_error.dm', TRUTH)
    version = session.version
    feed.look()
    assert session.version == version       # nothing new was heard
    feed.look()
    assert slider(session, 'payload_error.dm').value == TRUTH and len(session.curves().x) == 120
    assert session.errors()['fitted'].now < 1e-5 and session.unseen == []
    saved = read_measurement(feed.save())
    np.testing.assert_allclose(saved.column('angle'), whole.column('angle'))


def test_what_keeps_a_live_recording_from_coming_is_told(folder):
    session = Session(MuscleModel.load(folder / 'model.yaml'), [], model_path='model.yaml')

    def fails():
        raise MeasurementError('joint_states has\nno elbow')
    feed = Feed(session, fails, 'live.csv', period=0.01)
    version = session.version
    feed.start()
    while session.version == version:
        pass
    feed.stop()
    assert feed.trouble == 'joint_states has no elbow'


def test_work_in_the_background_tells_how_far_it_is_and_stops():
    go, at_two = threading.Event(), threading.Event()

    def work(progress):
        for number in progress(range(4), 4):
            if number == 2:
                at_two.set()
                assert go.wait(30)
    job = Job('diagnose', work)
    assert at_two.wait(30) and job.running and job.share == 0.5
    job.stop()
    go.set()
    job.wait(30)
    assert not job.running and job.error == '' and job.share == 0.75


def test_work_that_cannot_be_done_says_why(caplog):
    def refused(progress):
        raise ParameterError('too\nfew rows')

    def broken(progress):
        raise ZeroDivisionError('by zero')
    jobs = [Job('fit', refused), Job('fit', broken)]
    for job in jobs:
        job.wait(30)
    assert jobs[0].error == 'too few rows' and 'ZeroDivisionError: by zero' in jobs[1].error
    assert 'Traceback' in caplog.text


def test_the_next_free_port_is_taken_and_a_taken_one_refused():
    with socket.socket() as taken:
        taken.bind((server.HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ParameterError, match=f'--port {port}: is taken'):
            server.free_port(port)
    assert server.free_port(port) == port
    with socket.socket() as taken:
        first = server.free_port()
        taken.bind((server.HOST, first))
        taken.listen()
        assert first < server.free_port() < server.FIRST_PORT + server.PORTS


@pytest.mark.parametrize('arguments, words', [
    (['--live', '--data', 'train.csv'], 'leave --data and --test away'),
    (['--test', 'test.csv'], 'give --data, too'),
    (['--data', 'missing.csv'], 'no such file'),
    (['--model', 'train.csv', '--data', 'train.csv'], 'train.csv'),
    (['--data', 'train.csv', '--port', '70000'], 'from 1 to 65535'),
    (['--data', 'train.csv', '-o', 'model.yaml'], 'is a file')])
def test_bad_input_is_one_line(opened, monkeypatch, capsys, arguments, words):
    monkeypatch.setattr(server, 'require_framework', lambda: None)
    monkeypatch.setattr(server, 'serve', lambda *args, **more: pytest.fail('it was served'))
    assert main(['studio', '--no-browser', *arguments]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and words in said[0]


def test_without_the_extra_one_line_says_what_to_install(opened, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'nicegui', None)
    assert main(['studio', '--model', 'model.yaml', '--data', 'train.csv', '--no-browser']) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and said[0].endswith("pip install 'hysteresis_ros[studio]'")


def test_the_command_opens_what_it_was_given(opened, monkeypatch, capsys):
    served = []
    monkeypatch.setattr(server, 'require_framework', lambda: None)
    monkeypatch.setattr(server, 'serve', lambda *args, **more: served.append((args, more)))
    assert main(['studio', '--model', 'model.yaml', '--data', 'train.csv', '--test', 'test.csv',
                 '-o', 'out', '--no-browser', '--columns', 'angle=angle:rad']) == 0
    (session, port), options = served[0]
    assert options['show'] is False and f'http://127.0.0.1:{port}/' in capsys.readouterr().out
    assert names(session.unseen) == ['test.csv']
    session.tick('payload_error')
    assert '--columns angle=angle:rad' in session.commands()[-1]
    assert session.save('kept.yaml') == os.path.join('out', 'kept.yaml')


def test_without_recordings_an_example_is_made_once(opened, monkeypatch):
    made = []

    def write(protocol, folder, effects, seed):
        made.append(protocol)
        os.makedirs(folder)
        for name in ('train.csv', 'test.csv'):
            os.symlink(os.path.abspath(name), os.path.join(folder, name))
    monkeypatch.setattr('hysteresis_ros.laboratory.experiments.write_experiment', write)
    for _ in range(2):
        assert command.example('.') == (['studio_example/train.csv'], ['studio_example/test.csv'])
    assert made == ['arm-steps']
