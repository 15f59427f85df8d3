# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects between the voltage that was set and the voltage squared that heats the wire."""

import math

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.stages import DriveEffect

ELECTRIC_DRIVES = ('voltage', 'current')


class ElectricalEffect(DriveEffect):
    """An effect that only an electrically heated muscle can have."""

    stage = 'electrical'

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive is a voltage or a current."""
        return surroundings.drive in ELECTRIC_DRIVES


class SupplySag(ElectricalEffect):
    """Resistance of leads, switch and supply in series with the wire."""

    id = 'supply_sag'
    sentence = 'The supply and the leads drop a part of the voltage before it reaches the wire.'
    equation = 'Ve = V R / (R + Rs), R = 8 Ohm'
    source = "Ohm's law"
    shows_in = 'V: the arm stays behind in proportion to the voltage'
    experiment = 'measure the voltage at the wire itself while it is heated'
    confused_with = ('airflow',)
    parameters = (
        Parameter('Rs', 'Ohm', 'series resistance against a wire of 8 Ohm', 0.01, 2.0, 0.0,
                  (0.1, 0.3, 1.0), log=True),)

    WIRE_RESISTANCE = 8.0

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive is a voltage: a current is the same in supply and wire."""
        return surroundings.drive == 'voltage'

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Divide the voltage between series resistance and wire."""
        return signal * self.WIRE_RESISTANCE / (self.WIRE_RESISTANCE + self.Rs)

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Raise the voltage by what is lost."""
        return signal * (self.WIRE_RESISTANCE + self.Rs) / self.WIRE_RESISTANCE


# Values of `whole` for pulses that pass whole, and for those that lose what does not switch.
WHOLE, REDUCED = 1.0, 2.0


