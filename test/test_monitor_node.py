# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node model_monitor: the model beside the arm."""

import functools
import math
import re

from node_support import Graph, small_model
import numpy as np
import pytest
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from hysteresis_ros.background import Background
from hysteresis_ros.diagnosis import monitor
from hysteresis_ros.diagnosis.watch import Watch
from hysteresis_ros.effects import catalogue
from hysteresis_ros.measurements import read_measurement
from hysteresis_ros.nodes.bridge_node import BridgeNode
from hysteresis_ros.nodes.monitor_node import MonitorNode


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


class Monitor:
    """The node between publishers of measurements and lists of what it says of them."""

    def __init__(self, graph, model=None, **parameters):
        self._graph = graph
        self.node = graph.make(MonitorNode, model or small_model(), **parameters)
        self.predictions = graph.collect(JointState, 'predicted_joint_states')
        self.residuals = graph.collect(Float64, 'model_residual')
        self.statuses = graph.status()
        self._voltage = graph.publisher(Float64, 'applied_voltage')
        self._state = graph.publisher(JointState, 'joint_states')
        graph.listening(self.node, 'predicted_joint_states', 'model_residual', '/diagnostics')

    def measure(self, second, voltage, angle, name='elbow'):
        """Publish one sample of the voltage, then of the angle."""
        received = self.node._measured
        self._voltage.publish(Float64(data=voltage))
        self._graph.until(lambda: self.node._voltage == voltage or math.isnan(voltage),
                          'the voltage')
        state = JointState(name=[name], position=[angle])
        state.header.stamp.sec = second
        self._state.publish(state)
        self._graph.until(lambda: self.node._measured > received, 'the angle')

    def wait(self, count):
        """Wait for so many predictions and return the predicted angles."""
        self._graph.until(
            lambda: min(len(self.predictions), len(self.residuals)) >= count,
            f'{count} predictions')
        return [prediction.position[0] for prediction in self.predictions]


def test_prediction_and_residual(graph):
    """The observer's angle with the measurement's stamp; the residual is measured less that."""
    monitor = Monitor(graph)
    observer = small_model().observer()
    run = [(1, 0.0, 2.0), (2, 3.0, 1.9), (3, 6.0, 1.4), (4, 4.0, 1.5), (5, 4.0, 1.5)]
    expected = []
    for second, voltage, angle in run:
        monitor.measure(second, voltage, angle)
        expected.append(observer.step(float(second), voltage))
    assert monitor.wait(5) == pytest.approx(expected, abs=1e-12)
    assert [residual.data for residual in monitor.residuals] == pytest.approx(
        [angle - prediction for (_, _, angle), prediction in zip(run, expected)], abs=1e-12)
    assert [prediction.header.stamp.sec for prediction in monitor.predictions] == [1, 2, 3, 4, 5]
    assert monitor.predictions[0].name == ['elbow']


def test_time_runs_from_the_first_sample(graph):
    """An effect of the time since the start does not see the seconds since 1970."""
    drift = catalogue()['ambient_drift'](small_model().surroundings, rate=10.0)
    model = small_model([drift])
    monitor, observer = Monitor(graph, model), model.observer()
    expected = [observer.step(time, 3.0) for time in (0.0, 60.0)]
    for second in (1_700_000_000, 1_700_000_060):
        monitor.measure(second, 3.0, 1.7)
    assert monitor.wait(2) == pytest.approx(expected, abs=1e-12)
    assert expected[1] < expected[0]


def test_nothing_is_predicted_without_voltage_or_angle(graph):
    """Neither NaN nor another joint nor a missing voltage makes a prediction."""
    monitor = Monitor(graph)
    monitor.measure(1, math.nan, 2.0)
    monitor.measure(2, 3.0, math.nan)
    monitor.measure(3, 3.0, 2.0, name='shoulder')
    monitor.measure(4, 3.0, 2.0)
    monitor.wait(1)
    assert [prediction.header.stamp.sec for prediction in monitor.predictions] == [4]
    assert math.isfinite(monitor.residuals[0].data)


def test_reset_and_a_clock_that_goes_back_start_from_the_cold_arm(graph):
    """The memory of the prediction is wiped with the muscle's."""
    monitor = Monitor(graph)
    cold = small_model().observer().step(1.0, 3.0)
    for second, voltage in ((1, 3.0), (2, 6.0), (3, 3.0)):
        monitor.measure(second, voltage, 1.7)
    assert monitor.wait(3)[0] == pytest.approx(cold, abs=1e-12)
    assert abs(monitor.wait(3)[2] - cold) > 1e-3
    assert graph.call(Trigger, 'model_monitor/reset', Trigger.Request()).success
    monitor.measure(4, 3.0, 1.7)
    assert monitor.wait(4)[3] == pytest.approx(cold, abs=1e-12)
    monitor.measure(5, 6.0, 1.7)
    monitor.measure(1, 3.0, 1.7)
    assert monitor.wait(6)[5] == pytest.approx(cold, abs=1e-12)
    graph.until(lambda: any('time went back' in status.message for status in monitor.statuses),
                'the warning')


