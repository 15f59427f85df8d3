# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an arm is really like: each value is that of a perfect arm unless an effect changes it.

`Disturbance` is what no list of values holds: something that acts at its own time or place.
"""

import dataclasses
import math

from hysteresis_ros.laboratory.cable import Cable
from hysteresis_ros.laboratory.encoder_disc import EncoderDisc
from hysteresis_ros.laboratory.grain_wire import GrainMaterial
from hysteresis_ros.laboratory.heat import HeatBalance, ROOM
from hysteresis_ros.laboratory.linkage import Linkage
from hysteresis_ros.laboratory.supply import Supply
from hysteresis_ros.laboratory.wire import Material

# Resistance of a wire when it is austenite [Ohm], and the board's full voltage [V].
RESISTANCE = 8.0
FULL_VOLTAGE = 6.0


class Disturbance:
    """
    Something that acts on the arm at its own time or place; by default it does nothing.

    `time` [s] runs from the start of the recording, `theta` [rad] is the true angle.
    """

    def moment(self, time: float, theta: float) -> float:
        """Return a moment that lowers the arm and that the wires have to hold too [N m]."""
        return 0.0

    def warmth(self, time: float, theta: float) -> float:
        """Return by how much the wire's surroundings are warmer [K]."""
        return 0.0

    def airflow(self, time: float) -> float:
        """Return the heat transfer over that of the bench."""
        return 1.0

    def contact(self, time: float, theta: float) -> float:
        """Return the share of the voltage that arrives at the wires."""
        return 1.0

    def excess(self, time: float, tension: float) -> float:
        """Return by how much each wire has become longer [m]."""
        return 0.0

    def reading(self, time: float, theta: float) -> float:
        """Return what is wrong with the angle that the encoder sees [rad]."""
        return 0.0


@dataclasses.dataclass
class Air:
    """
    The room's temperature over the recording.

    Parameters
    ----------
    swing, period, phase : float
        Amplitude [K], period [s] and phase [rad] of a slow swing that the thermometer records.
    warming, warming_time : float
        Rise [K] of the air at the wires, and its time constant [s], that no thermometer sees.
    turbulence, turbulence_time : float
        Standard deviation [K] and correlation time [s] of small fluctuations.
    """

    swing: float = 0.0
    period: float = 400.0
    phase: float = 0.0
    warming: float = 0.0
    warming_time: float = 900.0
    turbulence: float = 0.05
    turbulence_time: float = 5.0

    def recorded(self, time: float) -> float:
        """Return the temperature at the thermometer [degC]."""
        if self.swing == 0.0:
            return ROOM
        turn = 2.0 * math.pi * time / self.period + self.phase
        return ROOM + self.swing * (0.7 * math.sin(turn) + 0.3 * math.sin(2.7 * turn))

    def unrecorded(self, time: float) -> float:
        """Return by how much the air at the wires is warmer than that [K]."""
        return self.warming * (1.0 - math.exp(-time / self.warming_time))

    def at_wires(self, time: float) -> float:
        """Return the temperature of the air at the wires without its fluctuations [degC]."""
        return self.recorded(time) + self.unrecorded(time)


@dataclasses.dataclass
class Conditions:
    """
    Everything that makes one arm differ from the next.

    Parameters
    ----------
    material : Material
        Of the wires on the arm.
    linkage : Linkage
        Dimensions and masses.
    heat : HeatBalance
        Eq. 1.
    air : Air
        The room.
    supply : Supply
        Of the board.
    lead_resistance : float
        Of board and leads, in series with each wire [Ohm].
    dead_voltage : float
        Setpoint below which the board gives nothing [V].
    largest_current : float
        Current that the board limits each wire to [A].
    resistance_growth : float
        Relative resistance that the martensite has above the austenite.
    creep : float
        Share of the resting length per factor e of time that a full transformation creeps.
    creep_time : float
        Time from which that logarithm counts [s].
    shrinkage : float
        Share of the resting length that a wire loses per factor e of cycles; negative in training.
    tiring : float
        Share of the grains that stay martensite per factor e of cycles; negative in training.
    dead_length : float
        Length of each wire that hangs loose [m].
    compliance : float
        Of what is in series with each wire [m/N].
    expansion : float
        Coefficient of thermal expansion of the wires [1/K].
    wire_offsets : tuple of float
        By how much each wire is longer than the others [m]; one entry: the wires are alike.
    yield_tension, yield_compliance : float
        Tension from which a wire yields for good [N], and its residual elongation per tension
        beyond [m/N].
    break_time : float
        When one of the wires breaks, since the recording began [s]; infinite: never.
    coulomb, viscous, inertia : float
        Friction [N m], damping [N m s/rad] and moment of inertia [kg m^2]; no inertia: the arm
        follows at once.
    cable : Cable
        Between each wire and the forearm.
    stop, stop_side, stop_stiffness : float
        Angle [rad] beyond which, to larger (1) or smaller (-1) angles, a spring [N m/rad] meets
        the arm; side 0: no stop.
    encoder_offset, backlash, latency : float
        Of the encoder [rad], [rad], [s].
    backlash_used : float
        Where in its play the encoder is zeroed: 0 in the middle, 1 where an arm that rises to
        larger angles takes it along at once, -1 where one that goes to smaller ones does.
    disc : EncoderDisc
        What the encoder reads.
    disturbances : list of Disturbance
        Whatever else acts.
    recording_time : float
        Time over which slow things happen on this arm [s]: about the length of a recording.
    """

    material: Material = GrainMaterial()
    linkage: Linkage = Linkage()
    heat: HeatBalance = dataclasses.field(default_factory=HeatBalance)
    air: Air = dataclasses.field(default_factory=Air)
    supply: Supply = Supply()
    lead_resistance: float = 0.0
    dead_voltage: float = 0.0
    largest_current: float = math.inf
    resistance_growth: float = 0.0
    creep: float = 0.0
    creep_time: float = 3.0
    shrinkage: float = 0.0
    tiring: float = 0.0
    dead_length: float = 0.0
    compliance: float = 0.0
    expansion: float = 0.0
    wire_offsets: tuple = (0.0,)
    yield_tension: float = math.inf
    yield_compliance: float = 0.0
    break_time: float = math.inf
    coulomb: float = 0.0
    viscous: float = 0.0
    inertia: float = 0.0
    cable: Cable = Cable()
    stop: float = 0.0
    stop_side: int = 0
    stop_stiffness: float = 20.0
    encoder_offset: float = 0.0
    backlash: float = 0.0
    backlash_used: float = 0.0
    latency: float = 0.0
    disc: EncoderDisc = EncoderDisc()
    disturbances: list = dataclasses.field(default_factory=list)
    recording_time: float = 900.0

    def drive_squared(self, voltage: float, martensite: float, contact: float = 1.0) -> float:
        """
        Return the square of the voltage that heats an austenitic wire as much [V^2].

        Parameters
        ----------
        voltage : float
            Setpoint of the board [V].
        martensite : float
            Share of martensite, for the resistance.
        contact : float
            Share of the voltage that arrives.
        """
        if voltage <= self.dead_voltage:
            return 0.0
        voltage *= contact
        voltage = (voltage - self.dead_voltage) * FULL_VOLTAGE / (FULL_VOLTAGE - self.dead_voltage)
        resistance = RESISTANCE * (1.0 + self.resistance_growth * martensite)
        voltage *= resistance / (resistance + self.lead_resistance)
        voltage = min(voltage, self.largest_current * resistance)
        return voltage * voltage * RESISTANCE / resistance
