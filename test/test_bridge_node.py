# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node hardware_bridge on the simulated board."""

import functools
import math
import signal
import time

from node_support import Graph, process
import numpy as np
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory.plant import Plant
from hysteresis_ros.nodes.bridge_node import BridgeNode

ERROR, WARN, OK = b'\2', b'\1', b'\0'


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


class Bridge:
    """The node with something that publishes setpoints and hears all that it says."""

    def __init__(self, graph, port='sim://bicep?speed=20', **parameters):
        self.graph = graph
        self.clocks = graph.collect(
            Clock, '/clock', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
        self.joints = graph.collect(JointState, 'joint_states')
        self.voltages = graph.collect(Float64, 'applied_voltage')
        self.ambients = graph.collect(Temperature, 'ambient_temperature')
        self.statuses = graph.status()
        # Few messages: node and listener share one executor here.
        values = {'port': port, 'telemetry_rate': 2.0 if 'speed' in port else 10.0, **parameters}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        self.node = graph.add(BridgeNode(context=graph.context, parameter_overrides=overrides))
        self._setpoints = graph.publisher(Float64, 'voltage_setpoint')

    def ask(self, voltage):
        """Publish a setpoint."""
        self._setpoints.publish(Float64(data=voltage))

    def last(self):
        """Return the last applied voltage."""
        return self.voltages[-1].data if self.voltages else math.nan

    def hold(self, voltage, condition, what):
        """Repeat a setpoint, 50 times a second, until something is so."""
        due = 0.0

        def repeat():
            nonlocal due
            if time.monotonic() > due:
                due = time.monotonic() + 0.02
                self.ask(voltage)
            return condition()
        self.graph.until(repeat, what)

    def says(self, words, level):
        """Wait until the diagnostics say something."""
        self.graph.until(lambda: any(words in status.message and status.level == level
                                     for status in self.statuses), f'{words!r} in diagnostics')

    def values(self):
        """Return the latest values of the diagnostics."""
        self.graph.until(lambda: self.statuses, 'diagnostics')
        return {pair.key: pair.value for pair in self.statuses[-1].values}


@pytest.fixture
def bridge(graph):
    """Make a bridge; it ends with the graph."""
    return functools.partial(Bridge, graph)


def test_setpoint_moves_the_arm(bridge, graph):
    """Volts in, angle out, in SI units, with names and stamps."""
    one = bridge()
    graph.until(lambda: one.joints and one.voltages and one.ambients, 'telemetry')
    first = one.joints[0]
    assert first.name == ['elbow'] and len(first.position) == len(first.velocity) == 1
    assert first.position[0] == pytest.approx(Plant(0).arm.angle, abs=2e-3)
    assert one.ambients[0].temperature == pytest.approx(22.0, abs=1.0)
    assert one.last() == 0.0
    one.hold(5.0, lambda: one.last() == pytest.approx(5.0, abs=0.02), 'the voltage')
    one.hold(5.0, lambda: one.joints[-1].position[0] < first.position[0] - 0.3, 'the arm')
    assert min(joint.velocity[0] for joint in one.joints) < 0.0
    stamps = [1e-9 * (joint.header.stamp.sec * 10 ** 9 + joint.header.stamp.nanosec)
              for joint in one.joints]
    assert stamps == sorted(stamps)
    # The median: a busy machine may lose a message.
    assert np.median(np.diff(stamps)) == pytest.approx(0.5, abs=0.1)


def test_clock_runs_with_the_board(bridge, graph):
    """At another speed than the wall's, the node publishes /clock."""
    one = bridge('sim://bicep?speed=20')
    graph.until(lambda: len(one.clocks) > 10, 'the clock')
    times = [clock.clock.sec + 1e-9 * clock.clock.nanosec for clock in one.clocks]
    assert times == sorted(times)
    before, now = time.monotonic(), times[-1]
    graph.spin(0.5)
    last = one.clocks[-1].clock
    speed = (last.sec + 1e-9 * last.nanosec - now) / (time.monotonic() - before)
    assert 8.0 < speed < 32.0
    stamp = one.joints[-1].header.stamp
    assert abs(stamp.sec - last.sec) <= 5


def test_no_clock_at_real_time(bridge, graph):
    """The wall's clock needs no help."""
    one = bridge('sim://bicep')
    graph.until(lambda: len(one.joints) > 3, 'telemetry')
    assert graph.probe.count_publishers('/clock') == 0
    stamp = one.joints[-1].header.stamp
    assert abs(stamp.sec - time.time()) < 3.0


def test_no_setpoint_no_voltage(bridge, graph):
    """The host's watchdog."""
    one = bridge('sim://bicep', setpoint_timeout=0.3)
    one.hold(4.0, lambda: one.last() == pytest.approx(4.0, abs=0.02), 'the voltage')
    graph.until(lambda: one.last() == 0.0, 'the end of the setpoint')
    one.says('no setpoint for setpoint_timeout (0.3 s)', WARN)
    one.hold(4.0, lambda: one.last() > 0.0, 'the voltage again')


def test_setpoint_that_makes_no_sense_never_reaches_the_board(bridge, graph):
    """The reason is in the diagnostics; the good ones before and after it count."""
    one = bridge()
    for wrong, words in ((math.nan, 'is nan'), (math.inf, 'is inf'), (-0.5, '-0.5 V refused'),
                         (6.5, 'the limits are 0 to 6 V')):
        one.hold(3.0, lambda: one.last() == pytest.approx(3.0, abs=0.02), 'the voltage')
        one.ask(wrong)
        one.says(words, WARN)
    one.hold(3.0, lambda: one.statuses[-1].level == OK and one.values()['setpoints refused'] == '4',
             'the warning to go')
    assert max(voltage.data for voltage in one.voltages) < 3.1


def test_output_can_be_disabled_and_enabled(bridge, graph):
    """~/enable answers when the board has followed."""
    one = bridge()
    one.hold(3.0, lambda: one.last() > 0.0, 'the voltage')
    response = graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=False))
    assert (response.success, response.message) == (True, 'disabled')
    graph.until(lambda: one.last() == 0.0, 'the output to go off')
    one.says('the output is disabled', OK)
    one.ask(3.0)
    graph.spin(0.2)
    assert one.last() == 0.0
    response = graph.call(Trigger, '/hardware_bridge/initialise', Trigger.Request())
    assert not response.success and 'not enabled' in response.message
    response = graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=True))
    assert (response.success, response.message) == (True, 'enabled')
    one.hold(3.0, lambda: one.last() > 0.0, 'the voltage')