def test_residual_that_lasts_is_a_warning(graph):
    """It comes when the limit is exceeded for long enough and goes below half of it."""
    monitor = Monitor(graph, residual_limit=0.2, residual_time=4.0)
    predicted = small_model().observer().step(1.0, 3.0)
    run = [(1, 0.19, b'\0'), (4, -0.21, b'\0'), (5, -0.21, b'\1'), (6, 0.15, b'\1'),
           (7, 0.09, b'\0'), (9, 0.3, b'\0'), (10, 0.19, b'\0'), (12, 0.3, b'\0')]
    for number, (second, off, level) in enumerate(run, 1):
        monitor.measure(second, 3.0, predicted + off)
        monitor.wait(number)
        graph.spin(0.02)    # for a status that is on its way
        count = len(monitor.statuses)
        monitor.node._diagnostics.publish()
        graph.until(lambda: len(monitor.statuses) > count, 'a status')
        assert monitor.statuses[-1].level == level, second


def test_ambient_temperature_counts_where_the_model_knows_it(graph):
    """A warmer room is a shorter muscle, if the model has the effect."""
    effect = catalogue()['ambient_temperature']
    monitor = Monitor(graph, small_model([effect(small_model().surroundings, gain=0.4)]))
    ambient = graph.publisher(Temperature, 'ambient_temperature')
    monitor.measure(1, 3.0, 1.7)
    ambient.publish(Temperature(temperature=35.0))
    graph.until(lambda: monitor.node._ambient == 35.0, 'the temperature')
    monitor.measure(2, 3.0, 1.7)
    cool, warm = monitor.wait(2)
    assert warm < cool


def test_services_say_what_cannot_be_done(graph, tmp_path):
    """In one line, where the arm has not been seen to hold still, or nothing can be written."""
    (tmp_path / 'file').write_text('', encoding='utf-8')
    monitor = Monitor(graph, recording_folder=str(tmp_path / 'file'))
    for service, start in (('diagnose', 'no hold of the arm has ended yet'),
                           ('save_recording', 'not saved: no hold of the arm has ended yet')):
        answer = graph.call(Trigger, f'model_monitor/{service}', Trigger.Request())
        assert not answer.success and answer.message.startswith(start)
    for number, voltage in enumerate((0.0, 2.0, 3.0)):
        for second in (1, 11, 21):
            monitor.measure(30 * number + second, voltage, 2.0)
    monitor.node._monitor._watch = Watch(0.01)
    for hold in monitor.node._monitor._pending:
        monitor.node._monitor._watch.add(hold)
    answer = graph.call(Trigger, 'model_monitor/save_recording', Trigger.Request())
    assert not answer.success and answer.message.startswith('not saved: [Errno')
    assert '\n' not in answer.message
    answer = graph.call(Trigger, 'model_monitor/diagnose', Trigger.Request())
    assert not answer.success
    assert re.fullmatch('[23] holds of the arm have ended so far; a diagnosis needs 8',
                        answer.message)


def test_no_diagnosis_where_none_is_wanted(graph):
    """The service says which parameter it is."""
    monitor = Monitor(graph, diagnosis=False)
    answer = graph.call(Trigger, 'model_monitor/diagnose', Trigger.Request())
    assert not answer.success and 'the parameter diagnosis is false' in answer.message
    assert not monitor.node._monitor._background.busy


@pytest.mark.slow
def test_effect_that_begins_in_mid_run_is_named(graph, tmp_path, monkeypatch):
    """On the simulated board at sixty times real time, by another process."""
    # At low priority, a machine that is busy with other tests would take very long.
    monkeypatch.setattr(monitor, 'Background', functools.partial(Background, niceness=0))
    bridge = graph.add(BridgeNode(context=graph.context, parameter_overrides=[
        Parameter(name, value=value) for name, value in {
            'port': 'sim://bicep?speed=60&seed=1&encoder_offset=1&effects_after=600',
            'telemetry_rate': 1.0, 'telemetry_timeout': 5.0, 'setpoint_timeout': 60.0}.items()]))
    node = graph.make(MonitorNode, recording_folder=str(tmp_path))
    statuses, joints = graph.status(), graph.collect(JointState, 'joint_states')
    setpoints = graph.publisher(Float64, 'voltage_setpoint')
    graph.until(lambda: joints and node._predicted > 2, 'telemetry')

    def passed():
        return joints[-1].header.stamp.sec - joints[0].header.stamp.sec

    def said(words):
        return [status for status in statuses
                if status.name == 'model_monitor' and words in status.message]

    rng = np.random.default_rng(1)
    while not said('the model lacks') and passed() < 20000.0:
        setpoints.publish(Float64(data=float(rng.uniform(2.4, 5.6))))
        end = passed() + 30.0
        graph.until(lambda end=end: passed() >= end, 'the end of a hold')
        # What came before the first message is not counted here.
        assert node._monitor.diagnoses == 0 or passed() > 300.0
    status = said('the model lacks')[-1]
    assert 'the model lacks encoder_offset (offset ' in status.message and status.level == b'\1'
    values = {pair.key: pair.value for pair in status.values}
    assert values['missing effect'] == 'encoder_offset' and float(values['probability']) > 0.5
    assert 5.0 < float(values['encoder_offset offset [deg]']) < 13.0
    answer = graph.call(Trigger, 'model_monitor/save_recording', Trigger.Request())
    assert answer.success and read_measurement(answer.message).settled
    future = graph.probe.create_client(Trigger, 'model_monitor/diagnose').call_async(
        Trigger.Request())
    graph.until(future.done, 'the diagnosis', 60.0)
    assert future.result().success
    assert future.result().message.startswith('missing: encoder_offset (offset ')
    assert bridge.active
