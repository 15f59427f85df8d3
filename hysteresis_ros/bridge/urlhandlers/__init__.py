# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Ports that pyserial learns from us: add this package to `serial.protocol_handler_packages`.

Then ``serial.serial_for_url('sim://bicep')`` opens the simulated board like any other port.
"""
