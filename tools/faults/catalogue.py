# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The faults that come to a board which is heated, one by one."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import dataclasses
import math
import time

from hysteresis_ros.bridge.protocol import encode
from hysteresis_ros.laboratory.board.port import PortClosed
from tools.faults.fault import AFTER, BEGIN, Fault, VOLTAGE
from tools.faults.run import Run


def another_master(run: Run) -> None:
    """Write setpoints of another program to the board, past the port's lock."""
    run.wait(BEGIN)
    with contextlib.suppress(PortClosed):       # the end of the run
        for number in range(int(AFTER / 0.05)):
            run.rig.write(encode('set', 40000 + number, {'duty': 0.9}))
            time.sleep(0.05)


def limits_that_fail(run: Run) -> None:
    """Let the host's own limits pass everything, soon after the RMS was limited to 3 V."""
    run.wait(BEGIN)
    protection = run.board.protection
    protection.limits = dataclasses.replace(protection.limits, rms_voltage=3.0, rms_window=1.0)
    protection.limit = lambda voltage, *_: (voltage, '', False)     # type: ignore[method-assign]


def then(voltage: float) -> Callable[[float], float]:
    """Return the run's voltage until `BEGIN`, and another one [V] from then on."""
    return lambda time_of_arm: VOLTAGE if time_of_arm < BEGIN else voltage


def heat_cool_heat(time_of_arm: float) -> float:
    """Return a voltage [V] under which the arm passes the index three times."""
    return 0.0 if 2.5 < time_of_arm < 5.5 else VOLTAGE


FAULTS = (
    Fault('board reset by a brown-out, in a frame', '`brownout`', 'has started anew',
          f'brownout={BEGIN}'),
    Fault('cable pulled, put back after 0.5 s', '`unplug_after`, `unplug_for`',
          'lost while it was enabled', f'unplug_after={BEGIN}&unplug_for=0.5'),
    Fault('board no longer hears', '`deaf_after`', 'no setpoint came in time',
          f'deaf_after={BEGIN}'),
    Fault('board no longer answers', '`silent_after`', 'the board is silent',
          f'silent_after={BEGIN}'),
    Fault('some bytes dropped', '`drop=0.002`', 'bad lines', 'drop=0.002', goes_on=True),
    Fault('some bytes flipped', '`flip=0.002`', 'bad lines', 'flip=0.002', goes_on=True),
    Fault('some bytes doubled', '`double=0.002`', 'bad lines', 'double=0.002', goes_on=True),
    Fault('bytes delayed by 0.5 s', '`late_after`', 'telemetry is late', f'late_after={BEGIN}',
          stays=False),
    Fault('flood of garbage, both ways', '`mad_after`', 'bad lines', f'mad_after={BEGIN}'),
    Fault('telemetry frozen', '`frozen_after`', 'no new telemetry', f'frozen_after={BEGIN}'),
    Fault('encoder counts the wrong way', '`encoder_reversed_after`', 'counts the wrong way',
          'encoder_reversed_after=0', counted_from="the arm's first motion", until=5.0),
    Fault('encoder stands still while heated', '`encoder_still_after`', 'the angle stands still',
          'encoder_still_after=0', counted_from='when motion is due (60 K above ambient)',
          until=8.5),
    Fault('encoder jumps', '`encoder_jump`', 'jumped by', f'encoder_jump={BEGIN}'),
    Fault('index pulse missing', '`index_missing_after`, `encoder_index: check`', 'none came',
          'index_missing_after=5&time_constant=0.5', heat_cool_heat,
          counted_from='the place of the index', until=8.0),
    Fault('supply sags to 0.6 of it', '`supply_low_after`', 'V, 12 V expected',
          f'supply_low_after={BEGIN}'),
    Fault('supply vanishes', '`supply_off_after`', 'supply voltage is too low',
          f'supply_off_after={BEGIN}'),
    Fault('supply doubles', '`supply_double_after`', 'V, 12 V expected',
          f'supply_double_after={BEGIN}'),
    Fault('MOSFET stuck on while the duty is 0', '`mosfet_stuck_after`', 'MOSFET may be stuck',
          f'mosfet_stuck_after={BEGIN}', then(0.0), counted_from='zero duty, until the alarm',
          until=BEGIN + 3.0),
    Fault('every setpoint NaN', 'asked for', 'it has to be a number', '', then(math.nan)),
    Fault('every setpoint negative', 'asked for', 'the limits are 0 to 6 V', '', then(-1.0)),
    Fault('every setpoint above the limit', 'asked for', 'the limits are 0 to 6 V', '',
          then(6.5)),
    Fault('two masters on one port', 'another program writes `set duty=0.9`',
          'another one talks to it', meddle=another_master),
    Fault('emergency stop pressed', '`stop_after`', 'emergency stop was pressed',
          f'stop_after={BEGIN}'),
    Fault('host heats beyond its limit of the RMS', 'its own protection fails',
          'above what the board allows', meddle=limits_that_fail),
    Fault("board's clock jumps back by a minute", '`clock_back`', 'has started anew',
          f'clock_back={BEGIN}'),
)
