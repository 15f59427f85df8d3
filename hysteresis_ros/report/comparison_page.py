# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The comparison as one HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from typing import TYPE_CHECKING

from hysteresis_ros import __version__
from hysteresis_ros.report import page
from hysteresis_ros.report.card import comparison_card
from hysteresis_ros.report.charts import explorer
from hysteresis_ros.report.descriptions import descriptions
from hysteresis_ros.report.drawing import png
from hysteresis_ros.report.glossary import glossary, linked
from hysteresis_ros.report.provenance import Origin, provenance
from hysteresis_ros.report.words import short_name
from hysteresis_ros.comparison.where import number
from hysteresis_ros.measurements.quantities import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hysteresis_ros.comparison.compare import Comparison
    from hysteresis_ros.measurements import Measurement

CAPTIONS = {
    'signals': 'The residual against every signal: rows, and means with their 95 % intervals.',
    'plane': 'The residual over drive and load.',
    'since_step': 'The residual against the time since the last step of the drive.',
    'correlogram': 'How long the residual remembers itself; white noise stays in the grey band.',
    'coverage': 'What the recording covers: in how many rows each value was met.',
}
ABOUT_RECORDING = ('coverage', 'correlogram')
# More trials than this are folded away.
FEW = 8


def comparison_page(comparison: Comparison, pictures: Mapping[str, bytes], model_path: str,
                    origin: Origin | None = None,
                    measurements: Sequence[Measurement] = ()) -> str:
    """
    Build the page.

    Parameters
    ----------
    comparison : Comparison
    pictures : dict of str to bytes
        PNG files by name, as `figures` and `png` make them.
    model_path : str
        Where the model came from.
    origin : Origin, optional
        The command that asked for the page.
    measurements : sequence of Measurement
        For the hashes of their files.

    Returns
    -------
    str
        An HTML document.

    """
    origin = origin or Origin()
    said = descriptions(comparison)
    drawn = {name: pictures[name] for name in ('overlay', 'loop') if name in pictures}
    parts = [comparison_card(comparison, model_path, origin),
             *[page.warning(note) for note in comparison.warnings],
             page.section('Errors', *errors(comparison))]
    if drawn:
        parts.append(page.section('Response and residual', explorer(comparison, pictures=drawn)))
    parts.append(page.section('Where it fails', regions(comparison), *[
        page.picture(data, CAPTIONS[name], said[name], 'signals' if name == 'signals' else '')
        for name, data in pictures.items()
        if name in CAPTIONS and name not in ABOUT_RECORDING]))
    parts.append(page.section('Trials', *trials(comparison)))
    if 'coverage' in pictures or 'correlogram' in pictures:
        parts.append(page.section('Recording', *[
            page.picture(pictures[name], CAPTIONS[name], said[name]) for name in ABOUT_RECORDING
            if name in pictures]))
    parts.append(provenance(origin, model_path, measurements, comparison.sources))
    return page.page('Model against measurement', *parts, glossary(*parts),
                     footer=f'hysteresis_ros {__version__}')


def regions(comparison: Comparison) -> str:
    """Return where a model fails, worst first, as HTML."""
    if not comparison.where:
        return page.paragraph('No region stands out: the error is much the same everywhere.')
    return page.listing([region.text for region in comparison.where])


def errors(comparison: Comparison) -> list[str]:
    """Return the table of errors, and the RMSE as bars, as HTML parts."""
    unit, scale = shown(comparison.quantity)
    header, rows = comparison.table()
    strong = [n for n, row in enumerate(rows) if row[0] == comparison.name]
    steps = comparison.extensions or [(comparison.name, comparison.model)]
    bars = [page.Bar(linked(short_name(name)), scale * values.rmse,
                     strong=len(steps) > 1 and values is steps[-1][1]) for name, values in steps]
    if comparison.linear is not None:
        bars.insert(0, page.Bar('linear model', scale * comparison.linear.rmse, hollow=True))
    bars.append(page.Bar('noise floor', scale * comparison.floor.value, hollow=True))
    parts = [page.bars(bars, f'{unit} RMS')]
    if steps[0][0] != short_name(steps[0][0]):
        kind, *effects = steps[0][0].split(' + ')
        parts.append(page.paragraph(linked(
            f'{short_name(steps[0][0])}: {kind} with {", ".join(effects)}.')))
    named = [[linked(renamed(row[0])), *row[1:]] for row in rows]
    return [*parts, page.table(header, named, strong)]


def renamed(name: str) -> str:
    """Return the name of a row of the table of errors with a short model name."""
    model, comma, rest = name.partition(', ')
    return short_name(model) + comma + rest


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
    table = page.table(header, rows)
    if len(rows) > FEW:
        table = page.details(f'{len(rows)} trials', table)
    return [*note, table]


def rendered(drawn: Mapping[str, Figure]) -> dict[str, bytes]:
    """Return the PNG files of figures, dict of str to bytes."""
    return {name: png(figure) for name, figure in drawn.items()}
