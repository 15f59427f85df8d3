# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue: what it lists, what each effect says of itself, and what a user adds to it."""

from importlib import metadata
import math
import types

import numpy as np
import pytest

from hysteresis_ros.diagnosis.parameters import ParameterVector
from hysteresis_ros.effects import (
    catalogue, DriveEffect, Effect, effect_class, Inputs, MaterialEffect, Parameter, SensorEffect,
    STAGES)
from hysteresis_ros.effects.base import PAPER
from hysteresis_ros.effects.catalogue import ENTRY_POINT_GROUP
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.model import Simulator
from model_support import arm_run, bicep_model, effect_of, STRENGTHS, wandering_voltage

# Stage, a word of what it shows in, a word of what excites it, and what it is confused with.
EXPECTED = {
    'supply_sag': ('electrical', 'V', 'at the wire', {'airflow'}),
    'pwm_dead_zone': ('electrical', 'low V', 'fine steps of the voltage from 0', {'ambient_drift'}),
    'supply_limit': ('electrical', 'high V', 'at the wire', {'end_stop', 'supply_sag'}),
    'measured_supply': ('electrical', 'recorded supply', 'log the supply',
                        {'supply_sag', 'ambient_drift'}),
    'resistance_change': ('electrical', 'middle of the loop', 'current', {'stress_dependence'}),
    'thermal_lag': ('thermal', 'time since a step', 'several rates',
                    {'latency', 'viscous_friction', 'creep'}),
    'heating_cooling_asymmetry': ('thermal', 'sign of dV/dt', 'up and down', {'thermal_lag'}),
    'heat_loss': ('thermal', 'where it begins', 'half of it',
                  {'thermal_lag', 'heating_cooling_asymmetry'}),
    'valve_lag': ('thermal', 'time since a step', 'up and down', {'creep', 'latency'}),
    'latent_heat': ('thermal', 'inside the loop', 'small steps', {'thermal_lag'}),
    'ambient_temperature': ('thermal', 'ambient', 'log the ambient', {'ambient_drift'}),
    'ambient_drift': ('thermal', 'time of day', 'repeat the same loop', {'fatigue', 'creep'}),
    'airflow': ('thermal', 'time constant', 'fan', {'supply_sag'}),
    'stress_dependence': ('material', 'load at the same', 'three or more loads',
                          {'supply_sag', 'series_compliance'}),
    'stress_dependent_strain': ('material', 'cold side', 'three or more loads',
                                {'series_compliance'}),
    'r_phase': ('material', 'shoulder on cooling', 'staircase', {'slack'}),
    'creep': ('material', 'log time', '300 s', {'thermal_lag', 'ambient_drift'}),
    'viscoelastic_creep': ('material', 'time under load', 'half an hour',
                           {'series_compliance', 'fatigue'}),
    'fatigue': ('material', 'cycle count', 'reference loop', {'ambient_drift'}),
    'slack': ('material', 'low force', 'preload', {'r_phase', 'geometry_error'}),
    'series_compliance': ('material', 'force', 'weights', {'payload_error', 'geometry_error'}),
    'transformation_slopes': ('material', "loop's width", 'three or more loads',
                              {'stress_dependence', 'r_phase'}),
    'phase_modulus': ('material', 'cold side', 'four or more loads',
                      {'stress_dependent_strain', 'series_compliance'}),
    'thermal_expansion': ('material', 'both ends', 'a dozen steps',
                          {'series_compliance', 'fatigue'}),
    'formation_memory': ('material', 'heating against cooling', 'change its payload',
                         {'stress_dependent_strain', 'backlash'}),
    'kinetics': ('material', 'small loops', 'to and fro', {'fatigue', 'creep'}),
    'overload': ('material', 'first time', 'step by step',
                 {'slack', 'series_compliance', 'fatigue'}),
    'cold_clamps': ('material', 'full heat', 'stroke of a short wire',
                    {'unequal_muscles', 'airflow', 'supply_sag'}),
    'unequal_muscles': ('material', 'smeared knees', 'one muscle at a time',
                        {'slack', 'geometry_error'}),
    'coulomb_friction': ('mechanism', 'reversals', 'tap', {'backlash'}),
    'cable_friction': ('mechanism', 'in proportion to the load', 'another payload',
                       {'coulomb_friction', 'backlash'}),
    'wire_break': ('mechanism', 'one moment', 'look at the muscles',
                   {'fatigue', 'payload_error', 'slack'}),
    'viscous_friction': ('mechanism', 'dtheta/dt', 'swing', {'thermal_lag', 'latency'}),
    'inertia': ('mechanism', 'ringing', 'pluck', {'viscous_friction'}),
    'payload_error': ('mechanism', 'gravity curve', 'scale', {'frame_tilt', 'supply_sag'}),
    'clamp_mass': ('mechanism', 'theta', 'without a payload', {'geometry_error'}),
    'geometry_error': ('mechanism', 'smooth in theta', 'calliper',
                       {'series_compliance', 'encoder_offset'}),
    'frame_tilt': ('mechanism', 'cos theta', 'spirit level', {'payload_error', 'encoder_offset'}),
    'end_stop': ('mechanism', 'one end of theta', 'into the stop', {'slack', 'supply_limit'}),
    'encoder_offset': ('sensor', 'constant', 'hard stop', {'geometry_error'}),
    'encoder_eccentricity': ('sensor', 'an offset and a scale', 'without its muscles',
                             {'encoder_offset', 'geometry_error'}),
    'encoder_scale': ('sensor', 'a straight line', 'known angle',
                      {'encoder_eccentricity', 'encoder_offset', 'geometry_error'}),
    'backlash': ('sensor', 'reversals', 'by hand', {'coulomb_friction'}),
    'latency': ('sensor', 'dtheta/dt', 'chirp', {'thermal_lag'}),
}

