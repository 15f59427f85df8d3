# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: what each command writes, and the one line it prints when it cannot."""

import argparse
import io
import json
import os
from pathlib import Path
import re
import subprocess
import sys

from hysteresis_ros.cli.common import column_map, numbers, one_line, Steps
from hysteresis_ros.cli.main import build_parser, COMMANDS, main
from hysteresis_ros.cli.rounds import Rounds
from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.laboratory.experiments import write_experiment
from hysteresis_ros.measurements import read_measurement, write_csv
from hysteresis_ros.model import MuscleModel
import numpy as np
import pytest

DATA = Path(__file__).parents[2] / 'shared' / 'data'


@pytest.fixture(scope='module')
def bench(tmp_path_factory):
    """Return a folder with bench tables, geometry and the model identified from them."""
    folder = tmp_path_factory.mktemp('bench')
    write_experiment('bench', folder, seed=5)
    assert main(['identify', '--force', f'{folder}/force.csv', '--length', f'{folder}/length.csv',
                 '--force-trials', '0', '--length-trials', '0-3', '--geometry',
                 f'{folder}/geometry.yaml', '-o', f'{folder}/model.yaml', '--json',
                 f'{folder}/identify.json']) == 0
    voltage = np.tile(np.repeat([0.0, 2.0, 3.0, 2.5, 4.0, 1.0], 5), 2)
    write_csv({'time': np.tile(np.arange(30) * 30.0, 2), 'trial': np.repeat([0, 1], 30),
               'voltage': voltage, 'angle': 2.4 - 0.12 * voltage}, folder / 'arm.csv')
    return folder


def failed(arguments, capsys):
    """Run a command that has to fail, and return its one line."""
    capsys.readouterr()
    assert main(arguments) == 1
    captured = capsys.readouterr()
    lines = captured.err.strip().splitlines()
    errors = [line for line in lines if ': error: ' in line]
    assert len(errors) == 1, captured.err
    assert all(': warning: ' in line for line in lines if line not in errors)
    assert 'Traceback' not in captured.err
    return errors[0]


def test_identify_prints_table_one_and_keeps_what_it_found(bench, capsys):
    content = json.loads((bench / 'identify.json').read_text())
    assert content['metrics']['length']['verification']['model']['mean_percent'] < 10
    model = MuscleModel.load(bench / 'model.yaml')
    assert (model.kind, model.drive, model.load_name) == ('two-stage', 'voltage', 'force')
    assert model.geometry is not None
    assert main(['identify', '--length', f'{bench}/length.csv', '--operator', 'preisach',
                 '-o', f'{bench}/plain.yaml']) == 0
    text = capsys.readouterr().out
    assert re.search(r'L-q identification +\d+\.\d\d % +\d+\.\d\d %', text)
    assert MuscleModel.load(bench / 'plain.yaml').kind == 'preisach'


def test_compare_puts_everything_in_the_folder_that_it_makes(bench, tmp_path):
    out = tmp_path / 'made' / 'here'
    assert main(['compare', '--model', f'{bench}/model.yaml', '--data', f'{bench}/force.csv',
                 '--json', f'{out}/c.json', '--report', f'{out}/c.html', '--plots',
                 f'{out}']) == 0
    assert {'c.json', 'c.html', 'overlay.png'} <= {path.name for path in out.iterdir()}


def test_compare_writes_table_json_page_and_pictures(bench, capsys):
    out = bench / 'out'
    out.mkdir(exist_ok=True)
    assert main(['compare', '--model', f'{bench}/model.yaml', '--data', f'{bench}/length.csv',
                 '--json', f'{out}/c.json', '--report', f'{out}/c.html', '--plots',
                 f'{out}/plots']) == 0
    text = capsys.readouterr().out
    content = json.loads((out / 'c.json').read_text())
    assert content['rows'] == read_measurement(bench / 'length.csv').rows
    assert content['quantity'] == 'length' and content['unit'] == 'm'
    assert content['model']['rmse'] < content['linear']['rmse']
    assert 'two-stage' in text and 'noise floor' in text
    for region in content['where']:
        assert region['text'] in text
    page = (out / 'c.html').read_text()
    assert page.count('<img alt=') == len(list((out / 'plots').iterdir())) >= 5
    for picture in (out / 'plots').iterdir():
        assert picture.read_bytes().startswith(b'\x89PNG')
    assert not re.search(r'(src|href)="(?!data:image/png;base64,)', page)
    assert page.count('<script>') == 1 and "default-src 'none'" in page
    assert page.count(read_measurement(bench / 'length.csv').digest) == 1
    assert f'hysteresis compare --model {bench}/model.yaml --data {bench}/length.csv' in page


