# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
One hour of the arm's time and a million setpoints through `Board`, with random faults.

The simulated board lives faster than the wall's clock; a fault comes every minute or so, and
whatever it switches off is enabled again. All that is measured goes into a bag, which is read then.
"""

from pathlib import Path
import random
import tempfile
import time
from typing import Any

from benchmark.watched_arm import CABLE, memory, WatchedArm
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from hysteresis_ros.bridge.board import Board
from hysteresis_ros.bridge.board_link import Timeouts
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.laboratory.board.port import SimulatedPort
from hysteresis_ros.measurements.bag_storage import open_bag
from hysteresis_ros.nodes.session import Bag

SPEED = 60.0                # s of the arm a second of the wall
ARM_TIME, QUICK_ARM_TIME = 3600.0, 60.0             # s
SETPOINTS, QUICK_SETPOINTS = 1_000_000, 2_000
BURST = 40                  # setpoints between two pauses
PAUSE = 0.001               # s
TELEMETRY_PERIOD = 1.0      # s of the arm
PATIENCE = 30.0             # times of the wall that it may take, for a machine that is slow


def endurance_benchmarks(quick: bool) -> dict:
    """
    Drive the arm for an hour of its time, with faults.

    Returns
    -------
    dict
        Setpoints, faults, lost messages, missed watchdogs and growth of the memory.
    """
    arm_time = QUICK_ARM_TIME if quick else ARM_TIME
    setpoints = QUICK_SETPOINTS if quick else SETPOINTS
    with tempfile.TemporaryDirectory() as folder:
        run = Run(Path(folder, 'bag'))
        run.drive(arm_time, setpoints)
        with open_bag(Path(folder, 'bag')) as bag:
            found = sum(1 for _ in bag.messages(list(bag.topics)))
    return {
        'endurance_arm_time_s': run.arm.time, 'endurance_setpoints_count': run.setpoints,
        'endurance_faults_count': run.arm.faults,
        'endurance_enabled_again_count': run.enabled_again,
        'endurance_published_count': run.published,
        'endurance_lost_in_the_bag_count': run.published - found,
        'endurance_heated_ratio': run.arm.heated,
        'endurance_missed_watchdogs_count': run.arm.missed,
        'endurance_memory_growth_MB': run.growth / 1e6}


class Run:
    """
    An arm behind the simulated board that is driven, disturbed and recorded.

    Parameters
    ----------
    folder : Path
        Of the bag.

    Attributes
    ----------
    arm : WatchedArm
        With its faults.
    setpoints, enabled_again, published : int
        How many there were.
    growth : float
        Of the process's memory in bytes, since a fifth of the time had passed.
    """

    def __init__(self, folder: Path) -> None:
        self.setpoints = self.enabled_again = self.published = 0
        self.growth = 0.0
        self._rng = random.Random(1)
        self._bag = Bag(folder)
        timeouts = Timeouts(watchdog=0.5)
        self._board = Board(f'sim://bicep?speed={SPEED:g}&{CABLE}', timeouts=timeouts,
                            telemetry_period=TELEMETRY_PERIOD, on_sample=self._record)
        made = self._board._link._serial
        made.simulation = SimulatedPort(made.port)
        self.arm = WatchedArm(made.simulation.cable, timeouts.watchdog * SPEED, self._rng)

    def drive(self, arm_time: float, setpoints: int) -> None:
        """Ask for voltages until so much time of the arm has passed and so many were asked."""
        end = time.monotonic() + PATIENCE * arm_time / SPEED
        settled = 0
        with self._board as board:
            board.enable(True)
            while (not self.arm.heated or self.arm.time < arm_time
                   or self.setpoints < setpoints):
                for _ in range(BURST):
                    board.set_voltage(self._rng.uniform(0.0, 5.0))
                    self.setpoints += 1
                time.sleep(PAUSE)
                self.arm.disturb()
                if not board.wanted:
                    board.clear_fault()
                    board.enable(True)
                    self.enabled_again += 1
                if not settled and self.arm.time > 0.2 * arm_time:
                    settled = memory()
                if time.monotonic() > end:
                    raise HysteresisError(
                        f'endurance: only {self.arm.time:.0f} s of {arm_time:g} s and '
                        f'{self.setpoints} setpoints in time')
            self.growth = memory() - settled
        self._bag.close()

    def _record(self, sample: Any) -> None:
        stamp = time.time_ns()
        self._bag.write('applied_voltage', stamp, Float64(data=sample.voltage))
        self._bag.write('joint_states', stamp, JointState(name=['elbow'], position=[sample.angle]))
        self.published += 2
