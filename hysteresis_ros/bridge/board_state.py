# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a board measures and how it fares, in SI units."""

from typing import NamedTuple

from hysteresis_ros.bridge.messages import Identity


class Sample(NamedTuple):
    """
    One frame of telemetry in SI units.

    Attributes
    ----------
    time : float
        Board time in s since the first contact; it only grows, also over restarts.
    angle, velocity : float
        In rad and rad/s.
    fresh : bool
        Whether the encoder's sample was believed; if not, `angle` is the one before.
    voltage : float
        Voltage in V that the board applies, as its duty and supply say.
    supply : float
        Smoothed supply voltage in V.
    ambient : float or None
        Ambient temperature in degC, in the frames that carry it.
    enabled : bool
        Whether the board takes setpoints.
    faults : tuple of str
        The board's faults, see `messages.FAULTS`.
    encoder_fault : str
        What is wrong with the angle, or ''.

    """

    time: float
    angle: float
    velocity: float
    fresh: bool
    voltage: float
    supply: float
    ambient: 'float | None'
    enabled: bool
    faults: tuple
    encoder_fault: str


class Status(NamedTuple):
    """
    How things are.

    Attributes
    ----------
    online : bool
        Whether telemetry comes.
    problem : str
        Why not, or '' while nobody has tried yet.
    faults : str
        The board's faults in words, or ''.
    limit : str
        Why the output is less than asked for, or ''.
    expired : bool
        Whether the setpoint is too old, so that 0 is sent.
    fault : str
        Why the output was switched off until it is enabled again, or ''.
    refusal : str
        The board's latest refusal, or ''.
    sample : Sample or None
        The latest one.
    identity : Identity or None
        The board's latest greeting.
    frames, bad_lines, lost_frames, connections : int
        Counters since the start.
    last_bad_line : str
        The latest bad line and what was wrong with it, or ''.

    """

    online: bool
    problem: str
    faults: str
    limit: str
    expired: bool
    fault: str
    refusal: str
    sample: 'Sample | None'
    identity: 'Identity | None'
    frames: int
    bad_lines: int
    lost_frames: int
    connections: int
    last_bad_line: str
