# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A row of a simulated arm, and a setpoint of its controller, beside the arm in plain Python.

The reference is given what the first stage gives and computes the balance alone, while the model
computes everything from voltage to angle.
"""

import dataclasses
import time

import numpy as np

from benchmark.reference import arm_of
from hysteresis_ros.effects import catalogue
from hysteresis_ros.kernels.warm_up import small_model
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.share import share_path

SETTLED, MOVING = 30.0, 0.1     # s between rows
CASES = {
    'settled': (SETTLED, {}),
    'viscous': (MOVING, {'viscous_friction': {'b': 0.05}}),
    'inertia': (MOVING, {'inertia': {'I': 0.002, 'b': 0.05}}),
}
# As many rows as a moving recording has, so that what a call takes besides counts as it does there.
ROWS, REPEATS = 12000, 5
# Rows of which angles are compared: an arm whose ringing nothing damps makes any difference larger,
# swing by swing.
COMPARED = 3000
QUICK_ROWS, QUICK_REPEATS = 200, 2
SETPOINTS, QUICK_SETPOINTS = 20000, 500


def arm_benchmarks(quick: bool) -> dict[str, float]:
    """
    Measure `MuscleModel.predict` on arm runs.

    Returns
    -------
    dict
        Microseconds a row of an arm at rest, with viscous friction and with inertia; the same over
        those of the reference; by how much the angles differ at first [rad].
    """
    results = {}
    rows, repeats = (QUICK_ROWS, QUICK_REPEATS) if quick else (ROWS, REPEATS)
    for name, (step, effects) in CASES.items():
        model = arm_model(effects)
        run = arm_run(model, rows, step)
        angles = model.predict(run)     # compiles, too
        ours, plain = [], []
        for _ in range(repeats):
            start = time.perf_counter()
            angles = model.predict(run)
            ours.append(time.perf_counter() - start)
            seconds, expected = reference(model, run, step)
            plain.append(seconds)
        results[f'arm_{name}_row_us'] = 1e6 * float(np.median(ours)) / rows
        results[f'arm_{name}_row_over_reference_ratio'] = float(
            np.median(ours) / np.median(plain))
        results[f'arm_{name}_difference_from_reference_rad'] = float(
            np.max(np.abs(angles - expected)[:COMPARED]))
    return results


def controller_benchmarks(quick: bool) -> dict[str, float]:
    """
    Measure `Controller.setpoint`, as a node calls it.

    Returns
    -------
    dict
        Median in microseconds, over a row of the arm's reference, and 99th percentile over median,
        of targets that the arm reaches; and over that median the median of the others, of which
        the controller also finds where the arm comes to rest instead.
    """
    model = arm_model({})
    controller = model.controller(arm=True)
    angles = np.random.default_rng(1).uniform(1.5, 2.2, QUICK_SETPOINTS if quick else SETPOINTS)
    references = [model.geometry.reference(angle) for angle in angles.tolist()]
    for wanted in references[:100]:
        controller.setpoint(*wanted)
    times: dict[bool, list[int]] = {False: [], True: []}
    for wanted in references:
        start = time.perf_counter_ns()
        found = controller.setpoint(*wanted)
        times[found.saturated].append(time.perf_counter_ns() - start)
    rows = QUICK_ROWS if quick else ROWS
    plain, _ = reference(model, arm_run(model, rows, SETTLED), SETTLED)
    median, beyond = (float(np.median(times[saturated])) for saturated in (False, True))
    return {'controller_setpoint_us': median / 1e3,
            'controller_setpoint_over_reference_row_ratio': median / (1e9 * plain / rows),
            'controller_setpoint_p99_over_median_ratio':
                float(np.percentile(times[False], 99)) / median,
            'controller_setpoint_out_of_reach_over_median_ratio': beyond / median}


def arm_model(effects) -> MuscleModel:
    """Return the model that comes with the package, on an arm, with effects of these values."""
    model = MuscleModel.load(share_path('config/bicep_model.yaml'))
    model = dataclasses.replace(model, geometry=model.geometry or small_model().geometry)
    return model.with_effects([*model.effects, *(
        catalogue()[name](model.surroundings, **values) for name, values in effects.items())])


def arm_run(model, rows: int, step: float) -> Measurement:
    """Return a run of a voltage that wanders, and at times jumps, over all of its range."""
    rng = np.random.default_rng(2)
    low, high = model.ranges['voltage']
    if step == SETTLED:
        voltage = rng.uniform(low, high, rows)
    else:
        corners = np.linspace(0, rows - 1, rows // 40 + 2)
        voltage = np.interp(np.arange(rows), corners, rng.uniform(low, high, len(corners)))
        voltage[rows // 2:] = np.repeat(voltage[rows // 2::50], 50)[:rows - rows // 2]
    return Measurement.from_columns({
        'time': step * (1.0 + np.arange(rows)), 'trial': np.zeros(rows), 'voltage': voltage,
        'angle': np.ones(rows)})


def reference(model, run, step: float) -> tuple[float, np.ndarray]:
    """Return the seconds that the reference takes for all rows, and its angles [rad]."""
    chain = model.chain()
    first, arm = model.first_stage(chain), arm_of(model)
    arm.start()
    arm.settle(first.step(float(chain.to_drive_squared(model.cold_drive))))
    inputs = [first.step(float(chain.to_drive_squared(drive)))
              for drive in run.columns['voltage'].tolist()]
    start = time.perf_counter()
    angles = [arm.step(x, step) for x in inputs]
    return time.perf_counter() - start, np.array(angles)
