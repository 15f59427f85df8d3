# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Speed, memory and accuracy of the operators, beside a dense grid of relays in NumPy.

The dense grid is the plain way to compute a Preisach operator: one relay in the middle of each
cell, all of them updated at each step. Blocks of steps of both go in turn, so that what else the
machine does falls on both alike.
"""

import math
import time
import tracemalloc

import numpy as np

from hysteresis_ros.operators import Cascade, Preisach, cells, signed_areas

LEVELS = 10, 20
VOLTS = 0.0, 6.0            # V
FORCES = 0.5, 15.0          # N
LENGTH = 0.02               # m, full scale
BLOCKS, BLOCK = 60, 500
QUICK_BLOCKS = 3
BATCH, QUICK_BATCH = 50000, 2000
WARM_UP, STEPS = 20000, 100000
QUICK_WARM_UP, QUICK_STEPS = 1000, 1000
NOISE = 1e-4                # of full scale, standard deviation of the reference
AFTER = 0.0, 0.001, 0.003, 0.01, 0.03, 0.1      # of full scale, from the reversal to the reference
TRIES, QUICK_TRIES = 300, 20
REQUESTS, QUICK_REQUESTS = 5000, 200


class Relays:
    """A dense grid of relays in the middles of the cells, on the same weights."""

    def __init__(self, operator):
        beta, alpha = cells(len(operator.nodes) - 1)
        middle = (operator.nodes[1:] + operator.nodes[:-1]) / 2.0
        width = np.diff(operator.nodes)
        self.alpha, self.beta = middle[alpha], middle[beta]
        area = width[alpha] * width[beta] * np.where(alpha == beta, 0.5, 1.0)
        self.weights, self.bias = operator.weights * area, operator.bias
        self.relays = np.full(len(area), -1.0)

    def step(self, u):
        """Commit an input and return the output."""
        self.relays[self.alpha < u] = 1.0
        self.relays[self.beta > u] = -1.0
        return self.weights @ self.relays + self.bias


class DenseCascade:
    """Two dense grids in the place of the two stages."""

    def __init__(self, cascade):
        self.first, self.second = map(Relays, cascade.stages)

    def step(self, inputs):
        """Commit (V, F) and return L."""
        return self.second.step(inputs[1] - self.first.step(inputs[0]))


def muscle():
    """Return two stages like the paper's muscle: 0.5 to 15 N over 6 V, 20 mm over the force."""
    return Cascade([_stage(LEVELS[0], *VOLTS, FORCES[1] - FORCES[0], sum(FORCES) / 2.0, 0.1),
                    _stage(LEVELS[1], FORCES[0] - FORCES[1], FORCES[1] - FORCES[0], LENGTH,
                           LENGTH / 2.0, 0.2)])


def _stage(levels, lower, upper, scale, bias, spread):
    """Return an operator whose weights fall off with the distance from the diagonal."""
    beta, alpha = cells(levels)
    weights = np.exp(-(alpha - beta) / (spread * levels))
    unit = Preisach(np.linspace(lower, upper, levels + 1), weights)
    low, high = unit.output_range
    return Preisach(unit.nodes, weights * scale / (high - low), bias)


