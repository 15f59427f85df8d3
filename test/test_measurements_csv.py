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
    (HEADER.replace(',', '|') + ROWS.replace(',', '|'), 'separated by bars'),
    ('# ' + HEADER + ROWS, "line 2 holds numbers.*Is that '# time,trial,.*Remove the #"),
    ('# ' + HEADER, 'nothing but comments'),
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


def test_millimetres_are_refused_with_the_option_that_converts_them(written):
    path = written('voltage,force,length\n0,3,-12\n1,3,2\n')
    with pytest.raises(MeasurementError, match='--columns length=length:mm') as refused:
        read_measurement(path)
    assert 'confirm it with --columns length=length:m' in str(refused.value)
    table = read_measurement(path, columns='length=length:mm')
    assert list(table.column('length')) == pytest.approx([-0.012, 0.002])
    assert list(read_measurement(path, columns='length=length:m').column('length')) == [-12, 2]


def test_another_unit_than_that_of_the_header_is_said(written):
    path = written('time,voltage,theta_deg\n0,0,91\n1,1,90\n')
    with pytest.warns(MeasurementWarning, match="'theta_deg' is read in the unit that --columns"):
        table = read_measurement(path, columns='angle=theta_deg:rad')
    assert list(table.column('angle')) == [91, 90]
    for columns in ('angle=theta_deg:deg', 'angle=theta_deg'):
        assert read_measurement(path, columns=columns).warnings == ()


@pytest.mark.parametrize('header, rows', [
    (HEADER.replace(',', ';'), ROWS.replace(',', ';')),
    (HEADER.replace(',', ';'), ROWS.replace(',', ';').replace('.', ',')),
    (HEADER.replace(',', '\t'), ROWS.replace(',', '\t').replace('.', ',')),
    ('# from the bench\n' + HEADER, '# begin\n' + ROWS + '  # "end"\n'),
    ('time [s],trial,Voltage (mV),angle_deg\n', '0,0,0,85.94367\n30,0,1e3,80.21409\n'
     '60,0,2e3,68.75494\n'),
    ('"time [ms]";"trial [-]";"voltage [V]";"angle [°]"\n', '0;0;0;85,94367\n3e4;0;1;80,21409\n'
     '6e4;0;2;68,75494\n')])
def test_tables_as_instruments_and_spreadsheets_write_them(written, header, rows):
    table = read_measurement(written(header + rows))
    assert (table.kind, table.warnings) == ('arm', ())
    for name, expected in (('time', [0, 30, 60]), ('voltage', [0, 1, 2]),
                           ('angle', [1.5, 1.4, 1.2])):
        np.testing.assert_allclose(table.column(name), expected, atol=1e-6)


def test_columns_with_names_of_their_own_are_mapped(written):
    path = written('t_s,V,theta_deg,T: air\n0,0,90,300\n30,1,45,301\n')
    table = read_measurement(
        path, columns='angle=theta_deg:deg, voltage=V,time=t_s,ambient_temperature=T: air:K')
    np.testing.assert_allclose(table.column('angle'), [np.pi / 2, np.pi / 4])
    np.testing.assert_allclose(table.column('ambient_temperature'), [26.85, 27.85])
    assert list(table.column('voltage')) == [0, 1] and list(table.time) == [0, 30]
    # The unit that ends the header counts where none is given.
    again = read_measurement(path, columns='angle=theta_deg,voltage=V,time=t_s')
    np.testing.assert_allclose(again.column('angle'), table.column('angle'))


def test_what_is_mapped_comes_before_a_column_with_the_name_itself(written):
    path = written('time,voltage,angle,filtered\n0,0,9,1.5\n30,1,9,1.4\n')
    assert list(read_measurement(path, columns='angle=filtered').column('angle')) == [1.5, 1.4]


@pytest.mark.parametrize('columns, words', [
    ('angle', 'not of the form name=column'), ('=x', 'not of the form'),
    ('angel=theta', "no column 'angel'; did you mean 'angle'"),
    ('angle=angle,angle=theta', 'angle is given twice'),
    ('angle=thetta', "no column 'thetta'; did you mean 'theta'"),
    ('angle=theta:turns', "'turns' is no unit of angle that is known; there are rad, deg")])
def test_a_mapping_that_makes_no_sense_is_refused(written, columns, words):
    path = written('time,voltage,theta\n0,0,1.5\n30,1,1.4\n')
    with pytest.raises(MeasurementError, match=words):
        read_measurement(path, columns=columns)


@pytest.mark.parametrize('header, words', [
    ('time,voltage [counts],angle\n', "'counts' is no unit of voltage"),
    ('time,angle_rad,angle_deg,voltage\n', "'angle_rad' and 'angle_deg' both mean angle")])
def test_headers_with_units_that_cannot_be_understood_are_refused(written, header, words):
    row = '1,' * header.count(',') + '1\n'
    with pytest.raises(MeasurementError, match=words):
        read_measurement(written(header + row))


def test_all_problems_of_a_file_are_said_in_one_line(written):
    path = written('time,trial,voltage,angle\n0,0,,90\n30,0,off,80\n60,0,1,nan\n90,0\n')
    with pytest.raises(MeasurementError) as refused:
        read_measurement(path)
    text = str(refused.value)
    assert text.startswith(f'{path}: 5 problems: (1) line 2, ') and '\n' not in text
    for words in ("'voltage' is empty", "is 'off'", "line 4, column 'angle' is nan",
                  'line 5 has 2 cells', 'angle reaches 90 rad'):
        assert words in text
    many = written(HEADER + 30 * '0,0,,1\n')
    with pytest.raises(MeasurementError, match='30 problems: .* and 22 more$'):
        read_measurement(many)


def test_a_name_that_looks_like_an_address_is_a_file(written, monkeypatch):
    path = written(HEADER + ROWS, 'http:run.csv')
    monkeypatch.chdir(path.parent)
    assert read_measurement(path.name).rows == 3


@settings(max_examples=40, deadline=None)
@given(strategies.lists(strategies.floats(-500, 500), min_size=2, max_size=30))
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