# Effect, parameter: unit and plausible range for a 0.2 mm wire on this arm.
RANGES = {
    ('supply_sag', 'Rs'): ('Ohm', 0.01, 2.0), ('pwm_dead_zone', 'Vd'): ('V', 0.05, 1.5),
    ('supply_limit', 'cut'): ('V', 0.05, 4.0),
    ('measured_supply', 'nominal'): ('V', 3.0, 60.0),
    ('thermal_lag', 'time_constant'): ('s', 0.03, 150.0),
    ('valve_lag', 'filling'): ('s', 0.03, 150.0), ('valve_lag', 'venting'): ('s', 0.03, 150.0),
    ('heat_loss', 'growth'): ('1', 0.05, 1.5),
    ('heating_cooling_asymmetry', 'ratio'): ('1', 0.2, 5.0), ('airflow', 'beta'): ('1', 0.5, 3.0),
    ('viscoelastic_creep', 'J'): ('% of l0', 0.01, 2.0),
    ('thermal_expansion', 'alpha'): ('% of l0', 0.016, 0.325),
    ('creep', 'c'): ('% of l0', 0.01, 0.5), ('slack', 'Ls'): ('mm', 0.1, 5.0),
    ('series_compliance', 'compliance'): ('mm/N', 0.005, 0.65),
    ('formation_memory', 'kept'): ('1', 0.1, 1.0), ('kinetics', 'share'): ('1', 0.1, 1.0),
    ('cold_clamps', 'share'): ('1', 0.005, 0.3),
    ('coulomb_friction', 'tau_c'): ('N m', 0.001, 0.150),
    ('cable_friction', 'mu_phi'): ('1', 0.005, 1.0),
    ('overload', 'Fy'): ('loads', 0.2, 5.0), ('overload', 'compliance'): ('mm/N', 0.1, 20.0),
    ('overload', 'lost'): ('1', 0.03, 0.9), ('overload', 't'): ('s', 1.0, 1e5),
    ('wire_break', 'time'): ('s', 1.0, 1e5),
    ('viscous_friction', 'b'): ('N m s/rad', 0.001, 4.0), ('payload_error', 'dm'): ('g', 1., 100.),
    # A clamp of 50 g, too: the base model's own error alone may look like 10 g.
    ('clamp_mass', 'moment'): ('g m', 5.0 * 0.020, 50.0 * 0.050),
    ('geometry_error', 'dx'): ('mm', 0.5, 5.0), ('frame_tilt', 'phi'): ('deg', 1.0, 25.0),
    ('encoder_eccentricity', 'e'): ('deg', 0.2, 10.0), ('encoder_scale', 'k'): ('1', 0.25, 4.0),
    ('encoder_offset', 'offset'): ('deg', 0.2, 15.0), ('backlash', 'B'): ('deg', 0.2, 12.0),
    ('latency', 'delay'): ('s', 0.005, 5.0),
}


