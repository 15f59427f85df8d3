# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A verdict as sentences that a person can act on, and the values of effects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import catalogue
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.model.loads import uncovered_load

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.model import MuscleModel


def verdict_in_words(found: Diagnosis) -> str:
    """
    Return the verdict of a diagnosis in plain words.

    Parameters
    ----------
    found : Diagnosis

    Returns
    -------
    str
        One paragraph.
    """
    kept, kinetics = found.kept_strain, found.kinetics
    sentences = [_verdict(found)]
    on_bench = found.pooled_before is not None
    if kept is not None:
        sentences.append(_wire_in_words(
            found, kept, 'no bench of constant loads shows',
            f'martensite that keeps {100.0 * kept["kept"]:.0f} % of its strain'))
    if kinetics is not None:
        sentences.append(_wire_in_words(
            found, kinetics, '' if on_bench else 'a bench with few minor loops does not show',
            f'minor loops that do not close, because {100.0 * kinetics["share"]:.0f} % of what '
            'transforms is in proportion to what has still to,'))
    return ' '.join(sentences)


def _wire_in_words(found: Diagnosis, own: dict[str, Any], hidden_from: str, what: str) -> str:
    """Say what a property of the wire itself would explain of a residual, or has explained."""
    unit, scale = shown(found.quantity)
    before, after = (f'{scale * own[name]:.2g}' for name in ('rmse_before', 'rmse_after'))
    residual = (f'The residual of {before} {unit} may be that of the wire itself, in a way that '
                f'{hidden_from}:' if hidden_from else
                f'Minor loops show the wire itself: a row left out is off by {before} {unit}, and')
    return f'{residual} with {what} it is {after} {unit}; `extend --add {own["effect"]}` adds it.'


def _verdict(found: Diagnosis) -> str:
    effects = catalogue()
    if found.verdict == 'missing':
        parts = []
        for name, others in zip(found.missing, found.alternatives):
            tied = [name, *others]
            if others:
                parts.append(f'one of {", ".join(tied)}. This data cannot tell them apart. '
                             + ' '.join(f'{one}: {effects[one].sentence}' for one in tied))
            else:
                parts.append(f'{name}. {effects[name].sentence}')
        share = 100.0 * (1.0 - found.rmse_after / found.rmse_before)
        return ('Missing: ' + ' Also missing: '.join(parts)
                + f' Adding {added_in_words(found)} takes {share:.0f} % off the '
                f'{error_in_words(found)}.')
    if found.verdict == 'unknown':
        if found.resembles:
            text = (f'Unknown: something acts here that is like {" with ".join(found.resembles)}, '
                    'but only values that are not physical would explain it.')
        elif found.explains_most:
            text = (f'Unknown: {" with ".join(found.explains_most)} would explain most of it, but '
                    "what stays is more than the model's own error could be: something else acts "
                    'here, or that acts otherwise than by its equation.')
        else:
            text = ('Unknown: something acts here that no effect of the catalogue explains '
                    f'({100.0 * found.unexplained:.0f} % of the mean square error).')
        if found.single_row is not None:
            text += (' Most of the squared error is that of a single row, '
                     f'{_when(found.single_row)}: look whether it is right, and leave it out if '
                     'not.')
        elif found.event is not None:
            text += f' It happened {_when(found.event)}, and lasts.'
        elif found.signal:
            text += f' It shows in {found.signal}.'
        elif found.uneven:
            text += (' It is like noise, but larger at some times than at others: something shakes '
                     'the arm or disturbs the encoder then.')
        return text
    if found.verdict == 'not_excited':
        return ('Not excited: this recording moves too little to show whether an effect is '
                'missing.')
    return ("Adequate: no effect of the catalogue explains more than chance and the base model's "
            'own error.')


def _when(time: float) -> str:
    return f'{time:.0f} s after the recording began, all trials counted'


