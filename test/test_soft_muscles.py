# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""McKibben and super-coiled polymer muscles against numbers of their sources."""

import dataclasses
import math
import re

from hysteresis_ros.cli.main import main
from hysteresis_ros.comparison.compare import compare
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory import experiment_tables, Plant, SOFT_MUSCLES
from hysteresis_ros.laboratory.heat import ROOM
from hysteresis_ros.laboratory.mckibben import McKibbenMaterial
from hysteresis_ros.laboratory.plant import bench_of
from hysteresis_ros.laboratory.scp import ScpMaterial
from hysteresis_ros.laboratory.soft_bench import SoftBench
from hysteresis_ros.measurements import Measurement
import numpy as np
import pytest

# Steps that go through a whole loop, over the highest drive.
LOOP = np.concatenate((np.linspace(0.0, 1.0, 21), np.linspace(1.0, 0.0, 21)))
LONG = 1e9


def width(readings):
    """Return the largest difference of a loop's two branches over its range."""
    up, down = np.split(readings, 2)
    return np.abs(up - down[::-1]).max() / np.ptp(readings)


def without_time(material):
    """Return the same material without creep."""
    return dataclasses.replace(material, relaxation=0.0)


def test_a_mckibben_muscle_pulls_with_more_than_1000_newtons_at_5_bar():
    """Tondu and Lopez (2000): at the initial length, with an outer radius of 1.5 cm and more."""
    material = McKibbenMaterial()
    assert 1000.0 < material.air_force(5e5, 1.0) - material.friction_limit(5e5, 1.0)
    assert material.air_force(5e5, 1.0) == pytest.approx(2214.0, abs=1.0)
    assert material.air_force(1e5, 0.8) == pytest.approx(0.2 * material.air_force(5e5, 0.8))


def test_an_ideal_mckibben_muscle_stops_at_the_magic_angle():
    """Chou and Hannaford (1996): pi D0^2 P (3 cos^2 - 1) / 4, which ends at 54.74 degrees."""
    material = McKibbenMaterial(end_factor=1.0)
    widest = 2.0 * material.initial_radius / math.sin(material.braid_angle)
    for stretch in (1.0, 0.8, 0.65):
        cosine = stretch * math.cos(material.braid_angle)
        assert material.air_force(2e5, stretch) == pytest.approx(
            math.pi * widest ** 2 * 2e5 / 4.0 * (3.0 * cosine ** 2 - 1.0))
    muscle = dataclasses.replace(material, friction=0.0, shear_modulus=1.0).muscle()
    muscle.hang(5e5, LONG, 0.0)
    stretch = 1.0 + muscle.elongation / material.initial_length
    angle = math.degrees(math.acos(stretch * math.cos(material.braid_angle)))
    assert angle == pytest.approx(54.7356, abs=0.01)


def test_the_braid_rubs_in_proportion_to_pressure_and_contact():
    """After more than the longest breakaway the two directions differ by 2 f S P."""
    material = without_time(McKibbenMaterial())
    assert material.friction_limit(1e5, 1.0) == pytest.approx(
        0.015 * 2.0 * math.pi * 0.01 * 0.3 * 1e5)
    loads = np.arange(20.0, 421.0, 4.0)
    for pressure in (1e5, 2e5):
        muscle, tensions = material.muscle(), []
        muscle.hang(pressure, LONG, 500.0)
        muscle.hang(pressure, LONG, loads[0])
        for way in (loads, loads[::-1]):
            lengths = []
            for load in way:
                muscle.hang(pressure, LONG, load)
                lengths.append(muscle.elongation)
            order = np.argsort(lengths)
            there = -0.05
            tensions.append(np.interp(there, np.array(lengths)[order], way[order]))
        limit = material.friction_limit(pressure, 1.0 + there / material.initial_length)
        assert tensions[0] - tensions[1] == pytest.approx(2.0 * limit, rel=0.02)