def test_catalogue_holds_every_effect_in_the_order_of_the_stages():
    assert set(catalogue()) == set(EXPECTED)
    stages = [STAGES.index(effect.stage) for effect in catalogue().values()]
    assert stages == sorted(stages)


@pytest.mark.parametrize('name', EXPECTED)
def test_effect_says_what_it_is(name):
    stage, shows_in, experiment, confused_with = EXPECTED[name]
    effect = catalogue()[name]
    assert effect.stage == stage
    assert shows_in in effect.shows_in
    assert experiment in effect.experiment
    assert set(effect.confused_with) == confused_with
    assert effect.sentence.endswith('.') and effect.equation and effect.source


@pytest.mark.parametrize('effect', EXPECTED)
@pytest.mark.parametrize('muscle', [None, bicep_model(mean_load=PAPER.load).surroundings])
def test_what_is_plausible_stays_so_where_estimates_may_be_off(effect, muscle):
    """An end below zero lies further away by the share, too: not nearer."""
    for parameter in catalogue()[effect](muscle).parameters:
        for value in parameter.choices or (parameter.low, parameter.high):
            assert parameter.plausible(value) and parameter.plausible(value, 0.15), parameter.name


@pytest.mark.parametrize('effect, name', RANGES)
def test_parameter_has_its_unit_and_plausible_range(effect, name):
    model = bicep_model(mean_load=PAPER.load)
    parameter = {p.name: p for p in effect_of(model, effect).parameters}[name]
    unit, low, high = RANGES[effect, name]
    assert (parameter.unit, parameter.low, parameter.high) == (
        unit, pytest.approx(low), pytest.approx(high))
    assert parameter.plausible(low * 1.01) and parameter.plausible(high * 0.99)
    assert not parameter.plausible(high * 1.01) and not parameter.plausible(low * 0.99)
    assert parameter.plausible(-high * 0.99) == parameter.both_signs


@pytest.mark.parametrize('name', EXPECTED)
def test_starts_and_neutral_value_lie_within_the_bounds_of_a_fit(name):
    for parameter in effect_of(bicep_model(), name).parameters:
        low, high = parameter.bounds
        assert low < high and parameter.description
        for start in parameter.starts:
            assert low <= start <= high
        if not parameter.log and not parameter.choices:
            assert low <= parameter.neutral <= high


@pytest.mark.parametrize('name', EXPECTED)
def test_neutral_values_are_no_effect_at_all(name):
    model = bicep_model()
    voltage = wandering_voltage(60)
    for run in (arm_run(voltage, 0.1, ambient_temperature=np.full(60, 30.0),
                        supply_voltage=np.full(60, 10.0)),
                arm_run(voltage, 30.0)):
        neutral = catalogue()[name](model.surroundings)
        np.testing.assert_array_equal(
            Simulator(model, run).run([neutral]), Simulator(model, run).run([]))


@pytest.mark.parametrize('name', EXPECTED)
def test_every_effect_changes_what_an_arm_run_shows(name):
    model = bicep_model()
    run = arm_run(np.tile(wandering_voltage(60), 2), 0.5,
                  ambient_temperature=np.linspace(20.0, 30.0, 120),
                  supply_voltage=np.linspace(12.0, 10.0, 120))
    simulator = Simulator(model, run)
    # A load changes the strain that is kept only where it changes any.
    others = [effect_of(model, 'stress_dependent_strain')] if name == 'formation_memory' else []
    change = simulator.run([*others, effect_of(model, name)]) - simulator.run(others)
    assert np.all(np.isfinite(change))
    assert np.max(np.abs(change)) > math.radians(0.01)


def test_implausible_values_are_named_but_neutral_ones_are_not():
    model = bicep_model()
    assert effect_of(model, 'fatigue', a=0.4).implausible() == ['a']
    assert effect_of(model, 'fatigue', a=-0.4).implausible() == ['a']
    assert effect_of(model, 'encoder_offset', offset=-3.0).implausible() == []
    assert effect_of(model, 'end_stop', stop=1.0, side=0.5, stiffness=1.0).implausible() == ['side']


@pytest.mark.parametrize('values, named', [
    ({'dx': 0.1, 'da': 0.0, 'dz': 2.0}, []), ({'dx': 0.3, 'da': 0.3, 'dz': -0.3}, []),
    ({'dx': 0.1, 'da': 0.2, 'dz': -0.1}, ['dx', 'da', 'dz']), ({'dx': 0.1, 'dz': 9.0}, ['dz'])])
