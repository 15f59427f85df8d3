# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The arm for RViz: where it is to be, where it is, and where the model says it is.

Subscribes `target_joint_states`, `joint_states` and `predicted_joint_states`; publishes
`arm_markers`, a forearm for each of them, and the muscles from their anchor to the measured clamp.
An angle that never came, or whose source has been silent, is not drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
import math
import time
from typing import Any

from geometry_msgs.msg import Point, Vector3
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.nodes.parameters import GEOMETRY, NAMES, Parameters, Spec
from hysteresis_ros.nodes.qos import LATEST
from hysteresis_ros.nodes.reference import read_angle
from hysteresis_ros.nodes.running import run

MARKERS = (
    Spec('marker_rate', 10.0, 'How often markers are published', 'Hz of the wall clock', 0.1,
         60.0, read_only=True),
)


@dataclasses.dataclass(frozen=True)
class Forearm:
    """How one of the forearms is drawn, and the topic that it comes from."""

    topic: str
    colour: tuple[float, float, float, float]
    width: float
    patience: float     # seconds of the wall without a message until it goes


FOREARMS = {
    # A target stays in force, however long ago it was given.
    'target': Forearm('target_joint_states', (0.15, 0.65, 0.25, 0.6), 0.018, math.inf),
    'measured': Forearm('joint_states', (0.2, 0.35, 0.6, 1.0), 0.012, 2.0),
    'predicted': Forearm('predicted_joint_states', (0.9, 0.5, 0.1, 0.8), 0.008, 2.0),
}
FRAME = 'base_link'     # of urdf/bicep.urdf.xacro: origin in the elbow, z up
MUSCLE_COLOUR, MUSCLE_WIDTH, MUSCLE_GAP = (0.75, 0.15, 0.15, 1.0), 0.002, 0.008
IDENTITIES = 2      # a line and a text
TEXT_HEIGHT, LINE_HEIGHT = 0.016, 0.022     # [m]


class MarkerNode(Node):
    """
    The node `arm_markers`.

    Parameters
    ----------
    model : None
        Taken like by the other nodes, and not needed.
    **options
        For `rclpy.node.Node`, such as ``namespace`` or ``parameter_overrides``.
    """

    PARAMETERS = MARKERS + NAMES + GEOMETRY

    def __init__(self, model: None = None, **options: Any) -> None:
        super().__init__('arm_markers', **options)
        settings = self._settings = Parameters(
            self, self.PARAMETERS, check=BicepGeometry.from_mapping, changed=self._configure)
        self._configure(settings)
        self._angles: dict[str, tuple[float, float]] = {}   # angle and when it came
        self._drawn: set[str] = set()
        self._publisher = self.create_publisher(MarkerArray, 'arm_markers', 10)
        for name, forearm in FOREARMS.items():
            self.create_subscription(
                JointState, forearm.topic,
                lambda message, name=name: self._take(name, message), LATEST)
        # By the wall: a simulation at 60 times real time is to flood nobody's screen.
        self.create_timer(1.0 / settings['marker_rate'], self._publish,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _configure(self, settings: Parameters) -> None:
        self._geometry = BicepGeometry.from_mapping(settings)

    def _take(self, name: str, message: JointState) -> None:
        angle = read_angle(message, self._settings['joint_name'])
        if angle is not None and math.isfinite(angle):
            self._angles[name] = angle, time.monotonic()

    def _publish(self) -> None:
        now = time.monotonic()
        angles = {name: angle for name, (angle, heard) in self._angles.items()
                  if now - heard <= FOREARMS[name].patience}
        markers = [marker for number, name in enumerate(FOREARMS) if name in angles
                   for marker in self._forearm(name, angles[name], number)]
        if 'measured' in angles:
            markers.append(self._muscles(angles['measured']))
        gone = self._drawn.difference(marker.ns for marker in markers)
        self._drawn = {marker.ns for marker in markers}
        markers += [self._marker(name, Marker.LINE_STRIP, action=Marker.DELETE, identity=identity)
                    for name in sorted(gone) for identity in range(IDENTITIES)]
        if markers:
            self._publisher.publish(MarkerArray(markers=markers))

    def _forearm(self, name: str, angle: float, number: int) -> list[Marker]:
        look = FOREARMS[name]
        geometry = self._geometry
        line = self._marker(name, Marker.LINE_STRIP, look.colour)
        line.scale = Vector3(x=look.width)
        line.points = [Point(), _point(geometry.point(angle, geometry.forearm_length))]
        text = self._marker(name, Marker.TEXT_VIEW_FACING, look.colour[:3] + (1.0,), identity=1)
        text.text = f'{name} {math.degrees(angle):.1f} deg'
        text.scale = Vector3(z=TEXT_HEIGHT)
        text.pose.position = _point((0.5 * geometry.forearm_length, 0.0,
                                     geometry.anchor_height - number * LINE_HEIGHT))
        return [line, text]

    def _muscles(self, angle: float) -> Marker:
        geometry = self._geometry
        marker = self._marker('muscles', Marker.LINE_LIST, MUSCLE_COLOUR)
        marker.scale = Vector3(x=MUSCLE_WIDTH)
        x, _, z = geometry.point(angle, geometry.clamp_distance, geometry.clamp_height)
        for number in range(int(geometry.muscle_count)):
            y = MUSCLE_GAP * (number - 0.5 * (geometry.muscle_count - 1))
            marker.points += [_point((0.0, y, geometry.anchor_height)), _point((x, y, z))]
        return marker

    def _marker(self, name: str, kind: int, colour: tuple[float, ...] = (0.0,) * 4,
                action: int = Marker.ADD, identity: int = 0) -> Marker:
        """Return a marker; its stamp of zero stands for the latest transform."""
        marker = Marker(ns=name, id=identity, type=kind, action=action)
        marker.header.frame_id = FRAME
        marker.pose.orientation.w = 1.0
        red, green, blue, alpha = colour
        marker.color = ColorRGBA(r=red, g=green, b=blue, a=alpha)
        return marker


def _point(position: tuple[float, float, float]) -> Point:
    x, y, z = position
    return Point(x=float(x), y=float(y), z=float(z))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(MarkerNode, args)
