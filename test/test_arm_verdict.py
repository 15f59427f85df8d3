# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said of runs of an arm: which effects could have shown, and what an unknown one is."""

from model_support import arm_run, bicep_model, effect_of
import numpy as np
import pytest
from selection_support import recording

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model.simulation import Simulator


@pytest.mark.parametrize('name', ['creep', 'overload', 'payload_error'])
def test_what_shows_best_at_small_values_is_not_called_hidden(name):
    """A creep of the largest time begins too late to show, and the largest load never yields."""
    model = bicep_model()
    run = arm_run(np.repeat(np.tile([0.0, 6.0, 1.0, 5.0], 3), 20), 0.2)
    angle = Simulator(model, run).run([])
    noise = 1e-3 * np.random.default_rng(2).standard_normal(len(angle))
    told = diagnose(model, [Measurement.from_columns({**run.columns, 'angle': angle + noise})],
                    [name])
    assert name not in told.not_excited


def test_an_unknown_says_what_would_explain_most_of_it():
    """And that more is left than the model may be off by."""
    model = bicep_model(metrics={'length': {'verification': {'rmse': 1e-4}}})
    measured = recording(model, [effect_of(model, 'payload_error', dm=60.0)])
    wave = 0.05 * np.sin(0.6 * np.arange(measured.rows))
    mixed = Measurement.from_columns(
        {**measured.columns, 'angle': measured.column('angle') + wave})
    told = diagnose(model, [mixed], ['payload_error', 'frame_tilt'])
    assert (told.verdict, told.missing, told.explains_most) == ('unknown', [], ['payload_error'])
    assert 'payload_error shows best' in told.experiment.replace('what is like ', '')
    assert diagnose(model, [measured], ['payload_error', 'frame_tilt']).explains_most == []
