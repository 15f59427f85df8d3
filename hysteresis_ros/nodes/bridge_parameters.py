# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the node `hardware_bridge`, and what is made of them."""

from collections.abc import Mapping

from typing import Any

from hysteresis_ros.bridge.encoder import Encoder
from hysteresis_ros.bridge.heat_and_cool import HeatAndCool
from hysteresis_ros.bridge.pwm import Pwm
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.nodes.lifecycle import LIFECYCLE
from hysteresis_ros.nodes.parameters import NAMES, Spec, VOLTAGE_LIMITS

BOARD = (
    Spec('port', 'sim://bicep', 'Device or pyserial URL of the board; sim://bicep?speed=60&seed=1 '
         'and the like for the simulated one', read_only=True),
    Spec('baud', 115200, 'Speed of the serial line', 'bit/s', 1200, 4000000, read_only=True),
    Spec('telemetry_rate', 10.0, 'How often the board reports', 'Hz', 0.1, 200.0, read_only=True),
    Spec('start_enabled', True, 'Whether setpoints are followed from the start, without ~/enable',
         read_only=True),
    Spec('setpoint_timeout', 2.0, 'Time without a setpoint after which the output is zero; by the '
         'slower of wall clock and board clock', 's', 0.05, 600.0, read_only=True),
    Spec('telemetry_timeout', 1.0, 'Time without telemetry after which the board counts as lost; '
         'by the slower clock', 's', 0.05, 600.0, read_only=True),
    Spec('board_watchdog', 1.0, 'Time without a word from this node after which the board '
         'switches off on its own, by the slower clock; a board may do so earlier, that of '
         'firmware/ after 0.5 s', 's', 0.3, 60.0, read_only=True),
)

OUTPUT = (
    Spec('pwm_law', 'rms', "What the voltage stands for: 'rms', duty = (V / supply)^2, because "
         "heating follows the mean square; 'mean', duty = V / supply", read_only=True),
    Spec('maximum_duty', 1.0, 'Largest duty', '', 0.01, 1.0),
    Spec('supply_voltage', 12.0, 'Nominal voltage of the supply', 'V', 1.0, 60.0, read_only=True),
    Spec('supply_tolerance', 0.25, 'Share by which the measured supply may differ; beyond, the '
         'output is off', '', 0.01, 0.9, read_only=True),
)

ENCODER = (
    Spec('counts_per_revolution', 8192, 'Quadrature counts in a turn: four times the pulses',
         '', 4, 1000000, read_only=True),
    Spec('encoder_direction', 1, '1 if counts grow with the angle, -1 if they fall', '', -1, 1,
         read_only=True),
    Spec('encoder_zero', 0.0, 'Angle at count 0', 'rad', -6.3, 6.3, read_only=True),
    Spec('encoder_index', 'ignore', "What the index pulse is for: 'ignore'; 'check' that no "
         "counts are lost; 'home': it comes at encoder_index_angle", read_only=True),
    Spec('encoder_index_angle', 0.0, 'Angle at the index pulse', 'rad', -6.3, 6.3,
         read_only=True),
    Spec('encoder_maximum_speed', 30.0, 'Speed that the arm cannot exceed; faster counts are not '
         'believed', 'rad/s', 0.1, 1000.0, read_only=True),
    Spec('velocity_window', 0.1, 'Time over which the velocity is taken', 's', 0.0, 10.0,
         read_only=True),
)

INITIALISATION = (
    Spec('initialise_voltage', 6.0, 'Heating voltage of ~/initialise, at most maximum_voltage',
         'V', 0.1, 48.0),
    Spec('initialise_heat_time', 30.0, 'Heating time of ~/initialise', 's', 1.0, 3600.0),
    Spec('initialise_cool_time', 60.0, 'Shortest cooling time of ~/initialise', 's', 1.0, 3600.0),
)

PARAMETERS = BOARD + OUTPUT + ENCODER + INITIALISATION + VOLTAGE_LIMITS + NAMES + LIFECYCLE


def make_pwm(values: Mapping[str, Any]) -> Pwm:
    """Return the law and limits between voltage and duty."""
    return Pwm(values['pwm_law'], values['minimum_voltage'], values['maximum_voltage'],
               values['maximum_duty'])


def make_encoder(values: Mapping[str, Any]) -> Encoder:
    """Return what turns counts into an angle."""
    return Encoder(
        values['counts_per_revolution'], values['encoder_direction'], values['encoder_zero'],
        maximum_speed=values['encoder_maximum_speed'], velocity_window=values['velocity_window'],
        index=values['encoder_index'], index_angle=values['encoder_index_angle'])


def make_cycle(values: Mapping[str, Any]) -> HeatAndCool:
    """Return a heat and cool cycle."""
    return HeatAndCool(min(values['initialise_voltage'], values['maximum_voltage']),
                       values['initialise_heat_time'], values['initialise_cool_time'])


def check(values: Mapping[str, Any]) -> None:
    """Refuse values that make no sense, alone or together, with a `ParameterError`."""
    make_pwm(values)
    make_encoder(values)
    if values['telemetry_timeout'] * values['telemetry_rate'] < 2.0:
        raise ParameterError(
            f'telemetry_timeout {values["telemetry_timeout"]:g} s has to be at least two periods '
            f'of the telemetry_rate {values["telemetry_rate"]:g} Hz')