def test_the_bladder_pulls_with_the_slope_of_its_energy():
    """An incompressible tube that follows the braid; no force as made, a push when shortened."""
    material = McKibbenMaterial()

    def energy(stretch):
        wide = (1.0 - (stretch * math.cos(material.braid_angle)) ** 2) / math.sin(
            material.braid_angle) ** 2
        volume = (2.0 * math.pi * material.initial_radius * material.bladder_thickness
                  * material.initial_length)
        return volume * material.shear_modulus / 2.0 * (
            stretch ** 2 + wide + 1.0 / (stretch ** 2 * wide) - 3.0)
    for stretch in (0.7, 0.9, 1.0, 1.03):
        slope = (energy(stretch + 1e-6) - energy(stretch - 1e-6)) / (2e-6 * 0.3)
        assert material.bladder_force(stretch) == pytest.approx(slope, rel=1e-5, abs=1e-4)
    assert material.bladder_force(0.75) < -20.0 and material.bladder_force(1.03) > 200.0


def test_the_valve_fills_and_vents_with_its_own_time_constants():
    muscle = McKibbenMaterial(filling_time=0.2, venting_time=0.5).muscle()
    muscle.hang(1e5, 0.2, 50.0)
    assert muscle.pressure == pytest.approx(1e5 * (1.0 - math.exp(-1.0)))
    muscle.hang(1e5, 60.0, 50.0)
    muscle.hang(0.0, 0.5, 50.0)
    assert muscle.pressure == pytest.approx(1e5 * math.exp(-1.0))


@pytest.mark.parametrize('kind, drive, load', [
    (McKibbenMaterial, 2e5, 200.0), (ScpMaterial, 0.0, 2.0)])
def test_muscles_creep_with_the_logarithm_of_time(kind, drive, load):
    """As long a way from 3 to 30 s as from 30 to 300 s; none without relaxation."""
    ways = {}
    for material in (kind(friction=0.0), without_time(kind(friction=0.0))):
        muscle = material.muscle()
        lengths, time = [], 0.0
        for end in np.geomspace(0.03, 300.0, 81):
            muscle.hang(drive, end - time, load)
            time = end
            lengths.append(muscle.elongation)
        ways[material.relaxation] = lengths[60] - lengths[40], lengths[80] - lengths[60]
    first, second = ways[kind().relaxation]
    assert second == pytest.approx(first, rel=0.2)
    assert abs(first) > 1e-4
    assert ways[0.0] == pytest.approx((0.0, 0.0), abs=1e-6)


def test_a_polymer_muscle_is_a_spring_with_a_thermal_force():
    """Yip and Niemeyer (2017): F = k x + c (T - T0), C dT/dt = V^2 / R - lambda (T - T0)."""
    material = ScpMaterial(friction=0.0, relaxation=0.0)
    muscle = material.muscle()
    for drive, load in ((0.0, 1.0), (6.0, 1.0), (4.0, 3.0)):
        muscle.hang(drive, LONG, load)
        warmer = drive ** 2 / (material.resistance * material.heat_loss)
        assert muscle.temperature == pytest.approx(ROOM + warmer)
        assert load == pytest.approx(
            material.stiffness * muscle.elongation + material.thermal_force * warmer, abs=1e-6)
    muscle.reset()
    muscle.hang(6.0, material.heat_capacity / material.heat_loss, 1.0)
    assert muscle.temperature - ROOM == pytest.approx(
        (1.0 - math.exp(-1.0)) * 36.0 / (material.resistance * material.heat_loss))


def test_damping_slows_a_polymer_muscle_down():
    """After b / k under a new load it has gone 1 - 1 / e of the way."""
    material = ScpMaterial(friction=0.0, relaxation=0.0)
    muscle = material.muscle()
    steps = 1000
    for _ in range(steps):
        muscle.hang(0.0, material.damping / material.stiffness / steps, 1.5)
    assert muscle.elongation == pytest.approx(
        (1.0 - math.exp(-1.0)) * 1.5 / material.stiffness, rel=2e-3)


def test_a_polymer_muscle_differs_by_up_to_30_percent_on_heating_and_cooling():
    """Zhang and others (2017); between clamps the loop is mild and grows with the pretension."""
    bench = SoftBench(ScpMaterial())
    drives = 6.0 * LOOP
    widths = [width(bench.length_trial(drives, load)) for load in ScpMaterial.loads]
    assert widths[-1] == pytest.approx(0.30, abs=0.05) and np.all(np.diff(widths) > 0.0)
    assert width(bench.force_trial(drives)) < 0.03


