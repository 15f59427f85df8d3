# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The board as a node: volts in, joint states out, the muscle off whenever anything is amiss.

Subscribes `voltage_setpoint`; publishes `joint_states`, `applied_voltage`, `ambient_temperature`
and, on a simulated board that does not live at real time, ``/clock``. The port is read and written
by threads of `Board`, so no callback ever waits for it; what the board measures is published from
the reading thread at once.

The output goes to zero when no setpoint came for ``setpoint_timeout``, when the compensator dies,
when the board is silent for 0.4 s, and first of all when the node ends. A setpoint that is no
number or out of the limits never reaches the board and does not renew the one before, which ends
0.3 s later. After a board was lost or started anew, an angle in doubt, or whatever `Protection`
forbids, ``~/enable`` has to be called before anything is heated again.

It is a managed node. Inactive, it keeps the port open and the clock going, with the output off, and
publishes and follows nothing; unconfigured, it has no port. After it was deactivated the output
stays off until ``~/enable``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import threading
import time
from typing import Any, TYPE_CHECKING

from builtin_interfaces.msg import Time
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.task import Future
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger

from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.board_link import Timeouts
from hysteresis_ros.bridge.protection import Protection
from hysteresis_ros.bridge.stamps import RealStamps, SimulatedStamps
from hysteresis_ros.errors import BoardError, RangeError
from hysteresis_ros.nodes.alive import ALIVE, listen_for_death
from hysteresis_ros.nodes.bridge_parameters import (
    check, make_cycle, make_encoder, make_limits, make_pwm, PARAMETERS)
from hysteresis_ros.nodes.diagnostics import Diagnostics, ERROR, OK, WARN
from hysteresis_ros.nodes.lifecycle import ManagedNode
from hysteresis_ros.nodes.parameters import Parameters
from hysteresis_ros.nodes.qos import COMMANDS, MEASUREMENTS
from hysteresis_ros.nodes.running import run

if TYPE_CHECKING:
    from hysteresis_ros.bridge.board_state import Sample, Status
    from hysteresis_ros.bridge.heat_and_cool import HeatAndCool

LOOK_PERIOD = 0.05          # s of the wall between two looks at the board's status
ENABLE_PATIENCE = 3.0       # s of the wall that ~/enable waits for the board to follow
BAD_LINES_SHOWN_FOR = 5.0   # s of the wall after the latest bad line


