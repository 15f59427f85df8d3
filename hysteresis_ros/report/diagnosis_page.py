# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnosis and extension as one self-contained page: the verdict first."""

from __future__ import annotations

from collections.abc import Sequence

from typing import TYPE_CHECKING

from hysteresis_ros import __version__
from hysteresis_ros.atomic import AnyPath, write_text
from hysteresis_ros.report import page
from hysteresis_ros.comparison.compare import compare, Comparison
from hysteresis_ros.report.card import diagnosis_card, extension_card
from hysteresis_ros.report.charts import explorer
from hysteresis_ros.report.comparison_page import CAPTIONS, errors, regions
from hysteresis_ros.report.descriptions import descriptions
from hysteresis_ros.report.drawing import png
from hysteresis_ros.report.glossary import glossary, linked
from hysteresis_ros.report.plots import residual_against_signals
from hysteresis_ros.report.provenance import Origin, provenance
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.comparison.where import number
from hysteresis_ros.report.words import (
    capital, draws_in_words, noise_in_words, parameters_in_words, typical_in_words)
from hysteresis_ros.measurements.quantities import shown

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.extend import Extension
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

MOST_ROWS = 15


def write_diagnosis(path: AnyPath, model: MuscleModel, measurements: Sequence[Measurement],
                    found: Diagnosis, model_path: str, origin: Origin | None = None) -> None:
    """
    Write the page of a diagnosis.

    Parameters
    ----------
    path : str or Path
        The HTML file.
    model : MuscleModel
        As it was diagnosed.
    measurements : sequence of Measurement
    found : Diagnosis
    model_path : str
        Where the model came from.
    origin : Origin, optional
        The command that asked for the page.
    """
    origin = origin or Origin()
    quantity = measurements[0].response
    unit, scale = shown(quantity)
    before = compare(model, measurements)
    after = None
    if found.effects:
        problem = problem_for(model, measurements)
        after = compare(problem.completed([*model.effects, *found.effects]), measurements)
    with_effects = 'with ' + ' and '.join(found.missing)
    parts = [diagnosis_card(found, quantity, model_path, [m.source for m in measurements], origin),
             page.section('Response and residual', explorer(before, after, with_effects)),
             _where(before)]
    if found.ranking:
        parts.append(_ranking(found, scale, unit))
    alternatives = [linked(f'{name} cannot be told from {", ".join(others)}')
                    for name, others in zip(found.missing, found.alternatives) if others]
    hidden = [linked(f'{name}: {reason}') for name, reason in found.not_excited.items()]
    if len(found.sets) > 1:
        parts.append(page.section('Probabilities', _sets(found, scale, unit)))
    if alternatives:
        parts.append(page.section('Alternatives', page.listing(alternatives, ordered=False)))
    if hidden:
        parts.append(page.section('What this recording could not show', page.listing(
            hidden, ordered=False)))
    if after is not None:
        parts.append(page.section('Before and after, on all rows', *errors(after)))
    parts.append(_parts_of_the_error(found, scale, unit))
    parts.append(provenance(origin, model_path, measurements))
    _write(path, 'What the model is missing', parts)


def write_extension(path: AnyPath, model: MuscleModel, extension: Extension,
                    train: Sequence[Measurement], test: Sequence[Measurement],
                    model_path: str, origin: Origin | None = None) -> None:
    """
    Write the page of an extension.

    Parameters
    ----------
    path : str or Path
        The HTML file.
    model : MuscleModel
        Before.
    extension : Extension
    train, test : sequence of Measurement
        Fitted and unseen recordings.
    model_path : str
        Where the extended model was written.
    origin : Origin, optional
        The command that asked for the page.
    """
    origin = origin or Origin()
    judged = list(test) or list(train)
    parts = [extension_card(extension, bool(test), judged[0].response, model_path, origin)]
    parts += [page.warning(f'{name} is outside its physical range: an implausible explanation')
              for name in extension.implausible]
    before, after = compare(model, judged), compare(extension.model, judged)
    names = ' and '.join(effect.id for effect in extension.added)
    rows = [[linked(effect.id), name, f'{entry["value"]:.4g}', f'{entry["low"]:.4g}',
             f'{entry["high"]:.4g}', entry['unit']] for effect in extension.added
            for name, entry in effect.to_dict()['parameters'].items()]
    parts += [page.section('Response and residual', explorer(
        before, after, f'with {names}', judge_after=True)),
              page.section('Parameters', page.table(
                  ['effect', 'parameter', 'value', 'low', 'high', 'unit'], rows)),
              page.section('Before and after', *errors(after)),
              _where(after),
              provenance(origin, model_path, [*train, *test])]
    _write(path, 'The extended model', parts)