class PwmDeadZone(ElectricalEffect):
    """
    Pulses too short to switch the transistor on.

    Firmware may map the whole range of the setpoint to the duties that do switch, so that nothing
    is lost at full drive; or pulses pass whole as soon as they are long enough; or what does not
    switch is lost at any duty, which is nearly the same to an arm as `supply_sag` and
    `stress_dependence`. What takes 3 us to switch is 6 % of the period at 20 kHz, and on 12 V that
    duty heats as 2.9 V do, so that pulses drop out far up.
    """

    id = 'pwm_dead_zone'
    sentence = ('Below a smallest duty the board delivers nothing; above it the voltage is scaled, '
                'whole, or lower by it.')
    equation = ('Ve = 0 for V < Vd, else (V - Vd) Vmax / (Vmax - Vd), Vmax the largest of the '
                'bench; or, where whole is 1, V, and where it is 2, V - Vd')
    source = 'switching and dead time of a PWM stage'
    shows_in = 'low V'
    experiment = 'fine steps of the voltage from 0 up'
    confused_with = ('ambient_drift',)
    parameters = (
        Parameter('Vd', 'V', 'largest voltage that has no effect', 0.05, 1.5, 0.0, (0.3, 1.0),
                  log=True, scale='drive'),
        Parameter('whole', '1', 'what arrives above it, 0: the rest, stretched to the full range, '
                  '1: all, 2: less by Vd', 0.0, 2.0, 0.0, (0.0,), choices=(0.0, 1.0, 2.0),
                  kinds=('arm',), form=True))

    # Largest duty of pulses that drop out, as the voltage over that of a zone that is stretched.
    LARGEST = 8.0 / 3.0
    # Starts for what arrives whole above, over the same: no further apart than a fit finds its way.
    CUTS = tuple(0.8 * 1.05 ** step for step in range(25))
    # The same for what is lost at any duty.
    LOSSES = 0.1, 0.4
    # Prior odds of that: a sag and a shift are more usual, and nearly the same to an arm. Of 40
    # arms of this laboratory with one of these, and of 40 of one that is not ours with seven such
    # losses, the names are in the set in 39 and 40 (first 34 and 33) with odds of 1, in 40 and 39
    # with 0.1 (36 and 31) and 0.05 (38 and 31), in 40 and 38 with 0.02 (39 and 31).
    RARE = 0.05

    def guesses(self, measured: np.ndarray) -> list[dict[str, float]]:
        """Begin also with losses, and with pulses that drop out: no slope says where they do."""
        return [{'Vd': part * self.parameters[0].high, 'whole': whole}
                for parts, whole in ((self.CUTS, WHOLE), (self.LOSSES, REDUCED)) for part in parts]

    @property
    def prior_odds(self) -> float:
        """Return lower odds for a loss at any duty."""
        return self.RARE if self.whole == REDUCED else 1.0

    def implausible(self, slack: float = 0.0, duration: float = 0.0) -> list[str]:
        """Name a zone that is too wide; see `Effect.implausible`."""
        largest = self.LARGEST * self.parameters[0].high
        if self.whole == WHOLE and self.Vd <= (1.0 + slack) * largest:
            return []
        return super().implausible(slack, duration)

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Cut the lower end off, and stretch the rest, or not."""
        if self.whole == WHOLE:
            return np.where(np.asarray(signal) < self.Vd, np.minimum(signal, 0.0), signal)
        return np.maximum(signal - self.Vd, 0.0) * self._stretch(surroundings)

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """
        Add the dead zone again; zero stays zero, and what is below it out of reach.

        Where all arrives above, what is below is as near as can be in heat.
        """
        if signal <= 0.0:
            return signal
        if self.whole == WHOLE:
            return max(signal, self.Vd) if 2.0 * signal ** 2 > self.Vd ** 2 else 0.0
        return signal / self._stretch(surroundings) + self.Vd

    def _stretch(self, surroundings: Surroundings) -> float:
        if self.whole == REDUCED:
            return 1.0
        full = math.sqrt(surroundings.full_drive_squared)
        return full / max(full - self.Vd, 1e-3 * full)


class SupplyLimit(ElectricalEffect):
    """
    A supply, driver or fuse that gives no more than a limit below the largest voltage of the bench.

    Beyond it the muscle stays as hot as it is, and cools down from there: it goes through minor
    loops where an arm that meets an `end_stop` still goes through the major one. Nothing gives back
    what is beyond the limit; a controller says that such angles are out of reach.
    """

    id = 'supply_limit'
    sentence = 'Beyond a limit the supply gives no more, whatever is set.'
    equation = ('Ve = min(V, Vl), Vl = Vmax - cut, Vmax the largest of the bench; or, where soft '
                'is not 0, V / (1 + (V / Vl)^(1/soft))^soft')
    source = 'current limit of a supply, largest duty of a PWM stage'
    shows_in = 'high V: the hot end is not reached'
    experiment = 'measure the voltage at the wire itself while the setpoint rises to the largest'
    confused_with = ('end_stop', 'supply_sag')
    parameters = (
        Parameter('cut', 'V', 'what the limit is below the largest drive of the bench', 0.05, 4.0,
                  0.0, (0.5, 1.0, 1.5, 2.0, 2.5, 3.0), log=True, scale='drive'),
        Parameter('soft', '1', 'how gradually it is reached, 0: at once', 0.0, 0.2, 0.0,
                  (0.0, 0.08), limits=(0.0, 0.3), kinds=('arm',), form=True))

    # With less than this the knee is so narrow that it is none.
    SHARP = 0.01

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Cut the upper end off."""
        limit = self._limit(surroundings)
        if self.cut and self.soft > self.SHARP and limit > 0.0:
            # As 1 + x^n on one side and x (1 + x^-n) on the other, neither of which overflows.
            over = np.maximum(signal, 0.0) / limit
            small = np.minimum(over, 1.0 / np.maximum(over, 1e-300))
            knee = (1.0 + small ** (1.0 / self.soft)) ** -self.soft
            return np.where(over < 1.0, signal, limit) * knee
        return np.minimum(signal, limit) if self.cut else signal

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Leave what is below the limit; what is beyond it stays out of reach."""
        limit = self._limit(surroundings)
        if self.cut and self.soft > self.SHARP and signal > 0.0:
            left = 1.0 - (signal / limit) ** (1.0 / self.soft) if 0.0 < signal < limit else 0.0
            return signal * left ** -self.soft if left > 0.0 else signal + self.cut
        return signal if signal <= limit else signal + self.cut

    def _limit(self, surroundings: Surroundings) -> float:
        return math.sqrt(surroundings.full_drive_squared) - self.cut


class ResistanceChange(ElectricalEffect):
    """Austenite and martensite conduct differently."""

    id = 'resistance_change'
    sentence = ("The wire's resistance changes as it transforms, so the same voltage heats the "
                'two phases differently.')
    equation = ('Ve^2 = V^2 / (1 + eta (xi - xi0)), xi the martensite share: V^2 / R with R as on '
                'the bench at xi0, 0 that of the hot wire; the inverse for a current')
    source = "the paper's reference [46]: less than 15 % in phase transition"
    shows_in = 'the middle of the loop'
    experiment = 'log the current as well as the voltage'
    confused_with = ('stress_dependence',)
    needs_phase = True
    parameters = (
        Parameter('eta', '1', 'resistance of martensite over that of austenite, less one',
                  0.02, 0.20, 0.0, (-0.1, 0.1), both_signs=True),
        Parameter('xi0', '1', 'martensite share at which the resistance is that of the bench', 0.0,
                  1.0, 0.0, (0.0,), choices=(0.0, 0.5, 1.0)))

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Return the drive that heats a wire of constant resistance as much."""
        return signal * self._gain(inputs, surroundings)

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """Undo the change at the phase that is to be reached."""
        return signal / float(self._gain(inputs, surroundings))

    def _gain(self, inputs: Inputs, surroundings: Surroundings) -> Values:
        gain = 1.0 / np.sqrt(np.maximum(1.0 + self.eta * (inputs.phase - self.xi0), 0.1))
        return gain if surroundings.drive == 'voltage' else 1.0 / gain