def test_after_an_emergency_stop_somebody_has_to_enable(bridge, graph):
    """Refused with the reason while it is pressed; once it is released, the muscle is heated."""
    one = bridge('sim://bicep?speed=20&stop_after=30&stop_for=100')
    one.hold(3.0, lambda: one.last() > 0.0, 'the voltage')
    one.says('emergency stop was pressed', ERROR)
    response = graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=True))
    assert not response.success and 'emergency stop was pressed' in response.message
    # On a busy machine a board that lives so fast may be lost for a moment.
    graph.until(lambda: 'stop: ' not in one.statuses[-1].message
                and one.values()['online'] == 'True', 'its release')
    begin = len(one.voltages)
    one.ask(3.0)
    graph.until(lambda: len(one.voltages) > begin + 3, 'telemetry')
    assert {voltage.data for voltage in one.voltages[begin:]} == {0.0}
    response = graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=True))
    assert (response.success, response.message) == (True, 'enabled')
    one.hold(3.0, lambda: one.last() > 0.0, 'the voltage again')


def test_starts_disabled_where_that_is_wanted(bridge, graph):
    """A setpoint alone does not heat then."""
    one = bridge(start_enabled=False)
    graph.until(lambda: one.voltages, 'telemetry')
    one.ask(3.0)
    graph.spin(0.3)
    assert {voltage.data for voltage in one.voltages} == {0.0}