def test_json_to_standard_output_is_nothing_but_json(bench, capsys):
    assert main(['compare', '--model', f'{bench}/model.yaml', '--data', f'{bench}/force.csv',
                 '--json', '-']) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)['quantity'] == 'force'
    assert 'noise floor' in captured.err


def test_names_of_files_are_escaped_on_the_page(bench, tmp_path, capsys):
    name = '<img src=x onerror=alert(1)>&\x1b[31m\n.csv'
    path = tmp_path / name
    path.write_bytes((bench / 'length.csv').read_bytes())
    assert main(['compare', '--model', f'{bench}/model.yaml', '--data', str(path), '--report',
                 f'{tmp_path}/r.html']) == 0
    page = (tmp_path / 'r.html').read_text()
    assert '<img src=x' not in page and '&lt;img src=x onerror=alert(1)&gt;&amp;' in page
    path.write_text('voltage\n1\n')
    line = failed(['compare', '--model', f'{bench}/model.yaml', '--data', str(path)], capsys)
    assert '\x1b' not in line


def test_settled_states_of_a_continuous_run(bench, tmp_path, capsys):
    time = np.arange(0, 240, 0.5)
    voltage = np.array([0.0, 2, 3, 2.5, 4, 1, 2, 3])[(time / 30).astype(int)]
    write_csv({'time': time, 'voltage': voltage, 'force': 1 + voltage}, tmp_path / 'run.csv')
    model = ['--model', f'{bench}/model.yaml', '--json', f'{tmp_path}/j.json']
    for extra, rows in (([], 480), (['--settled'], 8)):
        assert main(['compare', *model, '--data', f'{tmp_path}/run.csv', *extra]) == 0
        content = json.loads((tmp_path / 'j.json').read_text())
        assert content['rows'] == rows
    write_csv({'time': time, 'voltage': time / 60, 'force': time}, tmp_path / 'ramp.csv')
    line = failed(['compare', *model, '--data', f'{tmp_path}/ramp.csv', '--settled'], capsys)
    assert 'no settled states' in line
    # A wire that settles sooner.
    held = [*model, '--data', f'{tmp_path}/fast.csv', '--settled']
    write_csv({'time': time / 6, 'voltage': voltage, 'force': 1 + voltage}, tmp_path / 'fast.csv')
    assert 'held for 20 s at a time' in failed(['compare', *held], capsys)
    assert main(['compare', *held, '--settled-time', '4.5']) == 0
    assert json.loads((tmp_path / 'j.json').read_text())['rows'] == 8
    for wrong in ('0', 'inf', 'five'):
        with pytest.raises(SystemExit):
            main(['compare', *held, '--settled-time', wrong])
        assert 'positive number of seconds' in capsys.readouterr().err


def test_trials_that_are_not_looked_at_need_no_settled_states(bench, tmp_path, capsys):
    time = np.arange(0, 300, 0.5)
    held = np.random.default_rng(2).uniform(0.0, 5.0, 10)[(time / 30).astype(int)]
    columns = {'time': np.tile(time, 2), 'trial': np.repeat([0.0, 3.0], len(time)),
               'voltage': np.concatenate([time / 60, held])}
    write_csv({**columns, 'force': 1 + columns['voltage']}, tmp_path / 'run.csv')
    given = ['diagnose', '--model', f'{bench}/model.yaml', '--data', f'{tmp_path}/run.csv',
             '--settled']
    assert 'from 0.0 s of trial 0 on' in failed(given, capsys)
    # Of that trial it is no more than the force that cannot be diagnosed.
    assert 'has no load to explain' in failed([*given, '--trials', '3'], capsys)
    assert read_measurement(tmp_path / 'run.csv', settled=True, trials=[3]).rows == 10


def test_predict_adds_a_column(bench, tmp_path, capsys):
    out = tmp_path / 'p.csv'
    for method in ('preisach', 'linear'):
        assert main(['predict', '--model', f'{bench}/model.yaml', '--data',
                     f'{bench}/length.csv', '--method', method, '-o', str(out)]) == 0
        table = read_measurement(out)
        model = MuscleModel.load(bench / 'model.yaml')
        expected = model.predict(read_measurement(bench / 'length.csv'), method=method)
        np.testing.assert_allclose(table.column('predicted_length'), expected, atol=1e-10)
    assert 'overwrite' in failed(
        ['predict', '--model', f'{bench}/model.yaml', '--data', str(out), '-o', str(out)], capsys)


