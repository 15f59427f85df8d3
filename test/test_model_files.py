# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The model file: an exact round trip, and one line for everything that is no model."""

import math

import numpy as np
import pytest
import yaml

from hysteresis_ros.errors import ModelFileError
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.model import files
from model_support import arm_run, bicep_model, effect_of, STRENGTHS, wandering_voltage


def refused(path, *words):
    """Check that a file is refused in one line that names it and says these words."""
    with pytest.raises(ModelFileError) as error:
        MuscleModel.load(path)
    message = str(error.value)
    assert message.startswith(f'{path}: ') and '\n' not in message and len(message) < 800
    for word in words:
        assert word in message


@pytest.fixture
def path(tmp_path):
    """Name of a model file that is there, with effects."""
    name = tmp_path / 'model.yaml'
    bicep_model(['thermal_lag', 'end_stop']).save(name)
    return name


def change(path, edit):
    """Change the content of a model file and write it again."""
    content = yaml.safe_load(path.read_text())
    edit(content)
    path.write_text(yaml.safe_dump(content))


def test_round_trip_is_exact(tmp_path):
    model = bicep_model(STRENGTHS)
    for effect in model.effects:
        effect.intervals = {name: (value - 0.1, value + 1.0 / 3.0)
                            for name, value in effect.values.items()}
    model.save(tmp_path / 'model.yaml')
    loaded = MuscleModel.load(str(tmp_path / 'model.yaml'))
    assert files.to_dict(loaded) == files.to_dict(model)
    for name in ('kind', 'drive', 'load_name', 'response', 'sign', 'mean_load', 'ranges', 'linear',
                 'geometry', 'metrics', 'provenance'):
        assert getattr(loaded, name) == getattr(model, name)
    assert [e.values for e in loaded.effects] == [e.values for e in model.effects]
    assert [e.intervals for e in loaded.effects] == [e.intervals for e in model.effects]
    run = arm_run(wandering_voltage(10), 0.5)
    np.testing.assert_array_equal(loaded.predict(run), model.predict(run))


def test_a_model_with_parts_left_out_comes_back(tmp_path):
    model = bicep_model(force_stage=None, linear=None, geometry=None, load_name=None, metrics={},
                        provenance={}, kind='preisach', sign=1)
    model.save(tmp_path / 'model.yaml')
    assert files.to_dict(MuscleModel.load(tmp_path / 'model.yaml')) == files.to_dict(model)


def test_numpy_numbers_and_open_intervals_come_back_as_plain_ones(tmp_path):
    model = bicep_model(['slack'])
    shared = [1.0, 2.0]
    model.metrics = {'length': {'rmse': np.float64(0.1), 'rows': np.int64(3)}, 'a': shared,
                     'b': shared, 'c': np.arange(3.0), 'd': (1, 2), 5: True}
    model.effects[0].intervals = {'Ls': (-math.inf, math.inf)}
    model.save(tmp_path / 'model.yaml')
    loaded = MuscleModel.load(tmp_path / 'model.yaml')
    assert loaded.metrics == {'length': {'rmse': 0.1, 'rows': 3}, 'a': shared, 'b': shared,
                              'c': [0.0, 1.0, 2.0], 'd': [1, 2], '5': True}
    assert loaded.effects[0].intervals == {'Ls': (-math.inf, math.inf)}


def test_units_are_written_beside_the_values(path):
    entry = yaml.safe_load(path.read_text())['effects'][0]
    assert entry == {'id': 'thermal_lag', 'parameters': {
        'time_constant': {'value': 3.0, 'low': 3.0, 'high': 3.0, 'unit': 's'}}}


def test_an_existing_file_is_replaced_only_by_a_complete_one(path):
    before = path.read_text()
    model = bicep_model()
    model.provenance = {'what': object()}
    with pytest.raises(yaml.YAMLError):
        model.save(path)
    assert path.read_text() == before
    bicep_model().save(path)
    assert [entry.name for entry in path.parent.iterdir()] == ['model.yaml']


@pytest.mark.parametrize('version', [0, 2, 'one', None])
def test_another_version_is_named(path, version):
    change(path, lambda content: content.update(schema=version))
    refused(path, f'schema {version!r}', 'identify the model again')


@pytest.mark.parametrize('key', [
    'kind', 'drive', 'load', 'response', 'sign', 'mean_load', 'metrics', 'effects', 'geometry',
    'ranges', 'linear', 'force_stage', 'length_stage', 'provenance'])
def test_a_missing_part_is_named(path, key):
    change(path, lambda content: content.pop(key))
    refused(path, f"lacks '{key}'")