def test_initialise_heats_and_cools(bridge, graph):
    """It takes as long as it needs, in board time; setpoints are refused meanwhile."""
    one = bridge('sim://bicep?speed=30', initialise_heat_time=60.0, initialise_cool_time=30.0)
    one.hold(3.5, lambda: one.joints and one.joints[-1].position[0] < 2.4, 'a history')
    client = graph.probe.create_client(Trigger, '/hardware_bridge/initialise')
    graph.until(client.service_is_ready, 'the service')
    answer = client.call_async(Trigger.Request())
    graph.until(lambda: one.last() == pytest.approx(6.0, abs=0.05), 'heating')
    begin = len(one.voltages)
    one.ask(2.0)
    one.says('the heat and cool cycle is running', WARN)
    second = client.call_async(Trigger.Request())
    graph.until(second.done, 'the second answer')
    assert not second.result().success and 'one is running' in second.result().message
    graph.until(answer.done, 'the end of the cycle')
    assert answer.result().success, answer.result().message
    cold = Plant(0).arm.angle
    graph.until(lambda: one.joints[-1].position[0] == pytest.approx(cold, abs=5e-3), 'rest')
    seen = [round(voltage.data) for voltage in one.voltages[begin:]]
    assert set(seen) == {0, 6}
    heating = seen.index(0)
    assert 110 <= heating <= 150 and set(seen[heating:]) == {0}
    assert any('heat and cool cycle: heating' in status.message for status in one.statuses)
    one.hold(2.0, lambda: one.last() == pytest.approx(2.0, abs=0.02), 'setpoints to count again')


def test_initialise_waits_for_a_board_that_is_being_enabled(bridge, graph):
    """As right after the start, when the first telemetry says that it is not enabled yet."""
    client = graph.probe.create_client(Trigger, '/hardware_bridge/initialise')
    one = bridge('sim://bicep', telemetry_rate=2.0, start_enabled=True)
    graph.until(lambda: one.joints and client.service_is_ready(), 'telemetry and the service')
    answer = client.call_async(Trigger.Request())
    graph.until(lambda: answer.done() or one.last() > 5.0, 'heating')
    assert not answer.done() and one.last() > 5.0


def test_initialise_ends_when_the_output_is_switched_off(bridge, graph):
    """The caller hears why."""
    one = bridge()
    graph.until(lambda: one.values().get('enabled') == 'True' if one.statuses else False, 'board')
    client = graph.probe.create_client(Trigger, '/hardware_bridge/initialise')
    graph.until(client.service_is_ready, 'the service')
    answer = client.call_async(Trigger.Request())
    graph.until(lambda: one.last() > 5.0, 'heating')
    graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=False))
    graph.until(answer.done, 'the end')
    assert not answer.result().success and 'switched off' in answer.result().message


def test_board_that_is_unplugged_meanwhile(bridge, graph):
    """The node lives on, says so, and the clock goes on; the cycle is given up."""
    one = bridge('sim://bicep?speed=20&unplug_after=20&unplug_for=30')
    graph.until(lambda: one.values().get('enabled') == 'True' if one.statuses else False, 'board')
    answer = graph.call(Trigger, '/hardware_bridge/initialise', Trigger.Request())
    assert not answer.success and 'unplugged' in answer.message
    one.says('the cable is unplugged', ERROR)
    before = len(one.clocks)
    answer = graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=True))
    assert not answer.success and 'not enabled' in answer.message
    graph.until(lambda: len(one.clocks) > before + 3, 'the clock')
    graph.until(lambda: 'started anew' in one.statuses[-1].message, 'the board')
    one.says('lost while it was enabled; the output is off until ~/enable', ERROR)
    for _ in range(5):      # whoever sends setpoints knows nothing of it
        one.ask(3.0)
        graph.spin(0.1)
    assert one.values()['enabled'] == 'False' and one.last() == 0.0
    answer = graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=True))
    assert answer.success
    graph.until(lambda: one.statuses[-1].level == OK, 'the doubt to go')


def test_board_that_goes_silent(bridge, graph):
    """Diagnostics say so, and the board's own watchdog has switched off."""
    one = bridge('sim://bicep?speed=20&silent_after=10&silent_for=40', telemetry_timeout=0.3,
                 telemetry_rate=10.0)
    one.hold(3.0, lambda: one.last() > 0.0, 'the voltage')
    one.says('the board is silent', ERROR)
    graph.until(lambda: one.values()['online'] == 'True', 'the board to come back')
    one.says('lost while it was enabled; the output is off until ~/enable', ERROR)
    assert graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=True)).success
    graph.until(lambda: one.statuses[-1].level == OK, 'the fault to go')