def test_of_parameters_that_are_one_size_together_one_has_to_be_large(values, named):
    """A clamp that is where it should be says nothing against an anchor that is not."""
    found = effect_of(bicep_model(), 'geometry_error', **values)
    assert found.implausible(slack=0.15) == named


def test_a_drift_that_begins_flat_is_a_drift():
    drift = effect_of(bicep_model(), 'ambient_drift', rate=0.01, curvature=2.0)
    assert drift.implausible(duration=600.0) == []


def test_a_small_rate_adds_up_in_a_long_recording():
    """3 K in two hours: 0.025 V^2 in ten minutes, and a bend."""
    drift = effect_of(bicep_model(), 'ambient_drift', rate=0.025, curvature=0.006)
    assert drift.implausible(duration=7200.0) == []
    assert drift.implausible(duration=600.0) == ['rate', 'curvature']
    # Of it a tenth is no drift in two hours, either.
    small = drift.with_values(rate=0.0025, curvature=0.00006)
    assert small.implausible(duration=7200.0) == ['rate', 'curvature']
    still = drift.with_values(rate=0.0, curvature=20.0)
    assert still.implausible(duration=7200.0) == ['total']
    # What takes minutes may be as fast as it likes, as long as it comes to no more than 20 K.
    assert still.implausible(duration=360.0) == []


def test_a_room_that_is_heated_in_turns_is_a_drift():
    """Whatever its mean does; and what belongs to the wave is fitted only with it."""
    drift = effect_of(bicep_model(), 'ambient_drift', offset=0.0, rate=0.0, curvature=0.0,
                      sine=0.8, cosine=-0.6, period=1200.0)
    assert drift.implausible(duration=3600.0) == []
    assert drift.total(np.array([0.0, 300.0, 600.0, 1500.0])) == pytest.approx(
        [-0.6, 0.8, 0.6, 0.8])
    steady = drift.with_values(sine=0.0)
    np.testing.assert_array_equal(steady.total(np.arange(5.0)), 0.0)
    assert [len(ParameterVector([one], 'arm')) for one in (drift, steady)] == [6, 3]
    assert 'total' in drift.with_values(sine=5.0).implausible(duration=3600.0)


@pytest.mark.parametrize('values, duration, named', [
    ({'offset': 6.0, 'rate': 9.0, 'curvature': 6.0}, 600.0, ['total']),
    # An end of the recording within the range, and so the start, but not the change between them.
    ({'offset': -6.0, 'rate': 12.0}, 600.0, ['total']),
    ({'rate': 12.0, 'curvature': -8.0}, 600.0, []),
    ({'rate': 4.0}, 600.0, []), ({'rate': 4.0}, 3600.0, ['total']),
    ({'offset': 9.0}, 0.0, ['offset', 'total'])])
def test_a_drift_of_plausible_terms_that_add_up_to_too_much_is_implausible(
        values, duration, named):
    """8 V^2 are 20 K; how much a rate adds depends on how long the recording takes."""
    drift = effect_of(bicep_model(), 'ambient_drift', **values)
    if 'offset' not in named:
        assert Effect.implausible(drift) == []
    assert drift.implausible(duration=duration) == named
    assert drift.implausible(slack=2.0, duration=duration) == []


def test_values_are_read_as_attributes_and_changed_in_a_copy():
    model = bicep_model()
    effect = effect_of(model, 'clamp_mass')
    effect.intervals = {'phi': (0.1, 0.7)}
    other = effect.with_values(phi=1.0)
    assert (other.moment, other.phi, effect.phi) == (0.6, 1.0, 0.4)
    assert other.intervals == {}
    with pytest.raises(AttributeError, match='no attribute'):
        effect.mass


@pytest.mark.parametrize('values, message', [
    ({'mass': 1.0}, "no parameter 'mass'; it has moment, phi"),
    ({'phi': math.nan}, 'phi must be finite')])
def test_wrong_values_are_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        effect_class('clamp_mass')(**values)


def test_unknown_effect_is_refused_with_the_list_of_those_there_are():
    with pytest.raises(ParameterError, match="no effect 'gremlins'; there are supply_sag, pwm"):
        effect_class('gremlins')


