# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How benchmarks are found and joined, and that all of them run; not what they measure."""

import json
import math
import os
import subprocess
import sys

from benchmark.__main__ import discover, in_own_process, main, merge
import pytest

from hysteresis_ros.errors import HysteresisError


def test_results_are_joined_in_order():
    """One flat mapping of numbers."""
    results = {}
    merge(results, {'step_us': 1})
    merge(results, {'error_percent': 0.25})
    assert list(results.items()) == [('step_us', 1.0), ('error_percent', 0.25)]


def test_a_name_stands_for_one_number():
    """Two benchmarks cannot overwrite each other."""
    with pytest.raises(HysteresisError, match='step_us is measured twice'):
        merge({'step_us': 1.0}, {'step_us': 2.0})


@pytest.mark.parametrize('value', [math.nan, math.inf])
def test_a_number_has_to_be_finite(value):
    """JSON knows neither."""
    with pytest.raises(HysteresisError, match='finite'):
        merge({}, {'step_us': value})


def test_every_module_offers_a_benchmark():
    """What is named in the way that the page says is found."""
    functions = discover()
    assert functions
    assert all(function.__name__.endswith('_benchmarks') for function in functions)


def here(function, quick):
    """Measure in this process."""
    return function(quick)


def test_a_benchmark_has_a_process_of_its_own(tmp_path, monkeypatch, capfd):
    """With nothing imported but what it needs; one that fails is named."""
    (tmp_path / 'measured.py').write_text(
        'import sys\n'
        'def sizes_benchmarks(quick):\n'
        '    print("on the way")\n'
        '    return {"quick": float(quick), "rclpy": float("rclpy" in sys.modules)}\n'
        'def broken_benchmarks(quick):\n'
        '    raise ValueError("it broke")\n')
    monkeypatch.setenv('PYTHONPATH', str(tmp_path), prepend=os.pathsep)
    monkeypatch.syspath_prepend(tmp_path)
    import measured
    assert in_own_process(measured.sizes_benchmarks, True) == {'quick': 1.0, 'rclpy': 0.0}
    with pytest.raises(HysteresisError, match=r'measured\.broken_benchmarks ended with 1'):
        in_own_process(measured.broken_benchmarks, False)
    assert 'it broke' in capfd.readouterr().err


@pytest.mark.slow
@pytest.mark.long
def test_every_benchmark_runs(root, tmp_path):
    """The quick form measures the same names, but for those of the long diagnoses."""
    pytest.importorskip('rclpy')
    path = tmp_path / 'benchmark.json'
    done = subprocess.run([sys.executable, '-m', 'benchmark', '--quick', str(path)], cwd=root,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    content = json.loads(path.read_text(encoding='utf-8'))
    assert all(isinstance(value, (int, float)) and math.isfinite(value)
               for value in content.values())
    for name in ('arm_settled_row_over_reference_ratio', 'arm_inertia_row_over_reference_ratio',
                 'two_stage_forward_batch_over_dense_grid_ratio', 'controller_setpoint_us',
                 'controller_setpoint_p99_over_median_ratio', 'compensator_node_warm_start_s',
                 'compare_240_rows_command_warm_start_s', 'identify_bench_s',
                 'node_chain_latency_median_ms', 'endurance_heated_ratio',
                 'endurance_node_heated_ratio', 'endurance_node_published_count',
                 'monitor_share_of_core_ratio', 'monitor_samples_per_s'):
        assert content[name] > 0.0, name
    # What a root may be off [rad]: its tolerance at rest, and what it adds up to in motion.
    for name, largest in (('settled', 1e-8), ('viscous', 1e-5), ('inertia', 1e-5)):
        assert content[f'arm_{name}_difference_from_reference_rad'] < largest, name
    for name in ('endurance_lost_in_the_bag_count', 'endurance_missed_watchdogs_count',
                 'endurance_node_lost_in_the_bag_count', 'endurance_node_setpoints_lost_count',
                 'endurance_node_missed_watchdogs_count'):
        assert content[name] == 0.0, name


def test_the_file_holds_one_flat_mapping(monkeypatch, tmp_path, capsys):
    """Names to numbers, and the same on the terminal."""
    monkeypatch.setattr('benchmark.__main__.discover', lambda: [lambda _: {'a_us': 2, 'b': 0.5}])
    assert main(str(tmp_path / 'benchmark.json'), measure=here) == 0
    content = json.loads((tmp_path / 'benchmark.json').read_text(encoding='utf-8'))
    assert content == {'a_us': 2.0, 'b': 0.5}
    assert 'a_us' in capsys.readouterr().out


def test_a_failing_benchmark_is_told_in_one_line(monkeypatch, tmp_path, capsys):
    """No file is written, and the exit status says so."""
    monkeypatch.setattr('benchmark.__main__.discover', lambda: [lambda _: {'a': math.nan}])
    assert main(str(tmp_path / 'benchmark.json'), measure=here) == 1
    assert not (tmp_path / 'benchmark.json').exists()
    assert capsys.readouterr().err.count('\n') == 1