def test_limits_of_the_muscle_are_shown_and_can_be_switched_off(bridge, graph):
    """Each by its parameter alone; what is off is said to be off."""
    one = bridge()
    one.hold(5.0, lambda: one.last() > 4.9, 'the voltage')
    graph.until(lambda: float(one.values()['RMS voltage [V]']) > 0.5, 'the power')
    values = one.values()
    assert float(values['estimated temperature [degC]']) > 25.0
    assert [values[name] for name in (
        'maximum_voltage [V]', 'maximum_temperature [degC]', 'rms_voltage_limit [V]',
        'full_heat_time [s]', 'soft_start_time [s]', 'encoder_check')] == [
        '6', '150', '6.5', '1800', '0.2', 'on']
    request = SetParameters.Request(parameters=[
        Parameter(name, value=value).to_parameter_msg() for name, value in (
            ('maximum_temperature', 0.0), ('rms_voltage_limit', 0.0), ('full_heat_time', 0.0),
            ('soft_start_time', 0.0), ('encoder_check', False))])
    answer = graph.call(SetParameters, '/hardware_bridge/set_parameters', request)
    assert all(result.successful for result in answer.results)
    graph.until(lambda: one.values()['maximum_temperature [degC]'] == 'off', 'the new values')
    assert [one.values()[name] for name in (
        'rms_voltage_limit [V]', 'full_heat_time [s]', 'soft_start_time [s]',
        'encoder_check')] == ['off'] * 4


def test_a_muscle_that_gets_too_warm_gets_less_voltage(bridge, graph):
    """By the identified thermal law: 60 degC are reached with 3.7 V above 22 degC."""
    one = bridge(maximum_temperature=60.0, encoder_check=False)
    one.hold(6.0, lambda: one.last() == pytest.approx(math.sqrt((60.0 - 22.0) / 2.7), abs=0.1),
             'the limit')
    one.says('degC allowed (maximum_temperature)', ERROR)


def test_full_heat_for_too_long_switches_off(bridge, graph):
    """Until somebody enables it again."""
    one = bridge(full_heat_time=40.0)
    one.hold(6.0, lambda: any('40 s are allowed (full_heat_time); the output is off until ~/enable'
                              in status.message for status in one.statuses), 'the end')
    graph.until(lambda: one.last() == 0.0, 'zero')


def test_an_encoder_that_stands_still_ends_the_heating(bridge, graph):
    """The setpoints go on, and are not followed until somebody says that there is no arm."""
    one = bridge('sim://bicep?speed=10&encoder_still_after=0')
    one.hold(6.0, lambda: any('the angle stands still' in status.message and status.level == ERROR
                              for status in one.statuses), 'the fault')
    graph.until(lambda: one.last() == 0.0, 'zero')
    one.says('set encoder_check to false where there is no arm', ERROR)
    answer = graph.call(SetParameters, '/hardware_bridge/set_parameters', SetParameters.Request(
        parameters=[Parameter('encoder_check', value=False).to_parameter_msg()]))
    assert answer.results[0].successful
    assert graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=True)).success
    one.hold(6.0, lambda: float(one.values()['estimated temperature [degC]']) > 100.0, 'the heat')
    assert 'stands still' not in one.statuses[-1].message


def test_board_that_does_not_hear(bridge, graph):
    """Its watchdog bites, and the node says which fault it reports."""
    one = bridge('sim://bicep?speed=20&deaf_after=10', board_watchdog=0.3)
    one.hold(3.0, lambda: one.last() > 0.0, 'the voltage')
    one.hold(3.0, lambda: any('watchdog: no setpoint came' in status.message
                              for status in one.statuses), 'the fault')
    graph.until(lambda: one.last() == 0.0, 'the output to go off')


def test_garbage_on_the_wire_is_counted_and_told(bridge, graph):
    """The frames between it still count."""
    one = bridge('sim://bicep?speed=20&garbage=0.5')
    one.says('bad lines so far, skipped; the latest is', WARN)
    graph.until(lambda: len(one.joints) > 20, 'telemetry')
    assert all('\n' not in status.message for status in one.statuses)


def test_port_that_does_not_exist(bridge, graph):
    """One line, and the node goes on trying."""
    one = bridge('/dev/tty_that_is_not_there')
    one.says('port /dev/tty_that_is_not_there cannot be opened: there is no such device', ERROR)
    one.ask(3.0)
    graph.spin(0.2)
    answer = graph.call(Trigger, '/hardware_bridge/initialise', Trigger.Request())
    assert not answer.success and 'no such device' in answer.message
    answer = graph.call(SetBool, '/hardware_bridge/enable', SetBool.Request(data=False))
    assert answer.success and 'will stay off' in answer.message