DAMAGES = {
    'weights': (lambda c: c['length_stage']['weights'].__setitem__(3, math.nan), 'weights'),
    'signs': (lambda c: c['force_stage']['weights'].__setitem__(3, -1.0), 'weights'),
    'count': (lambda c: c['force_stage']['weights'].pop(), 'weights'),
    'nodes': (lambda c: c['length_stage'].update(nodes=['a', 'b']), 'nodes'),
    'kind of operator': (lambda c: c['length_stage'].update(kind='magic'), 'magic'),
    'operator': (lambda c: c.update(length_stage=7), 'operator'),
    'sign': (lambda c: c.update(sign=0), 'sign must be -1 or 1'),
    'sign of truth': (lambda c: c.update(sign=True), 'sign must be -1 or 1'),
    'load': (lambda c: c.update(mean_load='much'), 'mean_load'),
    'endless load': (lambda c: c.update(mean_load=math.inf), 'mean_load'),
    'huge load': (lambda c: c.update(mean_load=10 ** 400), 'damaged'),
    'range': (lambda c: c['ranges'].update(voltage=[0.0]), 'damaged'),
    'range of nothing': (lambda c: c['ranges'].update(voltage=[math.nan, 1.0]), 'voltage'),
    'ranges': (lambda c: c.update(ranges=[1, 2]), 'damaged'),
    'effects': (lambda c: c.update(effects=3), 'damaged'),
    'effect': (lambda c: c['effects'][0].update(id='gremlins'), 'gremlins'),
    'parameter': (lambda c: c['effects'][0]['parameters'].update(
        mass={'value': 1.0, 'low': 1.0, 'high': 1.0}), "no parameter 'mass'"),
    'value': (lambda c: c['effects'][0]['parameters']['time_constant'].update(value=math.nan),
              'time_constant'),
    'interval': (lambda c: c['effects'][0]['parameters']['time_constant'].update(low=math.nan),
                 'interval of time_constant'),
    'interval left out': (lambda c: c['effects'][0]['parameters']['time_constant'].pop('low'),
                          "lacks 'low'"),
    'geometry': (lambda c: c['geometry'].update(clamp_distance=-1.0), 'clamp_distance'),
    'geometry left out': (lambda c: c['geometry'].pop('clamp_distance'), 'clamp_distance'),
    'linear': (lambda c: c['linear'].update(k1='steep'), 'k1, k2 and F0'),
    'linear of nothing': (lambda c: c['linear'].update(k1=math.nan), 'not finite'),
    'metrics': (lambda c: c.update(metrics=[1]), 'damaged'),
}


@pytest.mark.parametrize('damage', DAMAGES)
def test_damage_is_said_in_one_line(path, damage):
    edit, word = DAMAGES[damage]
    change(path, edit)
    refused(path, word)


@pytest.mark.parametrize('text', [
    '', '[]', 'schema', 'a: 1', 'schema: [', '\t', '\0', 'schema: 1\nwhen: 2001-99-99',
    'schema: !!int x', '!!python/object/apply:os.system ["touch here"]',
    'schema: 1\nkind: !!python/object:hysteresis_ros.model.MuscleModel {}',
    'schema: 1\nkind: !!python/name:os.system', 'a: &a [*a]', 'a: &a [1]\nb: *a',
    'schema: ' + '[' * 100_000, 'schema: ' + '[' * 50 + ']' * 50,
    'schema: 1\n' + 'x: {' * 50])
def test_what_is_no_model_file_is_refused_and_runs_nothing(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'model.yaml').write_text(text)
    refused(tmp_path / 'model.yaml', 'not a model file')
    assert [entry.name for entry in tmp_path.iterdir()] == ['model.yaml']


def test_a_model_that_refers_to_itself_is_refused(path):
    text = path.read_text()
    start, stop = text.index('metrics:'), text.index('effects:')
    path.write_text(text[:start] + 'metrics: &all {again: *all}\n' + text[stop:])
    refused(path, 'not a model file', 'references')


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / 'model.yaml').write_bytes(bytes(range(256)))
    refused(tmp_path / 'model.yaml', 'not a model file')


def test_a_huge_file_is_refused_before_it_is_read(tmp_path):
    with open(tmp_path / 'model.yaml', 'wb') as file:
        file.truncate(10 ** 10)
    refused(tmp_path / 'model.yaml', 'larger than 20 MB')


def test_cut_off_files_are_refused_at_any_place(path):
    text = path.read_text()
    for end in range(40, len(text) - 40, len(text) // 25):
        path.write_text(text[:end])
        refused(path)


def test_a_file_that_is_not_there_is_an_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError):
        MuscleModel.load(tmp_path / 'none.yaml')
    with pytest.raises(FileNotFoundError):
        bicep_model().save(tmp_path / 'none' / 'model.yaml')


def test_values_of_effects_depend_on_the_muscle_they_are_loaded_for(tmp_path):
    model = bicep_model(load_name='stress', drive='temperature', response='strain',
                        ranges={'temperature': (20.0, 150.0), 'strain': (0.0, 0.04)})
    model = model.with_effects([effect_of(model, 'stress_dependence', C=8.0)])
    model.save(tmp_path / 'model.yaml')
    effect = MuscleModel.load(tmp_path / 'model.yaml').effects[0]
    assert effect.parameters[0].unit == 'MPa/K' and effect.load_per_drive_squared == 8e6
