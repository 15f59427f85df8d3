# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Comparison: the numbers, and that the region where a model fails is the one that is named."""

import dataclasses
import json
import re
from types import SimpleNamespace

from hysteresis_ros.comparison.compare import bench_effects, compare, ladder
from hysteresis_ros.comparison.signals import changes, signals_of, varies
from hysteresis_ros.comparison.where import (
    binned, blocks_of, correlogram, half_width, memory, number, placed)
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.measurements.columns import Column
import numpy as np
import pytest

# The muscle of these tests is longer than one that a unit explains.
METRES = {'length': Column('length', 'length', confirmed=True)}


@dataclasses.dataclass
class FakeModel:
    """angle = 2 - 0.1 V plus an offset for each effect; the linear model is off by 0.1."""

    effects: list = dataclasses.field(default_factory=list)
    kind: str = 'two-stage'
    linear: object = 'linear'
    geometry: object = None
    ranges: dict = dataclasses.field(default_factory=lambda: {'voltage': (0.0, 6.0)})
    provenance: dict = dataclasses.field(default_factory=dict)

    def with_effects(self, effects):
        return dataclasses.replace(self, effects=list(effects))

    def predict(self, measurement, method='preisach'):
        line = 2.0 - 0.1 * measurement.column(measurement.drive)
        if method == 'linear':
            return line + 0.1
        return line + sum(effect.offset for effect in self.effects)


def effect(name, offset):
    return SimpleNamespace(id=name, offset=offset)


