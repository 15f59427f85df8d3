# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The picture of operators side by side: their error over what they cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hysteresis_ros.report.drawing import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hysteresis_ros.identification.choice import Choice


def choice_figure(choice: Choice) -> Figure:
    """
    Draw the error on rows held out over the number of parameters and over the time of a step.

    Parameters
    ----------
    choice : Choice

    Returns
    -------
    matplotlib.figure.Figure

    """
    figure, axes = new_figure(11.0, 5.5, columns=2, sharey=True)
    costs = (('parameters', 'number of parameters'), ('invert_us', 'time of a scalar inverse [us]'))
    for axis, (cost, label) in zip(axes[0], costs):
        for number, score in enumerate(choice.scores, start=1):
            taken = score is choice.simplest
            place = getattr(score, cost), 100.0 * score.held_out / choice.span
            axis.plot(*place, 's' if taken else 'o', markersize=7 if taken else 4,
                      color='#2f6db5' if taken else '#333333',
                      label=f'{number}  {score.name}')
            axis.annotate(str(number), place, xytext=(4, 4), textcoords='offset points',
                          fontsize=8)
        axis.set_xscale('log')
        axis.set_ylim(bottom=0.0)
        axis.set_xlabel(label, fontsize=9)
    axes[0, 0].set_ylabel(f'RMSE of the {choice.response} held out [% of its range]', fontsize=9)
    axes[0, 1].legend(fontsize=7, loc='center left', bbox_to_anchor=(1.0, 0.5), frameon=False,
                      handlelength=1.0)
    return figure
