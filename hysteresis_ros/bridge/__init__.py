# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The way from volts to a PWM board and from encoder counts back to radians.

In the order of the data: `pwm` turns a voltage into a duty, `protocol` and `messages` turn it into
bytes, `board` sends them over any pyserial port and reads what comes back, `encoder` turns counts
into an angle. `simulated_board` answers the same bytes from an arm that exists only in the virtual
laboratory; `urlhandlers` makes it a port (``sim://bicep``) of pyserial.
"""