def test_invert_gives_voltages_that_predict_the_reference(bench, tmp_path):
    model = MuscleModel.load(bench / 'model.yaml')
    voltage = np.random.default_rng(0).uniform(0.5, 5.5, 40)
    trial = np.repeat([0, 1], 20)
    columns = {'trial': trial, 'step': np.tile(np.arange(20), 2), 'voltage': voltage,
               'force': np.repeat([3.136, 5.0], 20), 'length': np.zeros(40)}
    write_csv(columns, tmp_path / 'inputs.csv')
    columns['length'] = model.predict(read_measurement(tmp_path / 'inputs.csv'))
    del columns['voltage']
    write_csv(columns, tmp_path / 'ref.csv')
    assert main(['invert', '--model', f'{bench}/model.yaml', '--reference',
                 f'{tmp_path}/ref.csv', '-o', f'{tmp_path}/volts.csv']) == 0
    found = read_measurement(tmp_path / 'volts.csv')
    assert not found.column('saturated').any()
    np.testing.assert_allclose(model.predict(found), columns['length'], atol=2e-6)


@pytest.mark.parametrize('method', ['preisach', 'linear'])
def test_invert_takes_forces_and_flags_what_is_out_of_reach(bench, tmp_path, method):
    write_csv({'step': np.arange(4), 'force': [2.0, 9.0, 500.0, 4.0]}, tmp_path / 'ref.csv')
    assert main(['invert', '--model', f'{bench}/model.yaml', '--reference',
                 f'{tmp_path}/ref.csv', '--method', method, '-o', f'{tmp_path}/volts.csv']) == 0
    found = read_measurement(tmp_path / 'volts.csv')
    assert list(found.column('saturated')) == [0, 0, 1, 0]
    assert np.all(np.diff(found.column('voltage')[:3]) > 0)
    low, high = MuscleModel.load(bench / 'model.yaml').ranges['voltage']
    assert found.column('voltage')[2] == pytest.approx(high)


@pytest.mark.parametrize('method', ['preisach', 'linear'])
def test_invert_takes_angles_and_keeps_the_last_voltage_where_the_arm_cannot_go(
        bench, tmp_path, method):
    low, high = MuscleModel.load(bench / 'model.yaml').geometry.angle_range
    middle = 0.5 * (low + high)
    write_csv({'step': np.arange(4), 'angle': [middle, middle - 0.1, 9.0, middle]},
              tmp_path / 'ref.csv')
    assert main(['invert', '--model', f'{bench}/model.yaml', '--reference',
                 f'{tmp_path}/ref.csv', '--method', method, '-o', f'{tmp_path}/volts.csv']) == 0
    header, *rows = (tmp_path / 'volts.csv').read_text().splitlines()
    assert header == 'trial,step,angle,voltage,saturated'
    voltage = [float(row.split(',')[3]) for row in rows]
    assert voltage[2] == voltage[1]
    assert rows[2].endswith(',1')


def test_simulate_writes_the_tables_of_a_protocol(tmp_path, capsys):
    assert main(['simulate', 'bench', '-o', f'{tmp_path}/lab', '--seed', '2']) == 0
    names = {Path(line).name for line in capsys.readouterr().out.split()}
    assert names == {'force.csv', 'length.csv', 'geometry.yaml'}
    assert 'no protocol' in failed(['simulate', 'nothing', '-o', f'{tmp_path}/x'], capsys)
    assert 'no effect' in failed(
        ['simulate', 'bench', '-o', f'{tmp_path}/x', '--effect', 'nothing=0.4'], capsys)


def test_simulate_takes_another_constitutive_model(tmp_path, capsys):
    for muscle in ('grains', 'lagoudas'):
        assert main(['simulate', 'bench', '-o', f'{tmp_path}/{muscle}', '--muscle', muscle]) == 0
    capsys.readouterr()
    usual, other = (Path(f'{tmp_path}/{muscle}/length.csv').read_text()
                    for muscle in ('grains', 'lagoudas'))
    assert usual != other and usual.splitlines()[0] == other.splitlines()[0]
    assert 'there are grains, brinson, lagoudas, tanaka' in failed(
        ['simulate', 'bench', '-o', f'{tmp_path}/x', '--muscle', 'auricchio'], capsys)
    assert 'a brinson muscle cannot have r_phase' in failed(
        ['simulate', 'bench', '-o', f'{tmp_path}/x', '--muscle', 'brinson', '--effect', 'r_phase'],
        capsys)
    assert not Path(f'{tmp_path}/x').exists()


