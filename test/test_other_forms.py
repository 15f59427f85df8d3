# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Physics that acts by another equation than the catalogue's has the right name all the same."""

import dataclasses
import math

from hidden_cases import found_in, TRIALS
from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory import hidden_physics, still_air
from hysteresis_ros.laboratory.arm import Arm
from hysteresis_ros.laboratory.conditions import Conditions, RESISTANCE
from hysteresis_ros.laboratory.grain_wire import GrainMaterial, GrainWire
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.parallel_wires import ParallelWires
from hysteresis_ros.laboratory.plant import specimen
import numpy as np
import pytest
from test_transformation_slopes import bench_tables

pytestmark = pytest.mark.slow
LONG = pytest.mark.long
# Of all effects those that a creeping muscle, or one that feels another voltage, may be taken for.
NEAR_CREEP = ('creep', 'fatigue', 'ambient_drift')
NEAR_VOLTAGE = ('pwm_dead_zone', 'supply_sag', 'supply_limit', 'heat_loss', 'stress_dependence')


def named(found):
    """Return what is said to be missing, and what could as well be in its place."""
    return {*found.missing, *(name for others in found.alternatives for name in others)}


def change_drive(monkeypatch, name, neutral, change):
    """Let ``change(voltage, value)`` be felt where a condition is not neutral, and not what is."""
    drive_squared = Conditions.drive_squared

    def otherwise(own, voltage, *others):
        value = getattr(own, name)
        setattr(own, name, neutral)
        found = drive_squared(own, voltage if value == neutral else change(voltage, value), *others)
        setattr(own, name, value)
        return found
    monkeypatch.setattr(Conditions, 'drive_squared', otherwise)


def change_condition(monkeypatch, effect, name, value):
    """Let a hidden effect set one condition to a value, and nothing else."""
    monkeypatch.setitem(hidden_physics.EFFECTS, effect, dataclasses.replace(
        hidden_physics.EFFECTS[effect],
        apply=lambda conditions, *others: setattr(conditions, name, value)))


@pytest.fixture
def harder_to_start(monkeypatch):
    """Dry friction that is half as large again until the arm slides (Stribeck 1902)."""
    slide = Arm._find_balance

    def find_balance(self, dt):
        if abs(self._pull(self.angle) - self._needed(self.angle)) <= 1.5 * self.conditions.coulomb:
            self.muscle.commit(self.temperature, self.tensions)
        else:
            slide(self, dt)
    monkeypatch.setattr(Arm, '_find_balance', find_balance)


@LONG
def test_friction_that_is_larger_at_rest_is_friction(harder_to_start):
    found = found_in({'coulomb_friction': 1.0}, 5, protocol='arm-steps', trials=(0, 1))
    assert found.verdict == 'missing' and 'coulomb_friction' in named(found)
    assert found.rmse_after < 0.4 * found.rmse_before


CREEP = {
    # Kelvin and Voigt, which comes to an end, and a power of time, which does not.
    'kelvin_voigt': lambda time: 3.0 * (1.0 - math.exp(-time / 12.0)),
    'power': lambda time: 0.75 * time ** 0.35,
}


@LONG
@pytest.mark.parametrize('form', ['kelvin_voigt', 'power'])
def test_creep_by_another_law_is_creep(monkeypatch, form):
    creep_on = ParallelWires._creep_on

    def otherwise(self, voltage, dt):
        creep_on(self, voltage, dt)
        if self._since > 0.0:
            self._creep *= CREEP[form](self._since) / math.log1p(
                self._since / self._conditions.creep_time)
    monkeypatch.setattr(ParallelWires, '_creep_on', otherwise)
    found = found_in({'creep': 1.0}, 5, trials=(0, 1))
    assert found.verdict == 'missing' and named(found) & {'creep', 'viscoelastic_creep'}
    assert found.rmse_after < 0.5 * found.rmse_before


@LONG
@pytest.mark.parametrize('rested', [True, False])
def test_creep_that_outlasts_its_hold_is_creep(monkeypatch, rested):
    """A relaxation of 90 s in holds of 30 s; the cold muscle may creep when a trial begins."""
    begin_trial, crept = ParallelWires._begin, {}

    def begin(self):
        begin_trial(self)
        crept[self] = 0.0 if rested else 1.0

    def otherwise(self, voltage, dt):
        share = self._share + (crept[self] - self._share) * math.exp(-dt / 90.0)
        crept[self] = share
        length = self._conditions.material.resting_length
        self._creep = 0.004 * length * (share - (0.0 if rested else 1.0))
    monkeypatch.setattr(ParallelWires, '_begin', begin)
    monkeypatch.setattr(ParallelWires, '_creep_on', otherwise)
    found = found_in({'creep': 1.0}, 5, protocol='arm-steps')
    assert (found.verdict, found.missing) == ('missing', ['creep'])
    assert found.effects[0].kept == 2.0 and found.effects[0].rested == rested
    assert found.effects[0].t0 == pytest.approx(90.0, rel=0.2)


