# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The comparison as one HTML page."""

from __future__ import annotations

from collections.abc import Mapping

from typing import TYPE_CHECKING

from hysteresis_ros import __version__
from hysteresis_ros.report import page
from hysteresis_ros.report.drawing import png
from hysteresis_ros.comparison.where import number
from hysteresis_ros.measurements.quantities import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hysteresis_ros.comparison.compare import Comparison

CAPTIONS = {
    'overlay': 'Measured and predicted response, and below what is left; the grey band is the '
               'noise floor.',
    'waterfall': 'How the error falls with every effect that was added, down to the noise.',
    'signals': 'What is left against every signal: rows, and means with their 95 % intervals.',
    'loop': 'The loop of drive and response, and where on it the model fails.',
    'plane': 'What is left over drive and load.',
    'since_step': 'What is left against the time since the last step of the drive.',
    'correlogram': 'How long what is left remembers itself; white noise stays in the grey band.',
    'coverage': 'What the recording covers: in how many rows each value was met.',
}


def comparison_page(comparison: Comparison, pictures: Mapping[str, bytes], model_path: str) -> str:
    """
    Build the page.

    Parameters
    ----------
    comparison : Comparison
    pictures : dict of str to bytes
        PNG files by name, as `figures` and `png` make them.
    model_path : str
        Where the model came from.

    Returns
    -------
    str
        An HTML document.

    """
    header, rows = comparison.table()
    strong = [n for n, row in enumerate(rows) if row[0] == comparison.name]
    where = (page.listing([region.text for region in comparison.where]) if comparison.where
             else page.paragraph('No region stands out: the error is much the same everywhere.'))
    parts = [page.verdict(summary(comparison)),
             *[page.warning(note) for note in comparison.warnings],
             page.section('Errors', page.table(header, rows, strong))]
    parts += [page.picture(pictures[name], CAPTIONS[name]) for name in ('waterfall', 'overlay')
              if name in pictures]
    parts.append(page.section('Where it fails', where, *[
        page.picture(data, CAPTIONS.get(name, name)) for name, data in pictures.items()
        if name not in ('waterfall', 'overlay', 'correlogram', 'coverage')]))
    parts.append(page.section('Trials', *trials(comparison)))
    parts.append(page.section('Recording', *[
        page.picture(pictures[name], CAPTIONS[name]) for name in ('coverage', 'correlogram')
        if name in pictures]))
    parts.append(page.section('Provenance', page.listing(
        [f'model: {model_path}', *[f'measurement: {source}' for source in comparison.sources]],
        ordered=False)))
    return page.page('Model against measurement', *parts,
                     footer=f'hysteresis_ros {__version__}')


def summary(comparison: Comparison) -> str:
    """
    Say in one or two sentences how good the model is.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    str

    """
    unit, scale = shown(comparison.quantity)
    text = (f'The model is off by {number(scale * comparison.model.mean_abs)} {unit} on average '
            f'({number(scale * comparison.model.rmse)} {unit} RMS) over {comparison.rows} rows')
    if comparison.linear is not None:
        text += f'; the linear model by {number(scale * comparison.linear.mean_abs)} {unit}'
    text += f'. The noise floor is {number(scale * comparison.floor.value)} {unit} RMS.'
    if comparison.where:
        text += f' Where it fails most: {comparison.where[0].text}.'
    return text


def trials(comparison: Comparison, most: int = 60) -> list[str]:
    """Return the table of the trials as HTML parts, the worst first if they are many."""
    unit, scale = shown(comparison.quantity)
    header = ['trial', 'rows', f'mean |e| [{unit}]', f'RMSE [{unit}]', 'linear RMSE', 'file']
    entries = comparison.by_trial
    note = []
    if len(entries) > most:
        note = [page.paragraph(f'The {most} worst of {len(entries)} trials.')]
        entries = sorted(entries, key=lambda entry: -entry['model'].rmse)[:most]
    rows = [[f'{entry["trial"]:g}', str(entry['rows']), number(scale * entry['model'].mean_abs),
             number(scale * entry['model'].rmse),
             '-' if entry['linear'] is None else number(scale * entry['linear'].rmse),
             entry['source']] for entry in entries]
    return [*note, page.table(header, rows)]


def rendered(drawn: Mapping[str, Figure]) -> dict[str, bytes]:
    """Return the PNG files of figures, dict of str to bytes."""
    return {name: png(figure) for name, figure in drawn.items()}
