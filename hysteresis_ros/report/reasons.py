# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure a diagnosis is: the probability of its answer, and why the next best one lost."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import Any, TYPE_CHECKING

from hysteresis_ros.comparison.where import number
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.report.words import error_in_words

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.verdict import Diagnosis

# Errors within this share of each other are as good as the same.
ALIKE = 0.1
# Probabilities that are told, and how many at most.
LEAST_TOLD, MOST_TOLD = 0.01, 6


def answers(found: Diagnosis) -> list[frozenset[str]]:
    """Return the sets of effects that the verdict holds to be possible, the named one first."""
    if found.verdict == 'unknown':
        return [frozenset(['unknown'])]
    places = [[name, *others] for name, others in zip(found.missing, found.alternatives)]
    return [frozenset(names) for names in product(*places)]


def probabilities(found: Diagnosis) -> list[tuple[str, float]]:
    """Return each possible answer that was weighed, in words, with its probability."""
    return [(named(names), entry['probability']) for names in answers(found)
            for entry in found.sets if frozenset(entry['effects']) == names]


def all_probabilities(found: Diagnosis) -> str:
    """Return what was weighed with its probability, in words; not what is less likely than 0.01."""
    told = [entry for entry in found.sets if entry['probability'] >= LEAST_TOLD]
    return ', '.join(f'{named(entry["effects"])} {share(entry["probability"])}'
                     for entry in told[:MOST_TOLD])


def share(value: float) -> str:
    """Return a probability as a person would say it."""
    if value > 0.995:
        return 'more than 0.99'
    return 'less than 0.01' if value < 0.005 else f'{value:.2f}'


def named(names: Iterable[str]) -> str:
    """Return a set of effects in words."""
    found = sorted(names)
    if found == ['unknown']:
        return 'an unknown cause'
    return ' with '.join(found) or 'the model as it is'


def why_not_another(found: Diagnosis, quantity: str) -> str:
    """
    Say which answer came next, and why it lost.

    Parameters
    ----------
    found : Diagnosis
    quantity : str
        What was measured.

    Returns
    -------
    str
        One or two sentences, '' where nothing else was weighed.
    """
    possible = answers(found)
    tied = {name for names in possible for name in names}
    rival = next((entry for entry in found.sets if frozenset(entry['effects']) not in possible
                  and entry['effects'] != ['unknown']), None)
    if rival is not None:
        return _of_sets(found, rival, possible, quantity)
    others = sorted((row for row in found.ranking if row['effect'] not in tied),
                    key=lambda row: row['rmse_after'])
    physical = [row for row in others if row['plausible']]
    # The best of all may be out of reach; then the best of those that are not is named, too.
    told = others[:1] + [row for row in physical[:1] if row is not others[0]]
    return ' '.join(_alone(found, row, quantity) for row in told)


def _of_sets(found: Diagnosis, rival: dict[str, Any], possible: list[frozenset[str]],
             quantity: str) -> str:
    """Say why a set that was weighed lost against the answer."""
    names = frozenset(rival['effects'])
    text = f'{named(names)} comes next, with probability {share(rival["probability"])}'
    winner = next((entry for entry in found.sets
                   if frozenset(entry['effects']) == possible[0]), None)
    if winner is None or found.verdict == 'unknown':
        return text + '.'
    errors = _errors(rival['rmse'], winner['rmse'], quantity)
    if any(names > answer for answer in possible):
        return (f'{text}: its additional effect changes the {found.error_name} to {errors}, '
                'less than one more effect has to earn.')
    if rival['rmse'] <= (1.0 + ALIKE) * winner['rmse']:
        return (f'{text}: it fits as well ({found.error_name} {errors}), but it needs more effects '
                'or less usual values.')
    return f'{text}: its {found.error_name} is {errors}.'


def _alone(found: Diagnosis, row: dict[str, Any], quantity: str) -> str:
    """Say why an effect by itself lost against the answer."""
    name = row['effect']
    if found.verdict == 'missing':
        errors = _errors(row['rmse_after'], found.rmse_after, quantity)
        if not row['plausible']:
            return (f'With {name} the {found.error_name} is {errors}, but only with values outside '
                    'its physical range.')
        return f'With {name} the {found.error_name} is {errors}.'
    text = (f'{name} comes next: it takes {100.0 * row["gain"]:.0f} % off the '
            f'{error_in_words(found)} on rows not fitted '
            f'(p {found.p_value(row)})')
    if not row['plausible']:
        return f'{text}, but only with values outside its physical range.'
    if found.verdict == 'unknown':
        return text + ', which does not explain the rest.'
    return text + ", not more than chance and the base model's own error could."


def _errors(other: float, best: float, quantity: str) -> str:
    """Compare an error with that of the answer."""
    unit, scale = shown(quantity)
    text = f'{number(scale * other)} {unit} instead of {number(scale * best)} {unit}'
    if best > 0.0 and other > 1.5 * best:
        text += f', {other / best:.1f} times as much'
    return text
