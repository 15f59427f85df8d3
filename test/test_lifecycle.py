# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Bridge and compensator as managed nodes, through the services that `ros2 lifecycle` calls."""

import signal

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from node_support import GEOMETRY_OF_TESTS, Graph, process, small_model
import pytest
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.nodes.bridge_node import BridgeNode
from hysteresis_ros.nodes.compensator_node import CompensatorNode

UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = (
    State.PRIMARY_STATE_UNCONFIGURED, State.PRIMARY_STATE_INACTIVE, State.PRIMARY_STATE_ACTIVE,
    State.PRIMARY_STATE_FINALIZED)


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


class Managed:
    """A managed node and who changes its state."""

    def __init__(self, graph, node, name):
        self._graph, self.node, self._name = graph, graph.add(node), name
        self.statuses = graph.status()

    @property
    def state(self):
        """What get_state says."""
        return self._graph.call(GetState, f'{self._name}/get_state',
                                GetState.Request()).current_state.id

    def change(self, number=0, label=''):
        """Ask for a transition and return whether it was made."""
        return self._graph.call(ChangeState, f'{self._name}/change_state', ChangeState.Request(
            transition=Transition(id=number, label=label))).success

    def says(self, words):
        """Wait until the diagnostics say something."""
        self._graph.until(lambda: any(words in status.message for status in self.statuses),
                          f'{words!r} in diagnostics')


@pytest.fixture
def bridge(graph):
    """Return a function that makes a bridge on the simulated board."""
    def make(**parameters):
        values = {'port': 'sim://bicep?speed=20', 'telemetry_rate': 2.0, **parameters}
        return Managed(graph, BridgeNode(context=graph.context, parameter_overrides=[
            Parameter(name, value=value) for name, value in values.items()]), 'hardware_bridge')
    return make


@pytest.fixture
def compensator(graph):
    """Return a function that makes a compensator of the small muscle."""
    def make(model=None, **parameters):
        return Managed(graph, CompensatorNode(
            model=model, context=graph.context, parameter_overrides=[
                Parameter(name, value=value) for name, value in parameters.items()]),
            'hysteresis_compensator')
    return make


def test_bridge_starts_active_by_itself(bridge):
    """As it did before it had a lifecycle."""
    one = bridge()
    assert one.state == ACTIVE


def test_bridge_waits_where_it_is_not_to_start(bridge, graph):
    """No port is opened, services say why nothing happens, and the state machine answers."""
    one = bridge(autostart=False)
    joints = graph.collect(JointState, 'joint_states')
    assert one.state == UNCONFIGURED
    one.says('the node is unconfigured')
    answer = graph.call(SetBool, 'hardware_bridge/enable', SetBool.Request(data=True))
    assert not answer.success and 'the node is unconfigured; activate it first' in answer.message
    answer = graph.call(Trigger, 'hardware_bridge/initialise', Trigger.Request())
    assert not answer.success and 'the node is unconfigured' in answer.message
    possible = graph.call(GetAvailableTransitions, 'hardware_bridge/get_available_transitions',
                          GetAvailableTransitions.Request()).available_transitions
    assert {one.transition.label for one in possible} == {'configure', 'shutdown'}
    assert one.change(Transition.TRANSITION_CONFIGURE) and one.state == INACTIVE
    graph.until(lambda: one.node._board.status.online, 'the board')
    graph.spin(0.3)
    assert joints == []
    assert one.change(label='activate') and one.state == ACTIVE
    graph.until(lambda: joints, 'telemetry')


def test_deactivated_bridge_is_off_until_it_is_enabled(bridge, graph):
    """Activating alone does not heat again; cleaning up closes the port."""
    one = bridge()
    voltages = graph.collect(Float64, 'applied_voltage')
    setpoints = graph.publisher(Float64, 'voltage_setpoint')

    def heated():
        setpoints.publish(Float64(data=3.0))
        return bool(voltages) and voltages[-1].data > 2.9

    graph.until(heated, 'the voltage')
    board = one.node._board
    assert one.change(Transition.TRANSITION_DEACTIVATE) and one.state == INACTIVE
    assert not board.status.sample.enabled and board.status.sample.voltage == 0.0
    # What was published before may still be on its way.
    graph.spin(0.3)
    del voltages[:]
    setpoints.publish(Float64(data=3.0))
    graph.spin(0.3)
    assert voltages == [] and not board.status.sample.enabled
    assert one.change(Transition.TRANSITION_ACTIVATE)
    setpoints.publish(Float64(data=3.0))
    graph.until(lambda: len(voltages) > 3, 'telemetry')
    assert {voltage.data for voltage in voltages} == {0.0}
    answer = graph.call(SetBool, 'hardware_bridge/enable', SetBool.Request(data=True))
    assert (answer.success, answer.message) == (True, 'enabled')
    graph.until(heated, 'the voltage')
    assert one.change(Transition.TRANSITION_DEACTIVATE) and one.change(
        Transition.TRANSITION_CLEANUP)
    assert one.state == UNCONFIGURED and not board.status.online
    assert not any(thread.is_alive() for thread in board._threads)
    assert one.change(Transition.TRANSITION_CONFIGURE) and one.change(
        Transition.TRANSITION_ACTIVATE)
    graph.until(lambda: one.node._board.status.online, 'the board')
    assert not one.node._board.status.sample.enabled
    assert one.change(Transition.TRANSITION_ACTIVE_SHUTDOWN) and one.state == FINALIZED