def test_effects_lists_and_explains(capsys, tmp_path):
    assert main(['effects', '--json', f'{tmp_path}/e.json']) == 0
    text = capsys.readouterr().out
    for name in ('supply_sag', 'thermal_lag', 'creep', 'payload_error', 'backlash'):
        assert name in text
    content = json.loads((tmp_path / 'e.json').read_text())
    assert len(content['effects']) >= 28
    assert content['effects'][0]['parameters']['Rs']['scale'] == ''
    assert main(['effects', 'payload_error']) == 0
    text = ' '.join(capsys.readouterr().out.split())
    assert "1 to 100 g (either sign) for the paper's muscle and arm, in proportion to mass" in text
    assert main(['effects', 'thermal_lag']) == 0
    text = capsys.readouterr().out
    assert 'equation:' in text and 'confused with:' in text and ' s' in text
    assert 'there is no effect' in failed(['effects', 'gremlins'], capsys)


BAD_TABLES = {
    'empty': ('', 'the file is empty'),
    'header only': ('trial,step,voltage,force\n', 'header and no rows'),
    'missing column': ('trial,step,voltage\n0,0,1\n', 'no column with the response'),
    'misnamed column': ('trial,step,volts,force\n0,0,1,2\n', "is 'volts' meant to be 'voltage'"),
    'NaN': ('trial,step,voltage,force\n0,0,nan,2\n', "line 2, column 'voltage' is nan"),
    'text': ('trial,step,voltage,force\n0,0,on,2\n', "line 2, column 'voltage' is 'on'"),
    'empty cell': ('trial,step,voltage,force\n0,0,,2\n', "line 2, column 'voltage' is empty"),
    'repeated step': ('trial,step,voltage,force\n0,1,1,2\n0,1,1,2\n', 'step is repeated'),
    'bars': ('trial|step|voltage|force\n0|0|1|2\n', 'separated by bars'),
    'binary': ('\x00\x01\x02', 'binary data, no table'),
    'one long line': ('a' * 2_000_000, 'more than 999999 characters'),
    'one long cell': ('a' * 200_000 + '\n', 'line 1: field larger than field limit')}


@pytest.mark.parametrize('name', BAD_TABLES)
@pytest.mark.parametrize('command', ['compare', 'predict', 'identify'])
def test_a_bad_table_is_one_line(bench, tmp_path, capsys, name, command):
    text, words = BAD_TABLES[name]
    path = tmp_path / 'bad.csv'
    path.write_text(text)
    rest = {'compare': ['--model', f'{bench}/model.yaml', '--data', str(path)],
            'predict': ['--model', f'{bench}/model.yaml', '--data', str(path), '-o', 'x.csv'],
            'identify': ['--force', str(path), '-o', f'{tmp_path}/m.yaml']}
    line = failed([command, *rest[command]], capsys)
    assert words in line and str(path) in line
    assert not (tmp_path / 'm.yaml').exists()


def test_units_off_by_a_thousand_are_refused_and_converted_as_the_line_says(
        bench, tmp_path, capsys):
    table = read_measurement(bench / 'force.csv')
    write_csv({**table.columns, 'voltage': 1000 * table.column('voltage')}, tmp_path / 'mv.csv')
    command = ['compare', '--model', f'{bench}/model.yaml', '--json', f'{tmp_path}/j.json',
               '--data']
    line = failed([*command, f'{tmp_path}/mv.csv'], capsys)
    option = re.search('is it in mV.* with (--columns voltage=voltage:mV), or confirm', line)[1]
    assert main([*command, f'{tmp_path}/mv.csv', *option.split()]) == 0
    converted = json.loads((tmp_path / 'j.json').read_text())
    assert main([*command, f'{bench}/force.csv']) == 0
    assert json.loads((tmp_path / 'j.json').read_text())['model'] == pytest.approx(
        converted['model'], rel=1e-6)
    assert 'warning' not in capsys.readouterr().err


