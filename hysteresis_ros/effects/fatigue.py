# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What cycles do to a muscle: wear, and training."""

import dataclasses

import numpy as np

from hysteresis_ros.effects.base import Effect, Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.electrical import ELECTRIC_DRIVES
from hysteresis_ros.effects.stages import DriveEffect, MaterialEffect


class Fatigue(MaterialEffect):
    """
    Cycle after cycle the muscle gets shorter or longer, loses or gains stroke, transforms later.

    A new muscle gains stroke while it is trained, an old one loses it; both slow down alike.
    Defects that cycles leave behind move the temperatures of the transformation, too.
    """

    id = 'fatigue'
    sentence = ('With every cycle the muscle gets a little shorter (b > 0) or longer (b < 0), and '
                'loses stroke, or gains it in training (a < 0); it may also need more heat.')
    equation = ('L -= b l0 w, stroke times (1 - a w), Vs^2 = V^2 - c w, w = ln(1 + N / N0), N the '
                'cycles of the recording: ln(1 + (N + Nb) / N1) against its start, N0 = N1 + Nb')
    source = ('functional fatigue and training of shape memory alloys (Lagoudas (ed.), Shape '
              'Memory Alloys, Springer 2008, ch. 1; Eggeler and others, Mater. Sci. Eng. A 378 '
              '(2004) 24); the logarithm is empirical')
    shows_in = 'cycle count'
    experiment = 'repeat a reference loop and compare the first with the last'
    confused_with = ('ambient_drift',)
    kinds = ('arm', 'bench')
    parameters = (
        Parameter('b', '% of l0', 'drift per factor e of the number of cycles, positive where '
                  'the muscle gets shorter', 0.0, 0.5, 0.0,
                  (0.05, -0.05), both_signs=True),
        Parameter('a', '1', 'loss of stroke per factor e of the number of cycles, negative where '
                  'training makes it grow', 0.0, 0.3, 0.0, (0.03,), both_signs=True),
        # Some 20 K within 20 cycles, of about 0.4 V^2 each.
        Parameter('c', 'V^2', 'rise of the transformation, in drive squared, per factor e of the '
                  'number of cycles', 0.0, 3.0, 0.0, (0.0, 0.5, -0.5), both_signs=True,
                  scale='drive squared', kinds=('arm',), form=True),
        Parameter('N0', '1', 'cycles before the recording, and those of the first wear: an old '
                  'muscle wears more slowly than a new one', 1.0, 1e5, 1.0, (1.0,), log=True,
                  limits=(1.0, 1e5), kinds=()),
        Parameter('kept', '1', '1: what earlier trials have worn stays; 0: every trial begins '
                  'anew, as with another specimen or one that recovers', 0.0, 1.0, 1.0, (1.0, 0.0),
                  choices=(1.0, 0.0), kinds=('bench',)))

    memory = ('_begun',)

    @classmethod
    def describe(cls, surroundings: Surroundings | None) -> tuple[Parameter, ...]:
        """Leave c neutral where the drive does not heat the muscle against its surroundings."""
        heated = surroundings is None or surroundings.drive in (*ELECTRIC_DRIVES, 'power')
        return tuple(dataclasses.replace(parameter, kinds=())
                     if parameter.name == 'c' and not heated else parameter
                     for parameter in super().describe(surroundings))

    # Cycles at the start of the trial; None before its first row.
    _begun: float | None

    def start(self) -> None:
        """Begin a trial."""
        self._begun = None

    def advance(self, drive: float, drive_squared: float, inputs: Inputs,
                surroundings: Surroundings) -> tuple[float, float]:
        """Return drift and stroke for the cycles counted since recording or trial began."""
        begun = self._begun
        if begun is None:
            begun = self._begun = 0.0 if self.kept else inputs.cycles
        return self._worn(inputs.cycles - begun, surroundings)

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the same for a whole trial at once."""
        begun = 0.0 if self.kept else inputs.cycles[0]
        return self._worn(inputs.cycles - begun, surroundings)

    def on_drive(self) -> DriveEffect | None:
        """Return what moves the transformation."""
        return LaterTransformation(self) if self.c else None

    def within_trials(self) -> Effect:
        """
        Return the effect with every trial beginning anew.

        Where each load has one trial, what use would carry over cannot be told from the load.
        """
        return self.with_values(kept=0.0).with_parameter('kept', choices=(0.0,))

    def wear(self, cycles: Values) -> Values:
        """Return w for cycles since the recording began."""
        return np.log1p(cycles / self.N0)

    def _worn(self, cycles: Values, surroundings: Surroundings) -> tuple[Values, Values]:
        logarithm = self.wear(cycles)
        offset = -self.b / 100.0 * surroundings.length * logarithm
        return offset, np.maximum(1.0 - self.a * logarithm, 0.1)


class LaterTransformation(DriveEffect):
    """
    Rise of the transformation by wear, taken off the drive squared; no effect of its own.

    Parameters
    ----------
    wear : Fatigue
        Whose c and w it has.
    """

    stage = 'thermal'

    def __init__(self, wear: Fatigue) -> None:
        super().__init__()
        self.id = wear.id       # type: ignore[misc]
        self._wear = wear

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Take off what moves the transformation."""
        return signal - self._wear.c * self._wear.wear(inputs.cycles)

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Add it."""
        return signal + float(self._wear.c * self._wear.wear(inputs.cycles))
