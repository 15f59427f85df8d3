# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The way from volts to a PWM board and from encoder counts back to radians.

In the order of the data: `pwm` turns a voltage into a duty, `protocol` and `messages` turn it into
bytes, `board` sends them over any pyserial port and reads what comes back, `encoder` turns counts
into an angle. `urlhandlers` makes the simulated board of the virtual laboratory a port of pyserial,
``sim://bicep``, that is spoken to byte for byte in the same protocol.
"""
