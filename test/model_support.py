# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A small model of the bicep for tests, made by formula, and measurements to feed it with."""

import math

import numpy as np

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.effects import catalogue
from hysteresis_ros.measurements import Measurement, write_csv
from hysteresis_ros.model import LinearModel, MuscleModel
from hysteresis_ros.operators import Preisach

GEOMETRY = BicepGeometry(
    clamp_distance=0.017, clamp_height=0.006, anchor_height=0.2655, forearm_length=0.30,
    resting_length=0.27, payload_mass=0.100, forearm_mass=0.040)

# An effect of each kind with values in its range, as it would show in an arm run.
STRENGTHS = {
    'supply_sag': {'Rs': 0.4}, 'measured_supply': {'nominal': 11.0},
    'pwm_dead_zone': {'Vd': 0.4}, 'supply_limit': {'cut': 0.8}, 'resistance_change': {'eta': 0.1},
    'airflow': {'beta': 1.2}, 'thermal_lag': {'time_constant': 3.0},
    'heating_cooling_asymmetry': {'time_constant': 3.0, 'ratio': 1.5},
    'heat_loss': {'time_constant': 4.0, 'growth': 0.6},
    'valve_lag': {'filling': 2.0, 'venting': 4.0},
    'latent_heat': {'time_constant': 3.0, 'latent': 0.2},
    'ambient_temperature': {'gain': 0.3, 'reference': 25.0},
    'ambient_drift': {'offset': 0.5, 'rate': 1.0, 'curvature': -0.3},
    'stress_dependence': {'shift': 0.15}, 'stress_dependent_strain': {'r': 0.5, 'F0': 1.2},
    'series_compliance': {'compliance': 0.05}, 'transformation_slopes': {'g': 0.3},
    'phase_modulus': {'m': 0.1}, 'thermal_expansion': {'alpha': 0.1},
    'overload': {'Fy': 1.0, 'compliance': 3.0},
    'r_phase': {'strain': 0.2, 'position': 0.2, 'width': 0.05},
    'creep': {'c': 0.1, 't0': 3.0}, 'viscoelastic_creep': {'J': 0.1, 't0': 10.0},
    'fatigue': {'b': 0.05, 'a': 0.02}, 'slack': {'Ls': 0.5},
    'formation_memory': {'kept': 0.8}, 'kinetics': {'share': 0.8}, 'cold_clamps': {'share': 0.1},
    'unequal_muscles': {'shorter': 0.6, 'longer': 0.9}, 'coulomb_friction': {'tau_c': 0.02},
    'cable_friction': {'mu_phi': 0.1}, 'wire_break': {'time': 20.0},
    'viscous_friction': {'b': 0.5}, 'inertia': {'I': 0.01},
    'frame_tilt': {'phi': 4.0},
    'payload_error': {'dm': 15.0}, 'clamp_mass': {'moment': 0.6, 'phi': 0.4},
    'geometry_error': {'dx': 0.6, 'da': -0.4, 'dz': 0.3},
    'end_stop': {'stop': 1.9, 'side': 1.0, 'stiffness': 5.0},
    'encoder_offset': {'offset': 2.0}, 'encoder_eccentricity': {'e': 3.0, 'phi': 1.0},
    'encoder_scale': {'k': 1.1, 'theta_0': 70.0},
    'backlash': {'B': 2.0}, 'latency': {'delay': 0.35},
}


# Rows of a trial.
ROWS = 60


def preisach(lower, upper, levels, lowest, highest, width):
    """Operator with weights near the line alpha - beta = width and an output range."""
    nodes = np.linspace(lower, upper, levels + 1)
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    weights = np.array([
        0.02 + math.exp(-((middle[a] - middle[b] - width) / (0.15 * (upper - lower))) ** 2
                        - (((middle[a] + middle[b]) / 2 - nodes.mean())
                           / (0.35 * (upper - lower))) ** 2)
        for b in range(levels) for a in range(b, levels)])
    low, high = Preisach(nodes, weights, 0.0).output_range
    weights *= (highest - lowest) / (high - low)
    low, high = Preisach(nodes, weights, 0.0).output_range
    return Preisach(nodes, weights, lowest - low)


def bladder(effects=()):
    """Return a model of a muscle that pressure shortens."""
    return MuscleModel(
        kind='two-stage', drive='pressure', load_name='force', response='length',
        force_stage=preisach(0.0, 3e5, 6, 0.0, 300.0, 2e4),
        length_stage=preisach(-300.0, 200.0, 10, -0.06, 0.005, 40.0),
        ranges={'pressure': (0.0, 3e5), 'length': (-0.06, 0.005), 'force': (0.0, 300.0)},
        mean_load=100.0).with_effects(list(effects))