class BridgeNode(ManagedNode):
    """
    The node `hardware_bridge`.

    Parameters
    ----------
    **options
        For `rclpy.node.Node`, such as ``namespace`` or ``parameter_overrides``.
    """

    PARAMETERS = PARAMETERS

    def __init__(self, **options: Any) -> None:
        super().__init__('hardware_bridge', **options)
        self._settings = parameters = Parameters(
            self, self.PARAMETERS, check=check, changed=self._configure)
        self._board: Board | None = None     # only where it is configured
        self._works = False                 # for the reading thread: whether the node is active
        self._wanted = parameters['start_enabled']
        self._lock = threading.Lock()   # of what callbacks and the reading thread share:
        # The heat and cool cycle that is running, and its end: (success, message).
        self._cycle: HeatAndCool | None = None
        self._outcome: tuple[bool, str] | None = None
        self._progress = ''
        self._stamps: RealStamps | SimulatedStamps | None = None
        self._wall = Clock(clock_type=ClockType.STEADY_TIME)
        # (is it so?, future, wall time until which to wait)
        self._waiting: list[tuple[Callable[[Status], bool], Any, float]] = []
        self._taken = self._refused = self._published = 0
        self._bad_lines = (0, -BAD_LINES_SHOWN_FOR)
        self._joints = self.create_publisher(JointState, 'joint_states', MEASUREMENTS)
        self._voltages = self.create_publisher(Float64, 'applied_voltage', MEASUREMENTS)
        self._ambients = self.create_publisher(Temperature, 'ambient_temperature', MEASUREMENTS)
        self._clocks: Any = None
        self._diagnostics = Diagnostics(
            self, parameters['hardware_id'], self._values, 'board and arm are fine')
        self.create_subscription(Float64, 'voltage_setpoint', self._on_setpoint, COMMANDS)
        # They wait for the board while all other callbacks go on.
        waiting = ReentrantCallbackGroup()
        self.create_service(SetBool, '~/enable', self._on_enable, callback_group=waiting)
        self.create_service(Trigger, '~/initialise', self._on_initialise, callback_group=waiting)
        self.create_timer(LOOK_PERIOD, self._look, clock=self._wall)
        # No timeout of setpoints is as short as that of the node which gives them.
        listen_for_death(self, f'hysteresis_compensator/{ALIVE}', self._on_death)
        if parameters['autostart']:
            self.start()

    def set_up(self) -> None:
        """Open the port, and go on trying to; the output is off."""
        parameters = self._settings
        self._board = Board(
            parameters['port'], parameters['baud'], make_pwm(parameters), make_encoder(parameters),
            Timeouts(setpoint=parameters['setpoint_timeout'],
                     telemetry=parameters['telemetry_timeout'],
                     watchdog=parameters['board_watchdog']),
            1.0 / parameters['telemetry_rate'], parameters['supply_voltage'],
            parameters['supply_tolerance'], self._on_sample,
            Protection(make_limits(parameters)))
        self._board.start()

    def activate(self) -> None:
        """Publish, and follow setpoints where the output is enabled."""
        self._the_board().enable(self._wanted)
        self._works = True

    def deactivate(self) -> None:
        """Switch the muscle off; only ``~/enable`` switches it on again."""
        self._stand_still('the node was deactivated')
        if not self._the_board().switch_off():
            self.get_logger().warning('the board has not said that its output is off; its '
                                      'watchdog switches off now that no setpoint comes')

    def clean_up(self) -> None:
        """Write zero to the board and close the port."""
        self._stand_still('the node was shut down')
        if self._board is not None:
            self._board.stop()
        waiting, self._waiting = self._waiting, []
        for _, future, _ in waiting:
            future.set_result(False)
        self._board = self._stamps = None

    def destroy_node(self) -> None:
        """Stop the board, whose thread publishes, before the publishers go."""
        self.clean_up()
        super().destroy_node()

    def _stand_still(self, reason: str) -> None:
        """Publish and follow nothing any more, and give up a heat and cool cycle."""
        if self._works:
            self._wanted = False
        self._works = False
        with self._lock:
            if self._cycle is not None:
                self._end_cycle(False, f'heat and cool cycle: {reason}')

    def _the_board(self) -> Board:
        """Return the board; BoardError where the node is not configured."""
        if self._board is None:
            raise BoardError(f'the node is {self.state}: it has no board')
        return self._board

    def _configure(self, parameters: Parameters) -> None:
        if self._board is not None:
            self._board.pwm = make_pwm(parameters)
            self._board.protection.limits = make_limits(parameters)

    # Setpoints and services

    def _on_setpoint(self, message: Float64) -> None:
        board = self._board
        if board is None or not self._works:
            return
        try:
            with self._lock:
                if self._cycle is not None:
                    raise RangeError(f'voltage setpoint {message.data:g} V refused: the heat and '
                                     'cool cycle is running')
                board.set_voltage(message.data)
        except RangeError as error:
            self._refused += 1
            self._diagnostics.set('setpoint', WARN, str(error))
            return
        self._taken += 1
        self._diagnostics.clear('setpoint')
        self._diagnostics.clear('compensator')

    def _on_death(self) -> None:
        board = self._board
        if board is None or not self._works or board.speed > 1.0:
            return      # nothing can burn there, and a busy machine must not spoil the run
        with self._lock:
            if self._cycle is None:
                board.set_zero()
        self._diagnostics.set('compensator', ERROR, 'the compensator has died or hangs: the output '
                              'is zero until the next setpoint')

    async def _on_enable(self, request: SetBool.Request,
                         response: SetBool.Response) -> SetBool.Response:
        wanted, board = request.data, self._board
        if board is None or not self._works:
            # What is off already stays off.
            response.success = not wanted
            response.message = ('disabled' if not wanted else
                                f'not enabled: the node is {self.state}; activate it first')
            return response
        status = board.status
        if wanted and not status.online:
            response.message = f'not enabled: {status.problem or "there is no board yet"}'
            return response
        self._wanted = wanted
        if wanted:
            board.clear_fault()
        board.enable(wanted)
        if not status.online:
            response.success = True
            response.message = 'disabled; the board is not there, and will stay off'
            return response
        await self._until(
            lambda status: enabled(status) == wanted or (wanted and bool(status.fault)),
            ENABLE_PATIENCE * board.slowness)
        response.success = enabled(board.status) == wanted
        response.message = 'enabled' if wanted else 'disabled'
        if not response.success:
            status = board.status
            response.message = f'the board did not follow: {status.problem or status.fault}'
        return response

    async def _on_initialise(self, request: Trigger.Request,
                             response: Trigger.Response) -> Trigger.Response:
        board = self._board
        if board is None or not self._works:
            response.message = f'not begun: the node is {self.state}; activate it first'
            return response
        if board.wanted and board.status.online:    # at the start, it is being enabled just now
            await self._until(lambda status: bool(enabled(status)) or not board.wanted,
                              ENABLE_PATIENCE * board.slowness)
        status = board.status
        if not enabled(status):
            response.message = f'not begun: {status.problem or "the output is not enabled"}'
            return response
        with self._lock:
            if self._cycle is not None:
                response.message = f'not begun: one is running ({self._progress})'
                return response
            self._outcome = None
            self._progress = 'begun'
            self._cycle = make_cycle(self._settings)
        await self._until(lambda status: self._outcome is not None)
        if self._outcome is not None:
            response.success, response.message = self._outcome
        self._diagnostics.clear('setpoint')
        self.get_logger().info(f'~/initialise: {response.message}')
        return response

    async def _until(self, condition: Callable[[Status], bool],
                     patience: float = float('inf')) -> bool:
        """Let other callbacks run until the board's status is as wanted; False if it is not."""
        future = Future()
        self._waiting.append((condition, future, time.monotonic() + patience))
        return await future

    # What the board says, in its reading thread

    def _on_sample(self, sample: Sample) -> None:
        board = self._board
        if board is None or not self.context.ok():
            return
        stamp = self._stamp(board.speed, sample)
        if not self._works:
            return
        self._voltages.publish(Float64(data=sample.voltage))
        self._published += 1
        if sample.fresh:
            message = JointState(name=[self._settings['joint_name']], position=[sample.angle],
                                 velocity=[sample.velocity])
            message.header.stamp = stamp
            self._joints.publish(message)
            self._published += 1
        if sample.ambient is not None:
            message = Temperature(temperature=sample.ambient)
            message.header.stamp = stamp
            self._ambients.publish(message)
            self._published += 1
        with self._lock:
            if self._cycle is not None:
                self._heat_and_cool(board, self._cycle, sample)

    def _stamp(self, speed: float, sample: Sample) -> Time:
        now = 1e-9 * self.get_clock().now().nanoseconds
        if speed == 1.0:
            if self._stamps is None:
                self._stamps = RealStamps()
            return _message(self._stamps.stamp(sample.time, now))
        with self._lock:
            if self._stamps is None:
                self._stamps = SimulatedStamps(time.time() - sample.time, speed)
            stamp = _message(self._stamps.stamp(sample.time, time.monotonic()))
            if self._clocks is not None:
                self._clocks.publish(ClockMessage(clock=stamp))
        return stamp

    def _heat_and_cool(self, board: Board, cycle: HeatAndCool, sample: Sample) -> None:
        try:
            if not sample.enabled:
                raise BoardError('heat and cool cycle: the output was switched off meanwhile')
            phase = cycle.update(sample.time, sample.angle, sample.voltage)
        except BoardError as error:
            self._end_cycle(False, str(error))
            return
        self._progress = phase.progress
        if phase.done:
            self._end_cycle(True, 'heated and cooled: the memory is wiped')
        elif phase.voltage > 0.0:
            board.set_voltage(phase.voltage)
        else:
            board.set_zero()

    def _end_cycle(self, success: bool, message: str) -> None:
        if self._board is not None:
            self._board.set_zero()
        self._cycle = None
        self._outcome = success, message

    # The board's status, in the executor

    def _look(self) -> None:
        if not self.context.ok():
            return
        self._tell('lifecycle', OK, '' if self._works else f'the node is {self.state}',
                   'active: publishing measurements and taking setpoints')
        board = self._board
        if board is None:
            for name in ('board', 'faults', 'supply', 'timeout', 'encoder', 'fault', 'output',
                         'initialise', 'lines'):
                self._diagnostics.clear(name)
            return
        status = board.status
        self._keep_clock(status)
        if not status.online:
            with self._lock:
                if self._cycle is not None:
                    self._end_cycle(False, f'heat and cool cycle: {status.problem}')
        self._judge(status, board.wanted)
        now = time.monotonic()
        waiting, self._waiting = self._waiting, []
        for condition, future, deadline in waiting:
            if condition(status):
                future.set_result(True)
            elif now > deadline:
                future.set_result(False)
            else:
                self._waiting.append((condition, future, deadline))

    def _keep_clock(self, status: Status) -> None:
        if status.identity is None or status.identity.speed == 1.0:
            return
        if self._clocks is None:
            self._clocks = self.create_publisher(ClockMessage, '/clock', 10)
        with self._lock:
            if not status.online and isinstance(self._stamps, SimulatedStamps):
                self._clocks.publish(
                    ClockMessage(clock=_message(self._stamps.idle(time.monotonic()))))

    def _judge(self, status: Status, wanted: bool) -> None:
        sample = status.sample
        if not status.online and not status.problem:
            self._diagnostics.set('board', OK, f'looking for the board at '
                                  f'{self._settings["port"]}')
        else:
            found = status.identity.name if status.identity else 'a board'
            self._tell('board', ERROR, status.problem,
                       f'the board at {self._settings["port"]} is there: {found}')
        self._tell('faults', ERROR, status.faults if status.online else '')
        self._tell('supply', ERROR, status.limit)
        self._tell('timeout', WARN, 'no setpoint for setpoint_timeout '
                   f'({self._settings["setpoint_timeout"]:g} s): the output is zero until the '
                   'next one' if status.expired else '')
        self._tell('encoder', WARN, f'{sample.encoder_fault} (~/enable ends this warning)'
                   if sample and sample.encoder_fault else '')
        self._tell('fault', ERROR, f'{status.fault}; the output is off until ~/enable'
                   if status.fault else '')
        self._tell('output', OK, '' if wanted or status.fault
                   else 'the output is disabled, see ~/enable')
        self._tell('initialise', OK, f'heat and cool cycle: {self._progress}; setpoints are '
                   'refused' if self._cycle is not None else '')
        self._judge_lines(status)

    def _judge_lines(self, status: Status) -> None:
        now = time.monotonic()
        count, since = self._bad_lines
        if status.bad_lines > count:
            self._bad_lines = status.bad_lines, now
            self._diagnostics.set('lines', WARN, (
                f'{status.bad_lines} bad lines so far, skipped; the latest is '
                f'{status.last_bad_line}'))
        elif now - since > BAD_LINES_SHOWN_FOR:
            self._diagnostics.clear('lines')

    def _tell(self, name: str, level: bytes, sentence: str, instead: str = '') -> None:
        if sentence:
            self._diagnostics.set(name, level, sentence)
        else:
            self._diagnostics.clear(name, instead)

    def _values(self) -> dict[str, Any]:
        values: dict[str, Any] = {
            'state': 'initialising' if self._cycle is not None else 'ready',
            'lifecycle': self.state}
        if self._board is None:
            return values
        status = self._board.status
        values.update({
            'port': self._settings['port'], 'online': status.online,
            'board': status.identity.name if status.identity else 'unknown',
            'connections': status.connections, 'frames': status.frames,
            'bad lines': status.bad_lines, 'lost frames': status.lost_frames,
            'latest refusal of the board': status.refusal or 'none',
            'fault': status.fault or 'none',
            'setpoints taken': self._taken, 'setpoints refused': self._refused,
            'measurements published': self._published})
        sample = status.sample
        if sample is not None:
            values.update({
                'board time [s]': sample.time, 'angle [rad]': sample.angle,
                'applied voltage [V]': sample.voltage, 'supply [V]': sample.supply,
                'enabled': sample.enabled})
        values.update(_protection_values(self._board.protection))
        return values


def _protection_values(protection: Protection) -> dict[str, Any]:
    limits = protection.limits
    return {
        'estimated temperature [degC]': protection.temperature,
        'maximum_temperature [degC]': limits.maximum_temperature or 'off',
        'RMS voltage [V]': protection.rms, 'rms_voltage_limit [V]': limits.rms_voltage or 'off',
        'full heat [s]': protection.full_heat, 'full_heat_time [s]': limits.full_heat_time
        or 'off',
        'maximum_voltage [V]': limits.maximum_voltage,
        'soft_start_time [s]': limits.soft_start_time or 'off',
        'encoder_check': 'on' if limits.encoder_check else 'off'}


def enabled(status: Status) -> bool | None:
    """Return whether the board says that its output is enabled; None while it is not there."""
    return status.sample.enabled if status.online and status.sample is not None else None


def _message(seconds: float) -> Time:
    whole = int(seconds)
    return Time(sec=whole, nanosec=min(int(1e9 * (seconds - whole)), 999_999_999))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(BridgeNode, args)