def run(error, minutes=20, rate=5, seed=0, trials=2, extra=None):
    """Continuous run with slow ramps; `error(time, voltage, rising)` is what the model misses."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, minutes * 60, 1 / rate)
    trial = np.minimum((time / time[-1] * trials).astype(int), trials - 1)
    phase = time / 47.0 + 0.3 * np.sin(time / 200)
    voltage = 3 + 3 * np.sin(phase)
    angle = 2 - 0.1 * voltage + error(time, voltage, np.cos(phase) > 0)
    angle = angle + 1e-4 * rng.standard_normal(len(time))
    start = np.array([time[trial == k][0] for k in range(trials)])[trial]
    columns = {'time': time - start, 'trial': trial, 'voltage': voltage, 'angle': angle}
    return Measurement.from_columns({**columns, **(extra or {})})


def test_the_json_has_the_names_that_programs_rely_on():
    comparison = compare(FakeModel(), [run(lambda t, v, up: 0.02 * (v > 5))])
    content = json.loads(json.dumps(comparison.to_dict(), allow_nan=False))
    assert {'rows', 'quantity', 'unit', 'model', 'linear', 'by_trial', 'where'} <= set(content)
    assert (content['rows'], content['quantity'], content['unit']) == (6000, 'angle', 'rad')
    for errors in (content['model'], content['linear'], content['by_trial'][0]['model']):
        assert set(errors) == {'mean_abs', 'std', 'rmse', 'mean_percent', 'std_percent'}
    assert {'signal', 'from', 'to', 'mean_residual', 'rmse', 'rows'} <= set(content['where'][0])
    assert [entry['trial'] for entry in content['by_trial']] == [0.0, 1.0]


def test_errors_are_those_of_the_rows():
    measured = run(lambda t, v, up: 0.03)
    comparison = compare(FakeModel(), [measured])
    residual = measured.column('angle') - (2 - 0.1 * measured.column('voltage'))
    span = np.ptp(measured.column('angle'))
    assert comparison.model.mean_abs == pytest.approx(np.mean(np.abs(residual)))
    assert comparison.model.rmse == pytest.approx(np.sqrt(np.mean(residual ** 2)))
    assert comparison.model.mean_percent == pytest.approx(100 * np.mean(np.abs(residual)) / span)
    assert comparison.linear.mean_abs == pytest.approx(0.07, abs=1e-4)
    assert np.mean(comparison.residual) == pytest.approx(0.03, abs=1e-4)


@pytest.mark.parametrize('error, signal, low, high, mean', [
    (lambda t, v, up: 0.05 * (v > 4.5), 'voltage', 4.2, 6.0, 0.05),
    (lambda t, v, up: -0.05 * up, 'direction', 1.0, 1.0, -0.05),
    (lambda t, v, up: 0.05 * (t > 900), 'elapsed_time', 850, 1200, 0.05),
    (lambda t, v, up: 0.05 * (t >= 600), 'trial', 1.0, 1.0, 0.05),
    (lambda t, v, up: 0.04 * np.clip((v - 1) / 2, -1, 0), 'voltage', 0.0, 1.5, -0.02)])
def test_the_region_where_the_model_fails_is_named(error, signal, low, high, mean):
    comparison = compare(FakeModel(), [run(error)])
    found = {name: (region, first, last) for region in comparison.where
             for name, first, last in (*region.same_rows,
                                       (region.signal, region.low, region.high))}
    assert signal in found
    region, first, last = found[signal]
    assert first >= low - 1e-9 and last <= high + 1e-9
    assert region.mean_residual == pytest.approx(mean, rel=0.35)
    assert region.share > 0.6
    assert comparison.where[0].share > 0.6
    words = 'larger' if mean > 0 else 'smaller'
    assert f'{words} than predicted' in region.text


def test_the_cause_ranks_before_signals_that_only_go_along():
    comparison = compare(FakeModel(), [run(lambda t, v, up: 0.05 * (v > 4.5))])
    assert comparison.where[0].signal in ('voltage', 'predicted_angle')


def test_regions_that_are_the_same_rows_are_one():
    """The prediction goes along with the voltage, so both name the same rows."""
    comparison = compare(FakeModel(), [run(lambda t, v, up: 0.05 * (v > 4.5))])
    first = comparison.where[0]
    other, = (name for name in ('voltage', 'predicted_angle') if name != first.signal)
    assert other in [name for name, _, _ in first.same_rows]
    assert 'the same rows are those where ' in first.text
    assert other not in [region.signal for region in comparison.where]
    assert first.to_dict()['same_rows'][0]['signal'] == first.same_rows[0][0]


def test_an_error_that_some_rows_do_not_have_is_not_everywhere():
    comparison = compare(FakeModel(), [run(lambda t, v, up: 0.1 * np.sqrt(v / 6))])
    text = comparison.where[0].text
    assert 'everywhere' not in text
    assert re.search(r'\d deg larger than predicted on average [(]-0[.]0\d+ to 5.\d+ deg[)]', text)


def test_white_noise_has_no_region():
    named = 0
    for seed in range(10):
        comparison = compare(FakeModel(), [run(lambda t, v, up: 0.0, seed=seed)])
        named += len(comparison.where)
    assert named == 0
    assert 'No region stands out' in comparison.to_text()


def test_an_error_that_is_everywhere_is_said_to_be():
    comparison = compare(FakeModel(), [run(lambda t, v, up: -0.08)])
    region = comparison.where[0]
    assert region.text.endswith('smaller than predicted everywhere')
    assert region.rows == comparison.rows and len(comparison.where) == 1


def test_errors_of_both_signs_are_found_by_their_size():
    def error(time, voltage, up):
        return 0.05 * (voltage < 1) * np.sign(np.sin(time * 3))
    comparison = compare(FakeModel(), [run(error)])
    region = next(r for r in comparison.where if r.signal == 'voltage')
    assert 'of both signs' in region.text and region.high < 1.6


def test_time_since_a_step_is_a_signal_of_stepped_runs():
    time = np.arange(0, 1200, 0.2)
    levels = np.random.default_rng(0).uniform(0, 6, 40)
    step = (time / 30).astype(int)
    lag = np.exp(-(time - 30 * step) / 4) * np.diff(levels, prepend=0)[step]
    angle = 2 - 0.1 * (levels[step] - lag)
    measured = Measurement.from_columns({'time': time, 'voltage': levels[step], 'angle': angle})
    comparison = compare(FakeModel(), [measured])
    low, high = next(part for r in comparison.where
                     for name, *part in ((r.signal, r.low, r.high), *r.same_rows)
                     if name == 'time_since_step')
    assert low < 1 and high < 8
    assert comparison.settled['rows'] == 40
    assert comparison.settled['model'].rmse < 0.05 * comparison.model.rmse
    assert '40 ends of holds' in comparison.to_text()


def test_each_extension_is_a_row():
    measured = run(lambda t, v, up: 0.05)
    model = FakeModel(effects=[effect('payload_error', 0.03), effect('frame_tilt', 0.02)])
    comparison = compare(model, [measured])
    names = [name for name, _ in comparison.extensions]
    assert names == ['two-stage', '+ payload_error', '+ frame_tilt']
    errors = [round(values.mean_abs, 3) for _, values in comparison.extensions]
    assert errors == [0.05, 0.02, 0.0]
    assert comparison.model == comparison.extensions[-1][1]
    text = comparison.to_text()
    assert text.index('linear') < text.index('two-stage') < text.index('+ payload_error')
    assert compare(FakeModel(), [measured]).extensions == []


def test_effects_of_the_bench_fit_are_in_every_row():
    effects = [effect('stress_dependence', 0.01), effect('payload_error', 0.02)]
    model = FakeModel(effects=effects, provenance={'length': {'sha256': 'ab'}, 'extended': [
        {'effects': ['stress_dependence'], 'data': [{'source': 'length.csv', 'sha256': 'ab'}]},
        {'effects': ['payload_error'], 'data': [{'source': 'run.csv', 'sha256': 'cd'}]}]})
    stages = ladder(model)
    assert [name for name, _ in stages] == ['two-stage + stress_dependence', '+ payload_error']
    assert [e.id for e in stages[0][1].effects] == ['stress_dependence']
    assert stages[1][1] is model
    assert bench_effects({'extended': [
        {'effects': ['a'], 'data': []}, {'effects': ['b'], 'kind': 'bench', 'data': []},
        {'effects': ['c'], 'kind': 'arm', 'data': []}]}) == {'a', 'b'}
    assert bench_effects({'extended': [{'effects': ['a'], 'data': [{'sha256': ''}]}],
                          'length': {'sha256': ''}}) == set()


def test_several_recordings_are_one_comparison():
    parts = [run(lambda t, v, up: 0.0), run(lambda t, v, up: 0.05, seed=1)]
    comparison = compare(FakeModel(), parts)
    assert comparison.rows == 12000
    assert len(comparison.by_trial) == 4
    assert comparison.by_trial[3]['model'].mean_abs == pytest.approx(0.05, rel=0.01)
    assert any(r.signal == 'trial_number' and r.low == 2 for r in comparison.where)


def test_a_load_that_is_constant_in_each_recording_is_a_signal_of_all():
    def bench(load, error):
        drive = np.tile(np.linspace(0, 6, 30), 4)
        return Measurement.from_columns({'voltage': drive, 'force': np.full(120, load),
                                         'length': (2 - 0.1 * drive + error)}, origin=METRES)
    comparison = compare(FakeModel(), [bench(1.0, 0.0), bench(5.0, 0.01)])
    assert set(comparison.signals['force']) == {1.0, 5.0}
    assert any(r.signal == 'force' and r.low == 5.0 for r in comparison.where)


def test_a_temperature_that_does_not_change_is_no_signal():
    """Neither in one recording, where it has the noise of its sensor, nor over several."""
    noise = 22.0 + 0.05 * np.random.default_rng(0).standard_normal(6000)
    noisy = run(lambda t, v, up: 0.03 * (t > 600), extra={'ambient_temperature': noise})
    still = run(lambda t, v, up: 0.03, extra={'ambient_temperature': np.full(6000, 22.0)})
    for recordings in ([noisy], [still, still], [noisy, still]):
        assert 'ambient_temperature' not in compare(FakeModel(), recordings).signals
    warm = run(lambda t, v, up: 0.03, extra={'ambient_temperature': np.full(6000, 26.0)})
    assert 'ambient_temperature' in compare(FakeModel(), [still, warm]).signals


def test_measurements_of_two_quantities_are_refused():
    force = Measurement.from_columns({'voltage': [0, 1], 'force': [0, 1]})
    with pytest.raises(MeasurementError, match='differ in their response .angle, force.'):
        compare(FakeModel(), [run(lambda t, v, up: 0.0), force])
    with pytest.raises(MeasurementError, match='no measurement'):
        compare(FakeModel(), [])


@pytest.mark.parametrize('factor, words', [
    (1000, 'is one of them in another unit'), (1e-3, 'is one of them in another unit'),
    (1.5, 'is an extrapolation'), (1.0, None)])
def test_a_drive_outside_the_identified_range_is_warned_about(factor, words):
    drive = factor * np.linspace(0, 6, 50)
    measured = Measurement.from_columns(
        {'voltage': drive, 'force': 2 - 0.1 * drive},
        origin={'voltage': Column('voltage', 'voltage', confirmed=True)})
    notes = [n for n in compare(FakeModel(), [measured]).warnings if 'identified' in n]
    assert [words in note for note in notes] == ([True] if words else [])


@pytest.mark.parametrize('change, seen', [(0.005, False), (0.02, True)])
def test_a_recorded_signal_has_to_vary_by_more_than_its_noise(change, seen):
    """A supply of 12 V that wanders by 60 mV is constant; a drive is what it is."""
    values = 12.0 * (1.0 + change * np.linspace(0.0, 1.0, 50))
    assert varies(values, 'supply_voltage') == seen
    assert varies(values) and not varies(np.full(50, 12.0))
    assert varies(np.array([22.0, 22.3]), 'ambient_temperature') is False
    assert varies(np.array([2.0, 2.6]), 'ambient_temperature') is True


def test_one_row_and_a_constant_response_are_compared():
    one = Measurement.from_columns({'time': [0.0], 'voltage': [1.0], 'angle': [1.8]})
    comparison = compare(FakeModel(), [one])
    assert comparison.rows == 1
    json.dumps(comparison.to_dict(), allow_nan=False)
    assert '-' in comparison.to_text()


def test_a_model_without_a_linear_part():
    comparison = compare(FakeModel(linear=None), [run(lambda t, v, up: 0.0)])
    assert comparison.linear is None and comparison.to_dict()['linear'] is None
    assert 'linear' not in comparison.to_text()


def test_the_interval_of_a_mean_allows_for_memory():
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(200):
        noise = np.convolve(rng.standard_normal(2100), np.ones(50) / 50, 'valid')[:2000]
        block = blocks_of(noise, np.zeros(2000, dtype=int))
        half = half_width(noise - noise.mean(), np.zeros(2000, dtype=int), block,
                          np.array([2000]))[0]
        hits += abs(noise.mean()) < half
    assert 175 <= hits <= 200
    naive = 1.96 * noise.std() / np.sqrt(2000)
    assert half > 3 * naive


def test_blocks_never_span_trials():
    trial = np.repeat([0, 1, 2], [40, 3, 50])
    block = blocks_of(np.sin(np.arange(93) / 20), trial)
    assert all(len(set(trial[block == b])) == 1 for b in set(block))
    assert list(np.unique(np.diff(block))) == [0, 1]


def test_memory_and_correlogram():
    rng = np.random.default_rng(3)
    assert memory(rng.standard_normal(5000)) < 1.5
    smooth = np.convolve(rng.standard_normal(6000), np.ones(20) / 20, 'valid')
    assert 12 < memory(smooth) < 30
    values = correlogram(smooth, most=10)
    np.testing.assert_allclose(values, 1 - np.arange(11) / 20, atol=0.08)
    assert list(correlogram(np.ones(8), most=2)) == [1, 0, 0]


def test_bins_hold_all_rows_and_their_means():
    rng = np.random.default_rng(0)
    values = rng.uniform(0, 1, 1000)
    residual = values ** 2
    bins = binned('x', values, residual, np.arange(1000) // 10)
    assert bins.rows.sum() == 1000 and len(bins.rows) == 12
    assert np.sum(bins.rows * bins.mean) == pytest.approx(residual.sum())
    assert np.all(bins.low[1:] > bins.high[:-1])
    np.testing.assert_allclose(bins.mean, bins.centre ** 2, atol=0.01)
    few = binned('x', np.array([1.0, 1, 2, 5]), np.array([1.0, 3, 5, 7]), np.arange(4))
    assert list(few.low) == [1, 2, 5] and list(few.mean) == [2, 5, 7]
    assert np.isinf(few.half[1])


def test_direction_and_last_step_ignore_ripple():
    voltage = np.array([0, 0, 5, 5.001, 4.999, 5, 2, 2.001, 2, 6])
    measured = Measurement.from_columns(
        {'time': np.arange(10.0), 'voltage': voltage, 'angle': np.arange(10.0) / 2})
    last, jump = changes(measured)
    assert list(last) == [0, 0, 2, 2, 2, 2, 6, 6, 6, 9]
    np.testing.assert_allclose(jump, [0, 0, 5, 5, 5, 5, -3, -3, -3, 4])


def test_signals_are_those_that_vary():
    measured = run(lambda t, v, up: 0.0, extra={
        'ambient_temperature': np.linspace(20, 24, 6000), 'supply_voltage': np.full(6000, 12.0),
        'fan': np.arange(6000.0)})
    found = signals_of(measured, measured.column('angle'))
    assert {'voltage', 'predicted_angle', 'direction', 'time', 'elapsed_time', 'voltage_rate',
            'cycle', 'ambient_temperature'} == set(found)
    np.testing.assert_allclose(
        found['voltage_rate'][1:2900], np.diff(measured.column('voltage'))[:2899] * 5, rtol=1e-6)
    assert found['elapsed_time'][-1] == pytest.approx(1199.8 - 0.2)
    travel = np.sum(np.abs(np.diff(measured.column('voltage')))) / 12
    assert found['cycle'][-1] == pytest.approx(travel, rel=1e-3)


@pytest.mark.parametrize('value, text', [
    (0, '0'), (1234.5, '1230'), (12.345, '12.3'), (0.98765, '0.988'), (0.001234, '0.00123'),
    (1.5e-8, '1.5e-08'), (-2, '-2.00')])
def test_numbers_for_people(value, text):
    assert number(value) == text


def test_places_in_words():
    assert placed('direction', -1.0, -1.0) == 'while the drive falls'
    assert placed('trial', 2.0, 3.0) == 'in trials 2 to 3'
    assert placed('angle', 0.0, np.pi) == 'where angle is 0 to 180 deg'
    assert placed('voltage_rate', -1.0, 2.0) == 'where voltage rate is -1.00 to 2.00 V/s'