def test_supply_that_is_not_what_was_agreed(bridge, graph):
    """No voltage from a supply that is measured wrong or was exchanged."""
    one = bridge('sim://bicep?supply=24&speed=20')
    one.hold(3.0, lambda: any('24 V, 12 V expected' in status.message and status.level == ERROR
                              for status in one.statuses), 'the reason')
    assert {voltage.data for voltage in one.voltages} == {0.0}


def test_mean_law_and_encoder_parameters(bridge, graph):
    """What the board is told depends on them; what is published does not."""
    one = bridge(pwm_law='mean', encoder_direction=-1, encoder_zero=1.0, joint_name='knee')
    one.hold(3.0, lambda: one.last() == pytest.approx(3.0, abs=0.02), 'the voltage')
    assert one.joints[0].name == ['knee']
    assert one.joints[0].position[0] == pytest.approx(1.0 - Plant(0).arm.angle, abs=2e-3)


def test_limits_can_be_changed_while_it_runs(bridge, graph):
    """And only to what makes sense."""
    one = bridge()

    def change(name, value):
        request = SetParameters.Request(parameters=[Parameter(name, value=value)
                                                    .to_parameter_msg()])
        return graph.call(SetParameters, '/hardware_bridge/set_parameters', request).results[0]

    assert change('maximum_voltage', 2.0).successful
    one.ask(3.0)
    one.says('the limits are 0 to 2 V', WARN)
    refused = change('minimum_voltage', 2.5)
    assert not refused.successful and 'below the larger' in refused.reason
    assert not change('port', 'sim://bicep').successful
    assert not change('maximum_duty', 2.0).successful


def test_parameters_that_make_no_sense_are_refused_at_start(graph):
    """In one line that says what is possible."""
    for name, value, words in (
            ('port', 'sim://leg', 'the simulated board is sim://bicep'),
            ('port', 'sim://bicep?gravity=2', "there is no 'gravity'"),
            ('port', 'foo://x', "'foo' not known"), ('pwm_law', 'max', 'rms, mean'),
            ('encoder_direction', 0, '1 or -1'), ('encoder_index', 'x', 'ignore, check, home'),
            ('telemetry_rate', 1000.0, 'from 0.1 to 200 Hz'),
            ('telemetry_rate', 1.0, 'at least two periods'),
            ('supply_voltage', math.nan, 'supply_voltage'), ('setpoint_timeout', 0.0, '0.05'),
            ('minimum_voltage', 6.0, 'below the larger'), ('full_heat_time', 20.0, 'at least the'),
            ('maximum_temperature', 30.0, 'above 40 degC')):
        with pytest.raises(ParameterError) as error:
            BridgeNode(context=graph.context, parameter_overrides=[Parameter(name, value=value)])
        assert words in str(error.value) and '\n' not in str(error.value)


@pytest.mark.parametrize('ends', [(signal.SIGINT, signal.SIGINT), (signal.SIGTERM,)])
def test_process_ends_cleanly(graph, ends):
    """Status 0 and no traceback, however it is ended, with a board at work."""
    joints = graph.collect(JointState, 'joint_states')
    with process('bridge_node', '--ros-args', '-p', 'port:=sim://bicep?speed=20') as child:
        graph.until(lambda: len(joints) > 5, 'telemetry')
        for one in ends:
            child.send_signal(one)
        out, err = child.communicate(timeout=15)
    assert child.returncode == 0
    assert 'Traceback' not in err + out and 'rror' not in err + out


def test_process_with_a_port_that_does_not_exist(graph):
    """It stays until it is told to go."""
    statuses = graph.status()
    with process('bridge_node', '--ros-args', '-p', 'port:=/dev/tty_no') as child:
        graph.until(lambda: any('no such device' in status.message for status in statuses),
                    'the reason')
        child.send_signal(signal.SIGINT)
        _, err = child.communicate(timeout=15)
    assert child.returncode == 0
    assert err.count('/dev/tty_no cannot be opened') == 1 and 'Traceback' not in err


def test_process_with_a_wrong_parameter(domain_id):
    """One line on stderr, status 1."""
    with process('bridge_node', '--ros-args', '-p', 'port:=sim://leg') as child:
        out, err = child.communicate(timeout=30)
    assert child.returncode == 1 and out == ''
    assert err.splitlines() == ['error: port sim://leg: the simulated board is sim://bicep']
