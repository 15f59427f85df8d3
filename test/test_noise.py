# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What noise that lasts does to intervals and verdicts: as often wrong as is said, and no more."""

import math

from hidden_cases import bench_model
from model_support import autoregressive, bicep_model, effect_of, runs, with_noise
import numpy as np
import pytest

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.extend import extend
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.measurements import Measurement

ROWS = 60
# Specimen of the laboratory.
SPECIMEN = 11
RUNS = 40


def noisy(run, rho, seed):
    """Return a recording with a degree of noise that lasts as rho says."""
    noise = autoregressive(np.random.default_rng(seed), run.rows // ROWS, ROWS, rho)
    return with_noise(run, math.radians(1.0) * noise)


@pytest.mark.slow
@pytest.mark.parametrize('error', [4e-4, pytest.param(4e-5, marks=pytest.mark.long)])
def test_intervals_under_noise_that_lasts_hold_the_truth_as_often_as_they_say(error):
    """
    Of 200 runs 181 to 197: what 95 % gives with a probability of 99 %.

    The model itself has made them, so that its own error, which its bench says is `error` [m], is
    none. One that counts for little against the noise leaves all to what is estimated of that, and
    a trial lasts for six of its correlation times.
    """
    base = bicep_model(metrics={'length': {'verification': {'rmse': error}}})
    clean = runs(base.with_effects([effect_of(base, 'payload_error', dm=15.0)]), 2, ROWS)
    held = 0
    for seed in range(200):
        effect, = extend(base, ['payload_error'], [noisy(clean, 0.9, seed)]).added
        low, high = effect.intervals['dm']
        held += low <= 15.0 <= high
    assert 181 <= held <= 197, held


@pytest.mark.slow
@pytest.mark.parametrize('trials, rho', [
    pytest.param(1, 0.98, marks=pytest.mark.long),
    pytest.param(2, 0.98, marks=pytest.mark.long),
    pytest.param(4, 0.9, marks=pytest.mark.long)])
def test_noise_that_lasts_is_no_effect(trials, rho):
    """
    For 50 rows of a trial's 60 it is nearly an offset of each trial, for 10 a drift.

    It is larger than what the model may be wrong by, so that most of these recordings are said to
    have a cause that is in no catalogue. If one in fifty were given a name, as is asked for, more
    than 3 of 40 would be in less than 1 % of all cases.
    """
    table = experiment_tables('arm-steps', {}, SPECIMEN)['train.csv']
    clean, model = Measurement.from_columns(table).select(range(trials)), bench_model(SPECIMEN)
    found = [diagnose(model, [noisy(clean, rho, seed)], seed=seed) for seed in range(RUNS)]
    assert sum(bool(one.missing) for one in found) <= 3
    assert all(one.verdict in ('adequate', 'unknown') for one in found if not one.missing)