def test_clamped_loops_of_a_polymer_muscle_grow_with_the_pretension(monkeypatch):
    """Fig. 10: the hysteresis of the force is mild, its size depends on the pretension."""
    widths = []
    for pretension in (0.5, 3.0):
        monkeypatch.setattr(ScpMaterial, 'pretension', pretension)
        widths.append(width(SoftBench(ScpMaterial(relaxation=0.0)).force_trial(6.0 * LOOP)))
    assert widths[0] < widths[1] < 0.1


def test_the_force_of_a_clamped_mckibben_muscle_is_nearly_a_line():
    """Fig. 10: force and pressure are about proportional; lengths have a wide loop."""
    bench = SoftBench(McKibbenMaterial.specimen(np.random.default_rng(4)))
    drives = 3e5 * LOOP
    force = bench.force_trial(drives)
    slope, offset = np.polyfit(drives, force, 1)
    assert np.abs(force - slope * drives - offset).max() < 0.02 * np.ptp(force)
    assert 0.1 < width(bench.length_trial(drives, 100.0)) < 0.25


def test_the_model_is_identified_on_a_mckibben_muscle():
    """Mean error of the lengths, in percent, at most as the results page says."""
    tables = experiment_tables('bench', seed=11, muscle='mckibben')
    force, length = (Measurement.from_columns(tables[name])
                     for name in ('force.csv', 'length.csv'))
    found = identify(length, force, force_trials=(0,), length_trials=(0, 1, 2, 3))
    assert found.model.drive == 'pressure' and found.model.sign == -1
    verified = found.model.metrics['length']['verification']
    assert 1.0 < verified['model']['mean_percent'] < 3.5
    assert 2.0 * verified['model']['mean_percent'] < verified['linear']['mean_percent']
    assert found.model.metrics['force']['verification']['model']['mean_percent'] < 0.5
    compared = compare(found.model, [length]).to_dict()
    assert compared['quantity'] == 'length'
    assert compared['model']['mean_percent'] < 3.5


def test_table_1_of_a_polymer_muscle(capsys):
    """Errors at most as the results page says; neither an arm nor numbers of the paper."""
    assert main(['table1', '--muscle', 'scp', '--seeds', '1', '--first-seed', '11']) == 0
    printed = capsys.readouterr().out
    assert 'specimens of the laboratory (scp)' in printed
    assert 'the paper, ' not in printed and 'arm,' not in printed
    rows = {line[:18]: [float(word) for word in re.findall(r'([0-9.]+) \(', line)]
            for line in printed.splitlines() if line.startswith(('F-q', 'L-q'))}
    assert len(rows) == 6
    for name, (two_stage, linear) in rows.items():
        assert 0.0 < two_stage < 1.0 and 3.0 * two_stage < linear, name


@pytest.mark.parametrize('muscle', SOFT_MUSCLES)
def test_specimens_differ_and_seeds_repeat(muscle):
    drives = SOFT_MUSCLES[muscle].highest_drive * np.array([0.0, 0.5, 1.0, 0.3])
    first, again, other = (bench_of(seed, muscle=muscle).force_trial(drives)
                           for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.ptp(first - other) > 0.005 * np.ptp(first)


def test_simulate_writes_pressures_of_a_mckibben_muscle(tmp_path, capsys):
    """In Pa; without the geometry of an arm that it does not drive."""
    assert main(['simulate', 'bench', '-o', f'{tmp_path}/m', '--muscle', 'mckibben']) == 0
    assert len(capsys.readouterr().out.split()) == 2
    header, *rows = (tmp_path / 'm' / 'length.csv').read_text().split()
    assert header == 'trial,step,pressure,force,length'
    pressures = [float(row.split(',')[2]) for row in rows]
    assert min(pressures) == 0.0 and max(pressures) == 3e5


def test_what_other_muscles_cannot_is_refused():
    with pytest.raises(ParameterError, match='scp muscle is on the bench only.*grains, brinson'):
        experiment_tables('arm-steps', muscle='scp')
    with pytest.raises(ParameterError, match='mckibben muscle cannot have creep'):
        experiment_tables('bench', {'creep': 1.0}, muscle='mckibben')
    with pytest.raises(ParameterError, match='tanaka, mckibben, scp'):
        experiment_tables('bench', muscle='auricchio')
    with pytest.raises(ParameterError, match='on the bench only'):
        Plant(0, muscle='mckibben')
