# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The port ``avr://bicep`` of pyserial: the pseudo-terminal of the firmware in simavr."""

from typing import Any

import serial

from hysteresis_ros.laboratory.board.chip import Chip
from hysteresis_ros.laboratory.board.port import CableUnplugged


class Serial(serial.Serial):
    """
    The firmware in simavr as a port; made by `serial.serial_for_url`.

    Attributes
    ----------
    chip : Chip or None
        What stands behind it, from the first `open` on.

    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.chip: Chip | None = None
        super().__init__(*args, **kwargs)

    def open(self) -> None:
        """
        Open the port; the first time, switch the chip on.

        Raises
        ------
        ParameterError
            If the programs are missing or the URL makes no sense.
        SerialException
            If the simulated cable is unplugged.

        """
        if self.chip is None:
            self.chip = Chip(self._port)
        try:
            self.portstr = self.chip.terminal
        except CableUnplugged as error:
            raise serial.SerialException(str(error)) from None
        super().open()