def test_tables_of_ones_own_go_through_every_command(bench, tmp_path, capsys):
    """With names and units of their own they give what the plain ones give."""
    force, length, arm = (read_measurement(bench / f'{name}.csv')
                          for name in ('force', 'length', 'arm'))
    write_csv({'trial': force.column('trial'), 'U': force.column('voltage'),
               'F': force.column('force')}, tmp_path / 'force.csv')
    write_csv({'trial': length.column('trial'), 'U': length.column('voltage'),
               'F': length.column('force'), 'dz_mm': 1e3 * length.column('length')},
              tmp_path / 'length.csv')
    write_csv({'t': arm.time, 'trial': arm.column('trial'), 'U': arm.column('voltage'),
               'theta': np.degrees(arm.column('angle'))}, tmp_path / 'arm.csv')
    bench_columns = ['--columns', 'voltage=U,force=F,length=dz_mm']
    arm_columns = ['--columns', 'angle=theta:deg,voltage=U,time=t']
    model = f'{tmp_path}/model.yaml'
    assert main(['identify', '--force', f'{tmp_path}/force.csv', '--length',
                 f'{tmp_path}/length.csv', '--force-trials', '0', '--length-trials', '0-3',
                 '--geometry', f'{bench}/geometry.yaml', *bench_columns, '-o', model]) == 0
    voltage = np.linspace(0, 5, 9)
    assert MuscleModel.load(model).linear.to_dict() == pytest.approx(
        MuscleModel.load(bench / 'model.yaml').linear.to_dict(), rel=1e-6)
    out = f'{tmp_path}/out.csv'
    data = ['--model', model, '--data', f'{tmp_path}/arm.csv', *arm_columns]
    assert main(['compare', *data]) == 0
    assert main(['predict', *data, '-o', out]) == 0
    assert read_measurement(out).column('angle') == pytest.approx(arm.column('angle'))
    assert main(['extend', *data, '--add', 'payload_error', '-o', f'{tmp_path}/m2.yaml']) == 0
    write_csv({'theta': np.degrees(2.0 - 0.02 * voltage)}, tmp_path / 'reference.csv')
    assert main(['invert', '--model', model, '--reference', f'{tmp_path}/reference.csv',
                 '--columns', 'angle=theta:deg', '-o', out]) == 0
    assert 'is it in deg? Convert it with --columns angle=theta:deg' in failed(
        ['invert', '--model', model, '--reference', f'{tmp_path}/reference.csv',
         '--columns', 'angle=theta', '-o', out], capsys)


def test_columns_lists_names_units_and_spellings(tmp_path, capsys):
    assert main(['columns', '--json', f'{tmp_path}/c.json']) == 0
    text = capsys.readouterr().out
    assert re.search(r'^angle +rad +deg', text, re.MULTILINE)
    assert re.search(r'^responses: angle, length', text, re.MULTILINE)
    content = {entry['column']: entry for entry in json.loads(
        (tmp_path / 'c.json').read_text())['columns']}
    assert {'voltage', 'ambient_temperature', 'time', 'trial', 'step'} <= set(content)
    assert content['length']['unit'] == 'm' and 'mm' in content['length']['units']
    # The example that it prints is one that is understood.
    assert len(column_map(re.search('--columns (angle.*)', text)[1])) == 3


@pytest.mark.parametrize('text, words', [
    ('', 'not a model file'), ('{', 'not a model file'), ('a: 1', 'not a model file'),
    ('schema: 99', 'schema 99'), ('schema: 1', 'lacks'),
    ('!!python/object/apply:os.system [exit]', 'not a model file')])
def test_a_bad_model_is_one_line(bench, tmp_path, capsys, text, words):
    (tmp_path / 'm.yaml').write_text(text)
    line = failed(['compare', '--model', f'{tmp_path}/m.yaml', '--data', f'{bench}/force.csv'],
                  capsys)
    assert words in line


