# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Something that happened once is told by its time."""

import dataclasses

from model_support import bicep_model, effect_of
import numpy as np
import pytest
from scipy import special, stats
from selection_support import recording, selection

from hysteresis_ros.diagnosis import events
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.discrepancy import sensitivity
from hysteresis_ros.diagnosis.kind import problem_for


@pytest.fixture(scope='module')
def model():
    """Return the model without effects."""
    return bicep_model()


def test_something_that_happened_once_has_its_time(model):
    """A step of the angle at a moment: an unknown, told by when it happened."""
    rows = 90
    row = 52
    measured = recording(model, change=0.15 * (np.arange(rows) >= row))
    found = selection(model, measured, ('payload_error', 'supply_sag'))
    time, log_posterior = events.most_probable(found.problem, found)
    assert abs(time - found.problem.clock[row]) <= 60.0
    best = max((found.sets.log_posterior(names) for names in found.sets.valid()), default=-np.inf)
    assert log_posterior > best
    told = diagnose(model, [measured], ['payload_error', 'supply_sag'])
    assert (told.verdict, told.missing, told.event) == ('unknown', [], time)


@pytest.mark.parametrize('of_length', [False, True])
def test_an_event_has_the_evidence_of_a_column_of_unknown_size(model, of_length):
    """Of each moment, in the angle or in the length, equally probable: integrated over the size."""
    row = 40
    gain = sensitivity(problem_for(model, [recording(model)]), [])
    shape = gain / np.sqrt(np.mean(gain ** 2)) if of_length else np.ones(90)
    found = selection(model, recording(model, change=0.1 * shape * (np.arange(90) >= row)), ())
    problem, rows = found.problem, 90 - 2 * int(events.MARGIN * 90)
    residual = problem.measured - found.sets.base.predicted
    moment, total = events.most_probable(problem, found)
    assert moment == problem.clock[row]
    best, spread = -np.inf, np.sqrt(np.mean(residual ** 2))
    sizes = spread * np.linspace(-8.0, 8.0, 20001)
    for point in found.covariance.points:
        for one in (np.ones(90), gain / np.sqrt(np.mean(gain ** 2))):
            whitened = point.whiten(np.column_stack([residual, one * (np.arange(90) >= row)]))
            density = stats.norm(scale=spread).logpdf(sizes) + point.log_density(
                whitened[:, :1] - whitened[:, 1:] * sizes)
            best = max(best, special.logsumexp(density) + np.log(sizes[1] - sizes[0]))
    odds = np.log(found.settings.prior / (1.0 - found.settings.prior))
    assert total == pytest.approx(best / found.sets.temper + odds - np.log(2 * rows), abs=0.3)


def test_an_event_has_to_explain_more_than_the_base_models_own_error():
    """A step that the bench's error could have caused is none."""
    for rmse, happened in ((0.0001, True), (0.004, False)):
        model = bicep_model(metrics={'length': {'verification': {'rmse': rmse}}})
        found = selection(model, recording(model, change=0.03 * (np.arange(90) >= 40)), ())
        assert np.isfinite(events.most_probable(found.problem, found)[1]) == happened


def test_what_martensite_keeps_is_no_event(monkeypatch):
    """However much of a step a share of it would explain; of another course it hides nothing."""
    step = 0.03 * (np.arange(90) >= 40)
    model = bicep_model(metrics={'length': {'verification': {'rmse': 0.0001}}})
    found = selection(model, recording(model, change=step), ())
    for kept, happened in ((2.0 * step, False), (step[::-1] - step, True)):
        monkeypatch.setattr(found.covariance, 'discrepancy', dataclasses.replace(
            found.covariance.discrepancy, courses=kept[:, None]))
        assert np.isfinite(events.most_probable(found.problem, found)[1]) == happened


def test_a_recording_without_an_event_has_none(model):
    """An effect that acts all the time is more probable than a step."""
    measured = recording(model, [effect_of(model, 'payload_error', dm=15.0)])
    told = diagnose(model, [measured], ['payload_error', 'supply_sag'])
    assert (told.verdict, told.event) == ('missing', None)
