# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The interface for notebooks: seven functions, what they take, and how results show themselves."""

from html.parser import HTMLParser
import json
import os
import subprocess
import sys

from matplotlib.figure import Figure
from model_support import bicep_model, effect_of, runs
import numpy as np
import pytest

import hysteresis_ros as hr
from hysteresis_ros.errors import MeasurementError, ModelFileError, ParameterError
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.measurements.csv import write_csv
from hysteresis_ros.result import Brief

FUNCTIONS = ('compare', 'diagnose', 'extend', 'identify', 'load_model', 'predict', 'read')


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with bench tables, a model, and runs of an arm that carries more."""
    folder = tmp_path_factory.mktemp('notebook')
    for name, columns in bench_tables({}, 3).items():
        write_csv(columns, folder / name)
    model = bicep_model()
    model.save(folder / 'model.yaml')
    heavier = model.with_effects([effect_of(model, 'payload_error', dm=40.0)])
    for name, seed in (('train.csv', 0), ('test.csv', 7)):
        write_csv(runs(heavier, trials=2, rows=40, seed=seed).columns, folder / name)
    return folder


@pytest.fixture(scope='module')
def comparison(folder):
    """Return the comparison of the model with both runs."""
    return hr.compare(folder / 'model.yaml', [folder / 'train.csv', folder / 'test.csv'])


@pytest.fixture(scope='module')
def identified(folder):
    """Return what is identified on the first trial of each bench table."""
    return hr.identify(folder / 'length.csv', folder / 'force.csv', force_trials=[0],
                       length_trials=[0, 1, 2, 3], geometry=GEOMETRY)


@pytest.fixture(scope='module')
def diagnosis(folder):
    """Return the diagnosis of the heavier arm among three effects."""
    return hr.diagnose(folder / 'model.yaml', folder / 'train.csv',
                       ['payload_error', 'supply_sag', 'airflow'], jobs=1)


@pytest.fixture(scope='module')
def extension(folder):
    """Return the model with the heavier payload."""
    return hr.extend(folder / 'model.yaml', 'payload_error', folder / 'train.csv',
                     folder / 'test.csv')


def fresh(code):
    """Return what code prints in a new process."""
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=False, env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_import_loads_no_numerical_package():
    """The import costs no more than Python itself; names are listed before any is used."""
    loaded = fresh(
        'import sys\nbefore = set(sys.modules)\nimport hysteresis_ros as hr\n'
        'print(sorted(set(dir(hr)) >= set(hr.__all__) and hr.__all__))\n'
        'print(sorted({name.split(".")[0] for name in set(sys.modules) - before}))').split('\n')
    assert loaded[0] == str(sorted(FUNCTIONS))
    assert 'hysteresis_ros' in loaded[1]
    for package in ('numpy', 'scipy', 'matplotlib', 'numba', 'yaml', 'rclpy', 'serial'):
        assert f"'{package}'" not in loaded[1]


def test_import_takes_less_than_a_third_of_a_second():
    """Measured inside the process, without the start of Python."""
    seconds = fresh('import time\nstart = time.perf_counter()\nimport hysteresis_ros\n'
                    'print(time.perf_counter() - start)')
    assert float(seconds) < 0.3


def test_reading_needs_neither_matplotlib_nor_ros(folder):
    """Each function imports what it needs, not what others need."""
    printed = fresh(
        f'import sys, hysteresis_ros as hr\nhr.read({str(folder / "train.csv")!r})\n'
        'print([name for name in ("matplotlib", "rclpy", "serial") if name in sys.modules])')
    assert printed.strip() == '[]'


def test_unknown_names_are_refused():
    """As in any module."""
    with pytest.raises(AttributeError, match="'hysteresis_ros' has no attribute 'identfy'"):
        hr.identfy


def test_a_notebook_goes_from_the_bench_to_the_extended_model(folder, tmp_path):
    """The seven functions one after the other, with paths and with objects."""
    table = hr.read(folder / 'length.csv')
    found = hr.identify(table, folder / 'force.csv', levels=(4, 6), geometry=GEOMETRY)
    found.model.save(tmp_path / 'model.yaml')
    model = hr.load_model(tmp_path / 'model.yaml')
    heavier = model.with_effects([effect_of(model, 'payload_error', dm=40.0)])
    train, test = (runs(heavier, trials=2, rows=40, seed=seed) for seed in (0, 7))
    before = hr.compare(model, test)
    assert 'payload_error' in hr.diagnose(
        found, train, ['payload_error', 'supply_sag'], jobs=1).missing
    extended = hr.extend(model, ['payload_error'], train, test)
    after = hr.compare(extended, test)
    assert after.model.rmse < 0.1 * before.model.rmse
    assert hr.predict(extended, test) == pytest.approx(test.column('angle'), abs=0.01)


def test_a_model_is_shown_in_one_line(folder):
    model = hr.identify(folder / 'length.csv', folder / 'force.csv').model
    assert repr(model) == '<MuscleModel two-stage of voltage: no effects>'


def test_read_returns_one_measurement_or_a_list(folder):
    """One path, one measurement."""
    one = hr.read(folder / 'train.csv')
    assert isinstance(one, Measurement) and one.rows == 80
    both = hr.read(folder / 'train.csv', str(folder / 'length.csv'))
    assert [m.response for m in both] == ['angle', 'length']
    with pytest.raises(MeasurementError, match='no measurement was given'):
        hr.read()


def test_read_takes_settled_states(tmp_path):
    """Of holds the ends; a run without holds has none."""
    time = np.arange(0.0, 120.0, 0.5)
    columns = {'time': time, 'voltage': np.floor(time / 30.0), 'angle': 1.0 + time / 1000.0}
    write_csv(columns, tmp_path / 'held.csv')
    write_csv({**columns, 'voltage': time / 30.0}, tmp_path / 'ramp.csv')
    assert hr.read(tmp_path / 'held.csv', settled=True).rows == 4
    assert hr.read(tmp_path / 'held.csv').rows == len(time)
    assert not hr.read(tmp_path / 'held.csv').settled
    assert hr.read(tmp_path / 'held.csv', settled_time=0.5).settled
    with pytest.raises(MeasurementError, match='not held for 20 s .* from 0.0 s of trial 0 on'):
        hr.read(tmp_path / 'ramp.csv', settled=True)
    with pytest.raises(MeasurementError, match='not held for 40 s'):
        hr.read(tmp_path / 'held.csv', settled=True, settled_time=40.0)


def test_data_may_be_paths_objects_or_columns(folder):
    """All of them give the same prediction; a list gives a list."""
    path = folder / 'train.csv'
    measurement = hr.read(path)
    expected = hr.predict(folder / 'model.yaml', path)
    assert expected.shape == (80,)
    for data in (str(path), measurement, dict(measurement.columns)):
        assert np.array_equal(hr.predict(folder / 'model.yaml', data), expected)
    several = hr.predict(hr.load_model(folder / 'model.yaml'), [path, measurement])
    assert [np.array_equal(one, expected) for one in several] == [True, True]
    assert len(hr.predict(folder / 'model.yaml', [path])) == 1
    linear = hr.predict(folder / 'model.yaml', path, method='linear')
    assert not np.allclose(linear, expected)


def test_a_data_frame_is_a_table_of_columns(folder):
    """It has columns and items, as pandas gives them."""
    columns = hr.read(folder / 'train.csv').columns

    class DataFrame:
        def items(self):
            return columns.items()

    assert np.array_equal(hr.predict(folder / 'model.yaml', DataFrame()),
                          hr.predict(folder / 'model.yaml', columns))


@pytest.mark.parametrize('call, error, words', [
    (lambda folder: hr.load_model(folder / 'train.csv'), ModelFileError, 'no model file'),
    (lambda folder: hr.compare(3, folder / 'train.csv'), ParameterError, 'model cannot be a int'),
    (lambda folder: hr.compare(folder / 'model.yaml', 3), ParameterError, 'cannot be a int'),
    (lambda folder: hr.compare(folder / 'model.yaml', [3]), ParameterError, 'cannot be a int'),
    (lambda folder: hr.compare(folder / 'model.yaml', []), MeasurementError, 'no measurement'),
    (lambda folder: hr.identify(), ValueError, 'nothing to identify'),
    (lambda folder: hr.identify(force=folder / 'force.csv', effects='auto'), ParameterError,
     'need a length table'),
    (lambda folder: hr.identify(folder / 'force.csv', folder / 'length.csv'), MeasurementError,
     'swapped'),
    (lambda folder: hr.identify(folder / 'train.csv'), MeasurementError, 'takes bench tables'),
    (lambda folder: hr.extend(folder / 'model.yaml', 'nothing', folder / 'train.csv'),
     ParameterError, 'nothing'),
    (lambda folder: hr.extend(folder / 'model.yaml', [], folder / 'train.csv'), ParameterError,
     'no effect is named'),
    (lambda folder: hr.diagnose(folder / 'model.yaml', folder / 'train.csv', 'nothing'),
     ParameterError, 'nothing')])
def test_bad_input_is_one_clear_line(folder, call, error, words):
    """What, where, what to do."""
    with pytest.raises(error, match=words) as raised:
        call(folder)
    assert '\n' not in str(raised.value)


def test_identify_adds_the_effects_that_are_named(folder):
    """And says no more of the fit that they replaced."""
    found = hr.identify(folder / 'length.csv', folder / 'force.csv', levels=(4, 6),
                        effects='stress_dependent_strain')
    assert [effect.id for effect in found.model.effects] == ['stress_dependent_strain']
    assert found.length_fit is None and found.force_fit is not None


def test_diagnose_says_where_the_model_fails(folder, diagnosis):
    """As the comparison does, and in the JSON."""
    assert diagnosis.missing == ['payload_error']
    where = [region.to_dict() for region in
             hr.compare(folder / 'model.yaml', folder / 'train.csv').where]
    assert where and diagnosis.to_dict()['where'] == where


def results(request):
    """Return every kind of result."""
    return [request.getfixturevalue(name)
            for name in ('comparison', 'identified', 'diagnosis', 'extension')]


def test_results_are_shown_in_one_to_five_lines(request):
    """By repr and by print, with the numbers that count, in units for people."""
    comparison, identified, diagnosis, extension = results(request)
    for result in results(request):
        assert 1 <= len(repr(result).splitlines()) <= 5
        assert str(result) == repr(result)
        assert max(map(len, repr(result).splitlines())) < 250
    degrees = np.degrees(comparison.model.rmse)
    assert f'RMSE {degrees:.3g} deg' in repr(comparison)
    assert repr(identified).startswith('Identified: two-stage, length of voltage')
    assert 'length, verification: mean error' in repr(identified)
    assert repr(diagnosis).startswith('Diagnosis: missing payload_error')
    assert f'{np.degrees(diagnosis.rmse_before):.3g} deg' in repr(diagnosis)
    assert 'RMSE on data not fitted' in repr(extension)


class Tags(HTMLParser):
    """Notes every element and checks that it is closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Note an element."""
        self.open.append(tag)
        self.seen.append(tag)

    def handle_endtag(self, tag):
        """Close it."""
        assert self.open.pop() == tag


def test_notebooks_show_results_as_a_small_table(request):
    """Well-formed HTML with the words of the text."""
    for result in results(request):
        tags = Tags(result._repr_html_())
        assert tags.open == [] and tags.seen.count('table') == 1
        assert 1 <= tags.seen.count('tr') <= 12


def test_html_is_escaped():
    """Names come from files of strangers."""
    html = Brief(['<script>'], ['<b>'], [['<i>']]).to_html()
    assert Tags(html).seen == ['div', 'p', 'b', 'table', 'thead', 'tr', 'th', 'tbody', 'tr', 'td']
    assert '&lt;script&gt;' in html and '&lt;b&gt;' in html and '&lt;i&gt;' in html


def test_results_become_plain_types(request):
    """What the command line writes with --json; no NaN, which JSON does not have."""
    for result, key in zip(results(request), ('where', 'metrics', 'verdict', 'added')):
        content = json.loads(json.dumps(result.to_dict(), allow_nan=False))
        assert content[key]


def test_results_draw_themselves(request):
    """A figure that a notebook shows without pyplot."""
    for result in results(request):
        figure = result.plot()
        assert isinstance(figure, Figure) and figure.axes
    assert figure._repr_png_().startswith(b'\x89PNG')


def test_plots_are_chosen_by_name(comparison, identified):
    """Pictures of a comparison, tables of an identification; others are refused."""
    assert len(comparison.plot('loop').axes) == 3 and len(comparison.plot().axes) == 2
    force, length = identified.plot('force'), identified.plot()
    assert force.axes[0].get_ylabel() == 'force [N]'
    assert length.axes[0].get_ylabel() == 'length [mm]'
    with pytest.raises(ParameterError, match="no picture 'nothing'.*overlay"):
        comparison.plot('nothing')
    with pytest.raises(ParameterError, match='no angle table'):
        identified.plot('angle')
