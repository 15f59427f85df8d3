# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The counts that an encoder with troubles shows of an arm: it stands still, turns round, jumps."""

from collections.abc import Callable
import math

COUNTS_PER_REVOLUTION = 8192
INDEX_COUNTS = 2731         # the index pulse: at 120 degrees, within the range of the arm
JUMP_COUNTS = 5 * COUNTS_PER_REVOLUTION // 2   # of an encoder that jumps


class EncoderTroubles:
    """
    What comes between an arm and the counter of its encoder.

    Parameters
    ----------
    jump : float
        Time of the arm in s at which the encoder jumps by `JUMP_COUNTS`.
    """

    def __init__(self, jump: float = math.inf) -> None:
        self._jump = jump
        self._still = self._turned = 0      # counts at which the encoder stands, or turned round
        self._was_still = self._was_reversed = False

    def counts(self, true: int, time: float, troubled: Callable[[str], bool]) -> int:
        """
        Return what the encoder shows.

        Parameters
        ----------
        true : int
            Counts of the arm.
        time : float
            Of the arm, in s.
        troubled : callable
            Whether a trouble is there now, by its name.

        Returns
        -------
        int
        """
        counts = true
        if troubled('encoder_still'):
            if not self._was_still:
                self._still = counts
            counts = self._still
        self._was_still = troubled('encoder_still')
        if troubled('encoder_reversed'):
            if not self._was_reversed:
                self._turned = counts
            counts = 2 * self._turned - counts
        self._was_reversed = troubled('encoder_reversed')
        return counts + (JUMP_COUNTS if time >= self._jump else 0)
