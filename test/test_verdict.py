# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What follows from a verdict: ranking, confusion, and the next experiment."""

import numpy as np
import pytest

from hysteresis_ros.diagnosis.verdict import add_signatures, in_order, next_experiment


@pytest.mark.parametrize('verdict, names, alternatives, unobservable, words', [
    ('unknown', ['backlash'], [], {}, ['repeat the recording', 'like backlash shows best']),
    ('missing', ['payload_error'], [['encoder_offset']], {},
     ['to tell payload_error from encoder_offset']),
    ('missing', ['payload_error', 'slack'], [[], []], {}, ['--add payload_error,slack']),
    ('adequate', [], [], {'thermal_lag': 'every row is settled'}, ['to see thermal_lag, too']),
    ('adequate', [], [], {}, ['nothing'])])
def test_the_next_experiment_follows_from_the_verdict(
        verdict, names, alternatives, unobservable, words):
    """What a person would do: tell apart, repeat, add, or look for what could not show."""
    text = next_experiment(verdict, names, alternatives, unobservable)
    assert all(word in text for word in words)


def test_ranked_effects_say_with_what_they_are_confused_and_what_weights_absorb():
    """Signatures along each other are confused; one along a weight's column is absorbed."""
    rows = [{'effect': name} for name in ('one', 'twin', 'other')]
    signatures = np.array([[1.0, 0.0, 0.0], [-2.0, 0.1, 0.0], [0.0, 0.0, 1.0]])
    add_signatures(rows, signatures, np.array([[0.0], [0.0], [3.0]]))
    assert [row['confused_with'] for row in rows] == [['twin'], ['one'], []]
    assert [row['absorbed'] for row in rows] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize('cosine, confused', [(0.95, True), (-0.95, True), (0.85, False)])
def test_signatures_that_nearly_agree_are_confused(cosine, confused):
    """Nine tenths is the border; opposite signatures are the same one."""
    rows = [{'effect': name} for name in ('one', 'other')]
    signatures = np.array([[1.0, 0.0], [cosine, np.sqrt(1.0 - cosine ** 2)]])
    add_signatures(rows, signatures, np.zeros((2, 0)))
    assert [row['confused_with'] for row in rows] == (
        [['other'], ['one']] if confused else [[], []])


def test_the_ranking_begins_with_the_answer_and_ends_with_what_is_not_physical():
    """In between the error on rows that were not fitted decides."""
    rows = [{'effect': name, 'plausible': name != 'odd', 'rmse_after': after} for name, after in (
        ('odd', 0.1), ('second', 0.5), ('weak', 0.9), ('good', 0.3), ('first', 0.7))]
    assert [row['effect'] for row in in_order(rows, ['first', 'second'])] == [
        'first', 'second', 'good', 'weak', 'odd']
