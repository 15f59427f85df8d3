# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""CSV files: what is read, and the one line that says why another file is not."""

from pathlib import Path
import warnings

from hypothesis import given, settings, strategies
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import MeasurementWarning, read_measurement, write_csv
import numpy as np
import pytest

HEADER = 'time,trial,voltage,angle\n'
ROWS = '0,0,0,1.5\n30,0,1,1.4\n60,0,2,1.2\n'


@pytest.fixture
def written(tmp_path):
    def write(content, name='run.csv'):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path
    return write


def test_a_file_is_read_with_its_unknown_columns(written):
    path = written('time,trial,voltage,angle,fan\n0,0,0,1.5,7\n0.1,0,1,1.4,nan\n')
    table = read_measurement(path)
    assert (table.kind, table.source) == ('arm', str(path))
    assert list(table.column('voltage')) == [0, 1]
    assert table.column('fan')[0] == 7 and np.isnan(table.column('fan')[1])
    assert len(table.digest) == 64


@pytest.mark.parametrize('content', [
    b'\xef\xbb\xbf' + (HEADER + ROWS).encode(), (HEADER + ROWS).replace('\n', '\r\n'),
    '\n\n' + HEADER + ROWS, HEADER.replace(',', ' , ') + ROWS.replace(',', ', ') + '\n\n',
    '"time","trial","voltage","angle"\n' + ROWS.replace('1.5', '"1.5"'), (HEADER + ROWS)[:-1]])
def test_spellings_of_the_same_table(written, content):
    table = read_measurement(written(content))
    assert table.rows == 3
    assert list(table.column('angle')) == [1.5, 1.4, 1.2]


def test_a_table_without_trials_is_one_trial(written):
    table = read_measurement(written('voltage,force\n0,1\n1,2\n'))
    assert list(table.trials) == [0]


def test_a_trial_of_one_row(written):
    table = read_measurement(written(HEADER + '0,0,1,1.5\n0,1,2,1.4\n'))
    assert table.split() == [(0.0, slice(0, 1)), (1.0, slice(1, 2))]
    assert table.settled


@pytest.mark.parametrize('content, message', [
    ('', 'the file is empty'),
    ('\n \n', 'the file is empty'),
    (HEADER, 'header and no rows'),
    (HEADER + '0,0,,1\n', "line 2, column 'voltage' is empty"),
    (HEADER + '0,0,1,1\n\n1,0,1,nan\n', "line 4, column 'angle' is nan"),
    (HEADER + '0,0,1,1\n1,0,inf,1\n', "line 3, column 'voltage' is inf"),
    (HEADER + '0,0,1,1\n1,0,off,1\n', "line 3, column 'voltage' is 'off', not a number"),
    (HEADER + '0,0,1,1\n1,0,1_0,1\n', "is '1_0', not a number"),
    (HEADER + ROWS + '90,0,2', 'line 5 has 3 cells, the header 4; the file seems to be cut off'),
    (HEADER + '0,0,1,5,1,2\n1,0,1,6,1,3\n', 'line 2 has 6 cells, the header 4; use a dot'),
    (ROWS, 'line 1 holds numbers; the first line has to name the columns'),
    (HEADER.replace(',', ';') + ROWS.replace(',', ';'), 'separated by semicolons'),
    (HEADER.replace(',', '\t') + ROWS.replace(',', '\t'), 'separated by tabs'),
    ('time,trial,voltage,voltage\n' + ROWS, "two columns 'voltage'"),
    ('time,,voltage,angle\n' + ROWS, 'column 2 has no name'),
    ('time,trial,voltage,angel\n' + ROWS, "is 'angel' meant to be 'angle'"),
    (b'\xff\xfet\x00', 'no UTF-8 text'),
    (HEADER + '0,0,1,1\n' + '1,0,1,\x00\n', "line 3, column 'angle'"),
    (HEADER + '0,0,0,1\n2,0,0,1\n1,0,0,1\n', 'time goes backwards'),
    ('step,voltage,force\n0,0,1\n1,1,2\n1,1,2\n', 'step is repeated')])
def test_a_file_that_is_no_measurement_is_refused_in_one_line(written, content, message):
    path = written(content)
    with pytest.raises(MeasurementError, match=message) as refused:
        read_measurement(path)
    assert '\n' not in str(refused.value)
    assert str(refused.value).startswith(f'{path}: ')


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(MeasurementError, match='no such file'):
        read_measurement(tmp_path / 'nothing.csv')


def test_a_column_of_text_is_left_out_with_a_warning(written):
    path = written('time,trial,note,voltage,angle\n0,0,1,0,1\n1,0,fan on,1,1\n')
    with pytest.warns(MeasurementWarning, match="'note' is left out: line 3 holds 'fan on'"):
        table = read_measurement(path)
    assert 'note' not in table.columns
    assert list(table.column('voltage')) == [0, 1]


def test_millimetres_are_warned_about(written):
    with pytest.warns(MeasurementWarning, match='length reaches 12; is it in mm'):
        read_measurement(written('voltage,force,length\n0,3,-12\n1,3,2\n'))


def test_a_name_that_looks_like_an_address_is_a_file(written, monkeypatch):
    path = written(HEADER + ROWS, 'http:run.csv')
    monkeypatch.chdir(path.parent)
    assert read_measurement(path.name).rows == 3


@settings(max_examples=40, deadline=None)
@given(strategies.lists(strategies.floats(-1e3, 1e3), min_size=2, max_size=30))
def test_what_is_written_is_read_back(tmp_path_factory, values):
    path = tmp_path_factory.mktemp('table') / 'table.csv'
    columns = {'trial': np.zeros(len(values)), 'step': np.arange(len(values)),
               'voltage': np.array(values), 'force': np.ones(len(values)),
               'a, "b"': np.array(values) / 3}
    write_csv(columns, path)
    assert path.read_text().startswith('trial,step,voltage,force,"a, ""b"""\n0,0,')
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', MeasurementWarning)
        table = read_measurement(path)
    for name, expected in columns.items():
        np.testing.assert_allclose(table.column(name), expected, rtol=1e-11)


def test_columns_of_different_length_are_not_written(tmp_path):
    with pytest.raises(MeasurementError, match='one length'):
        write_csv({'a': [1, 2], 'b': [1]}, tmp_path / 'x.csv')


@pytest.mark.parametrize('name, rows, trials', [
    ('sma_react/nitihf_isobaric.csv', 2400, 6), ('sma_react/nitico_isobaric.csv', 1226, 4),
    ('piezo/stack_nested_loops.csv', 14155, 1)])
def test_real_measurements_are_read(name, rows, trials):
    path = Path(__file__).parents[2] / 'shared' / 'data' / name
    if not path.exists():
        pytest.skip(f'{path} is not here')
    table = read_measurement(path)
    assert (table.rows, len(table.trials)) == (rows, trials)
    assert table.kind == 'bench'
    assert table.settled == name.startswith('sma')
    assert table.warnings == ()