def bicep_model(effects=(), **changes):
    """Return a model whose arm goes from about 60 to 115 degrees."""
    model = MuscleModel(
        kind='two-stage', drive='voltage', load_name='force', response='length',
        force_stage=preisach(0.0, 6.0, 6, 0.5, 14.5, 0.5),
        length_stage=preisach(-13.0, 9.0, 10, -0.0205, 0.0005, 4.0),
        linear=LinearModel(2.5, 1.1e-3, 0.5), geometry=GEOMETRY,
        ranges={'voltage': (0.0, 6.0), 'length': (-0.0205, 0.0), 'force': (0.5, 14.5)},
        mean_load=3.0, metrics={'length': {'verification': {'rmse': 0.0004}}},
        provenance={'files': [{'name': 'length.csv', 'sha256': '00'}]})
    for name, value in changes.items():
        setattr(model, name, value)
    return model.with_effects([effect_of(model, name) for name in effects])


def effect_of(model, name, **values):
    """Return an effect of the catalogue with its values of `STRENGTHS`, or others."""
    return catalogue()[name](model.surroundings, **(values or STRENGTHS[name]))


def arm_run(voltage, dt=30.0, first=None, **columns):
    """Return an arm run of one trial with rows `dt` seconds apart."""
    voltage = np.asarray(voltage, dtype=float)
    time = dt * np.arange(len(voltage)) + (dt if first is None else first)
    return Measurement.from_columns({
        'time': time, 'trial': np.zeros(len(voltage)), 'voltage': voltage,
        'angle': np.full(len(voltage), 1.5), **columns})


def wandering_voltage(rows, seed=0):
    """Return a smooth random voltage from 0 to 6 V with reversals of all sizes."""
    rng = np.random.default_rng(seed)
    time = np.arange(rows)
    waves = sum(math.sin(phase) + np.sin(2 * math.pi * time / period + phase)
                for period, phase in zip(rng.uniform(40, 400, 5), rng.uniform(0, 6.28, 5)))
    return 6.0 * (waves - waves.min()) / np.ptp(waves)


def runs(model, trials=3, rows=ROWS, seed=0, dt=30.0, sizes=None):
    """Return an arm run of some settled trials, over all voltages, that the model has made."""
    sizes = sizes or [rows] * trials
    share = model.ranges['voltage'][1] / 6.0
    voltage = share * np.concatenate([
        wandering_voltage(400, seed + trial)[::400 // size][:size]
        for trial, size in enumerate(sizes)])
    trial = np.repeat(np.arange(float(len(sizes))), sizes)
    time = dt * np.concatenate([1.0 + np.arange(size) for size in sizes])
    columns = {'time': time, 'trial': trial, 'voltage': voltage, 'angle': np.ones(len(voltage))}
    angle = model.predict(Measurement.from_columns(columns))
    return Measurement.from_columns({**columns, 'angle': angle})


def autoregressive(rng, trials, rows, rho):
    """Return AR(1) noise of unit size, trial by trial, shape (trials * rows,)."""
    noise = rng.standard_normal((trials, rows))
    for row in range(1, rows):
        noise[:, row] = rho * noise[:, row - 1] + math.sqrt(1.0 - rho ** 2) * noise[:, row]
    return noise.ravel()


def with_noise(measured, noise):
    """Return a recording with more on its response."""
    name = measured.response
    return Measurement.from_columns(
        {**measured.columns, name: measured.column(name) + noise}, source=measured.source)


def heavier_arm(folder, grams, recordings):
    """Fill a folder with a model and recordings (name to seed) of an arm that carries more."""
    base = bicep_model()
    base.save(folder / 'model.yaml')
    arm = base.with_effects([effect_of(base, 'payload_error', dm=grams)])
    for name, seed in recordings.items():
        write_csv(runs(arm, trials=4, rows=30, seed=seed), folder / name)
    return folder


def misses_of_targets(model, low=82.0):
    """Return by how much [deg] the arm misses angles from `low` to 100 deg within reach."""
    controller, observer = model.controller(arm=True), model.observer()
    missed = []
    for number, theta in enumerate(np.radians(
            np.random.default_rng(1).uniform(low, 100.0, 25))):
        point = controller.setpoint(*controller.reference(float(theta)))
        angle = observer.step(30.0 * (number + 1.0), point.voltage)
        if not point.saturated:
            missed.append(float(np.degrees(angle - theta)))
    assert len(missed) >= 15
    return np.abs(missed)
