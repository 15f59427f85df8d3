# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The stages between drive and sensor, put together from the effects of a model.

An effect is applied in the order of its stage; one whose equation contains another's (a lag with
two time constants contains one with a single time constant) takes its place.
"""

from collections.abc import Mapping, Sequence
import copy
import math
from typing import Any

import numpy as np

from hysteresis_ros.effects import (
    DriveEffect, Effect, Inputs, MaterialEffect, MechanismEffect, needs_phase, SensorEffect,
    Surroundings, catalogue)
from hysteresis_ros.effects.base import STAGES, Values
from hysteresis_ros.effects.electrical import ELECTRIC_DRIVES
from hysteresis_ros.effects.thermal import LatentHeat

# The compliance of no wire of an arm is below this [m/N].
LEAST_COMPLIANCE = 1e-6


def in_order(effects: Sequence[Effect]) -> list[Effect]:
    """Return the effects in the order of their stages, without those that another replaces."""
    replaced = {name for effect in effects for name in effect.replaces}
    known = list(catalogue())
    kept = [effect for effect in effects if effect.id not in replaced]
    return sorted(kept, key=lambda effect: (STAGES.index(effect.stage), known.index(effect.id)
                                            if effect.id in known else len(known)))


def _of_stage(stage: str, effects: Sequence[Effect]) -> list[Any]:
    return [effect for effect in effects if effect.stage == stage]


class Chain:
    """
    The effects of a model by stage.

    Parameters
    ----------
    effects : sequence of Effect
        In any order.
    surroundings : Surroundings
        Scales of the muscle.
    """

    def __init__(self, effects: Sequence[Effect], surroundings: Surroundings) -> None:
        # Copies, because what an effect remembers of the past belongs to one chain.
        ordered = [copy.copy(effect) for effect in in_order(effects)]
        self.surroundings = surroundings
        # Voltage and current heat with their square (Eq. 2).
        self.heats_by_square = surroundings.drive in ELECTRIC_DRIVES
        self.electrical: list[DriveEffect] = _of_stage('electrical', ordered)
        self.material: list[MaterialEffect] = _of_stage('material', ordered)
        on_drive = (effect.on_drive() for effect in self.material)
        self.thermal: list[DriveEffect] = [
            *_of_stage('thermal', ordered), *(one for one in on_drive if one is not None)]
        self.mechanism: list[MechanismEffect] = _of_stage('mechanism', ordered)
        self.sensor: list[SensorEffect] = _of_stage('sensor', ordered)
        # Those to whose elongation time or history add.
        self.drifting = [effect for effect in self.material
                         if type(effect).drift is not MaterialEffect.drift
                         or type(effect).advance is not MaterialEffect.advance]
        # Those that make something of the load.
        self._shifting, self._playing = self._with('shift_load'), self._with('loop_width')
        self._scaling, self._stretching = self._with('scale'), self._with('stretch')
        self._elastic, self._orienting = self._with('elastic_share'), self._with('oriented')
        self.needs_phase = needs_phase(ordered)
        # A fan changes gain and time constant together (d1 stands in both).
        for effect in self.thermal:
            effect.speed = math.prod(other.exchange for other in self.thermal)
        self.start()

    def _with(self, method: str) -> list[MaterialEffect]:
        """Return the effects of the material that have this method of their own."""
        neutral = getattr(MaterialEffect, method)
        return [e for e in self.material if getattr(type(e), method) is not neutral]

    @property
    def offsets(self) -> tuple[float, ...]:
        """Excess length [m] of each parallel muscle."""
        return next((e.offsets for e in self.material if len(e.offsets) > 1), (0.0,))

    @property
    def places(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Parts of the wire and their excess temperature, each shape (K,); None: all alike."""
        found = (effect.places for effect in self.material)
        return next((places for places in found if places is not None), None)

    @property
    def moves(self) -> bool:
        """Whether the arm's own velocity or acceleration counts."""
        return any(effect.moves for effect in self.mechanism)

    @property
    def meanwhile(self) -> list[Effect]:
        """Effects of what happens to the arm's muscles while it runs: they break, or yield."""
        return [*(effect for effect in self.mechanism if effect.break_time < math.inf),
                *(one for one in self.material if one.yields(self.surroundings)[0] < math.inf)]

    @property
    def break_time(self) -> float:
        """When one of the muscles breaks first, since the recording began [s]."""
        return min((effect.break_time for effect in self.mechanism), default=math.inf)

    @property
    def yields(self) -> tuple[float, float]:
        """Load [N] from which the muscle yields for good, infinite if never, and 1 / K [m/N]."""
        return min((effect.yields(self.surroundings) for effect in self.material),
                   default=(math.inf, 0.0))

    @property
    def drifts(self) -> bool:
        """Whether time or history add to the elongation."""
        return bool(self.drifting)

    def to_drive_squared(self, drive: Values) -> Values:
        """Return the drive squared, sign kept; the drive where it is no voltage or current."""
        return drive * np.abs(drive) if self.heats_by_square else drive

    def to_drive(self, drive_squared: Values) -> Values:
        """Return the drive that has a drive squared: the steady-state voltage of Eq. 2."""
        if not self.heats_by_square:
            return drive_squared
        return np.sign(drive_squared) * np.sqrt(np.abs(drive_squared))

    def drive_squared(self, drive: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Return the drive squared that the muscle feels in each row of one trial, (rows,)."""
        signal = drive
        for effect in self.electrical:
            signal = effect.forward(signal, inputs, self.surroundings)
        signal = self.to_drive_squared(signal)
        for effect in self.thermal:
            signal = effect.forward(signal, inputs, self.surroundings)
        return signal

    @property
    def latent(self) -> LatentHeat | None:
        """The effect that makes the phase work against what causes it, if there is one."""
        return next((one for one in self.thermal if isinstance(one, LatentHeat)), None)

    def start(self) -> None:
        """Make the effects with a past forget it."""
        for effect in self._all():
            effect.start()

    def save(self) -> list[dict[str, Any]]:
        """Return what the effects remember of the past, as plain types."""
        return [effect.save() for effect in self._all()]

    def restore(self, state: Sequence[Mapping[str, Any]]) -> None:
        """
        Take back what `save` returned.

        Raises
        ------
        KeyError, ValueError
            If it was saved with other effects.
        """
        for effect, entry in zip(self._all(), state, strict=True):
            effect.restore(entry)

    def _all(self) -> list[Effect]:
        return [*self.electrical, *self.thermal, *self.material, *self.mechanism, *self.sensor]

    def step(self, drive: float, inputs: Inputs) -> float:
        """Return the drive squared after one more sample, for a model that runs along."""
        signal = drive
        for effect in self.electrical:
            signal = self._advance(effect, signal, inputs)
        signal = float(self.to_drive_squared(signal))
        for effect in self.thermal:
            signal = self._advance(effect, signal, inputs)
        return signal

    def _advance(self, effect: DriveEffect, signal: float, inputs: Inputs) -> float:
        # One without a past may look at all inputs, such as the ambient temperature.
        if type(effect).step is DriveEffect.step:
            return float(effect.forward(signal, inputs, self.surroundings))
        return effect.step(signal, inputs.dt, inputs.phase, self.surroundings)

    def inverse(self, drive_squared: float, inputs: Inputs) -> float:
        """Return the drive for a wanted drive squared, the stages taken in reverse."""
        signal = drive_squared
        for effect in reversed(self.thermal):
            signal = effect.inverse(signal, inputs, self.surroundings)
        signal = float(self.to_drive(signal))
        for effect in reversed(self.electrical):
            signal = effect.inverse(signal, inputs, self.surroundings)
        return float(signal)

    def at_thermal(self, drive_squared: float, last: DriveEffect, inputs: Inputs) -> float:
        """Return what a thermal effect gives where the muscle feels a drive squared."""
        for effect in reversed(self.thermal):
            if effect is last:
                break
            drive_squared = effect.inverse(drive_squared, inputs, self.surroundings)
        return drive_squared

    def load_per_drive_squared(self) -> float:
        """Return C of `stress_dependence`, or 0 where the first stage is the model's own."""
        return sum(effect.load_per_drive_squared for effect in self.material)

    def load_inside(self, load: Values) -> Values:
        """Return the load as the transformation feels it."""
        shifted = load + self._shift(load)
        share = sum(effect.follows_strain for effect in self.material)
        if share == 0.0:
            return shifted
        strain = math.prod(effect.strain_of_bench(load, self.surroundings)
                           for effect in self.material)
        return shifted + share * load * (strain - 1.0)

    @property
    def keeps_strain(self) -> float:
        """
        Share, 0 to 1, of its strain that martensite keeps; 0 where no load changes it.

        And where branches orient martensite: what is oriented then stays so whatever the load.
        """
        if not (self._scaling or self._elastic) or self.orients:
            return 0.0
        return min(sum((effect.keeps_strain for effect in self.material), 0.0), 1.0)

    @property
    def oriented_anew(self) -> bool:
        """Whether a load heavier than that of its formation orients martensite anew."""
        return any(effect.oriented_anew for effect in self.material)

    @property
    def cooled_on_arm(self) -> bool:
        """Whether what a trial begins with formed while the arm cooled down."""
        return all(effect.cooled_on_arm for effect in self.material)

    @property
    def kinetics(self) -> float:
        """Share, 0 to 1, of the transformation whose minor loops are scaled from the major one."""
        return min(sum((effect.kinetics for effect in self.material), 0.0), 1.0)

    @property
    def orients(self) -> bool:
        """Whether branches orient anew what a load has left twinned; see `oriented`."""
        return bool(self._orienting) and any(effect.orients_anew for effect in self.material)

    def oriented(self, load: Values) -> Values:
        """Return the share of what forms that is oriented, for branches that orient it anew."""
        found = 1.0 + 0.0 * load
        for effect in self._orienting:
            found = found * effect.oriented(load, self.surroundings)
        share = min(sum(effect.orients_anew for effect in self.material), 1.0)
        return 1.0 - share * (1.0 - found)

    @property
    def plays(self) -> bool:
        """Whether the loop's width depends on the load."""
        return bool(self._playing)

    def _shift(self, load: Values) -> Values:
        return sum((effect.shift_load(load, self.surroundings) for effect in self._shifting),
                   0.0 * load)

    def loop_width(self, load: Values) -> Values:
        """
        Return w(F), by which the loop is wider than that of H2, at least 0.

        Where a load shifts the transformation further than on the bench, it does so in both
        directions: what it adds to the width, their difference, grows by the same factor.
        """
        width = sum((effect.loop_width(load, self.surroundings) for effect in self._playing),
                    0.0 * load)
        if self._shifting and self._playing:
            mean = self.surroundings.load or 1.0
            width = width * (1.0 + (self._shift(mean) - self._shift(0.0)) / mean)
        return np.maximum(width, 0.0)

    def scale(self, load: Values) -> Values:
        """Return S(F), the factor on the transformation strain."""
        factor = 1.0 + 0.0 * load
        for effect in self._scaling:
            factor = factor * effect.scale(load, self.surroundings)
        if self._elastic:
            share = sum(effect.elastic_share(self.surroundings) for effect in self._elastic)
            factor = (1.0 - share) * factor + share * load / self.surroundings.load
        return factor

    def stretch(self, load: Values) -> Values:
        """Return e(F), the elongation by the load alone."""
        return sum((effect.stretch(load, self.surroundings) for effect in self._stretching),
                   0.0 * load)

    def compliance(self) -> float:
        """Return the elastic compliance of a wire [m per unit of u], 0 where it is not known."""
        load = self.surroundings.load or 1.0
        loads = np.array([0.0, load])
        stretched, inside = self.stretch(loads), self.load_inside(loads)
        found = float((stretched[1] - stretched[0]) / max(inside[1] - inside[0], 1e-3 * load))
        return found if found >= LEAST_COMPLIANCE else 0.0

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs
              ) -> tuple[np.ndarray, np.ndarray]:
        """Return offset and factor of each row, each shape (rows,)."""
        offset, factor = np.zeros(len(drive)), np.ones(len(drive))
        for effect in self.drifting:
            added, times = effect.drift(drive, drive_squared, inputs, self.surroundings)
            offset, factor = offset + added, factor * times
        return offset, factor

    def advance(self, drive: float, drive_squared: float, inputs: Inputs) -> tuple[float, float]:
        """Return offset and factor of the next row, for a model that runs along."""
        offset, factor = 0.0, 1.0
        for effect in self.drifting:
            added, times = effect.advance(drive, drive_squared, inputs, self.surroundings)
            offset, factor = offset + added, factor * times
        return offset, factor

    def rows_read(self, asked: np.ndarray, inputs: Inputs) -> np.ndarray:
        """Return the rows (rows,) whose true response the sensor reads for those asked for."""
        for effect in reversed(self.sensor):
            asked = effect.rows_read(asked, inputs)
        return asked

    def measured(self, response: np.ndarray, inputs: Inputs, rest: float | None) -> np.ndarray:
        """Return what the sensor says of the true response of one trial (rows,) after a rest."""
        for effect in self.sensor:
            effect.start()
            # Each is given the rest as those before it measure it.
            if rest is not None:
                rest = effect.start_from(rest)
            response = effect.forward(response, inputs)
        return response
