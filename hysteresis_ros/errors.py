# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Errors that a user can mend.

Each message is one line that says what is wrong, where, and what to do. The command line prints
it and exits with status 1; a node logs it and reports it in its diagnostics.
"""


class HysteresisError(Exception):
    """Base of every error that this package raises on purpose."""


class MeasurementError(HysteresisError, ValueError):
    """A table or bag that cannot be read as a measurement."""


class ModelFileError(HysteresisError, ValueError):
    """A model file that is missing a part, is damaged, or is of another version."""


class ParameterError(HysteresisError, ValueError):
    """A parameter or option with a value that makes no sense."""


class RangeError(HysteresisError, ValueError):
    """A request that the muscle or the arm cannot reach; the message gives the range."""


class IdentificationError(HysteresisError, ValueError):
    """Measurements from which no model can be identified."""


class ProtocolError(HysteresisError, ValueError):
    """Bytes that are no frame of the board's protocol."""


class BoardError(HysteresisError, OSError):
    """A board that cannot be opened, that reports a fault or that has fallen silent."""