@pytest.mark.parametrize('arguments, words', [
    (['compare', '--model', 'no.yaml', '--data', 'BENCH/force.csv'], 'no.yaml: No such file'),
    (['compare', '--model', 'BENCH/model.yaml', '--data', 'no.csv'], 'no.csv: no such file'),
    (['compare', '--model', 'BENCH/model.yaml', '--data', 'BENCH'],
     'holds no bag (*.mcap or *.db3); to read its tables, name the files, such as BENCH/arm.csv'),
    (['compare', '--model', 'BENCH/model.yaml', '--data', 'BENCH/model.yaml'],
     'model.yaml: a model of a muscle, no table; give it as the model, and as data a table or'),
    (['compare', '--model', 'BENCH/geometry.yaml', '--data', 'BENCH/force.csv'],
     'geometry.yaml: the geometry of an arm, not a model file'),
    (['effects', 'thermal_lg'], "there is no effect 'thermal_lg'; did you mean 'thermal_lag'?"),
    (['extend', '--model', 'BENCH/model.yaml', '--data', 'BENCH/arm.csv', '--add', 'payload-error',
      '-o', 'BENCH/x.yaml'], "did you mean 'payload_error'?"),
    (['identify', '--length', 'BENCH/length.csv', '--effects', 'stress_dependance', '-o',
      'BENCH/x.yaml'], "did you mean 'stress_dependence'?"),
    (['simulate', 'arm-step', '-o', 'BENCH/x'], "did you mean 'arm-steps'?"),
    (['simulate', 'bench', '--muscle', 'brinsen', '-o', 'BENCH/x'], "did you mean 'brinson'?"),
    (['simulate', 'bench', '--effect', 'crep', '-o', 'BENCH/x'], "did you mean 'creep'?"),
    (['demo', '--hidden', 'termal_lag', '-o', 'BENCH/x'], "did you mean 'thermal_lag'?"),
    (['compare', '--model', 'BENCH/force.csv', '--data', 'BENCH/force.csv'],
     "force.csv: a table ('trial,step,voltage,force'), no model file; give it as data"),
    (['compare', '--model', 'BENCH', '--data', 'BENCH/force.csv'], 'is a folder; name a file'),
    (['compare', '--model', 'BENCH/model.yaml', '--data', ''], '--data: the path is empty'),
    (['identify', '--length', 'BENCH/length.csv', '--geometry', '', '-o', 'BENCH/x.yaml'],
     '--geometry: the path is empty'),
    (['identify', '--length', 'BENCH/arm.csv', '-o', 'BENCH/x.yaml'],
     'measures angle, but length or strain is needed here; identify takes bench tables'),
    (['invert', '--model', 'BENCH/model.yaml', '--reference', 'BENCH', '-o', 'x.csv'],
     'a folder, no table; give a CSV file'),
    (['compare', '--model', 'BENCH/model.yaml', '--data', 'BENCH/force.csv',
      'BENCH/length.csv'], 'differ in their response'),
    (['compare', '--model', 'BENCH/model.yaml', '--data', 'BENCH/force.csv', '--report',
      'BENCH/no/r.html'], 'BENCH/no does not exist; make it first'),
    (['predict', '--model', 'BENCH/model.yaml', '--data', 'BENCH/force.csv', 'BENCH/arm.csv',
      '-o', 'x.csv'], 'takes one measurement'),
    (['identify', '-o', 'BENCH/x.yaml'], 'nothing to identify'),
    (['identify', '--force', 'BENCH/length.csv', '-o', 'BENCH/x.yaml'], 'swapped'),
    (['identify', '--length', 'BENCH/length.csv', '--length-trials', '0,77', '-o',
      'BENCH/x.yaml'], 'trial 77'),
    (['identify', '--length', 'BENCH/length.csv', '--effects', 'atuo', '-o', 'BENCH/x.yaml'],
     "--effects atuo: did you mean 'auto'?"),
    (['identify', '--length', 'BENCH/length.csv', '--levels', '5', '101', '-o', 'BENCH/x.yaml'],
     'levels must be two numbers from 1 to 100, not [5, 101]'),
    (['invert', '--model', 'BENCH/model.yaml', '--reference', 'BENCH/geometry.yaml', '-o',
      'x.csv'], 'geometry.yaml: a YAML file, no table')])
def test_what_cannot_be_done_is_one_line(bench, capsys, arguments, words):
    line = failed([word.replace('BENCH', str(bench)) for word in arguments], capsys)
    assert words.replace('BENCH', str(bench)) in line


def test_invert_says_which_column_is_missing(bench, tmp_path, capsys):
    write_csv({'length': [0.0, 0.001]}, tmp_path / 'ref.csv')
    line = failed(['invert', '--model', f'{bench}/model.yaml', '--reference',
                   f'{tmp_path}/ref.csv', '-o', f'{tmp_path}/v.csv'], capsys)
    assert 'no force; the model needs both' in line


@pytest.mark.parametrize('arguments', [
    [], ['nothing'], ['compare'], ['compare', '--model', 'm.yaml'], ['effects', '--what'],
    ['simulate', 'bench', '-o', 'x', '--seed', '-1'],
    ['simulate', 'bench', '-o', 'x', '--effect', '=3'],
    ['simulate', 'bench', '-o', 'x', '--effect', 'creep=much'],
    ['identify', '--force', 'f', '--force-trials', '3-1', '-o', 'x'],
    ['compare', '--model', 'm', '--data', 'd', '--columns', 'angel=theta'],
    ['identify', '--length', 'l', '--operator', 'magic', '-o', 'x'],
    ['identify', '--length', 'l', '--levels', '0', '5', '-o', 'x'],
    ['diagnose', '--model', 'm', '--data', 'd', '--seed', '-1'],
    ['diagnose', '--model', 'm', '--data', 'd', '--jobs', '0'],
    ['diagnose', '--model', 'm', '--data', 'd', '--jobs', '-5'],
    ['demo', '--seed', '-1']])
