# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The part of a page in which a recording can be explored: response, residual and loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hysteresis_ros.report import page
from hysteresis_ros.report.descriptions import descriptions
from hysteresis_ros.report.drawing import png
from hysteresis_ros.report.plots import overlay, residual_on_loop
from hysteresis_ros.report.recording import as_json, Curve, recording
from hysteresis_ros.report.words import short_name

if TYPE_CHECKING:
    from hysteresis_ros.comparison.compare import Comparison

LINES = ('Response, and below it the residual; the grey band is the noise floor, dotted lines '
         'part the trials, the tinted rows are the region that is chosen.')
LOOP = 'The loop of drive and response; where on it the model fails.'


def explorer(comparison: Comparison, after: Comparison | None = None, with_effects: str = '',
             pictures: dict[str, bytes] | None = None) -> str:
    """
    Return response, residual and loop of a recording, with the controls of the page's script.

    Parameters
    ----------
    comparison : Comparison
        Its residual colours the loop, and its regions are shaded.
    after : Comparison, optional
        The same rows with more effects.
    with_effects : str
        What the curve of `after` is called.
    pictures : dict of str to bytes, optional
        PNG files by name that were drawn already; what is missing of `overlay` and `loop` is drawn.

    Returns
    -------
    str
        HTML. Without the script the pictures stay.
    """
    drawn = pictures or {'overlay': png(overlay(comparison, after)),
                         'loop': png(residual_on_loop(comparison))}
    curves = [Curve(short_name(comparison.name), 'model', comparison.predicted)]
    if after is not None:
        curves.append(Curve(with_effects, 'after', after.predicted))
    if comparison.linear_predicted is not None:
        curves.append(Curve('linear model', 'linear', comparison.linear_predicted))
    content = recording(comparison, curves)
    said = descriptions(comparison, after)
    note = ([] if content['drawn'] == comparison.rows else [page.paragraph(
        f'{content["drawn"]} of {comparison.rows} rows are drawn: of each stretch the extremes.')])
    figures = [page.picture(drawn[kind], caption, said[kind], chart)
               for kind, caption, chart in (('overlay', LINES, 'lines'), ('loop', LOOP, 'loop'))
               if kind in drawn]
    return ('<div class="explore">\n<div class="tools"></div>\n' + '\n'.join([*figures, *note])
            + '\n' + page.data('recording', as_json(content)) + '\n</div>')
