# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node hysteresis_compensator: muscle reference to voltage, with memory and feedback."""

import dataclasses
import math
import time

from node_support import GEOMETRY_OF_TESTS, Graph, small_model
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import numpy as np
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import ModelFileError, ParameterError
from hysteresis_ros.nodes import compensator_node
from hysteresis_ros.nodes.compensator_node import CompensatorNode
from hysteresis_ros.nodes.feedback import AngleFeedback
from hysteresis_ros.nodes.reference import ArmReference

# Angles that the small muscle of the tests reaches.
LOW, HIGH = 1.5, 1.95


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


def message(length, force, name='muscle'):
    """Return a muscle reference."""
    return JointState(name=[name], position=[length], effort=[force])


class Muscle:
    """The node between a publisher of references and a list of voltages."""

    def __init__(self, graph, model=None, **parameters):
        self._graph = graph
        self.node = graph.make(CompensatorNode, model or small_model(), **parameters)
        self._setpoints = graph.collect(Float64, 'voltage_setpoint')
        self.statuses = graph.status()
        self._references = graph.publisher(JointState, 'muscle_reference')
        graph.listening(self.node, 'voltage_setpoint', '/diagnostics')

    @property
    def voltages(self):
        """All voltages so far."""
        return [setpoint.data for setpoint in self._setpoints]

    def ask(self, *angles):
        """Publish the references of these angles."""
        for angle in angles:
            self._references.publish(message(*GEOMETRY_OF_TESTS.reference(angle)))

    def send(self, reference):
        """Publish a message as it is."""
        self._references.publish(reference)

    def wait(self, count):
        """Wait for so many voltages and return them."""
        self._graph.until(lambda: len(self._setpoints) >= count, f'{count} setpoints')
        return self.voltages[:count]

    def status(self, level):
        """Wait for a status of this level and return it."""
        self._graph.until(lambda: self.statuses and self.statuses[-1].level == level,
                          f'a status of level {level}')
        return self.statuses[-1]

    def reset(self):
        """Call the service."""
        assert self._graph.call(Trigger, 'hysteresis_compensator/reset', Trigger.Request()).success


def offline(angles, limits=(0.0, 6.0), model=None):
    """Return the voltages of the inverse model without ROS."""
    controller = (model or small_model()).controller(voltage_limits=limits, arm=True)
    return [controller.setpoint(*GEOMETRY_OF_TESTS.reference(angle)).voltage for angle in angles]


def wave(count, seed=1):
    """Return random angles within reach."""
    return np.random.default_rng(seed).uniform(LOW, HIGH, count).tolist()


def test_references_in_order_move_the_memory_once_each(graph):
    """A burst comes out complete, in order, and as the inverse model without ROS has it."""
    muscle = Muscle(graph)
    angles = wave(300)
    muscle.ask(*angles)
    assert muscle.wait(300) == pytest.approx(offline(angles), abs=1e-12)
    assert min(np.ptp(muscle.voltages), 1.0) == 1.0


def test_repeating_does_not_move_the_memory(graph):
    """The last voltage comes again and again; the next reference finds the memory as it was."""
    muscle = Muscle(graph, republish_period=0.02)
    angles = wave(4)
    expected = offline(angles)
    for angle, voltage in zip(angles, expected):
        before = len(muscle.voltages)
        muscle.ask(angle)
        graph.until(lambda: len(muscle.voltages) >= before + 5, 'repeated setpoints')
        # A repeat of the old voltage may still have been on its way.
        assert muscle.voltages[-1] == pytest.approx(voltage, abs=1e-12)
    assert len(set(muscle.voltages)) == 4


def test_no_setpoint_before_the_first_reference_and_no_repeats_with_zero(graph):
    """Nothing is invented."""
    muscle = Muscle(graph, republish_period=0.0)
    graph.spin(0.2)
    assert muscle.voltages == []
    muscle.ask(1.7)
    muscle.wait(1)
    graph.spin(0.3)
    assert len(muscle.voltages) == 1


def test_repeat_period_changes_at_run_time(graph):
    """Off and on again, without a restart that would forget the muscle's history."""
    muscle = Muscle(graph, republish_period=0.0)
    muscle.ask(1.7)
    muscle.wait(1)
    parameter = Parameter('republish_period', value=0.02).to_parameter_msg()
    assert graph.call(SetParameters, 'hysteresis_compensator/set_parameters',
                      SetParameters.Request(parameters=[parameter])).results[0].successful
    muscle.wait(5)
    assert len(set(muscle.voltages)) == 1