def test_deactivation_ends_the_heat_and_cool_cycle(bridge, graph):
    """Whoever asked for it hears so."""
    one = bridge()
    graph.until(lambda: one.node._board.status.sample is not None
                and one.node._board.status.sample.enabled, 'the board')
    client = graph.probe.create_client(Trigger, 'hardware_bridge/initialise')
    graph.until(client.service_is_ready, 'the service')
    answer = client.call_async(Trigger.Request())
    graph.until(lambda: one.node._cycle is not None, 'the cycle')
    assert one.change(Transition.TRANSITION_DEACTIVATE)
    graph.until(answer.done, 'the answer')
    assert not answer.result().success and 'was deactivated' in answer.result().message


def test_transition_that_the_state_does_not_have(bridge, capfd):
    """One line says what is possible, and the node goes on."""
    one = bridge(autostart=False)
    assert not one.change(Transition.TRANSITION_ACTIVATE)
    assert not one.change(label='dance')
    assert not one.change(99)
    assert one.state == UNCONFIGURED
    lines = [line for line in capfd.readouterr().err.splitlines() if 'refused' in line]
    assert len(lines) == 3
    assert all('the node is unconfigured, and can configure, shutdown' in line for line in lines)


def test_error_in_a_transition_is_one_line(graph, bridge, capfd):
    """At start it is an error as ever; later the state stays."""
    with pytest.raises(ParameterError, match='the simulated board is sim://bicep'):
        bridge(port='sim://leg')
    one = bridge(port='sim://bicep?payload_error=99', autostart=False)
    capfd.readouterr()
    assert not one.change(Transition.TRANSITION_CONFIGURE) and one.state == UNCONFIGURED
    error, = [line for line in capfd.readouterr().err.splitlines() if 'ERROR' in line]
    assert 'not configured: ' in error and 'payload_error' in error


def test_mistake_in_a_transition_ends_where_nothing_is_on(bridge, capfd, monkeypatch):
    """rclpy would swallow the exception."""
    one = bridge()

    def stumble():
        raise KeyError('a mistake')

    monkeypatch.setattr(one.node, 'deactivate', stumble)
    assert not one.change(Transition.TRANSITION_DEACTIVATE)
    assert one.state == UNCONFIGURED and one.node._board is None
    assert "not deactivated: unexpected KeyError('a mistake')" in capfd.readouterr().err


def test_compensator_follows_only_while_it_is_active(compensator, graph):
    """Deactivated it lets the muscle go, and forgets."""
    one = compensator(small_model(), republish_period=0.02, autostart=False)
    assert one.state == UNCONFIGURED
    voltages = graph.collect(Float64, 'voltage_setpoint')
    references = graph.publisher(JointState, 'muscle_reference')
    graph.listening(one.node, 'voltage_setpoint')

    def ask(angle):
        length, force = GEOMETRY_OF_TESTS.reference(angle)
        references.publish(JointState(name=['muscle'], position=[length], effort=[force]))

    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        ask(1.7)
        graph.spin(0.2)
        assert voltages == []
        assert one.change(transition)
    ask(1.7)
    graph.until(lambda: len(voltages) > 5, 'repeats')
    first = voltages[0].data
    assert first > 1.0
    assert one.change(Transition.TRANSITION_DEACTIVATE)
    graph.until(lambda: voltages[-1].data == 0.0, 'zero')
    count = len(voltages)
    ask(1.9)
    graph.spin(0.2)
    assert len(voltages) == count
    assert one.change(Transition.TRANSITION_CLEANUP) and one.node._model is None
    assert graph.call(Trigger, 'hysteresis_compensator/reset', Trigger.Request()).success
    assert one.change(Transition.TRANSITION_CONFIGURE) and one.change(
        Transition.TRANSITION_ACTIVATE)
    ask(1.7)
    graph.until(lambda: len(voltages) > count, 'the setpoint')
    assert voltages[count].data == pytest.approx(first, abs=1e-12)


def test_model_that_cannot_be_read_is_told_when_configuring(compensator, capfd):
    """The node stays, so that it can be tried again."""
    one = compensator(model_file='none.yaml', autostart=False)
    capfd.readouterr()
    assert not one.change(Transition.TRANSITION_CONFIGURE) and one.state == UNCONFIGURED
    error, = [line for line in capfd.readouterr().err.splitlines() if 'ERROR' in line]
    assert 'not configured: ' in error and 'none.yaml' in error


def test_processes_end_cleanly_in_every_state(graph):
    """Ctrl-C finds nothing to do in a node that was never configured."""
    with process('bridge_node', '--ros-args', '-p', 'autostart:=false') as child:
        client, labels = graph.probe.create_client(GetState, 'hardware_bridge/get_state'), []

        def answered():
            # The first answers may be gone before a service of another process knows who asked.
            client.call_async(GetState.Request()).add_done_callback(
                lambda future: labels.append(future.result().current_state.label))
            graph.spin(0.5)
            return bool(labels)

        graph.until(answered, 'its state')
        assert labels[0] == 'unconfigured'
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=15)
    assert (child.returncode, out) == (0, '') and 'rror' not in err