def short_name(name: str) -> str:
    """
    Return a model's name with its effects counted where they are many.

    Parameters
    ----------
    name : str
        As in a comparison: `two-stage + creep + slack`, or `+ creep` for what an effect added.

    Returns
    -------
    str
        `two-stage + 2 effects`.
    """
    kind, *effects = name.split(' + ')
    return f'{kind} + {len(effects)} effects' if kind and len(effects) > 1 else name


def added_in_words(found: Diagnosis) -> str:
    """Return what was added for the error after it: of tied effects the first."""
    if any(found.alternatives):
        return ' and '.join(found.missing)
    return 'them' if len(found.missing) > 1 else 'it'


def capital(text: str) -> str:
    """Return text as it begins a sentence, abbreviations as they are."""
    return text[:1].upper() + text[1:]


def error_in_words(found: Diagnosis) -> str:
    """Name the error by which effects are chosen, 'error' where there is but one."""
    return 'error' if found.pooled_before is None else found.error_name


def noise_in_words(found: Diagnosis) -> str:
    """Name the noise floor; of a bench table without time that is the sensor's rounding alone."""
    return ('noise floor of the sensor' if found.small_error is None
            else "the sensor's rounding, or its noise from sample to sample")


def typical_in_words(found: Diagnosis) -> str:
    """Say what the error is by which effects of a bench are chosen; '' on an arm."""
    if found.pooled_before is None:
        return ''
    return ('the typical RMSE is the geometric mean of the RMSE on each load, or group of trials, '
            'that was held out; effects are chosen by it, not by the RMSE of all these rows')


def draws_in_words(found: Diagnosis) -> str:
    """Say that p values are the smallest that the draws can give; '' where none is."""
    if not any(found.p_value(row).startswith('<=') for row in found.ranking):
        return ''
    return (f'p <= {1.0 / (1.0 + found.draws):.2g} is the smallest that {found.draws} random draws '
            'can give')


def load_in_words(model: MuscleModel, theta: np.ndarray) -> str:
    """
    Say where the bench has not shown the muscle under the loads of an arm.

    Parameters
    ----------
    model : MuscleModel
    theta : ndarray, shape (k,)
        Angles [rad] that the arm takes.

    Returns
    -------
    str
        One sentence, empty if there is nothing to say.
    """
    found = uncovered_load(model, theta)
    if found is None:
        return ''
    arm, bench, gap = found
    where = (f"reaches into the gap between the bench's loads of {bench[0]:.1f} and "
             f'{bench[1]:.1f} N' if gap else
             f"lies beyond the bench's {bench[0]:.1f} to {bench[1]:.1f} N")
    return (f"the arm's load of {arm[0]:.1f} to {arm[1]:.1f} N {where}: expect larger errors "
            'there')


def parameters_in_words(name: str, parameters: Mapping, intervals: bool = True) -> str:
    """
    Write parameters of an effect with their units, but for those that are neutral and not fitted.

    Parameters
    ----------
    name : str
        The effect's identifier.
    parameters : mapping of str to mapping
        By name 'value', 'low', 'high' and 'unit', as `Effect.to_dict` gives them.
    intervals : bool
        Whether to write low and high, too; of what was not fitted they are the value itself.

    Returns
    -------
    str
    """
    words = []
    # All but the first, which is the effect's size.
    further = catalogue()[name].parameters[1:] if name in catalogue() else ()
    neutral = {parameter.name: parameter.neutral for parameter in further}
    for own, entry in parameters.items():
        if entry['value'] == entry['low'] == entry['high'] == neutral.get(own):
            continue
        text = f'{own} {entry["value"]:.3g}'
        if intervals and entry['low'] != entry['high']:
            text += f' ({entry["low"]:.3g} to {entry["high"]:.3g})'
        # 1 is the unit of what has none.
        words.append(text + (f' {entry["unit"]}' if entry['unit'] not in ('', '1') else ''))
    return ', '.join(words)