def test_wrong_usage_has_status_2(arguments, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert 'usage: hysteresis' in capsys.readouterr().err


@pytest.mark.parametrize('command', ['identify', 'compare', 'predict', 'invert', 'simulate',
                                     'effects', 'operators'])
def test_every_command_explains_itself(command, capsys):
    with pytest.raises(SystemExit) as left:
        main([command, '--help'])
    assert left.value.code == 0
    text = capsys.readouterr().out
    assert text.startswith(f'usage: hysteresis {command}') and len(text) > 200


def test_the_list_of_commands_and_the_version(capsys):
    for option in ('--help', '--version'):
        with pytest.raises(SystemExit) as left:
            main([option])
        assert left.value.code == 0
    text = capsys.readouterr().out
    assert all(name in text for name in ('identify', 'compare', 'simulate'))
    assert re.search(r'hysteresis_ros \d', text)
    assert set(COMMANDS) >= {'diagnose', 'extend', 'table1', 'demo'}


def test_only_the_command_that_is_called_is_imported():
    code = ('import sys; from hysteresis_ros.cli.main import build_parser; '
            'build_parser(["effects"]); '
            'assert "hysteresis_ros.cli.compare" not in sys.modules; '
            'assert "matplotlib" not in sys.modules and "scipy" not in sys.modules')
    environment = {**os.environ, 'PYTHONPATH': str(Path(__file__).parents[1])}
    subprocess.run([sys.executable, '-c', code], check=True, env=environment)
    assert isinstance(build_parser(['effects']), argparse.ArgumentParser)


def test_the_module_runs_and_a_closed_pipe_is_no_error():
    environment = {**os.environ, 'PYTHONPATH': str(Path(__file__).parents[1])}
    done = subprocess.run(
        f'"{sys.executable}" -m hysteresis_ros effects | head -1', shell=True, text=True,
        capture_output=True, env=environment, check=True)
    assert done.stdout == 'electrical:\n' and done.stderr == ''


def test_a_package_that_is_not_installed_is_one_line(bench, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'matplotlib.figure', None)
    line = failed(['compare', '--model', f'{bench}/model.yaml', '--data', f'{bench}/force.csv',
                   '--plots', f'{tmp_path}/plots'], capsys)
    assert 'matplotlib.figure is not installed' in line


def test_an_interrupt_is_one_line(bench, capsys, monkeypatch):
    def interrupt(path):
        raise KeyboardInterrupt
    monkeypatch.setattr(MuscleModel, 'load', interrupt)
    assert main(['compare', '--model', 'm', '--data', 'd']) == 130
    assert capsys.readouterr().err == 'hysteresis compare: interrupted\n'


def test_a_muscle_that_creeps_in_one_long_hold_gets_a_diagnosis(tmp_path, capsys):
    """One trial of a pressure muscle: a ramp, then 240 s in which only the length moves."""
    time = np.arange(2600) * 0.1
    pressure = 3e5 * np.minimum(time / 20.0, 1.0)
    # Rubber gives way with 3 s and with 90 s after each step of the pressure.
    length = -0.012 * (pressure / 3e5) ** 1.3 + np.random.default_rng(0).normal(0.0, 2e-5, 2600)
    for creep, constant in ((0.001, 3.0), (0.0015, 90.0)):
        kernel = np.exp(-time / constant) * 0.1 / constant
        length -= creep * np.convolve(pressure / 3e5, kernel)[:2600]
    write_csv({'time': time, 'trial': np.zeros(2600), 'pressure': pressure, 'length': length},
              tmp_path / 'hold.csv')
    model = f'{tmp_path}/model.yaml'
    assert main(['identify', '--operator', 'preisach', '--levels', '4', '5', '--length',
                 f'{tmp_path}/hold.csv', '-o', model]) == 0
    assert main(['diagnose', '--model', model, '--data', f'{tmp_path}/hold.csv', '--jobs', '1',
                 '--json', f'{tmp_path}/found.json']) == 0
    found = json.loads((tmp_path / 'found.json').read_text())
    assert found['verdict'] == 'unknown' or found['missing'] == ['creep']
    creep, = (row for row in found['ranking'] if row['effect'] == 'creep')
    assert creep['rmse_after'] < creep['rmse_before']
    assert 'both signs' not in capsys.readouterr().err


def test_lists_of_trials():
    assert numbers('0') == [0]
    assert numbers('0, 2,5-7') == [0, 2, 5, 6, 7]
    for text in ('', 'a', '3-1', '1,,2', '0-999999999'):
        with pytest.raises(argparse.ArgumentTypeError, match='no list of trials'):
            numbers(text)


def test_one_line_keeps_a_terminal_safe():
    assert one_line('a\nb\t\x1b[31mc') == 'a b  [31mc'


def test_steps_are_shown_on_a_terminal_only(capsys):
    class Terminal:
        text = ''

        def isatty(self):
            return True

        def write(self, text):
            self.text += text

        def flush(self):
            pass
    terminal = Terminal()
    steps = Steps(terminal)
    steps('reading')
    steps.clear()
    assert 'reading ...' in terminal.text and terminal.text.endswith('\x1b[K')
    Steps()('reading')
    assert capsys.readouterr().err == ''


def test_rounds_have_names_and_one_total_and_time(capsys):
    """The second round goes on where the first ended, and the steps of an arm have names."""
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    def _grow_sets():
        pass
    rounds = Rounds(['each effect alone'], Terminal())
    assert list(rounds(range(3), 3)) == [0, 1, 2]
    bar, begun = rounds._bar, rounds._bar.start_t
    assert (bar.desc, bar.n, bar.total) == ('each effect alone: ', 3, 3)
    assert list(rounds([_grow_sets, 5], 2)) == [_grow_sets, 5]
    assert rounds._bar is bar and bar.start_t == begun
    assert (bar.n, bar.total) == (5, 5)
    text = rounds.stream.getvalue()
    rounds.close()
    assert 'each effect alone' in text and bar.desc == 'growing sets of effects: '
    assert list(rounds([1], 1)) == [1] and bar.desc == 'round 3: '
    silent = Rounds()
    assert list(silent(range(2), 2)) == [0, 1] and silent._bar is None


def test_identify_says_what_effects_auto_does(bench, tmp_path, capsys, monkeypatch):
    """Before it begins."""
    def found_nothing(*args, **options):
        assert 'each effect that a bench can show is fitted' in capsys.readouterr().out
        raise IdentificationError('stopped here')
    monkeypatch.setattr('hysteresis_ros.api.identify', found_nothing)
    assert 'stopped here' in failed(['identify', '--length', f'{bench}/length.csv', '--effects',
                                     'auto', '-o', f'{tmp_path}/m.yaml'], capsys)


@pytest.mark.parametrize('effects, said', [('auto', True), ('none', False)])
def test_identify_says_that_nothing_was_found(bench, tmp_path, capsys, monkeypatch, effects, said):
    """A bench of which no effect is named has been looked at, too."""
    monkeypatch.setattr('hysteresis_ros.diagnosis.bench_effects.add_effects',
                        lambda model, *args, **options: (model, []))
    assert main(['identify', '--length', f'{bench}/length.csv', '--force', f'{bench}/force.csv',
                 '--effects', effects, '-o', f'{tmp_path}/m.yaml']) == 0
    assert ('No effect: with none are trials' in capsys.readouterr().out) is said


@pytest.mark.parametrize('name, operator, kind, better', [
    # A plain Preisach operator does not see the load, the linear model does.
    ('sma_react/nitihf_isobaric.csv', 'preisach', 'preisach', 3.0),
    ('sma_react/nitico_isobaric.csv', 'two-stage', 'two-stage', 1.0),
    ('piezo/stack_nested_loops.csv', 'preisach', 'preisach', 0.4)])
def test_real_measurements_are_identified_and_compared(tmp_path, name, operator, kind, better):
    if not (DATA / name).exists():
        pytest.skip(f'{DATA / name} is not here')
    assert main(['identify', '--length', str(DATA / name), '--operator', operator, '-o',
                 f'{tmp_path}/m.yaml']) == 0
    assert main(['compare', '--model', f'{tmp_path}/m.yaml', '--data', str(DATA / name), '--json',
                 f'{tmp_path}/j.json']) == 0
    content = json.loads((tmp_path / 'j.json').read_text())
    assert MuscleModel.load(tmp_path / 'm.yaml').kind == kind
    assert content['model']['mean_abs'] < better * content['linear']['mean_abs']
    assert content['where'] or name.startswith('piezo')
