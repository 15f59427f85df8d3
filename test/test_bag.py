# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Arm runs from rosbag2 recordings: storages, topics, time, trials, damage."""

import sys
from types import ModuleType, SimpleNamespace

from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import bag_storage, read_measurement, settled_rows
from hysteresis_ros.measurements.cdr import (
    decode_diagnostics, decode_float64, decode_joint_state, decode_temperature, JointReader)
import numpy as np
import pytest

rosbag2 = pytest.importorskip('rosbags.rosbag2')
typesys = pytest.importorskip('rosbags.typesys')

STORE = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
START = 1_700_000_000_000_000_000
FLOAT, JOINTS = 'std_msgs/msg/Float64', 'sensor_msgs/msg/JointState'
AMBIENT, STATUS = 'sensor_msgs/msg/Temperature', 'diagnostic_msgs/msg/DiagnosticArray'


def header(seconds):
    time = STORE.types['builtin_interfaces/msg/Time']
    nanoseconds = round(seconds * 1e9)
    return STORE.types['std_msgs/msg/Header'](
        time(nanoseconds // 10**9, nanoseconds % 10**9), 'base')


def voltage(value):
    return FLOAT, STORE.types[FLOAT](value)


def joints(stamp, positions, names=('elbow',)):
    nothing = np.array([])
    return JOINTS, STORE.types[JOINTS](
        header(stamp), list(names), np.array(positions, dtype=float), nothing, nothing)


def ambient(value):
    return AMBIENT, STORE.types[AMBIENT](header(0.0), value, 0.0)


def status(state, name='hardware_bridge: board'):
    pair = STORE.types['diagnostic_msgs/msg/KeyValue']
    entry = STORE.types['diagnostic_msgs/msg/DiagnosticStatus'](
        0, name, 'fine', 'sim', [pair('port', 'sim://bicep'), pair('state', state)])
    return STATUS, STORE.types[STATUS](header(0.0), [entry])


def write_bag(path, messages, storage='MCAP', compression=None):
    """Write (wall seconds, topic, (type, message)) to a bag, like `ros2 bag record`."""
    writer = rosbag2.Writer(path, version=8, storage_plugin=rosbag2.StoragePlugin[storage])
    if compression:
        writer.set_compression(rosbag2.CompressionMode[compression],
                               rosbag2.CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for wall, topic, (kind, message) in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], START + round(wall * 1e9),
                         bytes(STORE.serialize_cdr(message, kind)))
    return path


def run(levels=(1.0, 2.0, 0.5), hold=30.0, speed=60.0, begin=5.0, wall=0.0, prefix=''):
    """Messages of a run at many times real time: stamps of /clock, received in wall time."""
    messages = []
    for n, level in enumerate(levels):
        for k in range(int(hold)):
            stamp = begin + n * hold + k
            received = wall + (stamp - begin) / speed
            if k == 0:
                messages.append((received, f'{prefix}/applied_voltage', voltage(level)))
            messages.append((received + 1e-3, f'{prefix}/joint_states',
                             joints(stamp, [2.0 - 0.1 * level])))
    return messages


@pytest.mark.parametrize('storage', ['MCAP', 'SQLITE3'])
@pytest.mark.parametrize('compression', [None, 'MESSAGE', 'FILE'])
def test_storages_and_compression(tmp_path, storage, compression):
    bag = write_bag(tmp_path / 'bag', run(), storage, compression)
    table = read_measurement(bag)
    assert (table.kind, table.response, table.drive) == ('arm', 'angle', 'voltage')
    np.testing.assert_allclose(table.time, np.arange(90.0), atol=1e-6)
    np.testing.assert_array_equal(table.column('voltage'), np.repeat([1.0, 2.0, 0.5], 30))
    np.testing.assert_allclose(table.column('angle'), 2.0 - 0.1 * table.column('voltage'))
    assert list(settled_rows(table).column('voltage')) == [1.0, 2.0, 0.5]
    assert len(table.digest) == 64


def test_the_voltage_of_a_row_is_the_last_one_received(tmp_path):
    messages = [(0.0, '/joint_states', joints(0.0, [1.0])),
                (0.1, '/applied_voltage', voltage(3.0)),
                (0.2, '/joint_states', joints(7.0, [1.1])),
                (0.3, '/applied_voltage', voltage(4.0)),
                (0.4, '/applied_voltage', voltage(5.0)),
                (0.5, '/joint_states', joints(9.0, [1.2]))]
    table = read_measurement(write_bag(tmp_path / 'bag', messages))
    assert list(table.time) == [0.0, 2.0]
    assert list(table.column('voltage')) == [3.0, 5.0]
    assert list(table.column('angle')) == [1.1, 1.2]


def test_without_stamps_the_time_of_receiving_counts(tmp_path):
    messages = [(0.1 * k, topic, message) for k in range(5) for topic, message in (
        ('/applied_voltage', voltage(k)), ('/joint_states', joints(0.0, [k])))]
    table = read_measurement(write_bag(tmp_path / 'bag', messages))
    np.testing.assert_allclose(table.time, 0.1 * np.arange(5), atol=1e-6)


def test_applied_voltage_is_preferred_and_the_setpoint_is_enough(tmp_path):
    setpoint = [(0.0, '/voltage_setpoint', voltage(9.0))]
    both = read_measurement(write_bag(tmp_path / 'both', setpoint + run()))
    assert both.column('voltage').max() == 2.0
    alone = [m for m in run() if m[1] != '/applied_voltage']
    table = read_measurement(write_bag(tmp_path / 'alone', setpoint + alone))
    assert set(table.column('voltage')) == {9.0}


def test_ambient_temperature_is_interpolated(tmp_path):
    extra = [(0.0, '/ambient_temperature', ambient(20.0)),
             (1.5, '/ambient_temperature', ambient(26.0))]
    table = read_measurement(write_bag(tmp_path / 'bag', run() + extra))
    values = table.column('ambient_temperature')
    assert values[0] == pytest.approx(20.0, abs=0.01)
    assert values[45] == pytest.approx(20.0 + 6.0 * (45 / 60 + 1e-3) / 1.5, abs=1e-6)


def test_the_elbow_is_taken_or_the_only_joint(tmp_path):
    start = [(0.0, '/applied_voltage', voltage(1.0))]
    two = start + [(k, '/joint_states', joints(k, [5.0, 1.0], ('wrist', 'elbow')))
                   for k in (1, 2)]
    assert set(read_measurement(write_bag(tmp_path / 'two', two)).column('angle')) == {1.0}
    other = start + [(k, '/joint_states', joints(k, [0.5], ('knee',))) for k in (1, 2)]
    assert set(read_measurement(write_bag(tmp_path / 'one', other)).column('angle')) == {0.5}
    unclear = start + [(1, '/joint_states', joints(1, [1, 2], ('knee', 'hip')))]
    with pytest.raises(MeasurementError, match="joints 'knee', 'hip'; one named 'elbow'"):
        read_measurement(write_bag(tmp_path / 'unclear', unclear))


def test_several_arms_need_a_namespace(tmp_path):
    messages = sorted(run(prefix='/left') + run(levels=(4.0,), prefix='/right'),
                      key=lambda m: m[0])
    bag = write_bag(tmp_path / 'bag', messages)
    with pytest.raises(MeasurementError, match='several topics applied_voltage.*--namespace'):
        read_measurement(bag)
    assert set(read_measurement(bag, namespace='right').column('voltage')) == {4.0}
    with pytest.raises(MeasurementError, match="joint_states in the namespace '.middle'"):
        read_measurement(bag, namespace='/middle')


def test_a_heat_and_cool_cycle_begins_a_trial(tmp_path):
    first = [(0.0, '/diagnostics', status('ready'))] + run(levels=(1.0, 2.0))
    cycle = [(1.0, '/applied_voltage', voltage(6.0)),
             (1.005, '/joint_states', joints(65.3, [0.5])),
             (1.01, '/diagnostics', status('initialising')),
             (1.02, '/joint_states', joints(66.2, [0.4])),
             (1.4, '/applied_voltage', voltage(0.0)),
             (1.5, '/joint_states', joints(95.0, [1.9])),
             (1.51, '/diagnostics', status('other', name='monitor')),
             (1.52, '/joint_states', joints(96.2, [1.9])),
             (1.6, '/diagnostics', status('ready'))]
    second = run(levels=(3.0,), begin=101.0, wall=1.6)
    table = read_measurement(write_bag(tmp_path / 'bag', first + cycle + second))
    assert table.split() == [(0.0, slice(0, 60)), (1.0, slice(60, 90))]
    assert set(table.column('voltage')) == {1.0, 2.0, 3.0}
    assert table.time[60] == 0.0 and table.time[59] == pytest.approx(59.0)


def test_a_bag_that_begins_with_a_cycle_has_no_empty_trial(tmp_path):
    messages = [(0.0, '/diagnostics', status('initialising')),
                (0.0, '/applied_voltage', voltage(6.0)),
                (0.1, '/joint_states', joints(1.0, [0.5])),
                (0.2, '/diagnostics', status('ready'))] + run(wall=0.3)
    assert list(read_measurement(write_bag(tmp_path / 'bag', messages)).trials) == [0]


def test_rows_that_are_no_number_or_come_twice_are_left_out(tmp_path):
    messages = [(0.0, '/applied_voltage', voltage(1.0))] + [
        (1.0 + k, '/joint_states', joints(*row)) for k, row in enumerate(
            [(1.0, [1.0]), (2.0, [np.nan]), (3.0, [1.1]), (3.0, [1.2]), (4.0, []), (5.0, [1.3])])]
    table = read_measurement(write_bag(tmp_path / 'bag', messages))
    assert list(table.column('angle')) == [1.0, 1.1, 1.3]


@pytest.mark.parametrize('messages, words', [
    ([(0.0, '/voltage', voltage(1.0))], "no topic joint_states; the bag has '/voltage'"),
    ([(0.0, '/joint_states', joints(0, [1]))], 'no topic applied_voltage or voltage_setpoint'),
    ([(0.0, '/joint_states', voltage(1.0))], 'has type std_msgs/msg/Float64, not sensor_msgs'),
    ([(0.0, '/joint_states', joints(0, [1])), (1.0, '/applied_voltage', voltage(1.0))],
     'no joint state with a known voltage'),
    ([(0.0, '/applied_voltage', voltage(1.0)), (1.0, '/joint_states', joints(50, [1])),
      (2.0, '/joint_states', joints(1, [1]))], 'jump back by 49 s at message 1'),
    ([], 'no messages')])
def test_a_bag_without_a_run_is_refused_in_one_line(tmp_path, messages, words):
    bag = write_bag(tmp_path / 'bag', messages)
    with pytest.raises(MeasurementError, match=words) as refused:
        read_measurement(bag)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize('storage', ['MCAP', 'SQLITE3'])
@pytest.mark.parametrize('keep', [0, 20, 0.1])
def test_a_truncated_bag_is_refused_in_one_line(tmp_path, storage, keep):
    bag = write_bag(tmp_path / 'bag', run(), storage)
    file = next(p for p in bag.iterdir() if p.name != 'metadata.yaml')
    data = file.read_bytes()
    file.write_bytes(data[:int(keep if keep != 0.1 else keep * len(data))])
    with pytest.raises(MeasurementError) as refused:
        read_measurement(bag)
    assert '\n' not in str(refused.value)
    assert ('empty' if keep == 0 else 'truncated or damaged') in str(refused.value)


def test_a_recorder_that_was_killed(tmp_path):
    bag = write_bag(tmp_path / 'bag', run())
    (bag / 'metadata.yaml').unlink()
    assert read_measurement(bag).rows == 90
    (bag / 'second.mcap').write_bytes(b'')
    with pytest.raises(MeasurementError, match='no metadata.yaml.*ros2 bag reindex'):
        read_measurement(bag)
    for file in bag.iterdir():
        file.write_bytes(b'')
    (bag / 'second.mcap').unlink()
    with pytest.raises(MeasurementError, match='the bag is empty'):
        read_measurement(bag)
    for file in bag.iterdir():
        file.unlink()
    with pytest.raises(MeasurementError, match='holds no bag'):
        read_measurement(bag)


def test_metadata_that_is_garbage_or_names_another_file(tmp_path):
    bag = write_bag(tmp_path / 'bag', run())
    for text in ('!!python/object/apply:os.system [false]', '[', 'rosbag2_bagfile_information: 1'):
        (bag / 'metadata.yaml').write_text(text)
        with pytest.raises(MeasurementError, match='cannot be read') as refused:
            read_measurement(bag)
        assert '\n' not in str(refused.value)


def test_one_storage_file_is_enough(tmp_path):
    bag = write_bag(tmp_path / 'bag', run())
    assert read_measurement(next(bag.glob('*.mcap'))).rows == 90


def test_messages_are_decoded_like_rosbags_does():
    def data(message):
        return bytes(STORE.serialize_cdr(message[1], message[0]))

    assert decode_float64(data(voltage(-2.5))) == -2.5
    stamp, names, positions = decode_joint_state(data(joints(12.25, [1, 2], ('a', 'bcd'))))
    assert (stamp, names, positions) == (12.25, ['a', 'bcd'], [1.0, 2.0])
    assert decode_temperature(data(ambient(21.5))) == 21.5
    assert decode_diagnostics(data(status('ready'))) == [
        ('hardware_bridge: board', {'port': 'sim://bicep', 'state': 'ready'})]
    big = bytes(STORE.serialize_cdr(voltage(3.5)[1], FLOAT, little_endian=False))
    assert decode_float64(big) == 3.5


def test_a_joint_is_read_from_messages_of_changing_shape():
    reader = JointReader(lambda names: 'elbow')
    for little in (True, False):
        for stamp, positions, names in (
                (1.5, [2.0, 3.0], ('wrist', 'elbow')), (2.5, [4.0, 5.0], ('wrist', 'elbow')),
                (3.5, [6.0, 7.0], ('elbow', 'wrist')), (4.5, [8.0], ('elbow',)),
                (5.5, [9.0], ('wrist',)), (6.5, [], ('elbow',)), (7.5, [1.0], ('elbow',))):
            kind, message = joints(stamp, positions, names)
            data = bytes(STORE.serialize_cdr(message, kind, little_endian=little))
            expected = dict(zip(names, positions)).get('elbow')
            assert reader.read(data) == (stamp, expected)


@pytest.mark.parametrize('decode, message', [
    (decode_float64, voltage(1.0)), (decode_joint_state, joints(1.0, [1.0])),
    (decode_temperature, ambient(20.0)), (decode_diagnostics, status('ready'))])
def test_a_message_that_is_cut_off_or_garbage_is_refused(decode, message):
    data = bytes(STORE.serialize_cdr(message[1], message[0]))
    needed = len(data) - (24 if decode is decode_joint_state else 8)
    for length in range(min(needed, len(data) - 4)):
        with pytest.raises(MeasurementError):
            decode(data[:length])
    with pytest.raises(MeasurementError, match='not in plain CDR'):
        decode(b'\x00\x07' + data[2:])
    if decode is not decode_float64:
        with pytest.raises(MeasurementError):
            decode(data[:12] + b'\xff' * 20)


def test_garbage_inside_a_message_names_its_topic(tmp_path, monkeypatch):
    bag = write_bag(tmp_path / 'bag', run())
    monkeypatch.setattr('hysteresis_ros.measurements.bag.decode_float64',
                        lambda data: decode_joint_state(data[:6]))
    with pytest.raises(MeasurementError, match='topic /applied_voltage holds a message that is'):
        read_measurement(bag)


class FakeReader:
    """ROS 2's reader as far as it is used, over the messages of `run`."""

    def open(self, storage, converter):
        assert storage.storage_id in ('mcap', 'sqlite3')
        if storage.uri.endswith('broken'):
            raise RuntimeError('No plugin\ndetected')
        self.left = []

    def get_all_topics_and_types(self):
        return [SimpleNamespace(name='/applied_voltage', type=FLOAT),
                SimpleNamespace(name='/joint_states', type=JOINTS)]

    def set_filter(self, chosen):
        self.left = [(topic, bytes(STORE.serialize_cdr(message, kind)), START + round(wall * 1e9))
                     for wall, topic, (kind, message) in run() if topic in chosen.topics]

    def has_next(self):
        return bool(self.left)

    def read_next(self):
        return self.left.pop(0)


@pytest.mark.parametrize('compression', [None, 'FILE'])
def test_without_rosbags_the_reader_of_ros_is_used(tmp_path, monkeypatch, compression):
    bag = write_bag(tmp_path / 'bag', run(), compression=compression)
    fake = ModuleType('rosbag2_py')
    fake.SequentialReader = fake.SequentialCompressionReader = FakeReader
    fake.StorageOptions = fake.StorageFilter = SimpleNamespace
    fake.ConverterOptions = lambda *formats: formats
    monkeypatch.setitem(sys.modules, 'rosbags.rosbag2', None)
    monkeypatch.setitem(sys.modules, 'rosbag2_py', fake)
    assert read_measurement(bag).rows == 90
    bag.rename(tmp_path / 'broken')
    with pytest.raises(MeasurementError, match='No plugin detected'):
        read_measurement(tmp_path / 'broken')
    monkeypatch.delitem(sys.modules, 'hysteresis_ros.measurements.bag_rosbag2')
    monkeypatch.setitem(sys.modules, 'rosbag2_py', None)
    with pytest.raises(MeasurementError, match='pip install rosbags'):
        bag_storage.open_bag(tmp_path / 'broken')


@pytest.mark.parametrize('made, words', [
    ([], '; it is empty'), (['notes.txt'], "but 'notes.txt'"),
    (['run/run_0.mcap'], 'the bag is one folder deeper, such as .*run')])
def test_a_folder_without_a_bag_says_what_it_holds(tmp_path, made, words):
    for name in made:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text('x')
    with pytest.raises(MeasurementError, match=f'holds no bag .*{words}'):
        read_measurement(tmp_path)


def test_the_metadata_of_a_bag_is_no_table(tmp_path):
    (tmp_path / 'metadata.yaml').write_text('rosbag2_bagfile_information:\n  version: 5\n')
    with pytest.raises(MeasurementError, match='metadata of a recording, no table; give its'):
        read_measurement(tmp_path / 'metadata.yaml')