@pytest.mark.long
def test_creep_that_a_settled_bench_contains_is_found(monkeypatch):
    """What transforms comes in part at once, and later what is left, in 1.5 to 150 s."""
    times = 1.5 * 10.0 ** np.arange(0.0, 2.5, 0.5)
    begin_trial, crept = ParallelWires._begin, {}

    def begin(self):
        begin_trial(self)
        crept.clear()

    def otherwise(self, voltage, dt):
        before = crept.get(self, self._share)
        crept[self] = self._share + (before - self._share) * np.exp(-dt / times)
        length = self._conditions.material.resting_length
        self._creep = 0.02 * length * float(np.mean(crept[self] - self._share))
    monkeypatch.setattr(ParallelWires, '_begin', begin)
    monkeypatch.setattr(ParallelWires, '_creep_on', otherwise)
    found = found_in({'creep': 1.0}, 5, ['creep', 'thermal_lag', 'viscoelastic_creep', 'fatigue'])
    assert (found.verdict, found.missing) == ('missing', ['creep'])
    assert (found.effects[0].kept, found.effects[0].settled) == (1.0, 1.0)
    assert found.rmse_after < 0.2 * found.rmse_before


@pytest.mark.parametrize('protocol, names', [
    ('arm-steps', NEAR_CREEP), pytest.param('arm-steps', None, marks=LONG),
    pytest.param('arm-dynamic', None, marks=LONG)])
def test_creep_that_is_as_large_after_a_small_step_is_creep(monkeypatch, protocol, names):
    """Of 0.3 percent of the length in a hold of 30 s, however much has transformed."""
    creep_on = ParallelWires._creep_on

    def otherwise(self, voltage, dt):
        creep_on(self, voltage, dt)
        length = self._conditions.material.resting_length
        self._creep = (0.0012 * length * math.tanh((self._share - self._run_share) / 0.09)
                       * math.log1p(self._since / 2.0))
    monkeypatch.setattr(ParallelWires, '_creep_on', otherwise)
    found = found_in({'creep': 1.0}, 5, names, protocol=protocol, trials=(0, 1))
    assert (found.verdict, found.missing) == ('missing', ['creep'])
    made = {effect.id: effect for effect in found.effects}
    assert made['creep'].s > 0.0
    assert found.rmse_after < 0.7 * found.rmse_before


@LONG
@pytest.mark.parametrize('radiated', [0.0, 1.0])
def test_heat_lost_by_convection_or_radiation_alone_is_heat_loss(monkeypatch, radiated):
    monkeypatch.setattr(still_air, 'RADIATED', radiated)
    found = found_in({'heat_loss': 1.0}, 5, trials=(0, 1))
    assert found.verdict == 'missing' and 'heat_loss' in named(found)
    assert found.rmse_after < 0.4 * found.rmse_before


@LONG
@pytest.mark.parametrize('protocol', ['arm-steps', 'arm-dynamic'])
def test_heat_that_is_lost_otherwise_than_on_the_bench_is_heat_loss(monkeypatch, protocol):
    """By natural convection from the arm's wires, from those of the bench in proportion."""
    def change(air, excess, balance, rate, dt):
        count = max(1, math.ceil(rate * dt / 0.05))
        now = excess
        for _ in range(count):
            lost = math.copysign(40.0 * abs(now / 40.0) ** 1.25, now)
            now += rate * dt / count * (balance - lost)
        return now - excess
    monkeypatch.setattr(still_air.StillAir, 'change', change)
    found = found_in({'heat_loss': 1.0}, 5, protocol=protocol, trials=(0, 1))
    assert found.verdict == 'missing' and 'heat_loss' in named(found)
    assert found.rmse_after < 0.4 * found.rmse_before


@pytest.mark.parametrize('names', [NEAR_VOLTAGE, pytest.param(None, marks=LONG)],
                         ids=['some', 'all'])
