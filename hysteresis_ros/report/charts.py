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


def explorer(before: Comparison, after: Comparison | None = None, with_effects: str = '',
             judge_after: bool = False, pictures: dict[str, bytes] | None = None) -> str:
    """
    Return response, residual and loop of a recording, with the controls of the page's script.

    Parameters
    ----------
    before : Comparison
    after : Comparison, optional
        The same rows with more effects.
    with_effects : str
        What the curve of `after` is called.
    judge_after : bool
        Whether the loop's colours, the regions and the charts of the signals are those of `after`.
    pictures : dict of str to bytes, optional
        PNG files by name that were drawn already; by default `overlay` and `loop` are drawn.

    Returns
    -------
    str
        HTML. Without the script the pictures stay.
    """
    comparison = after if judge_after and after is not None else before
    drawn = pictures or {'overlay': png(overlay(before, after)),
                         'loop': png(residual_on_loop(comparison))}
    curves = [Curve(short_name(before.name), 'model', before.predicted)]
    if after is not None:
        curves.append(Curve(with_effects, 'after', after.predicted))
    if before.linear_predicted is not None:
        curves.append(Curve('linear model', 'linear', before.linear_predicted))
    content = recording(comparison, curves, int(comparison is after))
    said = {**descriptions(comparison), 'overlay': descriptions(before, after)['overlay']}
    note = ([] if content['drawn'] == comparison.rows else [page.paragraph(
        f'{content["drawn"]} of {comparison.rows} rows are drawn: of each stretch the extremes.')])
    figures = [page.picture(drawn[kind], caption, said[kind], chart)
               for kind, caption, chart in (('overlay', LINES, 'lines'), ('loop', LOOP, 'loop'))
               if kind in drawn]
    return ('<div class="explore">\n<div class="tools"></div>\n' + '\n'.join([*figures, *note])
            + '\n' + page.data('recording', as_json(content)) + '\n</div>')
