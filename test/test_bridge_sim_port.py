# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The port sim://bicep as pyserial's users see it."""

import threading

from hysteresis_ros.bridge.board_link import HANDLERS
from hysteresis_ros.bridge.protocol import encode
from hysteresis_ros.errors import ParameterError
import pytest
import serial


def open_port(url, **options):
    """Open a port as any program does that knows pyserial."""
    assert HANDLERS in serial.protocol_handler_packages
    return serial.serial_for_url(url, **options)


def test_port_speaks_pyserial():
    with open_port('sim://bicep?speed=20', timeout=2.0) as port:
        assert port.is_open and port.out_waiting == 0
        assert port.write(b'\n' + encode('hello', 7)) == 14
        line = b''
        while not line.startswith(b'board '):
            line = port.readline()
        port.flush()
        port.reset_output_buffer()
        port.reset_input_buffer()
        assert port.in_waiting < 500
        port.baudrate = 9600
        port.timeout = 0
        assert isinstance(port.read(1), bytes)
        with pytest.raises(serial.SerialException, match='already'):
            port.open()
    with pytest.raises(serial.SerialException):
        port.read(1)


def test_port_that_was_never_opened_says_so():
    port = open_port('sim://bicep', do_not_open=True)
    for use in (lambda: port.read(1), lambda: port.write(b'x'), lambda: port.in_waiting,
                port.cancel_read, port.reset_input_buffer):
        with pytest.raises(serial.PortNotOpenError):
            use()


def test_pulled_cable_is_a_serial_exception():
    port = open_port('sim://bicep?unplug_after=0', timeout=1.0, do_not_open=True)
    with pytest.raises(serial.SerialException, match='unplugged'):
        port.open()
        port.read(10 ** 4)
    port.close()
    assert not port.is_open


def test_waiting_read_can_be_ended_through_pyserial():
    with open_port('sim://bicep?silent_after=0') as port:
        thread = threading.Timer(0.1, port.cancel_read)
        thread.start()
        assert port.read(10 ** 6) == b''
        thread.join()


def test_wrong_url_is_refused_on_opening():
    with pytest.raises(ParameterError, match='sped'):
        open_port('sim://bicep?sped=1')
