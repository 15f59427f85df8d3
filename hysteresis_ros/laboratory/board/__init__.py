# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A simulated PWM board with an arm of the virtual laboratory on it.

`simulated_board` is the board's side of the protocol, `cable` the faults between host and board,
`url` what ``sim://bicep?...`` asks for, `port` all of them with the wall's clock. Of the bridge it
shares the codec (`protocol`, `messages`) alone; pyserial finds the port through
`hysteresis_ros.bridge.urlhandlers`.
"""
