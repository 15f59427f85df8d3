# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Creep in proportion to the load: its course, where it is tried, and the laboratory's cord."""

import math

import numpy as np
import pytest

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.effects import catalogue, Inputs, Surroundings
from hysteresis_ros.laboratory.hidden_soft import with_effects
from hysteresis_ros.laboratory.mckibben import McKibbenMaterial
from hysteresis_ros.laboratory.scp import ScpMaterial
from hysteresis_ros.laboratory.soft_bench import SoftBench
from hysteresis_ros.laboratory.tendon import Tendon
from hysteresis_ros.measurements import Measurement
from model_support import arm_run, bicep_model, bladder, wandering_voltage

BLADDER = Surroundings(0.3, 100.0, 3e5, 0.06, drive='pressure')


def creeping(surroundings=BLADDER, **values):
    """Return the effect with values."""
    return catalogue()['viscoelastic_creep'](surroundings, **values)


def rows(load, dt):
    """Return inputs of one trial under a load that was recorded."""
    dt = np.asarray(dt, dtype=float)
    none = np.full(len(dt), np.nan)
    return Inputs(np.cumsum(dt), np.cumsum(dt), dt, none, none, np.zeros(len(dt)),
                  load=np.asarray(load, dtype=float))


def course(made, inputs, surroundings=BLADDER):
    """Return the offsets [m]; the stroke stays as it is."""
    drive = np.zeros(len(inputs.dt))
    offset, factor = made.drift(drive, drive, inputs, surroundings)
    assert np.all(factor == 1.0)
    return offset


def bench(model, name='pressure', highest=3e5):
    """Return settled rows of a model under three loads."""
    rng = np.random.default_rng(4)
    loads = np.repeat([50.0, 100.0, 150.0], 40)
    columns = {'trial': np.repeat([0.0, 1.0, 2.0], 40), 'force': loads,
               name: rng.uniform(0.0, highest, 120), 'length': np.zeros(120)}
    run = Measurement.from_columns(columns)
    return Measurement.from_columns({**columns, 'length': model.predict(run)})


def test_a_constant_load_creeps_with_the_logarithm_of_time():
    made = creeping(J=0.5, t0=2.0)
    time = np.geomspace(2.0, 1500.0, 60)
    crept = course(made, rows(np.full(60, 150.0), np.diff(time, prepend=0.0)))
    expected = 0.005 * 0.3 * 1.5 * np.log1p(time / 2.0)
    assert np.max(np.abs(crept - expected)) < 0.09 * expected[-1]
    assert np.all(np.diff(crept) > 0.0)


def test_elongations_of_loads_add_up_and_recover():
    """Boltzmann: the course under a load that comes and goes is that of both steps."""
    dt = np.full(60, 10.0)
    on, later = np.full(60, 80.0), np.where(np.arange(60) < 30, 0.0, 80.0)
    made = creeping(J=0.5, t0=5.0)
    both = course(made, rows(on - later, dt))
    np.testing.assert_allclose(both, course(made, rows(on, dt)) - course(made, rows(later, dt)),
                               atol=1e-15)
    assert 0.0 < both[-1] < 0.5 * both[29] and np.all(np.diff(both[30:]) < 0.0)


def test_row_by_row_is_the_same_and_the_past_can_be_saved():
    rng = np.random.default_rng(2)
    inputs = rows(rng.uniform(0.0, 200.0, 30), rng.uniform(0.1, 60.0, 30))
    made, other = creeping(J=0.5, t0=5.0), creeping(J=0.5, t0=5.0)
    expected = course(made, inputs)
    made.start()
    for number in range(30):
        row = Inputs(*(float(column[number]) if np.ndim(column) else column for column in inputs))
        if number == 15:
            other.restore(made.save())
            assert other.advance(0.0, 0.0, row, BLADDER)[0] == pytest.approx(expected[15])
        assert made.advance(0.0, 0.0, row, BLADDER) == (pytest.approx(expected[number]), 1.0)


def test_an_arm_creeps_as_under_the_mean_load():
    model = bicep_model()
    made = creeping(model.surroundings, J=0.1, t0=3.0)
    run = arm_run(np.full(40, 3.0), 30.0)
    angles = model.with_effects([made]).predict(run)
    assert angles[-1] - angles[0] > math.radians(1.0) and np.all(np.diff(angles) > 0.0)
    inputs = rows(np.full(40, np.nan), np.full(40, 30.0))
    known = inputs._replace(load=np.full(40, model.surroundings.load))
    np.testing.assert_array_equal(course(made, inputs, model.surroundings),
                                  course(made, known, model.surroundings))


def test_it_is_tried_on_wires_only_where_it_is_named():
    wire, name = bicep_model(), 'viscoelastic_creep'
    run = Measurement.from_columns({**bench(wire, 'voltage', 6.0).columns})
    for model, table, tried in ((wire, run, False), (bladder(), bench(bladder()), True),
                                (wire, arm_run(wandering_voltage(60)), False)):
        names, unobservable = observable(problem_for(model, [table]))
        assert (name in names) == tried and name not in unobservable
        assert observable(problem_for(model, [table], [name, 'latency']))[0][:1] == [name]
    assert not catalogue()[name].available(BLADDER._replace(load=0.0))


def named(effect, **values):
    """Return the diagnosis of a bench whose muscle has an effect."""
    arm = bladder([catalogue()[effect](bladder().surroundings, **values)])
    return diagnose(bladder(), [bench(arm)], ['viscoelastic_creep', 'series_compliance', 'fatigue'])


def test_it_is_named_with_its_size():
    found = named('viscoelastic_creep', J=0.6, t0=10.0)
    assert (found.verdict, found.missing, found.alternatives) == (
        'missing', ['viscoelastic_creep'], [[]])
    assert found.effects[0].J == pytest.approx(0.6, rel=0.2)


@pytest.mark.parametrize('effect, values', [('series_compliance', {'compliance': 0.3}),
                                            ('fatigue', {'b': 0.4, 'kept': 0.0})])
def test_what_gives_way_at_once_or_with_use_is_not_taken_for_it(effect, values):
    assert 'viscoelastic_creep' not in named(effect, **values).missing


def test_the_laboratorys_cord_stretches_with_a_power_of_time():
    cord = Tendon(compliance=1e-5, exponent=0.2)
    assert cord.elongation(100.0, 60.0) == pytest.approx(1e-3)
    assert cord.elongation(50.0, 60.0 * 32.0) == pytest.approx(1e-3)
    assert Tendon().elongation(100.0, 60.0) == 0.0


@pytest.mark.parametrize('kind, load', [(McKibbenMaterial, 100.0), (ScpMaterial, 2.0)])
def test_the_laboratorys_bench_reads_muscle_and_cord(kind, load):
    material, cord = with_effects(kind(), {'viscoelastic_creep': 1.0}, 0)
    assert material == kind() and cord.compliance > 0.0
    plain, hung = (SoftBench(material, 1, one).length_trial(np.zeros(40), load)
                   for one in (Tendon(), cord))
    times = material.hold * (3.0 + np.arange(1, 41))
    expected = [cord.elongation(load, time) for time in times]
    np.testing.assert_allclose(hung - plain, expected, atol=9e-5)