def test_pulses_that_drop_out_and_pass_whole_above_are_a_dead_zone(monkeypatch, names):
    """No rest of them is stretched."""
    change_drive(monkeypatch, 'dead_voltage', 0.0,
                 lambda voltage, _: 0.0 if voltage < 3.6 else voltage)
    found = found_in({'pwm_dead_zone': 1.0}, 5, names, protocol='arm-steps', trials=(0, 1))
    assert (found.verdict, found.missing) == ('missing', ['pwm_dead_zone'])
    assert found.effects[0].whole == 1.0
    assert found.effects[0].Vd == pytest.approx(3.6, rel=0.1)


def test_a_voltage_lost_at_any_duty_is_found_as_a_dead_zone(monkeypatch):
    """Nearly a shift of the transformation, or a sag, to a settled arm, and rarer than these."""
    change_drive(monkeypatch, 'dead_voltage', 0.0, lambda voltage, _: max(voltage - 0.3, 0.0))
    names = ['pwm_dead_zone', 'stress_dependence', 'supply_sag', 'ambient_drift']
    found = found_in({'pwm_dead_zone': 1.0}, 5, names, protocol='arm-steps', trials=(0, 1))
    assert (found.verdict, found.missing) == ('missing', ['pwm_dead_zone'])
    assert found.effects[0].whole == 2.0
    assert found.effects[0].Vd == pytest.approx(0.3, rel=0.2)


def test_a_limited_current_is_a_limit_of_the_supply():
    """In a settled arm that is nearly an end stop, but for minor loops on cooling."""
    found = found_in({'supply_limit': 1.0}, 5, protocol='arm-steps', trials=(0, 1))
    assert found.verdict == 'missing' and 'supply_limit' in named(found)
    assert found.rmse_after < 0.4 * found.rmse_before


@LONG
def test_a_gradual_limit_of_the_supply_is_found(monkeypatch):
    """Of 4.75 V, with a knee of the fourth order in power."""
    change_drive(monkeypatch, 'largest_current', math.inf, lambda voltage, current: (
        voltage * (1.0 + (voltage / (current * RESISTANCE)) ** 8) ** -0.125))
    names = ['supply_limit', 'end_stop', 'supply_sag', 'cold_clamps', 'stress_dependence']
    found = found_in({'supply_limit': 1.0}, 5, names, protocol='arm-steps', trials=(0, 1))
    assert (found.verdict, found.missing) == ('missing', ['supply_limit'])
    assert found.effects[0].soft == pytest.approx(0.125, rel=0.2)


class Saturating(float):
    """A shift [K/Pa] that grows less and less with the stress that it is multiplied by."""

    largest = 200e6

    def __mul__(self, stress):
        return float(self) * self.largest * math.tanh(stress / self.largest)


class WideWire(GrainWire):
    """Loops that widen with the load at first, and less and less."""

    def __init__(self, material):
        super().__init__(material)
        self._cooling_shift = Saturating(self._cooling_shift / 1.2)


@dataclasses.dataclass(frozen=True)
class WideMaterial(GrainMaterial):
    """Grains of such a wire."""

    def wire(self):
        """Return a new wire, cold."""
        return WideWire(self)


@LONG
def test_loops_that_widen_by_another_law_are_wide_for_the_same_reason():
    fields = {field.name: getattr(specimen(5), field.name)
              for field in dataclasses.fields(specimen(5))}
    force, length = bench_tables(WideMaterial(**fields), 5)
    model = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **TRIALS).model
    extended, added = add_effects(model, length, force, **TRIALS)
    names = {effect.id for effect in added}
    assert 'transformation_slopes' in names and not names & {'r_phase', 'fatigue'}
    before, after = (one.metrics['length']['verification']['model']['mean_percent']
                     for one in (model, extended))
    assert after < 1.0 and after < 0.4 * before


def test_unequal_muscles_are_found_where_two_are_too_long(monkeypatch):
    change_condition(monkeypatch, 'unequal_muscles', 'wire_offsets', (0.0, 0.0013, 0.0033))
    found = found_in({'unequal_muscles': 1.0}, 5, protocol='arm-steps')
    assert (found.verdict, found.missing) == ('missing', ['unequal_muscles'])
    offsets = sorted(found.effects[0].offsets)
    assert np.array(offsets) == pytest.approx([0.0, 0.0013, 0.0033], rel=0.25, abs=2e-4)


@LONG
def test_a_large_moment_of_inertia_is_found(monkeypatch):
    """A moment of inertia 20 times that of the payload: periods of a second."""
    change_condition(monkeypatch, 'inertia', 'inertia', 0.2)
    names = ['inertia', 'viscous_friction', 'thermal_lag', 'latency']
    found = found_in({'inertia': 1.0}, 5, names)
    assert found.verdict == 'missing' and 'inertia' in found.missing
    assert found.rmse_after < 0.3 * found.rmse_before
