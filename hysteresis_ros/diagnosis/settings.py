# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Every number that the selection of effects rests on, with its reason."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Settings:
    """
    Settings of the selection.

    `tools/settings.py` prints how the scores move when each is halved and doubled.

    Attributes
    ----------
    prior : float
        Probability of each effect beforehand: about one of a catalogue of forty.
    most_effects : int
        Effects in one set; more are not told apart by one recording.
    most_on_bench : int
        The same for a bench, whose loads tell more of them apart.
    beam : int
        Sets from which larger ones are grown.
    refits : int
        Sets that are fitted in full of those scored by linearisation, a generation. On 80 cases of
        one wire 6 name one less than 4 and take a quarter longer, and 3 lose one of four pairs.
    scale_spread : float
        Spread (natural logarithm) of the discrepancy's size against that seen on the bench,
        because the arm goes other ways than the bench: a third.
    correlation : float
        Shortest length over which the discrepancy changes, as a share of the response's range and
        of its way over the drives: about one cell of the bench's grid of weights.
    practical : float
        Smallest reduction of the RMSE that matters to a user.
    form : float
        Share by which an effect's equation may be off, with a probability of 95 %: what an effect
        changes is as uncertain, and a set whose error is larger than that of another of as few
        effects by more than this share is no answer.
    coarsening : float
        Rows that many rows are worth: neither the discrepancy's covariance nor an effect's equation
        is exact, so that n rows say what n / (1 + n / coarsening) of a true model would, and log
        evidences are divided by 1 + n / coarsening before they are compared (Miller and Dunson,
        J. Am. Stat. Assoc. 114 (2019) 1113).
    reported : float
        Sets less likely than this are not reported as alternatives.
    draws : int
        Random draws behind a p value.
    """

    prior: float = 0.03
    most_effects: int = 3
    most_on_bench: int = 4
    beam: int = 3
    refits: int = 4
    scale_spread: float = 0.3
    correlation: float = 0.05
    practical: float = 0.05
    form: float = 0.1
    coarsening: float = 40.0
    reported: float = 0.02
    draws: int = 400
