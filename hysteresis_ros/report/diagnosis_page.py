# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnosis and extension as one self-contained page: the plain verdict first."""

from __future__ import annotations

from collections.abc import Sequence

from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros import __version__
from hysteresis_ros.atomic import AnyPath, write_text
from hysteresis_ros.report import page
from hysteresis_ros.comparison.compare import compare, Comparison
from hysteresis_ros.report.comparison_page import CAPTIONS
from hysteresis_ros.report.drawing import new_figure, png
from hysteresis_ros.report.plots import figures, ranking
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.comparison.where import number
from hysteresis_ros.report.words import draws_in_words, parameters_in_words, verdict_in_words
from hysteresis_ros.measurements.quantities import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hysteresis_ros.diagnosis.extend import Extension
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

MOST_ROWS = 15
BEFORE, AFTER = '#b0b0b0', '#1f77b4'


def write_diagnosis(path: AnyPath, model: MuscleModel, measurements: Sequence[Measurement],
                    found: Diagnosis, model_path: str) -> None:
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
    """
    unit, scale = shown(measurements[0].response)
    before = compare(model, measurements)
    parts = [page.verdict(verdict_in_words(found)),
             page.paragraph(f'What to do next: {found.experiment}.')]
    after = None
    if found.effects:
        problem = problem_for(model, measurements)
        after = compare(problem.completed([*model.effects, *found.effects]), measurements)
    parts += _where(before)
    if found.ranking:
        parts.append(page.section('Effects, by what they do on rows not fitted', page.picture(
            png(ranking(found, MOST_ROWS)),
            'Error with each effect added alone, with 95 % intervals; hollow: outside its physical '
            'range. Dashed: the error without it.'), _ranking_table(found, scale, unit),
            *([page.paragraph(draws_in_words(found) + '.')] if draws_in_words(found) else [])))
    alternatives = [f'{name} cannot be told from {", ".join(others)}' for name, others in zip(
        found.missing, found.alternatives) if others]
    hidden = [f'{name}: {reason}' for name, reason in found.not_excited.items()]
    if alternatives:
        parts.append(page.section('Alternatives', page.listing(alternatives, ordered=False)))
    if hidden:
        parts.append(page.section('What this recording could not show', page.listing(
            hidden, ordered=False)))
    if after is not None:
        parts += _before_and_after(before, after, scale, unit)
    parts.append(page.section('What the error is made of', page.table(
        ['part', f'RMSE [{unit}]'],
        [['without the effects, rows not fitted', number(scale * found.rmse_before)],
         ['with them', number(scale * found.rmse_after)],
         ['error of the base model by itself (from the bench)',
          number(scale * found.structural_error)],
         ['noise floor of the sensor', number(scale * found.noise_floor)]])))
    parts.append(_provenance(model_path, measurements))
    _write(path, 'What the model is missing', parts)


def write_extension(path: AnyPath, model: MuscleModel, extension: Extension,
                    train: Sequence[Measurement], test: Sequence[Measurement],
                    model_path: str) -> None:
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
    """
    judged = list(test) or list(train)
    unit, scale = shown(judged[0].response)
    errors = extension.test or extension.train
    seen = 'unseen' if test else 'fitted'
    names = ', '.join(effect.id for effect in extension.added)
    parts = [page.verdict(f'Adding {names} takes the error on the {seen} recording from '
                          f'{number(scale * errors["rmse_before"])} to '
                          f'{number(scale * errors["rmse_after"])} {unit} RMS.')]
    parts += [page.warning(f'{name} is outside its physical range: it stands in for something '
                           'else') for name in extension.implausible]
    rows = [[effect.id, name, f'{entry["value"]:.4g}', f'{entry["low"]:.4g}',
             f'{entry["high"]:.4g}', entry['unit']] for effect in extension.added
            for name, entry in effect.to_dict()['parameters'].items()]
    parts.append(page.section('Parameters', page.table(
        ['effect', 'parameter', 'value', 'low', 'high', 'unit'], rows)))
    before, after = compare(model, judged), compare(extension.model, judged)
    parts += _before_and_after(before, after, scale, unit)
    parts += _where(after)
    parts.append(_provenance(model_path, [*train, *test]))
    _write(path, 'The extended model', parts)


def _write(path: AnyPath, title: str, parts: Sequence[str]) -> None:
    write_text(path, page.page(title, *parts, footer=f'hysteresis_ros {__version__}'))


def _where(comparison: Comparison) -> list[str]:
    pictures = figures(comparison)
    return [page.section('Where it fails', *(
        [page.listing([region.text for region in comparison.where])] if comparison.where
        else [page.paragraph('No region stands out: the error is much the same everywhere.')]),
        *[page.picture(png(pictures[name]), CAPTIONS[name])
          for name in ('overlay', 'signals', 'loop') if name in pictures])]


def _before_and_after(before: Comparison, after: Comparison, scale: float, unit: str) -> list[str]:
    pictures = figures(after)
    parts = [page.picture(png(_residuals(before, after, scale, unit)),
                          'What is left before and after, on the same axes.')]
    if 'waterfall' in pictures:
        parts.insert(0, page.picture(png(pictures['waterfall']), CAPTIONS['waterfall']))
    header, rows = after.table()
    return [page.section('Before and after', page.table(header, rows), *parts)]


def _residuals(before: Comparison, after: Comparison, scale: float, unit: str) -> Figure:
    figure, axes = new_figure(10.0, 3.2)
    axis = axes[0, 0]
    step = max(1, before.rows // 4000)
    index = np.arange(0, before.rows, step)
    for comparison, label, colour in ((before, 'before', BEFORE), (after, 'after', AFTER)):
        axis.plot(index, scale * comparison.residual[::step], lw=0.9, color=colour, label=label)
    axis.axhline(0.0, color='black', lw=0.7)
    axis.set_xlabel('row')
    axis.set_ylabel(f'measured less predicted [{unit}]')
    axis.legend(fontsize=8)
    return figure


def _ranking_table(found: Diagnosis, scale: float, unit: str) -> str:
    rows = []
    for row in found.ranking[:MOST_ROWS]:
        values = parameters_in_words(row['parameters'])
        rows.append([row['effect'], number(scale * row['rmse_after']),
                     f'{100.0 * row["gain"]:.0f} %', found.p_value(row),
                     f'{100.0 * row["absorbed"]:.0f} %', 'yes' if row['plausible'] else 'no',
                     values])
    strong = [place for place, row in enumerate(found.ranking[:MOST_ROWS])
              if row['effect'] in found.missing]
    return page.table(['effect', f'RMSE after [{unit}]', 'gain', 'p', 'refitted weights would '
                       'absorb', 'plausible', 'parameters'], rows, strong)


def _provenance(model_path: str, measurements: Sequence[Measurement]) -> str:
    return page.section('Provenance', page.listing(
        [f'model: {model_path}', *[f'measurement: {m.source} ({m.digest[:12]})'
                                   for m in measurements]], ordered=False))