def _inputs(count, seed):
    """Return a random walk of (V, F) as a list of tuples of floats."""
    rng = np.random.default_rng(seed)
    volts = rng.uniform(*VOLTS, count)
    forces = np.repeat(rng.uniform(*FORCES, count // 100 + 1), 100)[:count]
    return list(zip(volts.tolist(), forces.tolist()))


def _timed(function, arguments):
    """Return the nanoseconds that each call takes."""
    clock = time.perf_counter_ns
    times = []
    for argument in arguments:
        start = clock()
        function(argument)
        times.append(clock() - start)
    return times


def speed_benchmarks(quick: bool) -> dict:
    """
    Measure steps of the two-stage model and of its inverse.

    Returns
    -------
    dict
        Medians in microseconds; ratios to the dense grid; 99th percentile over the median.
    """
    cascade, followed, dense = muscle(), muscle(), muscle()
    grid = DenseCascade(dense)
    single, coarse = muscle().stages[1], Relays(dense.stages[1])

    def invert(request):
        followed.invert_length(*request)

    def control(request):
        length, force = request
        followed.step((followed.invert_length(length, force).input, force))

    times = {name: [] for name in ('forward', 'dense', 'single', 'dense_single', 'inverse',
                                   'control')}
    for block in range(QUICK_BLOCKS if quick else BLOCKS):
        inputs = _inputs(BLOCK, block)
        lengths = np.random.default_rng(block).uniform(0.2 * LENGTH, 0.8 * LENGTH, BLOCK)
        requests = list(zip(lengths.tolist(), (f for _, f in inputs)))
        differences = [f - 2.4 * v for v, f in inputs]
        times['forward'] += _timed(cascade.step, inputs)
        times['dense'] += _timed(grid.step, inputs)
        times['single'] += _timed(single.step, differences)
        times['dense_single'] += _timed(coarse.step, differences)
        times['inverse'] += _timed(invert, requests)
        times['control'] += _timed(control, requests)
    volts, forces = np.array(_inputs(QUICK_BATCH if quick else BATCH, 0)).T
    batch = min(_batch(cascade, volts, forces) for _ in range(5))
    median = {name: float(np.median(values)) for name, values in times.items()}
    tail = {name: float(np.percentile(values, 99)) / median[name]
            for name, values in times.items()}
    start = time.perf_counter()
    signed_areas(single.nodes, np.random.default_rng(0).uniform(single.lower, single.upper, 148))
    areas = time.perf_counter() - start
    return {
        'two_stage_forward_step_us': median['forward'] / 1e3,
        'two_stage_dense_grid_step_us': median['dense'] / 1e3,
        'two_stage_forward_over_dense_grid_ratio': median['forward'] / median['dense'],
        'two_stage_forward_batch_step_us': batch / 1e3,
        'two_stage_forward_batch_over_dense_grid_ratio': batch / median['dense'],
        'two_stage_forward_p99_over_median_ratio': tail['forward'],
        'two_stage_inverse_us': median['inverse'] / 1e3,
        'two_stage_inverse_over_dense_grid_ratio': median['inverse'] / median['dense'],
        'two_stage_inverse_p99_over_median_ratio': tail['inverse'],
        'two_stage_inverse_and_commit_us': median['control'] / 1e3,
        'two_stage_inverse_and_commit_over_dense_grid_ratio': median['control'] / median['dense'],
        'two_stage_inverse_and_commit_p99_over_median_ratio': tail['control'],
        'preisach_20_levels_step_us': median['single'] / 1e3,
        'preisach_20_levels_over_dense_grid_ratio': median['single'] / median['dense_single'],
        'signed_areas_148_by_210_ms': areas * 1e3,
    }


def _batch(cascade, volts, forces):
    """Return the nanoseconds that a step takes when all steps are handed over at once."""
    first, second = cascade.stages
    first.reset()
    second.reset()
    start = time.perf_counter_ns()
    second.simulate(forces - first.simulate(volts))
    return (time.perf_counter_ns() - start) / len(volts)


def accuracy_benchmarks(quick: bool) -> dict:
    """Measure the round trip of the inverse, and how far pointwise relays are off."""
    cascade = muscle()
    rng = np.random.default_rng(0)
    worst = 0.0
    count = QUICK_REQUESTS if quick else REQUESTS
    for length, force in zip(rng.uniform(0.0, LENGTH, count), rng.uniform(*FORCES, count)):
        found = cascade.invert_length(length, force)
        output = cascade.step((found.input, force))
        if not found.saturated:
            worst = max(worst, abs(output - length) / LENGTH)
    operator = muscle().stages[1]
    relays = Relays(operator)
    differences = [abs(operator.step(u) - relays.step(u))
                   for u in rng.uniform(operator.lower, operator.upper, count)]
    return {'two_stage_round_trip_error_of_full_scale': worst,
            'dense_grid_20_levels_error_of_full_scale': max(differences) / LENGTH}


def memory_benchmarks(quick: bool) -> dict:
    """
    Measure the growth of memory over steps of the compensator (inverse and commit).

    Returns
    -------
    dict
        Bytes by which traced memory grew after the warm-up, and the most corners that a stage
        held.
    """
    cascade = muscle()
    rng = np.random.default_rng(0)
    # A slow oscillation that loses amplitude and noise on top: many loops inside loops.
    phase = np.arange(1000) * 0.07
    shape = 0.5 + 0.3 * np.cos(phase) * np.exp(-np.arange(1000) / 500.0)

    def run(count):
        most = 0
        for start in range(0, count, 1000):
            lengths = LENGTH * (shape + rng.normal(0.0, 1e-3, 1000))
            for length in lengths.tolist():
                cascade.step((cascade.invert_length(length, 8.0).input, 8.0))
            most = max(most, *(len(stage.corners) for stage in cascade.stages))
        return most

    tracemalloc.start()
    try:
        run(QUICK_WARM_UP if quick else WARM_UP)
        before, _ = tracemalloc.get_traced_memory()
        most = run(QUICK_STEPS if quick else STEPS)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    return {'compensator_memory_growth_bytes': max(after - before, 0),
            'compensator_corners_count': most}


def noise_benchmarks(quick: bool) -> dict:
    """
    Measure how noise in the length reference reaches the voltage after a reversal.

    Returns
    -------
    dict
        Jitter of the voltage (of its range) per jitter of the reference (of its range): for
        single references at distances from a reversal, and for a constant reference with noise
        whose voltages are committed one after the other, as a compensator does; with the exact
        inverse, and with a dead band as wide as the noise from peak to peak. For the committed
        run also the root mean square error of the length against the reference without noise.
    """
    options = {'exact': (), 'dead_band': (0.0, 8.0 * NOISE * LENGTH)}
    results = {}
    for name, bands in options.items():
        for distance in AFTER:
            place = f'{100.0 * distance:g}'.replace('.', '_')
            results[f'noise_gain_{name}_{place}_percent_after_reversal_ratio'], _ = _jitter(
                distance * LENGTH, bands, False, quick)
        gain, error = _jitter(0.03 * LENGTH, bands, True, quick)
        results[f'noise_gain_{name}_committed_ratio'] = gain
        results[f'noise_error_{name}_committed_of_full_scale'] = error
    return results


def _jitter(distance, bands, commit, quick):
    """Return the gain from reference to voltage noise, and the error of the length."""
    cascade = muscle()
    rng = np.random.default_rng(1)
    peak, force = 0.6 * LENGTH, 8.0
    start = np.linspace(cascade.output, peak, 50).tolist()
    for length in start + [peak - distance] * commit:
        cascade.step((cascade.invert_length(length, force).input, force))
    references = peak - distance + rng.normal(
        0.0, NOISE * LENGTH, QUICK_TRIES if quick else TRIES)
    volts, errors = [], []
    for length in references.tolist():
        found = cascade.invert_length(length, force, bands)
        volts.append(found.input)
        errors.append(found.output - (peak - distance))
        if commit:
            cascade.step((found.input, force))
    gain = (np.std(volts) / (VOLTS[1] - VOLTS[0])) / (np.std(references) / LENGTH)
    return float(gain), math.sqrt(np.mean(np.square(errors))) / LENGTH
