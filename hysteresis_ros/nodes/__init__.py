# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 nodes: thin shells around functions that need no ROS, one `main` each."""
