# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The robotic bicep as it lives: voltage in, encoder counts out, in its own time.

In every dt the heating warms the wires (Eq. 1), then wires and weights find their balance. The
arm follows at once unless it has inertia; with friction it sticks until the wires overcome it.
"""

import collections
from collections.abc import Callable, Sequence
import functools
import math

import numpy as np

from hysteresis_ros.laboratory import sensors
from hysteresis_ros.laboratory.conditions import Conditions
from hysteresis_ros.laboratory.linkage import GEOMETRY, HIGHEST_ANGLE, LOWEST_ANGLE
from hysteresis_ros.laboratory.parallel_wires import ParallelWires
from hysteresis_ros.laboratory.solve import RootFinder
from hysteresis_ros.laboratory.wire import steps_between

__all__ = ['Arm', 'GEOMETRY']

LENGTH_TOLERANCE = 1e-7
MOMENT_TOLERANCE = 2e-5
# Longest dt [s] where the temperature feeds back on itself, where the arm settles, and where it has
# inertia.
COUPLED_DT = 0.5
SETTLING_DT = 1.0
INERTIAL_DT = 0.02
# Damping of the wires' own, over the critical one, where nothing else damps the arm.
INNER_DAMPING = 0.03
# At which every wire is austenite, whatever its load [degC].
HOT = 160.0
# About how stiff the arm is [N m/rad], and how far the wires go with its angle [m/rad].
TYPICAL_STIFFNESS, TYPICAL_LEVER = 4.0, 0.025


class Arm:
    """
    One arm with its wires, in the state to which its past has brought it.

    Parameters
    ----------
    conditions : Conditions
        What this arm is really like.
    seed : int or sequence of int
        Of everything that is random.

    Attributes
    ----------
    time : float
        Since the recording began [s].
    angle : float
        True angle of the forearm [rad].
    temperature : float
        Of the wires [degC].
    tensions : list of float
        Tension of each different wire [N].
    """

    def __init__(self, conditions: Conditions, seed: int | Sequence[int] = 0) -> None:
        self.conditions = conditions
        self.muscle = ParallelWires(conditions)
        self._rng = np.random.default_rng(seed)
        self.time = 0.0
        self.angle = 2.2
        self.tensions = [5.0] * len(self.muscle.wires)
        self._change: Callable[[], object] | None = None
        self._change_time = math.inf
        self._adapt()
        if len(self.muscle.wires) == 1:
            self._find = RootFinder(TYPICAL_LEVER, LENGTH_TOLERANCE)
        else:
            self._find = RootFinder(TYPICAL_STIFFNESS, MOMENT_TOLERANCE)
        self.heat_and_cool()

    def _adapt(self) -> None:
        """Take over from the conditions what is kept elsewhere."""
        conditions = self.conditions
        coupled = (conditions.heat.latent or conditions.resistance_growth or conditions.viscous
                   or conditions.disturbances or conditions.creep or conditions.yield_compliance)
        self._settling_dt = SETTLING_DT if coupled else math.inf
        for wire in self.muscle.wires:
            wire.compliance, wire.expansion = conditions.compliance, conditions.expansion

    def change_at(self, time: float, change: Callable[[], object]) -> None:
        """
        Have the conditions changed while the arm lives.

        Parameters
        ----------
        time : float
            When [s].
        change : callable
            Changes `conditions`, but not material and number of the wires.
        """
        self._change_time, self._change = time, change

    def heat_and_cool(self) -> None:
        """Heat fully, cool, and let the arm hang: how every trial begins. Time stands still."""
        self._fluctuation = 0.0
        self.temperature = self._room()
        self.muscle.heat_and_cool(self.temperature)
        self._velocity = 0.0
        self._settle_down()
        if math.isfinite(self.conditions.material.temperature_step):
            self._cool_under_load()
        self._played = self.angle
        self._history = collections.deque([(self.time, self._seen())])

    def advance(self, dt: float, voltage: float) -> None:
        """
        Let the arm live for `dt` [s] under a constant voltage [V].

        Parameters
        ----------
        dt : float
            Time; not negative.
        voltage : float
            RMS voltage at the board's output.
        """
        longest = INERTIAL_DT if self.conditions.inertia > 0.0 else COUPLED_DT
        for part in _parts(dt, longest):
            self._step(part, voltage, moving=self.conditions.inertia > 0.0)

    def settle(self, hold: float, voltage: float) -> None:
        """Let the arm come to rest under a voltage [V] held for `hold` [s]."""
        for part in _parts(hold, self._settling_dt):
            self._step(part, voltage, moving=False)
        self._velocity = 0.0
        self._history.clear()
        self._history.append((self.time, self._seen()))

    @property
    def measured_angle(self) -> float:
        """Angle that reaches the encoder's counter now [rad], before it is counted."""
        latency = self.conditions.latency
        if latency <= 0.0 or len(self._history) == 1:
            return self._history[-1][1]
        wanted = self.time - latency
        while len(self._history) > 2 and self._history[1][0] <= wanted:
            self._history.popleft()
        (before, low), (after, high) = self._history[0], self._history[1]
        if wanted <= before or after <= before:
            return low
        return low + (high - low) * min((wanted - before) / (after - before), 1.0)

    @property
    def encoder_counts(self) -> int:
        """Quadrature counts, 8192 a turn, from the upward vertical."""
        return sensors.encoder_counts(self.measured_angle)

    @property
    def ambient_temperature(self) -> float:
        """What the thermometer beside the arm shows [degC]."""
        return sensors.thermometer(self.conditions.air.recorded(self.time), self._rng)

    @property
    def supply_voltage(self) -> float:
        """What the board measures of its own supply [V]."""
        return sensors.supply_meter(self.conditions.supply.voltage(self.time), self._rng)

    def _room(self) -> float:
        return self.conditions.air.at_wires(self.time) + self._fluctuation

    def _step(self, dt: float, voltage: float, moving: bool) -> None:
        conditions = self.conditions
        if dt <= 0.0:
            return
        self.time += dt
        if self._change is not None and self.time > self._change_time:
            self._change()
            self._change = None
            self._adapt()
        if self.time > conditions.break_time:
            self.muscle.count = conditions.linkage.muscle_count - 1
        air = conditions.air
        kept = math.exp(-dt / air.turbulence_time)
        self._fluctuation = kept * self._fluctuation + (
            air.turbulence * math.sqrt(1.0 - kept * kept) * self._rng.standard_normal())
        before = self.temperature
        self._heat(dt, voltage)
        extra = sum(one.excess(self.time, self.tensions[0]) for one in conditions.disturbances)
        self.muscle.age(voltage, dt, extra)
        path = steps_between(before, self.temperature, conditions.material.temperature_step)
        for self.temperature in path:
            if moving:
                self._swing(dt / len(path))
            else:
                self._find_balance(dt / len(path))
        self._sense()

    def _heat(self, dt: float, voltage: float) -> None:
        conditions, heat = self.conditions, self.conditions.heat
        room, airflow, contact = self._room(), 1.0, 1.0
        for one in conditions.disturbances:
            room += one.warmth(self.time, self.angle)
            airflow *= one.airflow(self.time)
            contact *= one.contact(self.time, self.angle)
        martensite = self.muscle.martensite
        drive_squared = conditions.drive_squared(voltage, martensite, contact)
        self.temperature = heat.advance(
            self.temperature, heat.balance(drive_squared, room, airflow), dt, airflow,
            functools.partial(self.muscle.share, self.tensions), martensite)

    def _needed(self, theta: float) -> float:
        """Return the moment that the wires have to hold at rest [N m]."""
        conditions = self.conditions
        moment = conditions.linkage.moment(theta)
        for one in conditions.disturbances:
            moment += one.moment(self.time, theta)
        beyond = conditions.stop_side * (theta - conditions.stop)
        if beyond > 0.0:
            moment -= conditions.stop_side * conditions.stop_stiffness * beyond
        return moment

    def _pull(self, theta: float) -> float:
        """Return the wires' moment at an angle [N m], and keep their tensions."""
        linkage, wires = self.conditions.linkage, self.muscle.wires
        elongation = linkage.elongation(theta)
        self.tensions = [wire.tension(self.temperature, elongation, guess)
                         for wire, guess in zip(wires, self.tensions)]
        return linkage.moment_arm(theta) * sum(self.tensions) * self.muscle.count / len(wires)

    def _find_balance(self, dt: float) -> None:
        conditions, old = self.conditions, self.angle
        cable, resistance, along = conditions.cable, 0.0, 1.0
        if conditions.coulomb > 0.0 or cable.rubs:
            pull, needed_here = self._pull(old), self._needed(old)
            if cable.behind(pull) > needed_here + conditions.coulomb:
                resistance, along = conditions.coulomb, cable.before(1.0)
            elif cable.before(pull) < needed_here - conditions.coulomb:
                resistance, along = -conditions.coulomb, cable.behind(1.0)
            else:
                self.muscle.commit(self.temperature, self.tensions)
                return
        damping = conditions.viscous / dt

        def needed(theta: float) -> float:
            return along * (self._needed(theta) + resistance - damping * (theta - old))
        self._rest_where(needed, old)

    def _rest_where(self, needed: Callable[[float], float], guess: float) -> None:
        """Bring the arm to the angle at which the wires hold the moment `needed`."""
        linkage, wires = self.conditions.linkage, self.muscle.wires
        highest = HIGHEST_ANGLE
        if self.conditions.stop_side > 0:
            # Beyond this the stop alone would carry more than all the weight.
            highest = min(highest, self.conditions.stop
                          + linkage.moment(self.conditions.stop) / self.conditions.stop_stiffness)
        if len(wires) == 1:
            wire, temperature, count = wires[0], self.temperature, self.muscle.count

            def tension(theta: float) -> float:
                return max(needed(theta) / (count * linkage.moment_arm(theta)), 0.0)

            self.angle = self._find(
                lambda theta: linkage.elongation(theta) - wire.elongation(
                    temperature, tension(theta)), guess, LOWEST_ANGLE, highest)
            if needed(self.angle) < 0.0:
                # A wire that has got longer than that hangs loose and does not push the arm.
                self.angle = self._find(lambda theta: -needed(theta), guess, LOWEST_ANGLE, highest)
            self.tensions = [tension(self.angle)]
        else:
            # The last evaluation, which leaves the tensions behind, is at the angle found.
            self.angle = self._find(lambda theta: self._pull(theta) - needed(theta),
                                    guess, LOWEST_ANGLE, highest)
        self.muscle.commit(self.temperature, self.tensions)

    def _settle_down(self) -> None:
        """Let the arm sink from above to where it rests, against friction if there is any."""
        left = self.conditions.cable.behind(1.0)
        self._rest_where(
            lambda theta: left * (self._needed(theta) - self.conditions.coulomb), self.angle)

    def _cool_under_load(self) -> None:
        """Heat fully and cool again with the arm's own load on the wires, which remember it."""
        def balance(temperature: float) -> None:
            self.temperature = temperature
            self._settle_down()
        room = self.temperature
        self.muscle.cool_down(
            steps_between(HOT, room, self.conditions.material.temperature_step), balance)

    def _swing(self, dt: float) -> None:
        """Move the arm with its inertia, by one semi-implicit step."""
        conditions = self.conditions
        damping = conditions.viscous or 2.0 * INNER_DAMPING * math.sqrt(
            TYPICAL_STIFFNESS * conditions.inertia)
        # The wires pull towards smaller angles.
        pull = self._pull(self.angle)
        self.muscle.commit(self.temperature, self.tensions)
        momentum = conditions.inertia * self._velocity + dt * (self._needed(self.angle) - pull)
        # Sinking, the cables hold the arm together with the wires; rising, they hold the wires.
        cable = conditions.cable
        rubbing = cable.before(pull) - pull if momentum > 0.0 else pull - cable.behind(pull)
        held = min(abs(momentum), dt * (conditions.coulomb + rubbing))
        momentum -= math.copysign(held, momentum)
        self._velocity = momentum / (conditions.inertia + dt * damping)
        self.angle += dt * self._velocity
        if not LOWEST_ANGLE < self.angle < HIGHEST_ANGLE:
            self.angle = min(max(self.angle, LOWEST_ANGLE), HIGHEST_ANGLE)
            self._velocity = 0.0

    def _sense(self) -> None:
        play, used = self.conditions.backlash, self.conditions.backlash_used
        behind, ahead = 0.5 * (1.0 - used) * play, 0.5 * (1.0 + used) * play
        self._played = min(max(self._played, self.angle - behind), self.angle + ahead)
        self._history.append((self.time, self._seen()))
        if self.conditions.latency <= 0.0:
            while len(self._history) > 1:
                self._history.popleft()

    def _seen(self) -> float:
        seen = self.conditions.disc.reading(self._played)
        return seen + self.conditions.encoder_offset + sum(
            one.reading(self.time, self.angle) for one in self.conditions.disturbances)


def _parts(duration: float, longest: float) -> list:
    count = 1 if duration <= longest else math.ceil(duration / longest - 1e-9)
    return [duration / count] * count