def test_reset_forgets_the_history_and_the_setpoint(graph):
    """After heating and cooling the same reference gets the voltage of a cold muscle."""
    muscle = Muscle(graph, republish_period=0.02)
    angles = [1.9, 1.5, 1.7]
    muscle.ask(*angles)
    graph.until(lambda: len(muscle.voltages) > 5, 'repeats')
    muscle.reset()
    graph.spin(0.1)
    count = len(muscle.voltages)
    graph.spin(0.2)
    assert len(muscle.voltages) == count
    muscle.ask(1.7)
    muscle.wait(count + 1)
    fresh = offline([1.7])[0]
    assert muscle.voltages[-1] == pytest.approx(fresh, abs=1e-12)
    assert abs(fresh - offline(angles)[-1]) > 1e-3


def test_the_heat_and_cool_cycle_of_the_bridge_wipes_the_memory(graph):
    """Not that of another arm's bridge; and the last setpoint is not repeated any more."""
    muscle = Muscle(graph, republish_period=0.02)
    muscle.ask(1.9, 1.5, 1.7)
    graph.until(lambda: len(muscle.voltages) > 5, 'repeats')
    publisher = graph.probe.create_publisher(DiagnosticArray, '/diagnostics', 10)
    graph.until(lambda: publisher.get_subscription_count() > 1, 'discovery')

    def say(name):
        publisher.publish(DiagnosticArray(status=[DiagnosticStatus(
            name=name, values=[KeyValue(key='state', value='initialising')])]))
        graph.spin(0.3)
        before = len(muscle.voltages)
        graph.spin(0.3)
        return len(muscle.voltages) - before

    assert say('other/hardware_bridge') > 0
    assert say('hardware_bridge') == 0
    count = len(muscle.voltages)
    muscle.ask(1.7)
    muscle.wait(count + 1)
    assert muscle.voltages[-1] == pytest.approx(offline([1.7])[0], abs=1e-12)


def test_reference_out_of_reach_is_saturated_with_the_expected_error(graph):
    """Nearest voltage within the limits, said in the diagnostics, gone with the next good one."""
    muscle = Muscle(graph, maximum_voltage=5.0)
    muscle.ask(1.2)
    assert muscle.wait(1) == [5.0]
    status = muscle.status(b'\1')
    expected = small_model().controller(voltage_limits=(0.0, 5.0), arm=True).setpoint(
        *GEOMETRY_OF_TESTS.reference(1.2))
    assert 'out of reach within 0 to 5' in status.message
    assert f'error {1e3 * expected.error:+.3f} mm' in status.message
    assert expected.error > 1e-3
    muscle.ask(1.9)
    muscle.status(b'\0')
    # The memory has to hold what was applied, not what was asked for.
    assert muscle.wait(2)[1] == pytest.approx(offline([1.2, 1.9], (0.0, 5.0))[1], abs=1e-12)


@pytest.mark.parametrize('wrong, words', [
    (message(math.nan, 6.0), 'finite'), (message(0.0, math.inf), 'finite'),
    (message(-0.01, 6.0, 'other'), "names ['other'], not 'muscle'"),
    (JointState(name=['muscle'], position=[-0.01]), 'lacks position (length) or effort'),
    (JointState(), 'names []')])
def test_wrong_reference_is_not_followed(graph, wrong, words):
    """No voltage comes of it, the reason is in the diagnostics, the counts agree."""
    muscle = Muscle(graph, republish_period=0.0)
    muscle.ask(1.6)
    muscle.send(wrong)
    assert words in muscle.status(b'\1').message
    muscle.ask(1.8)
    assert muscle.wait(2) == pytest.approx(offline([1.6, 1.8]), abs=1e-12)
    values = {pair.key: pair.value for pair in muscle.status(b'\0').values}
    graph.until(lambda: len(muscle.voltages) == 2, 'two setpoints')
    assert values['references refused'] == '1'
    assert int(values['references received']) == 1 + int(values['setpoints published']) + 1


def test_model_file_is_loaded_and_the_arm_of_the_parameters_counts(graph, tmp_path, capfd):
    """The file's own arm is another one: that is worth a warning, not an error."""
    other = dataclasses.replace(GEOMETRY_OF_TESTS, payload_mass=0.5)
    dataclasses.replace(small_model(), geometry=other).save(tmp_path / 'model.yaml')
    node = graph.make(CompensatorNode, model_file=str(tmp_path / 'model.yaml'))
    assert node._model.geometry == GEOMETRY_OF_TESTS
    assert 'payload_mass 0.5 instead of 0.1' in capfd.readouterr().err


@pytest.mark.parametrize('change, words', [
    ({'drive': 'pressure'}, 'from voltage to length'),
    ({'length_stage': None}, 'from voltage to length'),
    ({'sign': 1}, 'extends when driven'),
    ({'ranges': {'length': (0.26, 0.275)}}, 'no elongation of a muscle of 0.27 m')])