def test_what_makes_no_sense_for_a_muscle_is_not_available():
    effects = catalogue()
    current = bicep_model(drive='current').surroundings
    assert not effects['supply_sag'].available(current)
    assert effects['resistance_change'].available(current)
    assert not effects['resistance_change'].available(current._replace(drive='pressure'))
    unloaded = bicep_model(mean_load=0.0, load_name=None).surroundings
    for name in ('stress_dependence', 'stress_dependent_strain', 'series_compliance'):
        assert effects[name].available(current) and not effects[name].available(unloaded)
    for effect in effects.values():
        effect(unloaded)
        effect()
    assert effects['slack'].available(unloaded)


class Hum(DriveEffect):
    """A user's own effect: a hum of the supply."""

    id = 'hum'
    stage = 'electrical'
    sentence = 'The supply adds a constant voltage.'
    equation = 'Ve = V + u'
    source = 'a user'
    shows_in = 'V'
    experiment = 'another supply'
    parameters = (Parameter('u', 'V', 'what is added', 0.1, 1.0, 0.0, (0.2,)),)

    def forward(self, signal, inputs, surroundings):
        """Add it."""
        return signal + self.u

    def inverse(self, signal, inputs, surroundings):
        """Take it off."""
        return signal - self.u


class Drag(SensorEffect):
    """A user's effect with a past, defined by `step` alone."""

    id = 'drag'
    stage = 'sensor'
    sentence = equation = source = shows_in = experiment = 'The pointer follows half way.'
    parameters = (Parameter('share', '1', 'of the way', 0.1, 1.0, 0.0, (0.5,)),)
    memory = ('_last',)

    def start(self):
        """Forget."""
        self._last = None

    def step(self, value, dt):
        """Follow."""
        last = value if self._last is None else self._last
        self._last = value + self.share * (last - value)
        return self._last


class Swelling(MaterialEffect):
    """A user's effect of the material, defined by `drift` alone."""

    id = 'swelling'
    sentence = equation = source = shows_in = experiment = 'It gets longer with time.'
    parameters = (Parameter('rate', 'm/s', 'growth', 1e-6, 1e-3, 0.0, (1e-5,)),)

    def drift(self, drive, drive_squared, inputs, surroundings):
        """Grow."""
        return self.rate * inputs.time, np.ones(len(drive))


class Ratchet(MaterialEffect):
    """A user's effect of the material with a past, defined by `advance` alone."""

    id = 'ratchet'
    sentence = equation = source = shows_in = experiment = 'Each row adds a little.'
    parameters = (Parameter('tooth', 'm', 'per row', 1e-6, 1e-3, 0.0, (1e-5,)),)
    memory = ('_teeth',)

    def start(self):
        """Forget."""
        self._teeth = 0

    def advance(self, drive, drive_squared, inputs, surroundings):
        """Click."""
        self._teeth += 1
        return self.tooth * self._teeth, 1.0


class Scale(SensorEffect):
    """A user's effect of the sensor without a past, defined by `forward` alone."""

    id = 'scale'
    sentence = equation = source = shows_in = experiment = 'It counts too much.'
    parameters = (Parameter('more', '1', 'too much', 0.01, 0.1, 0.0, (0.05,)),)

    def forward(self, response, inputs):
        """Count."""
        return response * (1.0 + self.more)


@pytest.mark.parametrize('effect', [Ratchet(tooth=2e-5), Scale(more=0.03), Drag(share=0.3)])
def test_one_map_of_a_users_effect_is_enough(effect):
    voltage = wandering_voltage(30)
    run = arm_run(voltage, 1.0)
    model = bicep_model().with_effects([effect])
    predicted = model.predict(run)
    assert np.max(np.abs(predicted - bicep_model().predict(run))) > 0.01
    observer = model.observer()
    observer.reset(0.0)
    np.testing.assert_allclose(
        [observer.step(t, v) for t, v in zip(run.time, voltage)], predicted, atol=1e-12)


@pytest.fixture
def install(monkeypatch):
    """Return a function that makes classes look like installed entry points."""
    def install(*effects):
        entries = [types.SimpleNamespace(
            name=getattr(effect, 'id', 'x'), value='user:Effect', load=lambda effect=effect: effect)
            for effect in effects]
        plain = metadata.entry_points
        monkeypatch.setattr(metadata, 'entry_points', lambda **group: (
            entries if group == {'group': ENTRY_POINT_GROUP} else plain(**group)))
        catalogue.cache_clear()
    yield install
    monkeypatch.undo()
    catalogue.cache_clear()


