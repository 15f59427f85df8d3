# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The qualities of service that the nodes agree on."""

from rclpy.qos import QoSProfile, ReliabilityPolicy

# Targets, references and setpoints: each one moves the memory of the model and of the muscle, so
# none may be lost or change places. The depth bridges a pause of 20 s at 500 messages a second.
COMMANDS = QoSProfile(depth=10000, reliability=ReliabilityPolicy.RELIABLE)

# Measurements: reliable, because a recording or a prediction with gaps is worth less.
MEASUREMENTS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)

# For who records them: the depth bridges a pause of 20 s at 500 messages a second here, too.
RECORDED = QoSProfile(depth=10000, reliability=ReliabilityPolicy.RELIABLE)

# For who looks at the latest measurement only: what it has missed is not made up for.
LATEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