def _write(path: AnyPath, title: str, parts: Sequence[str]) -> None:
    write_text(path, page.page(title, *parts, glossary(*parts),
                               footer=f'hysteresis_ros {__version__}'))


def _where(comparison: Comparison) -> str:
    return page.section('Where it fails', regions(comparison), page.picture(
        png(residual_against_signals(comparison)), CAPTIONS['signals'],
        descriptions(comparison)['signals'], 'signals'))


def _parts_of_the_error(found: Diagnosis, scale: float, unit: str) -> str:
    """Return what is known of the error as a section; of a bench by both its means."""
    rows: list[tuple[str, float | None]] = [
        (f'{found.error_name} without the effects, rows not fitted', found.rmse_before),
        (f'{found.error_name} with them', found.rmse_after if found.missing else None),
        ('RMSE of all these rows without the effects', found.pooled_before),
        ('RMSE of all these rows with them', found.pooled_after if found.missing else None),
        ('error of the base model by itself, as its bench shows', found.bench_error),
        ('the same with what no bench of constant loads shows', found.structural_error),
        ('error below which none matters: 1 % of the range, or the noise', found.small_error),
        (noise_in_words(found), found.noise_floor)]
    words = typical_in_words(found)
    return page.section(
        'What the error is made of',
        page.table(['part', f'error [{unit}]'], [
            [capital(name), number(scale * value)] for name, value in rows if value is not None]),
        *([page.paragraph(f'{capital(words)}.')] if words else []))


def _ranking(found: Diagnosis, scale: float, unit: str) -> str:
    """Return the effects by themselves as a section: bars, and all numbers in a table."""
    rows = found.ranking[:MOST_ROWS]
    bars = [page.Bar(linked(row['effect']), scale * row['rmse_after'],
                     scale * row['rmse_before'] * (1.0 - row['gain_high']),
                     scale * row['rmse_before'] * (1.0 - row['gain_low']),
                     strong=row['effect'] in found.missing, hollow=not row['plausible'])
            for row in rows]
    if len(found.missing) > 1:
        bars.append(page.Bar(linked(' with '.join(found.missing)), scale * found.rmse_after,
                             strong=True))
    bars.append(page.Bar('without any of them', scale * found.rmse_before, hollow=True))
    draws = draws_in_words(found)
    return page.section(
        'Effects, by what they do on rows not fitted',
        page.paragraph(f'{capital(found.error_name)} with each effect added alone, with its 95 % '
                       'interval; in outline what is outside its physical range.'),
        page.bars(bars, unit), page.details('All numbers', _ranking_table(found, scale, unit)),
        *([page.paragraph(draws + '.')] if draws else []))


def _ranking_table(found: Diagnosis, scale: float, unit: str) -> str:
    rows = []
    for row in found.ranking[:MOST_ROWS]:
        values = parameters_in_words(row['effect'], row['parameters'])
        rows.append([linked(row['effect']), number(scale * row['rmse_after']),
                     f'{100.0 * row["gain"]:.0f} %', found.p_value(row),
                     f'{100.0 * row["absorbed"]:.0f} %', 'yes' if row['plausible'] else 'no',
                     values])
    strong = [place for place, row in enumerate(found.ranking[:MOST_ROWS])
              if row['effect'] in found.missing]
    return page.table(['effect', f'{found.error_name} after [{unit}]', 'gain', 'p',
                       'refitted weights would absorb', 'plausible', 'parameters'], rows, strong)


def _sets(found: Diagnosis, scale: float, unit: str) -> str:
    rows = [[linked(' with '.join(entry['effects']) or 'the model as it is'),
             f'{entry["probability"]:.3f}', number(scale * entry['rmse'])]
            for entry in found.sets[:MOST_ROWS]]
    return page.table(['effects', 'probability', f'{found.error_name} [{unit}]'], rows)
