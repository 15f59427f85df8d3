# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Arm runs from rosbag2 recordings.

Voltage messages have no stamp. They are matched with the joint states by the time at which the
recorder received them, and the stamps of the joint states give the time of the run; so a run at
many times real time (stamps of /clock, received in wall time) comes out right.
"""

from array import array
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
import warnings

from hysteresis_ros.atomic import AnyPath
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.bag_storage import open_bag, Storage, SUFFIXES
from hysteresis_ros.measurements.cdr import (
    decode_diagnostics, decode_float64, decode_temperature, JointReader)
from hysteresis_ros.measurements.csv import digest
from hysteresis_ros.measurements.table import Measurement, MeasurementWarning
from hysteresis_ros.spelling import short_list
import numpy as np

JOINT = 'elbow'
BRIDGE = 'hardware_bridge'
HEATING_UP = 2.0
"""A change of voltage at most this many seconds before `initialising` shows belongs to it."""

TYPES = {
    'applied_voltage': 'std_msgs/msg/Float64',
    'voltage_setpoint': 'std_msgs/msg/Float64',
    'joint_states': 'sensor_msgs/msg/JointState',
    'ambient_temperature': 'sensor_msgs/msg/Temperature',
}
DIAGNOSTICS = '/diagnostics'


class Recording(NamedTuple):
    """
    Messages of one arm, received times in ns as int64, everything else as float64.

    Attributes
    ----------
    voltage, angle, ambient : tuple of ndarray
        (received, value), and for the angle (received, stamp, value).
    initialising : tuple of ndarray
        (received, whether the bridge heats and cools the muscle).

    """

    voltage: tuple
    angle: tuple
    ambient: tuple
    initialising: tuple


def is_bag(path: AnyPath) -> bool:
    """Tell whether a path is a recording rather than a table: a folder, or .mcap or .db3."""
    path = Path(path)
    return path.is_dir() or path.name.removesuffix('.zstd').endswith(SUFFIXES)


def read_bag(path: AnyPath, namespace: str | None = None) -> Measurement:
    """
    Read an arm run from a rosbag2 recording.

    Topics are found by the last part of their names. `applied_voltage` is taken, or
    `voltage_setpoint` without it. Rows while the bridge reports `state: initialising` are left
    out, and each such heat and cool cycle begins a new trial.

    Parameters
    ----------
    path : str or Path
        Folder, or one storage file.
    namespace : str, optional
        Where the topics are, if the bag has those of several arms.

    Returns
    -------
    Measurement
        An arm run with `time, trial, voltage, angle` and, if recorded, `ambient_temperature`.

    Raises
    ------
    MeasurementError
        If the bag is damaged, empty or ambiguous, or a topic is missing.

    Warns
    -----
    MeasurementWarning
        As `read_csv`, and where the recording was cut off, as by a power failure: it is read up to
        its last whole chunk.

    """
    path = Path(path)
    with open_bag(path) as bag:
        topics = choose_topics(path, bag.topics, namespace)
        recording = collect(path, bag, topics)
        lost = bag.lost
    columns = arm_run(path, recording)
    measurement = Measurement.from_columns(columns, str(path), digest(path))
    for note in [*filter(None, [lost]), *measurement.warnings]:
        warnings.warn(note, MeasurementWarning, stacklevel=2)
    return measurement


def choose_topics(path: Path, topics: Mapping[str, str], namespace: str | None) -> dict[str, str]:
    """
    Choose the topics of one arm.

    Parameters
    ----------
    path : Path
        For messages.
    topics : dict of str to str
        Type of each topic in the bag.
    namespace : str or None

    Returns
    -------
    dict of str to str
        Topic by role; roles as in `TYPES`, without those that are not there.

    Raises
    ------
    MeasurementError
        If joint states or voltages are missing, or those of several arms are there.

    """
    if not topics:
        raise MeasurementError(f'{path}: the bag has no messages')
    prefix = None if namespace is None else '/' + namespace.strip('/')
    found = {}
    for role, expected in TYPES.items():
        if role == 'voltage_setpoint' and 'applied_voltage' in found:
            continue
        named = [t for t in topics if t.rsplit('/', 1)[-1] == role]
        fitting = [t for t in named if topics[t] == expected]
        if named and not fitting:
            raise MeasurementError(
                f'{path}: topic {named[0]} has type {topics[named[0]]}, not {expected}')
        if prefix is not None:
            fitting = [t for t in fitting if t.rsplit('/', 1)[0] == prefix.rstrip('/')]
        if len(fitting) > 1:
            raise MeasurementError(
                f'{path}: several topics {role} ({", ".join(sorted(fitting)[:6])}); choose one '
                'arm with --namespace')
        if fitting:
            found[role] = fitting[0]
    where = '' if namespace is None else f' in the namespace {namespace!r}'
    if 'joint_states' not in found:
        raise MeasurementError(
            f'{path}: no topic joint_states{where}; the bag has {short_list(topics)}')
    if 'applied_voltage' not in found and 'voltage_setpoint' not in found:
        raise MeasurementError(
            f'{path}: no topic applied_voltage or voltage_setpoint{where}; the bag has '
            f'{short_list(topics)}')
    return found


def collect(path: Path, bag: Storage, topics: Mapping[str, str]) -> Recording:
    """
    Read the messages of the chosen topics.

    Returns
    -------
    Recording

    """
    roles = {topic: role for role, topic in topics.items()}
    if bag.topics.get(DIAGNOSTICS, '').endswith('/DiagnosticArray'):
        roles[DIAGNOSTICS] = 'diagnostics'
    namespace = topics['joint_states'].rsplit('/', 1)[0].strip('/')
    voltage, angle = (array('q'), array('d')), (array('q'), array('d'), array('d'))
    ambient, state = (array('q'), array('d')), (array('q'), array('d'))
    joint = JointReader(lambda names: choose_joint(path, names))
    for topic, received, data in bag.messages(roles):
        role = roles[topic]
        try:
            if role == 'joint_states':
                stamp, position = joint.read(data)
                if position is not None:
                    angle[0].append(received)
                    angle[1].append(stamp)
                    angle[2].append(position)
            elif role == 'ambient_temperature':
                ambient[0].append(received)
                ambient[1].append(decode_temperature(data))
            elif role == 'diagnostics':
                busy = bridge_initialises(decode_diagnostics(data), namespace)
                if busy is not None:
                    state[0].append(received)
                    state[1].append(busy)
            else:
                voltage[0].append(received)
                voltage[1].append(decode_float64(data))
        except MeasurementError as error:
            raise MeasurementError(f'{path}: topic {topic} holds {error}') from None
    return Recording(*(tuple(np.array(column) for column in columns)
                       for columns in (voltage, angle, ambient, state)))


def choose_joint(path: Path, names: Sequence[str]) -> str:
    """Return the name of the joint: `elbow`, else the only one."""
    if JOINT in names:
        return JOINT
    if len(names) == 1:
        return names[0]
    raise MeasurementError(
        f'{path}: joint_states has the joints {short_list(names)}; one named {JOINT!r} is needed')


def bridge_initialises(statuses: Sequence[tuple[str, Mapping[str, str]]],
                       namespace: str) -> bool | None:
    """
    Tell whether the bridge heats and cools the muscle, None if no status is its own.

    Parameters
    ----------
    statuses : list of (str, dict of str to str)
        As `decode_diagnostics` gives them.
    namespace : str
        Of the arm; with several arms in a bag each bridge names its own in its status.

    Returns
    -------
    bool or None

    """
    mine = [(name, values['state']) for name, values in statuses
            if BRIDGE in name and 'state' in values]
    if len(mine) > 1:
        mine = [(name, state) for name, state in mine if namespace in name]
    return mine[0][1] == 'initialising' if mine else None


def arm_run(path: Path, recording: Recording) -> dict[str, np.ndarray]:
    """
    Put the messages on the rows of the joint states.

    Parameters
    ----------
    path : Path
        For messages.
    recording : Recording

    Returns
    -------
    dict of str to ndarray
        `time, trial, voltage, angle` and perhaps `ambient_temperature`.

    """
    received, stamp, angle = recording.angle
    volts_received, volts = recording.voltage
    for values, name in ((received, 'joint_states'), (volts_received, 'voltage')):
        if not len(values):
            raise MeasurementError(f'{path}: the bag has no {name} messages')
    stamp = stamp if np.ptp(stamp) > 0 else 1e-9 * (received - received[0])
    # The voltage of a row is the last one received; rows before the first have none.
    latest = np.searchsorted(volts_received, received, side='right') - 1
    keep = (latest >= 0) & np.isfinite(angle)
    voltage = np.where(keep, volts[np.maximum(latest, 0)], np.nan)
    keep &= np.isfinite(voltage)
    ahead = np.maximum.accumulate(stamp)
    if np.any(ahead - stamp > 1.0):
        row = int(np.argmax(ahead - stamp > 1.0))
        raise MeasurementError(
            f'{path}: the stamps of joint_states jump back by {ahead[row] - stamp[row]:.3g} s at '
            f'message {row}; record every run of the simulation in a bag of its own')
    keep &= np.concatenate(([True], stamp[1:] > ahead[:-1]))
    trial, busy = trials(received, stamp, voltage, recording.initialising)
    keep &= ~busy
    if not np.any(keep):
        raise MeasurementError(
            f'{path}: no joint state with a known voltage; was the bridge running and enabled?')
    time, trial = stamp[keep], trial[keep]
    ids, starts, trial = np.unique(trial, return_index=True, return_inverse=True)
    columns = {'time': time - time[starts][trial], 'trial': trial.astype(float),
               'voltage': voltage[keep], 'angle': angle[keep]}
    ambient_received, ambient = recording.ambient
    finite = np.isfinite(ambient)
    if np.any(finite):
        columns['ambient_temperature'] = np.interp(
            received[keep], ambient_received[finite], ambient[finite])
    return columns


def trials(received: np.ndarray, stamp: np.ndarray, voltage: np.ndarray,
           initialising: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """
    Divide the rows at the heat and cool cycles.

    Parameters
    ----------
    received : ndarray of int64, shape (rows,)
        ns.
    stamp, voltage : ndarray, shape (rows,)
        s and V.
    initialising : tuple of ndarray
        Received times and flags.

    Returns
    -------
    trial : ndarray of int, shape (rows,)
        Number of cycles before the row.
    busy : ndarray of bool, shape (rows,)
        Whether the row is inside a cycle.

    """
    when, flag = initialising
    if not np.any(flag):
        return np.zeros(len(received), dtype=int), np.zeros(len(received), dtype=bool)
    latest = np.searchsorted(when, received, side='right') - 1
    busy = (latest >= 0) & (flag[np.maximum(latest, 0)] > 0)
    for row in np.flatnonzero(busy & ~np.concatenate(([False], busy[:-1]))):
        # The board heats up at once, the status comes a moment later.
        early = max(int(np.searchsorted(stamp, stamp[row] - HEATING_UP)) - 1, 0)
        changes = np.flatnonzero(np.diff(voltage[early:row + 1]) != 0) + early + 1
        if changes.size:
            busy[changes[-1]:row] = True
    begins = busy & ~np.concatenate(([False], busy[:-1]))
    return np.cumsum(begins), busy
