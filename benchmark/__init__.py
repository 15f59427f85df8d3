# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Speed and accuracy, as ratios against references measured in the same run where it matters."""
