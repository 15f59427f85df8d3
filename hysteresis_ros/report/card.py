# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The card on top of a page: what was found, how sure it is, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from hysteresis_ros.comparison.where import number
from hysteresis_ros.effects import catalogue
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.report import commands, page
from hysteresis_ros.report.glossary import linked
from hysteresis_ros.report.page import Html
from hysteresis_ros.report.provenance import Origin
from hysteresis_ros.report.reasons import probabilities, share, why_not_another
from hysteresis_ros.report.words import capital, parameters_in_words, verdict_in_words

if TYPE_CHECKING:
    from hysteresis_ros.comparison.compare import Comparison
    from hysteresis_ros.diagnosis.extend import Extension
    from hysteresis_ros.diagnosis.verdict import Diagnosis


def card(headline: str, facts: Sequence[tuple[str, str]], *parts: str) -> str:
    """
    Return a card as HTML.

    Parameters
    ----------
    headline : str
        Text or Html.
    facts : sequence of (str, str)
        Name and content, text or Html; those without content are left out.
    *parts : str
        HTML between the headline and the facts.

    Returns
    -------
    str
    """
    return (f'<section class="card" aria-labelledby="verdict">\n'
            f'<h2 id="verdict">{page.html(headline)}</h2>\n' + '\n'.join(parts)
            + page.facts(facts) + '\n</section>')


def diagnosis_card(found: Diagnosis, quantity: str, model_path: str, sources: Sequence[str],
                   origin: Origin) -> str:
    """
    Return the card of a diagnosis.

    Parameters
    ----------
    found : Diagnosis
    quantity : str
        What was measured.
    model_path : str
        The model's file.
    sources : sequence of str
        Recordings.
    origin : Origin

    Returns
    -------
    str
        HTML.
    """
    headline, _, rest = verdict_in_words(found).partition('. ')
    if found.verdict == 'missing':
        headline = 'Missing: ' + '; and '.join(
            f'one of {", ".join([name, *others])}' if others else name
            for name, others in zip(found.missing, found.alternatives))
    facts = [(title, text) for title, text in (
        ('Value, with 95 % interval', values_of(found)),
        ('Probability', probability_of(found)),
        (f'{capital(found.error_name)} on rows not fitted', errors_of(found, quantity))) if text]
    wide = [('Why not another', linked(why_not_another(found, quantity))),
            ('What to do next', Html(
                f'{linked(found.experiment)}.' + page.command(
                    commands.after_diagnosis(found, model_path, sources, origin))))]
    return card(linked(headline.removesuffix('.')), [*facts, *wide],
                *([f'<p>{linked(rest)}</p>'] if rest else []))


def values_of(found: Diagnosis) -> Html:
    """Return the values of the missing effects, and of each tied one in its place."""
    fitted = {effect.id: effect.to_dict()['parameters'] for effect in found.effects}
    ranked = {row['effect']: row['parameters'] for row in found.ranking}
    lines = []
    for name, others in zip(found.missing, found.alternatives):
        for one in [name, *others]:
            parameters = fitted.get(one, ranked.get(one))
            if parameters:
                lines.append(f'{"or " if one != name else ""}{linked(one)}: '
                             + escape(parameters_in_words(one, parameters)))
    return Html('<br>'.join(lines))


def probability_of(found: Diagnosis) -> Html:
    """Return the probability of the answer; of tied ones that of all, and of each."""
    known = probabilities(found)
    if not known:
        return Html('')
    total = share(sum(value for _, value in known))
    text = f'<strong>{total}</strong>'
    if len(known) > 1:
        text += ' that it is one of them: ' + ', '.join(
            f'{linked(name)} {share(value)}' for name, value in known)
    return Html(text)


def errors_of(found: Diagnosis, quantity: str) -> Html:
    """Return the held-out error before and after, with the error below which none matters."""
    unit, scale = shown(quantity)
    text = f'<strong>{number(scale * found.rmse_before)}'
    if found.missing:
        text = f'from {text} to {number(scale * found.rmse_after)} {unit}</strong>'
        if found.rmse_before > 0.0:
            less = 100.0 * (1.0 - found.rmse_after / found.rmse_before)
            text += f', {less:.0f} % less'
    else:
        text += f' {unit}</strong>'
    if found.small_error is None:
        return Html(text + f'; the noise floor is {number(scale * found.noise_floor)} {unit}')
    return Html(text + f'; errors below {number(scale * found.small_error)} {unit} do not matter')


def comparison_card(comparison: Comparison, model_path: str, origin: Origin) -> str:
    """
    Return the card of a comparison.

    Parameters
    ----------
    comparison : Comparison
    model_path : str
        The model's file.
    origin : Origin

    Returns
    -------
    str
        HTML.
    """
    unit, scale = shown(comparison.quantity)
    error = f'{number(scale * comparison.model.mean_abs)} {unit}'
    rmse = (f'<strong>{number(scale * comparison.model.rmse)} {unit}</strong>; the noise floor is '
            f'{number(scale * comparison.floor.value)} {unit}')
    facts: list[tuple[str, str]] = [('RMSE', Html(rmse))]
    if comparison.linear is not None:
        facts.append(('RMSE of the linear model', Html(
            f'<strong>{number(scale * comparison.linear.rmse)} {unit}</strong>')))
    if comparison.extensions:
        before = comparison.extensions[0][1]
        facts.append(('RMSE without the added effects', Html(
            f'<strong>{number(scale * before.rmse)} {unit}</strong>')))
    facts.append(('Where it fails most', comparison.where[0].text if comparison.where
                  else 'nowhere: the error is much the same everywhere'))
    facts.append(('What to do next', Html('ask what the model is missing.' + page.command(
        commands.after_comparison(model_path, comparison.sources, origin)))))
    return card(f'Off by {error} on average over {comparison.rows} rows', facts)


def extension_card(extension: Extension, tested: bool, quantity: str, model_path: str,
                   origin: Origin) -> str:
    """
    Return the card of an extension.

    Parameters
    ----------
    extension : Extension
    tested : bool
        Whether there was a recording that was not fitted.
    quantity : str
        What was measured.
    model_path : str
        Where the extended model was written.
    origin : Origin

    Returns
    -------
    str
        HTML.
    """
    unit, scale = shown(quantity)
    errors = extension.test or extension.train
    before, after = (number(scale * errors[name]) for name in ('rmse_before', 'rmse_after'))
    seen = 'unseen' if tested else 'fitted'
    added = {effect.id: effect.to_dict()['parameters'] for effect in extension.added}
    values = Html('<br>'.join(f'{linked(name)}: {escape(parameters_in_words(name, parameters))}'
                              for name, parameters in added.items()))
    sentences = ' '.join(catalogue()[name].sentence for name in added if name in catalogue())
    return card(
        linked(f'Adding {", ".join(added)} takes the error on the {seen} recording from {before} '
               f'to {after} {unit} RMS'),
        [('Value, with 95 % interval', values),
         (f'RMSE on the {seen} recording',
          Html(f'from <strong>{before} to {after} {unit}</strong>')),
         ('What to do next', Html('try it on a recording that neither step has seen.'
                                  + page.command(commands.after_extension(model_path, origin))))],
        f'<p>{escape(sentences)}</p>')