def test_a_users_effect_takes_part_everywhere(install, tmp_path):
    install(Hum, Drag, Swelling)
    names = list(catalogue())
    assert names.index('resistance_change') < names.index('hum') < names.index('thermal_lag')
    assert effect_class('hum') is Hum

    voltage = wandering_voltage(40)
    model = bicep_model()
    model = model.with_effects([Drag(share=0.5), Hum(u=0.3), Swelling(rate=1e-5)])
    plain = bicep_model().predict(arm_run(voltage + 0.3, 1.0))
    hummed = Simulator(model, arm_run(voltage, 1.0)).run([Hum(u=0.3)])
    np.testing.assert_array_equal(hummed, plain)

    model.save(tmp_path / 'model.yaml')
    loaded = type(model).load(tmp_path / 'model.yaml')
    run = arm_run(voltage, 1.0)
    predicted = loaded.predict(run)
    np.testing.assert_array_equal(predicted, model.predict(run))
    observer = loaded.observer()
    observer.reset(0.0)
    np.testing.assert_allclose(
        [observer.step(t, v) for t, v in zip(run.time, voltage)], predicted, atol=1e-12)

    controller = model.with_effects([Hum(u=0.3)]).controller()
    reference = controller.reference(1.5)
    without = bicep_model().controller()
    assert controller.setpoint(*reference).voltage == pytest.approx(
        without.setpoint(*without.reference(1.5)).voltage - 0.3, abs=1e-12)


class Nameless(DriveEffect):
    """Says nothing."""

    stage = 'thermal'


class Idle(Hum):
    """Does nothing."""

    id = 'idle'
    forward = DriveEffect.forward


def variant(base, **attributes):
    """Return a changed copy of a class."""
    return type('Variant', (base,), attributes)


@pytest.mark.parametrize('effect, message', [
    (Nameless, 'Nameless lacks id, sentence, equation, source, shows_in, experiment'),
    (Idle, 'idle defines neither forward nor step'),
    (variant(Hum, stage='spiritual'), "stage 'spiritual' is none of electrical"),
    (variant(Hum, stage='material'), 'has to be a MaterialEffect'),
    (variant(Hum, id='slack'), "two effects are called 'slack'"),
    (Effect, 'lacks id'),
    (dict, 'no subclass of hysteresis_ros.effects.Effect')])
def test_a_users_effect_that_cannot_work_is_refused_in_one_line(install, effect, message):
    install(effect)
    with pytest.raises(ParameterError, match=message) as error:
        catalogue()
    assert '\n' not in str(error.value)


def test_an_effect_that_cannot_be_loaded_is_named(monkeypatch):
    def load():
        raise ImportError('no module named wire')
    entry = types.SimpleNamespace(name='wire', value='wire:Wire', load=load)
    monkeypatch.setattr(metadata, 'entry_points', lambda group: [entry])
    catalogue.cache_clear()
    with pytest.raises(ParameterError, match="'wire' of entry point 'wire:Wire' cannot be loaded"):
        catalogue()
    monkeypatch.undo()
    catalogue.cache_clear()


def test_defaults_of_the_stages_do_nothing():
    surroundings = bicep_model().surroundings
    inputs = Inputs(np.arange(3.0), np.arange(3.0), np.ones(3), np.full(3, np.nan), np.ones(3),
                    np.zeros(3))
    material = MaterialEffect()
    offset, factor = material.drift(np.ones(3), np.ones(3), inputs, surroundings)
    assert offset.tolist() == [0.0] * 3 and factor.tolist() == [1.0] * 3
    assert material.advance(1.0, 1.0, inputs, surroundings) == (0.0, 1.0)
    assert (material.shift_load(2.0, surroundings), material.scale(2.0, surroundings),
            material.stretch(2.0, surroundings)) == (0.0, 1.0, 0.0)
    sensor = SensorEffect()
    assert sensor.step(3.0, 0.1) == sensor.inverse(3.0) == 3.0
    assert sensor.forward(np.ones(3), inputs).tolist() == [1.0] * 3
    assert Hum(u=0.5).step(1.0, 0.1, 1.0, surroundings) == 1.5
    assert DriveEffect().inverse(2.0, inputs, surroundings) == 2.0


def test_strengths_of_these_tests_are_plausible():
    model = bicep_model()
    assert set(STRENGTHS) == set(catalogue())
    assert not [name for name in STRENGTHS if effect_of(model, name).implausible()]