def test_model_of_another_muscle_is_refused_at_start(graph, tmp_path, change, words):
    """Not only when the first reference comes."""
    path = tmp_path / 'model.yaml'
    dataclasses.replace(small_model(), **change).save(path)
    with pytest.raises(ModelFileError, match=f'model.yaml: .*{words}'):
        graph.make(CompensatorNode, model_file=str(path))


def test_small_reversals_are_not_followed(graph):
    """The dead band reaches the inverse, which amplifies noise right after a reversal."""
    muscle = Muscle(graph, dead_band=1e-3)
    angles = [1.6, 1.9, 1.899, 1.9, 1.898]
    muscle.ask(*angles)
    controller = small_model().controller(
        voltage_limits=(0.0, 6.0), dead_band=1e-3, arm=True)
    expected = [controller.setpoint(*GEOMETRY_OF_TESTS.reference(angle)).voltage
                for angle in angles]
    assert muscle.wait(5) == pytest.approx(expected, abs=1e-12)
    assert expected != pytest.approx(offline(angles), abs=1e-6)


def test_lagging_muscle_is_overdriven_until_it_is_warm(graph):
    """The first voltage is too high, and the repeats come down to the one that holds."""
    lag = catalogue()['thermal_lag'](small_model().surroundings, time_constant=0.5)
    model = small_model([lag])
    muscle = Muscle(graph, model, horizon=0.25, republish_period=0.05)
    muscle.ask(1.75)
    steady = offline([1.75], model=model)[0]
    assert muscle.wait(1)[0] > steady + 0.1
    graph.until(lambda: abs(muscle.voltages[-1] - steady) < 0.02, 'the steady voltage')


def test_without_repeats_nothing_is_overdriven(graph):
    """Nobody would bring the voltage down again."""
    lag = catalogue()['thermal_lag'](small_model().surroundings, time_constant=0.5)
    model = small_model([lag])
    muscle = Muscle(graph, model, horizon=0.25, republish_period=0.0)
    muscle.ask(1.75)
    assert muscle.wait(1) == pytest.approx(offline([1.75], model=model), abs=1e-12)


def test_repeats_come_within_the_horizon():
    """A cross check of two parameters."""
    values = {spec.name: spec.default for spec in CompensatorNode.PARAMETERS}
    for horizon in (0.0, 0.5, 5.0):
        compensator_node._check({**values, 'horizon': horizon, 'republish_period': 0.5})
    with pytest.raises(ParameterError, match='republish_period 0.5 s is longer than the horizon'):
        compensator_node._check({**values, 'horizon': 0.4, 'republish_period': 0.5})


def test_a_rate_limit_is_kept_and_the_repeats_do_the_rest_of_the_way(graph):
    muscle = Muscle(graph, rate_limit=20.0, republish_period=0.02)
    muscle.ask(1.75)
    steady = offline([1.75])[0]
    graph.until(lambda: muscle.voltages and muscle.voltages[-1] == pytest.approx(steady),
                'the whole voltage')
    assert muscle.voltages[0] == 0.0 < muscle.voltages[1] < 0.5 * steady
    values = {spec.name: spec.default for spec in CompensatorNode.PARAMETERS}
    with pytest.raises(ParameterError, match='rate_limit needs the repeats'):
        compensator_node._check({**values, 'rate_limit': 1.0, 'republish_period': 0.0})


class Arm:
    """A virtual arm in joint_states: the model's own prediction, with another payload."""

    def __init__(self, graph, muscle, grams):
        other = dataclasses.replace(GEOMETRY_OF_TESTS, payload_mass=0.1 + 1e-3 * grams)
        self._observer = dataclasses.replace(small_model(), geometry=other).observer()
        self._publisher = graph.publisher(JointState, 'joint_states')
        self._graph, self._muscle = graph, muscle
        self._time = math.ceil(time.time())
        self.angle = math.nan

    def advance(self, seconds):
        """Let the arm come to rest and publish its angle, once a second."""
        for _ in range(seconds):
            self._time += 1
            self.angle = self._observer.step(float(self._time), self._muscle.voltages[-1])
            state = JointState(name=['elbow'], position=[self.angle], velocity=[0.0])
            state.header.stamp.sec = self._time
            self._publisher.publish(state)
            self._graph.spin(0.01)


