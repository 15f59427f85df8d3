# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an arm has done before effects begin in the middle of its trial.

Until then the model acts that is in use. What the muscle, the arm and the effects of that model
remember goes on with the effects that begin. One that has a past itself begins in balance with the
last row before, as a lag does at the heat that is there and play that is centred at its angle; but
those that add to the elongation, as cycles do, have seen all that went by.
"""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import DriveEffect, Inputs
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.model.chain import Chain

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model.muscle import Lifting
    from hysteresis_ros.model.simulation import Response

# Column of an arm run that is not 0 in its first rows, those before the onset.
COLUMN = 'before_onset'


def rows_before(measurement: Measurement) -> int:
    """
    Return how many rows of an arm run lie before the onset; 0 where the effects always act.

    Raises
    ------
    MeasurementError
        If these are not the first ones of a single trial, with others after them.
    """
    marked = measurement.columns.get(COLUMN, np.zeros(0)) != 0.0
    count = int(np.count_nonzero(marked))
    if count and (not marked[:count].all() or count == measurement.rows
                  or len(list(measurement.split())) > 1):
        raise MeasurementError(
            f'{measurement.source}: the column {COLUMN!r} may be other than 0 only in the first '
            'rows of a recording of one trial, and not in all of them')
    return count


class Past:
    """
    The rows of a trial before the onset, as the effects that act before it have it.

    Parameters
    ----------
    chain : Chain
        These effects.
    response : Response
        What the arm does in the rows before.
    balance : ArmBalance, BreakingBalance or YieldingBalance
        The arm after them.
    phase : ndarray, shape (rows,)
        Martensite share in them.

    Attributes
    ----------
    rows : int
        How many these are.
    columns : ndarray, shape (3, rows)
        Angle [rad] before the sensor, output and input of H2.
    rest : float
        Angle of rest before the trial [rad].
    balance
        As given.
    """

    def __init__(self, chain: Chain, response: Response, balance: Lifting,
                 phase: np.ndarray) -> None:
        self.rows = len(phase)
        self.columns = np.array([response.values, response.output, response.inputs], dtype=float)
        self.rest, self.balance = response.rest, balance
        self._effects = {effect.id: effect for effect in (*chain.electrical, *chain.thermal)}
        self._sensor = {effect.id for effect in chain.sensor}
        self._phase = phase

    def drive_squared(self, chain: Chain, drive: np.ndarray, inputs: Inputs) -> np.ndarray:
        """
        Return the drive squared that the muscle feels in all rows of the trial.

        Parameters
        ----------
        chain : Chain
            Effects from the onset on.
        drive : ndarray, shape (rows,)
        inputs : Inputs
            Of the same shape.

        Returns
        -------
        ndarray, shape (rows,)
        """
        inputs = inputs._replace(
            phase=np.concatenate((self._phase, inputs.phase[self.rows:])))
        signal = drive
        for effect in chain.electrical:
            signal = self._go_on(effect, signal, inputs, chain)
        signal = chain.to_drive_squared(signal)
        for effect in chain.thermal:
            signal = self._go_on(effect, signal, inputs, chain)
        return signal

    def _go_on(self, effect: DriveEffect, signal: np.ndarray, inputs: Inputs, chain: Chain
               ) -> np.ndarray:
        """Return the signal (rows,) behind an effect that begins at the onset or has acted."""
        before, surroundings = signal[:self.rows], chain.surroundings
        known = next((copy.copy(self._effects[name]) for name in (effect.id, *effect.replaces)
                      if name in self._effects), None)
        if known is not None:
            before = known.forward(before, rows_of(inputs, slice(self.rows)), surroundings)
        if not effect.memory:
            after: np.ndarray = effect.forward(signal, inputs, surroundings)
            return np.concatenate((before, after[self.rows:]))
        # It may go on at another rate: that of lags changes with the heat exchange.
        effect.start()
        if known is not None and known.memory == effect.memory:
            effect.restore(known.save())
        else:
            effect.step(float(before[-1]), math.inf, float(self._phase[-1]), surroundings)
        rows = np.array([signal, inputs.dt, inputs.phase])[:, self.rows:].T.tolist()
        return np.append(before, [effect.step(value, dt, phase, surroundings)
                                  for value, dt, phase in rows])

    def measured(self, chain: Chain, response: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Return what the sensor says of the true response of the trial, shape (rows,)."""
        last, rest = self.rows - 1, self.rest
        for effect in chain.sensor:
            effect.start()
            if effect.id in self._sensor:
                if rest is not None:
                    rest = effect.start_from(rest)
                response = effect.forward(response, inputs)
            else:
                effect.begin(float(response[last]))
                after = effect.forward(response[last:], rows_of(inputs, slice(last, None)))
                response = np.concatenate((response[:self.rows], after[1:]))
        return response


def rows_of(inputs: Inputs, rows: slice) -> Inputs:
    """Return the inputs of some rows of a trial."""
    return Inputs(*(column[rows] for column in inputs))