def test_feedback_takes_out_what_the_model_does_not_know(graph):
    """20 g more than the model's: without feedback the arm hangs too low, with it it does not."""
    muscle = Muscle(graph, feedback=True, feedback_delay=0.0, republish_period=0.0)
    muscle.ask(1.7)
    first, = muscle.wait(1)
    arm = Arm(graph, muscle, 20.0)
    arm.advance(1)
    assert arm.angle - 1.7 > 0.02
    arm.advance(60)
    assert abs(arm.angle - 1.7) < 0.006
    assert 1 < len(muscle.voltages) <= 61
    assert muscle.voltages[-1] > first
    values = {pair.key: pair.value for pair in muscle.status(b'\0').values}
    assert values['references received'] == values['setpoints published'] == '1'


def test_feedback_waits_while_the_muscle_is_saturated(graph):
    """Already at the largest voltage, so asking for more would only wind the integral up."""
    muscle = Muscle(graph, feedback=True, feedback_delay=0.0, republish_period=0.0,
                    maximum_voltage=5.0)
    muscle.ask(1.3)
    assert muscle.wait(1) == [5.0]
    arm = Arm(graph, muscle, 0.0)
    arm.advance(10)
    assert arm.angle - 1.3 > 0.05
    assert muscle.voltages == [5.0]


def test_target_angle_is_recovered_from_the_reference():
    """Also where the encoder shows something else, and without a trace in the friction's state."""
    surroundings = small_model().surroundings
    model = small_model([catalogue()['encoder_offset'](surroundings, offset=3.0),
                         catalogue()['geometry_error'](surroundings, dx=2.0),
                         catalogue()['coulomb_friction'](surroundings, tau_c=0.02)])
    arm, alone = (ArmReference(GEOMETRY_OF_TESTS, model) for _ in range(2))
    for angle in (1.7, 1.9, 1.6, 1.6, 1.8):
        reference = arm.reference(angle)
        assert reference == alone.reference(angle)
        assert arm.angle(reference.length) == pytest.approx(angle, abs=1e-6)
    plain = ArmReference(GEOMETRY_OF_TESTS)
    assert plain.angle(GEOMETRY_OF_TESTS.reference(1.7).length) == pytest.approx(1.7, abs=1e-12)


def test_feedback_integral():
    """Rate, dead band, limit, the moving arm, and time that stands still or jumps."""
    feedback = AngleFeedback(gain=0.1, limit=0.05, rest_speed=0.01, dead_band=0.002, period=1.0)
    assert feedback.update(10.0, 1.0, 1.1) == 0.0
    assert feedback.update(11.0, 1.0, 1.1) == pytest.approx(0.01)
    assert feedback.update(11.5, 1.0, 1.1) == pytest.approx(0.01)
    assert feedback.update(13.0, 1.0, 1.1) == pytest.approx(0.03)
    assert feedback.update(14.0, 1.02, 1.1) == pytest.approx(0.03)     # on its way
    assert feedback.update(15.0, 1.025, 1.1) == pytest.approx(0.0375)
    assert feedback.update(16.0, math.nan, 1.1) == pytest.approx(0.0375)
    assert feedback.update(17.0, 1.025, 1.026) == pytest.approx(0.0375)   # dead band
    assert feedback.update(900.0, 1.025, 1.1) == 0.05
    assert feedback.update(2.0, 1.025, 1.1) == 0.05      # clock set back
    assert feedback.update(3.0, 1.025, 0.925) == pytest.approx(0.04)
    feedback.reset()
    assert feedback.correction == 0.0


def test_feedback_waits_after_a_new_target():
    """Samples from before the arm has set out say nothing; what was corrected stays."""
    feedback = AngleFeedback(gain=0.1, limit=1.0, rest_speed=0.01, period=1.0, delay=5.0)
    feedback.update(0.0, 1.0, 1.1)
    assert feedback.update(1.0, 1.0, 1.1) == pytest.approx(0.01)
    feedback.begin(1.0)
    for second in (2.0, 4.0, 5.9, 6.0):
        assert feedback.update(second, 1.0, 1.5) == pytest.approx(0.01)
    assert feedback.update(7.0, 1.0, 1.5) == pytest.approx(0.06)


@pytest.mark.parametrize('saturated, error, change', [
    (0, 0.1, 0.01), (0, -0.1, -0.01), (1, 0.1, 0.0), (1, -0.1, -0.01), (-1, 0.1, 0.01),
    (-1, -0.1, 0.0)])
def test_feedback_does_not_wind_up(saturated, error, change):
    """At a limit the integral moves only away from it."""
    feedback = AngleFeedback(gain=0.1, limit=1.0, rest_speed=0.01, dead_band=0.002, period=1.0)
    feedback.update(0.0, 1.0, 1.0 + error)
    assert feedback.update(1.0, 1.0, 1.0 + error, saturated) == pytest.approx(change)
